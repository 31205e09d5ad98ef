"""Requests for advice: why a learner asks, what it shows, who can answer, and the record of an advised episode."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from lab.learning.praise import ActionBiasing, Judgeable, Judgement
from lab.learning.selection import chances
from lab.learning.session_events import Improvement
from lab.learning.settings import GateSettings
from lab.learning.updates import Table
from lab.mdp import TabularMDP


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a gate asked; this base class stands for a gate that asks unconditionally."""

    def __str__(self) -> str:
        return "it asks about every step"


@dataclass(frozen=True, slots=True)
class TooSlow(Reason):
    """The improvement rate is below the threshold Lambda."""

    rate: float
    threshold: float

    def __str__(self) -> str:
        return f"its improvement is {self.rate:+.1%}, below {self.threshold:.0%}"


@dataclass(frozen=True, slots=True)
class TooLong(Reason):
    """The mean step count of the last K episodes is above a constant."""

    window: int
    mean: float
    enough: float

    def __str__(self) -> str:
        return f"the last {self.window} episodes took {self.mean:.1f} steps, more than {self.enough:g}"


@dataclass(frozen=True, slots=True)
class ValuesAlike(Reason):
    """The action values of the state span at most Psi."""

    width: float
    psi: float

    def __str__(self) -> str:
        return f"the values here span {self.width:.2f}, at most {self.psi:g}"


@dataclass(frozen=True, slots=True)
class ValuesApart(Reason):
    """The action values of the state span at least Psi."""

    width: float
    psi: float

    def __str__(self) -> str:
        return f"the values here span {self.width:.2f}, at least {self.psi:g}"


@dataclass(frozen=True, slots=True)
class TablesDiffer(Reason):
    """The tables of an ensemble disagree about the state."""

    tables: int
    spread: float
    least: float

    def __str__(self) -> str:
        return f"its {self.tables} tables differ by {self.spread:.2f} here, at least {self.least:g}"


@dataclass(frozen=True, slots=True)
class ByChance(Reason):
    """The gate asks at random, at this rate."""

    rate: float

    def __str__(self) -> str:
        return f"it asks about {self.rate:.0%} of the steps"


@dataclass(frozen=True, slots=True)
class Both(Reason):
    """Two reasons hold at the same time."""

    first: Reason
    second: Reason

    def __str__(self) -> str:
        return f"{self.first}, and {self.second}"


@dataclass(frozen=True, slots=True)
class ToldSeldom(Reason):
    """Few answers have been given in this state so far."""

    answers: int

    def __str__(self) -> str:
        return f"it was told {self.answers} times here"


@dataclass(frozen=True, slots=True)
class Trusted(Reason):
    """Advised episodes did better than the others; rate: the share of the recent advised ones that reached the goal."""

    rate: float

    def __str__(self) -> str:
        return (
            f"it knows nothing to hold on to here, and {self.rate:.0%} of the recent advised episodes reached the goal"
        )


# ---- what a request shows -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Standing:
    """The record of the advice so far: helped steps of `budget`, misleads of `omega` tolerated, Lambda.

    by_evidence: whether not the number of misleads, but the evidence in them rejects an advisor, see `GateSettings`.
    """

    helped_steps: int = 0
    budget: int = GateSettings.budget
    misleads: int = 0
    omega: int = 0
    lambda_threshold: float = 0.0
    by_evidence: bool = False


