"""The events of lessons and runs, as records; a listener is a function of an event."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from lab.advice.journal import Journal
from lab.advice.table_level import PolicyAdvisor
from lab.learning import session_events as session
from lab.learning.problem import Problem
from lab.learning.requests import Advisor, Reply, Request
from lab.learning.session import Session
from lab.learning.settings import GateSettings
from lab.sequencing.cell.cell import MAX_PARTS
from lab.sequencing.cell.schedule import Move, Schedule
from lab.sequencing.search import EpisodeSequenced, Reference, SequenceResult
from lab.teaching.lesson_plan import Lesson, LessonPlan
from lab.toolbox.policy import Policy

ORDER = "The order of the transfers"  # the name of its lesson in a `LessonEvent`


@dataclass(frozen=True)
class ScenePrepared:
    """The place of the next lesson is ready.

    scene: a prepared task or a world, None if there is no place; problem: the lesson's, None for a task whose skills are learned
    one after the other.
    """

    scene: Any
    problem: Problem | None = None


@dataclass(frozen=True)
class LessonContinued:
    """The next lesson continues an unfinished policy."""

    unfinished: Policy


@dataclass(frozen=True)
class LessonBegan:
    """A lesson begins, or begins again because an answer was taken back; then its events are repeated."""

    plan: LessonPlan
    journal: Journal = field(default_factory=Journal)


@dataclass(frozen=True)
class AdvisorGathered:
    """The advisor of the next session is ready; several are a `Panel`."""

    advisor: Advisor | None


@dataclass(frozen=True)
class SessionBegan:
    """A session of the lesson begins; its table and counts are live."""

    session: Session


@dataclass(frozen=True)
class LessonEvent:
    """An event of a session of the lesson; is_new: False if it is repeated."""

    lesson: str
    event: session.Event
    is_new: bool = True


@dataclass(frozen=True)
class QuestionAnswered:
    """An advisor answered a request; action: None if the step was left to the learner; it may be a judgement."""

    request: Request
    action: Reply


@dataclass(frozen=True)
class PhaseBegan:
    """A phase of a run begins; parts: the number of parts of the run."""

    name: str
    parts: int


@dataclass(frozen=True)
class RecordSkipped:
    """A record is damaged and was not read, or could not be saved."""

    why: str


@dataclass(frozen=True)
class KeptBeside:
    """The learned policy was saved as a version, but another version stays in use, and why."""

    name: str
    version: int
    why: str


@dataclass(frozen=True)
class PolicyAdvises:
    """A policy of the toolbox advises in the next lesson."""

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
    """A sequencing method begins; gate: decides when it asks which part to move, None if it asks nobody."""

    episodes: int
    reference: Reference | None = None
    gate: GateSettings | None = None
    method: str = ""


@dataclass(frozen=True)
class OrderLearned:
    """How the order was learned, in lines of text: the method, when it found the order, the bound."""

    lines: tuple[str, ...]


@dataclass(frozen=True)
class SequencingStands:
    """The state of the search for an order: the best cost, inf before the first order, the method that found it, the bound."""

    cost: float
    found_by: str
    reference: Reference


@dataclass(frozen=True)
class SequenceFound:
    """The best order of a session of a sequencing method.

    reference: the bound on the cost of any order, None if durations are random; parts: the number of parts; method: what found
    it, the name of a method or one of `lab.sequencing.BESIDE_METHODS`, "" if unknown.
    """

    result: SequenceResult
    reference: Reference | None = None
    parts: int = MAX_PARTS
    method: str = ""


@dataclass(frozen=True)
class OrderChosen:
    """The order that is used, and the costs of all orders; keys are names of methods or `BESIDE_METHODS`."""

    used: str
    costs: dict[str, float]
    objective: str = "makespan"


@dataclass(frozen=True)
class MoveMade:
    """A part was moved to its next position; part: its name."""

    move: Move
    part: str


@dataclass(frozen=True)
class MoveRetried:
    """A move failed and is tried again."""

    why: str


@dataclass(frozen=True)
class PlanMade:
    """An order for the remaining work was found.

    schedule: its times count from the beginning of the run [s], like at_s, the time of this event; moves: their number; gap: the
    proven one, None if unknown; proven: whether the order is optimal; why: the reason for a new plan, "" for the first one;
    method: what found it.
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
    """The robot begins move `number` of `moves`, from `start`; origin, target: where it picks and places the part."""

    number: int
    moves: int
    part: str
    start: str
    origin: str
    target: str
    at_s: float


@dataclass(frozen=True)
class SkillBegan:
    """The robot begins a skill; words: its description for people."""

    name: str
    words: str
    part: str
    at_s: float


@dataclass(frozen=True)
class MachineBegan:
    """A machine begins to process a part; until_s: when it will finish, None if unknown."""

    station: str
    part: str
    at_s: float
    until_s: float | None


@dataclass(frozen=True)
class MachineDone:
    """A machine has finished a part."""

    station: str
    part: str
    at_s: float


@dataclass(frozen=True)
class MachineFailed:
    """A machine failed to process a part."""

    station: str
    part: str
    why: str
    at_s: float


@dataclass(frozen=True)
class PartDone:
    """A part has reached the end of its route."""

    part: str
    at_s: float


@dataclass(frozen=True)
class PartLost:
    """A part was given up."""

    part: str
    why: str
    at_s: float


@dataclass(frozen=True)
class RunHeld:
    """The run was stopped; kind: "pause", "protective" or "emergency"; by: who stopped it."""

    kind: str
    why: str
    by: str
    at_s: float


@dataclass(frozen=True)
class RunWentOn:
    """The run continues."""

    at_s: float


@dataclass(frozen=True)
class OperatorActed:
    """The operator gave a command; refused: why it was not carried out, "" if it was."""

    words: str
    by: str
    at_s: float
    refused: str = ""


@dataclass(frozen=True)
class TroubleMet:
    """A deviation from the plan was noticed; answer: what is done about it."""

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
    """A listener that passes each event to all of these."""

    def tell(event: Any) -> None:
        for listener in listeners:
            listener(event)

    return tell


def unheard(event: Event) -> None:
    """A listener that ignores every event."""
