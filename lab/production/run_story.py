"""What a run's replay tells beside the picture, gathered from what the run tells while it is carried out."""

from dataclasses import dataclass, field

from lab.production.outcome import Outcome
from lab.sequencing.cell.schedule import Schedule
from lab.teaching.events import (
    Event,
    MachineFailed,
    MoveBegan,
    OperatorActed,
    PartDone,
    PartLost,
    PlanMade,
    RunHeld,
    RunWentOn,
    SkillBegan,
    TroubleMet,
)
from lab.view.scene_data import Mark, Story

LEAST_WAIT_S = 0.5  # that is worth a word


@dataclass
class _Story:
    """What people read of a run's events."""

    captions: list[tuple[float, str]] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    begins_s: list[float] = field(default_factory=list)

    def hear(self, event: Event) -> None:
        """Take over what people read of it."""
        match event:
            case SkillBegan(words=words, at_s=at_s):
                self._say(at_s, f"The robot {words}")
            case MoveBegan(part=part, origin=origin, target=target, at_s=at_s):
                self.begins_s.append(at_s)
                self._say(at_s, f"The robot brings {part} from '{origin}' to '{target}'")
            case PartDone(part, at_s):
                self._say(at_s, f"{part} is done")
            case PartLost(part, why, at_s):
                self._mark(Mark(at_s, "lost", f"{part} is given up: {why}"))
            case TroubleMet(what, answer, part, _, at_s):
                self._mark(Mark(at_s, "trouble", f"{part}: {what}; {answer}" if part else f"{what}; {answer}"))
            case MachineFailed(station, part, why, at_s):
                self._mark(Mark(at_s, "trouble", f"'{station}' with {part}: {why}"))
            case RunHeld(kind, why, by, at_s):
                self._mark(Mark(at_s, "stop", f"{held_words(kind)} by the {by}{why and f': {why}'}"))
            case RunWentOn(at_s):
                self._say(at_s, "The run goes on")
            case OperatorActed(words, _, at_s, refused):
                self._mark(Mark(at_s, "operator", f"{words}{refused and f': refused, {refused}'}"))
            case PlanMade(at_s=at_s, why=why, method=by) if why:
                self._say(at_s, f"A new plan{by and f' by {by}'}: {why}")

    def _say(self, at_s: float, words: str) -> None:
        self.captions.append((round(at_s, 3), words))

    def _mark(self, mark: Mark) -> None:
        self.marks.append(mark)
        self._say(mark.at_s, mark.words)


def story_of(outcome: Outcome, planned: Schedule | None) -> Story:
    """What was told of a run, with the measured schedule beside the plan, and the faults that struck."""
    found = _Story()
    for event in outcome.heard:
        found.hear(event)
    schedule = outcome.schedule
    names = {activity.part: activity.resource for activity in schedule.parts}
    for did in schedule.robot:
        if did.kind == "wait" and did.end_s - did.start_s > LEAST_WAIT_S:
            found._say(did.start_s, f"The robot waits at '{did.origin}' for {names.get(did.part, 'its part')}")
    struck = tuple(Mark(fault.at_s, "fault", fault.words) for fault in outcome.happened)
    return Story(schedule, planned, tuple(found.captions), (*found.marks, *struck), tuple(found.begins_s))


def held_words(kind: str) -> str:
    """A kind of stop in words."""
    return "paused" if kind == "pause" else f"{kind} stop"