class SupportsPicture(Protocol):
    """The part of an environment that a request uses."""

    def picture(self, state: int) -> str:
        """The environment's own drawing of a state as text, "" if it has none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """A question of a learner, about a table or about the order of transfers.

    episode, step: both count from 1.
    state: the number of the state.
    own: the learner's own choice; allowed: the possible answers.
    improvement: of the last K episodes over the K before, None before 2K episodes.
    reason: why the gate asks.
    standing: the record of the advice so far.
    undoable: whether the last answer of this episode can be taken back.
    judgement: whether the answer may be a `Judgement` of the moves that were shown ("also"), or has to be one, of the learner's
    own choice, which it makes now, and of those before it ("only").
    """

    episode: int
    step: int
    state: int
    own: int
    allowed: Sequence[int]
    improvement: Improvement | None = None
    reason: Reason | None = None
    standing: Standing = Standing()
    undoable: bool = False
    judgement: Judgeable = "no"


@dataclass(frozen=True, slots=True, kw_only=True)
class AdviceRequest(Request):
    """A question about the next action in a state of a table. An advisor is a function of it, or an object with `advise`.

    It answers with one of `allowed`, or with None for the learner's own choice, or raises `AdvisorLeft`; any other answer ends
    the session with BadInput.

    episode, step: both count from 1; state: the number of the state.
    own: the action that the learner would choose; allowed: the possible answers, indices of `mdp.action_labels`.
    mdp: the problem.
    q: the learner's current action values, `q[state][action]`; they must not be changed.
    temperature, selection: how the learner chooses at present; temperature is epsilon for "epsilon-greedy".
    environment: draws the state; None if the table's grid is all there is.
    praise: what the learner was told about its moves, None if nothing.
    improvement, reason, standing, undoable, judgement: how the learner improves, why it asks, what came of the advice so far, and
    what the answer may be, see `Request`.

        >>> import lab
        >>> def advise(request: lab.AdviceRequest) -> int | None:
        ...     return request.mdp.action_labels.index("right") if request.step == 1 else None
        >>> board = lab.grid((3, 3), [[0] * 3] * 3, (0, 0), (2, 2), None, ("up", "down", "left", "right"))
        >>> lab.teach(board, advisor=advise, gate="always", episodes=20).session.helped_steps
        20
    """

    mdp: TabularMDP
    q: Table
    temperature: float = 1.0
    selection: str = "softmax"
    environment: SupportsPicture | None = None
    praise: ActionBiasing | None = None

    @property
    def chances(self) -> list[float]:
        """The probability of each action, (A,), if the learner chose by itself, and by what it was told was good or bad."""
        if self.praise is not None:
            return self.praise.chances(self.state, self.q[self.state], self.temperature)
        return chances(self.selection, self.q[self.state], self.temperature)

    @property
    def picture(self) -> str:
        """The environment's own drawing of the state as text, "" if the table's grid is all there is."""
        return "" if self.environment is None else self.environment.picture(self.state)

    @property
    def shapes(self) -> list[dict[str, Any]]:
        """The state as shapes (see `lab.learning.physics.environment.shapes`), [] if the environment draws none."""
        shapes: list[dict[str, Any]] = getattr(self.environment, "shapes", lambda state: [])(self.state)
        return shapes


@dataclass(frozen=True)
class Walked:
    """The record of an episode that was open for advice.

    trail: (state, action, state entered) of each step; steps: as in `EpisodeEnded`; mean_before: the mean step count of the K
    episodes before it.
    """

    episode: int
    trail: list[tuple[int, int, int]]
    reached: bool
    steps: int | float
    mean_before: float


class AdvisorLeft(Exception):
    """Raised by an advisor that gives no more advice in this session; the text says why.

    The learner goes on alone.

        >>> import lab
        >>> def advise_early(request: lab.AdviceRequest) -> int | None:
        ...     if request.episode > 2:
        ...         raise lab.AdvisorLeft("two episodes are enough")
        ...     return request.own
        >>> lab.teach("world-1", advisor=advise_early, gate="always", episodes=5).session.guided.tolist()
        [True, True, False, False, False]
    """


Reply = int | Judgement | None  # to a request: an action, a judgement where that is allowed, or nothing
Ask = Callable[[Any], Reply]  # a function of a `Request`


class Advisor(Protocol):
    """The interface of an advisor."""

    def advise(self, request: Any) -> Reply:
        """The answer: one of `request.allowed`, or None for the learner's own choice. Raises AdvisorLeft to stop advising.

        Where `request.judgement` allows it, the answer may be a `Judgement`.
        """
