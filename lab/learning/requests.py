"""What a learner shows when it asks, who may be asked, and what came of an episode: records below all who advise."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from lab.learning.reasons import Reason
from lab.learning.selection import chances
from lab.learning.updates import Table
from lab.mdp import TabularMDP


@dataclass(frozen=True, slots=True)
class Standing:
    """How advice stands with the learner: steps helped of those allowed, episodes misled of those tolerated, Lambda."""

    helped_steps: int = 0
    budget: int = 1_000_000_000
    misleads: int = 0
    omega: int = 0
    lambda_threshold: float = 0.0


class Place(Protocol):
    """What a request shows of where the learner acts, beside the table."""

    def picture(self, state: int) -> str:
        """The environment's own drawing, "" when there is none."""


@dataclass(frozen=True, slots=True)
class AdviceRequest:
    """What a learner shows when it asks: where it is, what it thinks, how it has been doing, and why it asks.

    q: its live action values, q[state][action], not to be changed; step counts from 1; learner_action: what it
    would do itself; the means are step counts over the last K episodes and the K before, None (like the rate)
    before there are 2K; why: the gate's reason; temperature and selection: how it chooses now; place: what can
    draw the state; undoable: an answer of this episode can be taken back.
    """

    mdp: TabularMDP
    q: Table
    state: int
    episode: int
    step: int
    learner_action: int
    improvement_rate: float | None
    current_mean: float | None
    previous_mean: float | None
    why: Reason | None = None
    temperature: float = 1.0
    selection: str = "softmax"
    standing: Standing = Standing()
    place: Place | None = None
    undoable: bool = False

    @property
    def chances(self) -> list[float]:
        """The chance of each action if the learner chose by itself: its preference, and how sure it is."""
        return chances(self.selection, self.q[self.state], self.temperature)

    @property
    def picture(self) -> str:
        """The environment's own drawing of the state, "" where the problem's grid is all there is."""
        return "" if self.place is None else self.place.picture(self.state)


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


Ask = Callable[[AdviceRequest], int | None]


class Advisor(Protocol):
    """Whoever can be asked."""

    def advise(self, request: AdviceRequest) -> int | None:
        """The action to take; None leaves this step to the learner. Raises AdvisorLeft to end advice for good."""
