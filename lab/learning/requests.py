"""What a learner shows when it asks, who may be asked, and what came of an episode: records below all who advise."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from lab.learning.selection import chances
from lab.learning.session_events import Improvement
from lab.learning.settings import GateSettings
from lab.learning.updates import Table
from lab.mdp import TabularMDP


@dataclass(frozen=True, slots=True)
class Reason:
    """Why the last question was asked; this one: nothing decides it."""

    def __str__(self) -> str:
        return "it asks about every step"


@dataclass(frozen=True, slots=True)
class TooSlow(Reason):
    """The improvement rate is below Lambda."""

    rate: float
    threshold: float

    def __str__(self) -> str:
        return f"its improvement is {self.rate:+.1%}, below {self.threshold:.0%}"


@dataclass(frozen=True, slots=True)
class TooLong(Reason):
    """The mean of the last K episodes is above a constant."""

    window: int
    mean: float
    enough: float

    def __str__(self) -> str:
        return f"the last {self.window} episodes took {self.mean:.1f} steps, more than {self.enough:g}"


@dataclass(frozen=True, slots=True)
class ValuesAlike(Reason):
    """The values of the state span at most Psi."""

    width: float
    psi: float

    def __str__(self) -> str:
        return f"the values here span {self.width:.2f}, at most {self.psi:g}"


@dataclass(frozen=True, slots=True)
class ValuesApart(Reason):
    """The values of the state span at least Psi."""

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
    """Chance says so, at a rate."""

    rate: float

    def __str__(self) -> str:
        return f"it asks about {self.rate:.0%} of the steps"


@dataclass(frozen=True, slots=True)
class Both(Reason):
    """Two reasons that hold at a time."""

    first: Reason
    second: Reason

    def __str__(self) -> str:
        return f"{self.first}, and {self.second}"


@dataclass(frozen=True, slots=True)
class ToldSeldom(Reason):
    """So many answers were given in this state before."""

    answers: int

    def __str__(self) -> str:
        return f"it was told {self.answers} times here"


@dataclass(frozen=True, slots=True)
class Trusted(Reason):
    """Advised episodes did better than going alone; rate: how many of the recent ones reached the goal."""

    rate: float

    def __str__(self) -> str:
        return (
            f"it knows nothing to hold on to here, and {self.rate:.0%} of the recent advised episodes reached the goal"
        )


# ---- requests ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Standing:
    """How advice stands with the learner: steps helped of those allowed, episodes misled of those tolerated, Lambda."""

    helped_steps: int = 0
    budget: int = GateSettings.budget
    misleads: int = 0
    omega: int = 0
    lambda_threshold: float = 0.0


class SupportsPicture(Protocol):
    """An environment, as far as a request shows it beside the table."""

    def picture(self, state: int) -> str:
        """The environment's own drawing, "" when there is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What a learner shows when it asks, about a table or about the order: where it is, what it would do, why it asks.

    episode and step count from 1; state: a number for where it is; own: what it would do itself; allowed: what may be
    answered; improvement: of the last K episodes over the K before, None before there are 2K; reason: the gate's;
    undoable: an answer of this episode can be taken back.
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


def allowed_words(request: Request) -> str:
    """What may be answered, such as "0..3" or "1, 4, 6"."""
    known = request.allowed
    return f"{known[0]}..{known[-1]}" if isinstance(known, range) else ", ".join(map(str, known))


@dataclass(frozen=True, slots=True, kw_only=True)
class AdviceRequest(Request):
    """A request about the next action in a state of a table.

    q: its live action values, `q[state][action]`, not to be changed; temperature and selection: how it chooses now;
    environment: what can draw the state.
    """

    mdp: TabularMDP
    q: Table
    temperature: float = 1.0
    selection: str = "softmax"
    environment: SupportsPicture | None = None

    @property
    def chances(self) -> list[float]:
        """The chance of each action if the learner chose by itself: its preference, and how sure it is."""
        return chances(self.selection, self.q[self.state], self.temperature)

    @property
    def picture(self) -> str:
        """The environment's own drawing of the state, "" where the problem's grid is all there is."""
        return "" if self.environment is None else self.environment.picture(self.state)

    @property
    def shapes(self) -> list[dict[str, Any]]:
        """The state as shapes, where the environment draws some: see `lab.learning.physics.environment.shapes`."""
        found: list[dict[str, Any]] = getattr(self.environment, "shapes", lambda state: [])(self.state)
        return found


@dataclass(frozen=True)
class Walked:
    """An episode that was open for advice, as its advisor may judge it.

    trail: the states left, the actions taken there, the states entered; steps as in `EpisodeEnded`; mean_before: of the
    K episodes before it.
    """

    episode: int
    trail: list[tuple[int, int, int]]
    reached: bool
    steps: int
    mean_before: float


class AdvisorLeft(Exception):
    """The advisor ends its advice for the session."""


Ask = Callable[[Any], int | None]  # given a kind of `Request`


class Advisor(Protocol):
    """Whoever can be asked."""

    def advise(self, request: Any) -> int | None:
        """One of `request.allowed`; None leaves this step to the learner. Raises AdvisorLeft to end advice for good."""
