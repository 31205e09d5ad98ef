"""The events of lessons and runs in words, which terminal, page and progress lines share."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Literal

from lab.advice.advisors import shown_name
from lab.errors import counted
from lab.learning.session_events import (
    AdviceEnded,
    AdviceGiven,
    AdviceRejected,
    AdviceRequested,
    AdvisorDropped,
    AdvisorReadmitted,
    AdvisorsDisagreed,
    EpisodeEnded,
    MoveJudged,
)
from lab.learning.session_events import Event as SessionEvent
from lab.mdp import TabularMDP
from lab.seat.request_text import percent, verdict
from lab.sequencing import BESIDE_METHODS
from lab.sequencing.cell.objectives import MAKESPAN
from lab.sequencing.cell.routes import part_of
from lab.teaching.events import (
    Event,
    KeptBeside,
    LessonContinued,
    MoveMade,
    MoveRetried,
    MoveTimed,
    OrderChosen,
    PhaseBegan,
    PolicyAdvises,
    RecordSkipped,
    SequenceFound,
    SequencingStands,
    SkillReady,
)
from lab.teaching.lesson_plan import Lesson
from lab.view.figures import beside, gap_of

PHASES = {
    "learn": "Find or learn the skills",
    "measure": "Time every move in simulation",
    "sequence": "Find the order of the transfers",
    "carry out": "Carry the order out in physics",
    "draw": "Draw the pictures",
}
ENDED = {
    "converged": "the same result again and again; the learner asks no more",
    "advisor left": "advice has ended; the learner goes on alone",
    "budget spent": "all the help that may be asked for has been given; the learner goes on alone",
    "misled by what was remembered": "what was said led round in circles or into obstacles; the learner asks no more",
}
PARTS_DONE = (SkillReady, MoveTimed, SequenceFound, MoveMade)  # each reports that one item of a phase is done
_FOUND = {"reused": "by", "adapted": "from"}  # preposition before the policy of another problem
_SHOWN_MOVES = 24
_LEAST_WAIT_S = 0.05  # shortest wait that is mentioned

Tone = Literal["", "ask", "note", "good", "bad", "lost"]


@dataclass(frozen=True)
class Told:
    """The text for an event, and whether it is good news for the advisor."""

    text: str
    tone: Tone = ""


def _label(mdp: TabularMDP, action: int) -> str:
    return mdp.action_labels[action]


@dataclass
class SessionText:
    """The texts for the events of sessions, in order; an episode is compared with the mean at the time of the question.

    named: gives the name of a problem's move; kind: "steps", or "order", in which steps are costs.
    """

    named: Callable[[TabularMDP, int], str] = _label
    kind: str = "steps"
    _mean_before: float | None = None
    _help: str = "advised"  # what was done with the moves that were helped

    def told(self, event: SessionEvent, mdp: TabularMDP | None = None, skill: str = "") -> Told | None:
        """The text for an event of this problem, None for none; skill: the name of the skill, if the text has to contain it."""
        match event:
            case AdviceRequested():
                self._mean_before = event.current_mean
                about = f" about '{skill}'" if skill else ""
                return Told(f"Episode {event.episode}: the learner asks for advice{about}.", "ask")
            case MoveJudged():
                self._help = "judged"
            case AdviceGiven(action=int()):
                self._help = "advised"
            case EpisodeEnded(guided=True):
                return self._episode(event)
            case AdviceRejected():
                limit = f", tolerated: {event.omega}" if event.misleads > event.omega else "; the evidence is enough"
                return Told(
                    f"The learner takes no more advice (episodes misled: {event.misleads}{limit}). "
                    f"Episode {event.episode} {self._counted(event.steps)}, those before it {event.mean_before:.1f}.",
                    "lost",
                )
            case AdviceEnded():
                return Told(f"Episode {event.episode}: {ENDED[event.reason]}.")
            case AdvisorsDisagreed():
                return self._disagreed(event, mdp)
            case AdvisorDropped() | AdvisorReadmitted():
                is_lost = isinstance(event, AdvisorDropped)
                heard = f"{shown_name(event.advisor)} is heard {'no more' if is_lost else 'again'} (trust {percent(event.trust)})"
                return Told(f"Episode {event.episode}: {heard}: {event.why}.", "lost" if is_lost else "good")
        return None

    def _episode(self, event: EpisodeEnded) -> Told:
        """One line on an episode with advice: its steps, compared with the mean before it."""
        good, judged = verdict(event, self._mean_before)
        outcome = (
            f"{'reached the goal in' if event.reached else 'did not reach the goal:'} {counted(event.steps, 'step')}"
        )
        if self.kind == "order" or isinstance(event.steps, float):
            outcome = self._counted(event.steps)
        text = f"Episode {event.episode} {outcome}{judged and f', {judged}'}"
        tone: Tone = "" if good is None else "good" if good else "bad"
        return Told(f"{text}; moves {self._help}: {event.helped_steps}.", tone)

    def _counted(self, steps: int | float) -> str:
        if self.kind == "order":
            return f"cost {steps:.1f}"
        if isinstance(steps, float):  # without a goal
            return f"fell {steps:.2f} short of the highest return"
        return f"counted {counted(steps, 'step')}"

    def _disagreed(self, event: AdvisorsDisagreed, mdp: TabularMDP | None) -> Told:
        """The answers of advisors who disagree, and whom the learner follows."""
        where = f"state {event.state}" if mdp is None else mdp.state_label(event.state)

        def named(action: int) -> str:
            return f"move {action}" if mdp is None else self.named(mdp, action)

        said = ", ".join(f"{shown_name(who)} says {named(action)}" for who, action in event.said)
        followed = [shown_name(who) for who, action in event.said if action == event.followed]
        whom = f"it follows {' and '.join(followed)}" if followed else f"it goes {named(event.followed)}"
        return Told(f"Step {event.step} at {where}: {said}; {whom}.", "note")


def lesson_parts(lesson: Lesson, first_asked: int | None = None, rejected: AdviceRejected | None = None) -> list[str]:
    """The results of a lesson: the steps of the learned path and the fewest possible; if known, when the learner asked."""
    result = lesson.result
    reached, fewest = lesson.steps
    parts = [f"{'?' if reached is None else reached}/{fewest or '?'} steps"]
    if reached is not None and reached > (fewest or reached):
        parts.append("not the shortest path")
    if result is not None and not result.requests:
        parts.append("never asked")
    elif result is not None:
        when = "" if first_asked is None else f" from episode {first_asked}"
        parts.append(f"asked {result.requests} x{when}, {counted(result.helped_steps, 'helped step')}")
        if rejected is not None:
            misleads = counted(rejected.misleads, "mislead")
            parts.append(f"rejected its advisor in episode {rejected.episode} after {misleads}")
    if lesson.source == "composed":
        parts.append(lesson.reason)
    elif lesson.fitness is not None or lesson.parent is not None:
        parts.append(f"{_FOUND.get(lesson.source, 'refused')} {lesson.reason}")
    saved = saved_text(*lesson.saved)
    return [*parts, saved] if saved else parts


def saved_text(episodes: int, helped_steps: int) -> str:
    """The episodes and advised steps that a skill from the toolbox has saved, in words; "" for none."""
    counts = ((episodes, "episode"), (helped_steps, "helped step"))
    saved = [counted(number, what) for number, what in counts if number > 0]
    return f"saved {', '.join(saved)}" if saved else ""


def sequence_parts(event: SequenceFound) -> tuple[str, str]:
    """The order of the parts, and its cost compared with the bound."""
    best, known = event.result, event.reference
    order = " ".join(str(part_of(decision, event.parts)) for decision in best.sequence[:_SHOWN_MOVES])
    more = f" and {len(best.sequence) - _SHOWN_MOVES} more" if len(best.sequence) > _SHOWN_MOVES else ""
    shown, reference = f"{best.cost:.1f} s", "its luckiest drawn episode"  # there is no bound to compare it with
    if known is not None:
        gap = known.gap(best.cost)
        shown, bound = beside(best.cost, known.bound, known.unit, 1)
        what = "proven optimum" if known.proven else "proven bound"
        reference = f"{what} {bound}" + ("" if gap is None else f", gap {gap_of(gap, 1)}")
    by = f" by {event.method}" if event.method else ""
    episode, episodes = best.episode_costs.index(best.cost) + 1, len(best.episode_costs)
    cost_text = f"{shown} found{by} in episode {episode} of {episodes}"
    if event.method in BESIDE_METHODS:
        cost_text = f"{shown}, {BESIDE_METHODS[event.method]}"
    return f"parts {order}{more}:", f"{cost_text}, {reference}"


def stands_text(event: SequencingStands) -> str:
    """The incumbent's cost, and the bound."""
    known = event.reference
    if event.cost == inf:
        return f"no order yet, bound {known.bound:.1f}{known.unit}"
    shown, bound = beside(event.cost, known.bound, known.unit, 1)
    gap = known.gap(event.cost)
    return f"best so far {shown} ({event.found_by}), bound {bound}" + ("" if gap is None else f", gap {gap_of(gap, 1)}")


