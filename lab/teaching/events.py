"""What happens in a lesson and in a whole run, as records; whoever hears them is one function of an event."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from lab.advice.journal import Journal
from lab.advice.policy_advisor import PolicyAdvisor
from lab.learning import session_events as session
from lab.learning.problem import Problem
from lab.learning.requests import Advisor, Request
from lab.learning.session import Session
from lab.learning.settings import GateSettings
from lab.sequencing.cell.cell import MAX_PARTS
from lab.sequencing.cell.schedule import Move, Schedule
from lab.sequencing.search import EpisodeSequenced, Reference, SequenceResult
from lab.teaching.lesson_plan import Lesson, LessonPlan
from lab.toolbox.policy import Policy

ORDER = "The order of the transfers"  # the lesson of that name in a `LessonEvent`


@dataclass(frozen=True)
class ScenePrepared:
    """Where the next lesson takes place, for those who show it: a prepared task, a world, None for no place at all.

    problem: its own; None for a task whose skills are about to be learned one after the other.
    """

    scene: Any
    problem: Problem | None = None


@dataclass(frozen=True)
class LessonContinued:
    """The next lesson goes on from a policy that was left unfinished."""

    unfinished: Policy


@dataclass(frozen=True)
class LessonBegan:
    """A lesson begins, or begins again because an answer was taken back: what it told before is told again."""

    plan: LessonPlan
    journal: Journal = field(default_factory=Journal)


@dataclass(frozen=True)
class AdvisorGathered:
    """Who advises in the session that begins now, several as a `Panel`."""

    advisor: Advisor | None


@dataclass(frozen=True)
class SessionBegan:
    """A session of the lesson begins; its table and counts are those of the learner under way."""

    session: Session


@dataclass(frozen=True)
class LessonEvent:
    """Something happened in a session of the lesson of that name; not new: it is told again."""

    lesson: str
    event: session.Event
    is_new: bool = True


@dataclass(frozen=True)
class QuestionAnswered:
    """What an advisor said to a request; None: the step was left to the learner."""

    request: Request
    action: int | None


@dataclass(frozen=True)
class PhaseBegan:
    """A phase of a run with so many parts begins."""

    name: str
    parts: int


@dataclass(frozen=True)
class RecordSkipped:
    """What was kept is damaged, and was not read; or what was to be kept could not be."""

    why: str


@dataclass(frozen=True)
class KeptBeside:
    """What was learned is kept as a version of that name, but another one stays in use, and why."""

    name: str
    version: int
    why: str


@dataclass(frozen=True)
class PolicyAdvises:
    """A policy of the toolbox advises in the lesson that begins now."""

    advisor: PolicyAdvisor


@dataclass(frozen=True)
class SkillReady:
    """A skill was found or learned."""

    name: str
    lesson: Lesson


@dataclass(frozen=True)
class MoveTimed:
    """A move or a machine's process was timed [s]."""

    name: str
    seconds: float


@dataclass(frozen=True)
class SequencingBegan:
    """A sequencer, method, begins to try orders; gate: when it asks which part to move, None: it asks nobody."""

    episodes: int
    reference: Reference | None = None
    gate: GateSettings | None = None
    method: str = ""


@dataclass(frozen=True)
class OrderLearned:
    """How the order was learned, in words, a line each: by what, when it was found, what of it a method's bound is."""

    lines: tuple[str, ...]


@dataclass(frozen=True)
class SequencingStands:
    """What is known while orders are looked for: the best cost, inf where there is no order yet, whose it is, and the bound."""

    cost: float
    found_by: str
    reference: Reference


@dataclass(frozen=True)
class SequenceFound:
    """The best order of a sequencer's session, beside what no order can beat; None: costs were drawn. parts: how many.

    method: by what it was found, a method's name or one of `lab.sequencing.BESIDE_METHODS`; "" where that is not said.
    """

    result: SequenceResult
    reference: Reference | None = None
    parts: int = MAX_PARTS
    method: str = ""


@dataclass(frozen=True)
class OrderChosen:
    """Which of several orders is used, and what each of them costs, by a method's name or one of `BESIDE_METHODS`."""

    used: str
    costs: dict[str, float]
    objective: str = "makespan"


@dataclass(frozen=True)
class MoveMade:
    """A part was brought on; part: what it is called."""

    move: Move
    part: str


@dataclass(frozen=True)
class MoveRetried:
    """A step failed and is tried again."""

    why: str


@dataclass(frozen=True)
class PlanMade:
    """An order for the work that remains was found: its schedule, how many moves, and the proven gap (None: not known).

    at_s: when; the schedule's times are counted from the same beginning of the run [s], as all of a run's. why: what
    made a new plan necessary, "" at first; method: by what the new one was found.
    """

    schedule: Schedule
    moves: int
    gap: float | None
    proven: bool
    at_s: float
    why: str = ""
    method: str = ""


@dataclass(frozen=True)
class MoveBegan:
    """The robot sets out to bring a part on: the move's number of how many, from where it is to where it picks and drops."""

    number: int
    moves: int
    part: str
    start: str
    origin: str
    target: str
    at_s: float


@dataclass(frozen=True)
class SkillBegan:
    """The robot begins with a skill; words: what it does, for people."""

    name: str
    words: str
    part: str
    at_s: float


@dataclass(frozen=True)
class MachineBegan:
    """A machine works on a part; until_s: until when, None where that is not known before."""

    station: str
    part: str
    at_s: float
    until_s: float | None


@dataclass(frozen=True)
class MachineDone:
    """A machine has finished its part."""

    station: str
    part: str
    at_s: float


@dataclass(frozen=True)
class MachineFailed:
    """A machine does not do what it is for."""

    station: str
    part: str
    why: str
    at_s: float


@dataclass(frozen=True)
class PartDone:
    """A part stands at the end of its route."""

    part: str
    at_s: float


@dataclass(frozen=True)
class PartLost:
    """A part is given up."""

    part: str
    why: str
    at_s: float


@dataclass(frozen=True)
class RunHeld:
    """The run stands still: kind "pause", "protective" or "emergency", and who stopped it."""

    kind: str
    why: str
    by: str
    at_s: float


@dataclass(frozen=True)
class RunWentOn:
    """The run goes on."""

    at_s: float


@dataclass(frozen=True)
class OperatorActed:
    """The operator gave a command; refused: why it was not followed, "" when it was."""

    words: str
    by: str
    at_s: float
    refused: str = ""


@dataclass(frozen=True)
class TroubleMet:
    """Something is not as planned: what was noticed, and what is done about it."""

    what: str
    answer: str
    part: str
    station: str
    at_s: float


Event = (
    ScenePrepared
    | LessonContinued
    | LessonBegan
    | AdvisorGathered
    | SessionBegan
    | LessonEvent
    | QuestionAnswered
    | PhaseBegan
    | RecordSkipped
    | KeptBeside
    | PolicyAdvises
    | SkillReady
    | MoveTimed
    | SequencingBegan
    | EpisodeSequenced
    | OrderLearned
    | SequencingStands
    | SequenceFound
    | OrderChosen
    | MoveMade
    | MoveRetried
    | PlanMade
    | MoveBegan
    | SkillBegan
    | MachineBegan
    | MachineDone
    | MachineFailed
    | PartDone
    | PartLost
    | RunHeld
    | RunWentOn
    | OperatorActed
    | TroubleMet
)
Tell = Callable[[Event], None]


def told_to(*listeners: Tell) -> Tell:
    """One listener that tells several."""

    def tell(event: Any) -> None:
        for listener in listeners:
            listener(event)

    return tell


def unheard(event: Event) -> None:
    """Nobody listens."""