def chosen_text(event: OrderChosen) -> str:
    """The order that is used, and the cost of each order that was found."""
    unit = " s" if event.objective == MAKESPAN else ""
    whose = BESIDE_METHODS | {"exact": "the exact search"}
    worth = [f"{whose.get(by, f'{by} alone')} {cost:.1f}{unit}" for by, cost in event.costs.items()]
    return f"orders: {', '.join(worth)}; used: {whose.get(event.used, f'{event.used} alone')}"


def move_text(made: MoveMade) -> str:
    """A move in words: the part, its origin and its target."""
    move = made.move
    waited_s = move.pick_s - move.reach_s
    wait = f", waited {waited_s:.1f} s" if waited_s > _LEAST_WAIT_S else ""
    what = made.part if move.carries == "part" else f"{made.part}'s pallet"
    return f"{what}: {move.origin} to {move.target}{wait}"


def run_text(event: Event) -> str:
    """An event of a run as one line; "" for events without a text."""
    match event:
        case PhaseBegan():
            return PHASES.get(event.name, event.name)
        case RecordSkipped():
            return f"skipped: {event.why}"
        case KeptBeside():
            return f"'{event.name}', version {event.version} is kept, but not put in use: {event.why}"
        case PolicyAdvises():
            return f"advisor {event.advisor}"
        case MoveRetried():
            return f"failed, trying again: {event.why}"
        case SkillReady():
            return f"{event.lesson.source} {event.name}: {', '.join(lesson_parts(event.lesson))}"
        case MoveTimed():
            return f"{event.name}: {event.seconds:.2f} s"
        case SequencingStands():
            return stands_text(event)
        case SequenceFound():
            return " ".join(sequence_parts(event))
        case OrderChosen():
            return chosen_text(event)
        case MoveMade():
            return f"{event.move.drop_s:.1f} s: {move_text(event)}"
        case LessonContinued(unfinished=left):
            length = counted(len(left.curve), "episode")
            return f"'{left.name}' was left unfinished after {length}: it is learned on"
    return ""
