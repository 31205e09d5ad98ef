"""What all gates have in common, and the two that look at nothing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from lab.learning.requests import ByChance, Reason, ValuesAlike, ValuesApart
from lab.learning.selection import Draw
from lab.learning.session_events import Improvement, Verdict
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates.update import Update

Steps = Sequence[float]  # whole numbers, unless the high level compares makespans

OPENS_NEVER, OPENS_ALWAYS, OPENS_FROM_X, OPENS_WHILE_SLOW, OPENS_WHILE_LONG = range(5)
WEIGHS_NOTHING, WEIGHS_NOVELTY, WEIGHS_FADING, WEIGHS_SHAPING, WEIGHS_RELIABILITY, WEIGHS_WORTH, WEIGHS_TRUST = range(7)
ASKS_ALWAYS, ASKS_WHERE_ALIKE, ASKS_WHERE_APART, ASKS_BY_CHANCE, ASKS_WHERE_TABLES_DIFFER = range(5)


class CompiledGate(NamedTuple):
    """A gate by the rules that the kernel knows: which episodes it opens (OPENS_...), which steps of these it asks about
    (ASKS_...), whether it judges episodes as CCRL does, and how it weighs what it is told (WEIGHS_...).
    """

    opens: int
    asks: int
    judges: bool = False
    weighs: int = WEIGHS_NOTHING


def window_mean(steps: Steps, end: int, window: int) -> float:
    """The mean of the `window` step counts before index `end`."""
    total: float = 0
    for i in range(end - window, end):
        total += steps[i]
    return total / window


def too_slow(current_mean: float, previous_mean: float, threshold: float) -> bool:
    """Whether the improvement rate is below Lambda. Source: thesis eqs. 6.1 and 6.2 and the listing's ratio."""
    return current_mean / previous_mean > 1.0 - threshold


def misled(result: float, mean_before: float) -> bool:
    """Whether an episode was not better than the mean of the K before it. Source: thesis eq. 6.3 and listing."""
    return result >= mean_before


def unsure(width: float, psi: float) -> bool:
    """Whether the values of a state span at most Psi. Source: Clouse 1996; thesis eq. 9.3 (<), listing (<=)."""
    return width <= psi


def improvement(steps: Steps, window: int) -> Improvement | None:
    """The improvement of the step counts so far; None while fewer than two windows have ended."""
    n = len(steps)
    if n < 2 * window:
        return None
    current, previous = window_mean(steps, n, window), window_mean(steps, n - window, window)
    return Improvement(1.0 - current / previous, current, previous)


# ---- gate -------------------------------------------------------------------------------------------------------------


Values = Sequence[float]


@dataclass(frozen=True)
class Surroundings:
    """What a gate may be built with beside its settings.

    draw: uniform numbers; learners: so many tables that learn as the learner does, each with start values of its own;
    several_starts: episodes may begin in different states; values: what the learner knows of a state now
    (`Update.gauge`); size: (S, A); learner: its settings.
    """

    draw: Draw
    learners: Callable[[int], Sequence[Update]]
    several_starts: bool = False
    values: Callable[[int], Values] = lambda state: ()
    size: tuple[int, int] = (0, 0)
    learner: LearnerSettings = field(default_factory=LearnerSettings)


class Gate:
    """The base of all gates, and the gate "always": every step of every episode asks, and nothing is ever rejected.

    A session calls `opens` before each episode, `begins` where it begins, `asks` before each step of an open one, `takes`
    with what was answered, `saw` after each step (if `watches`), and `judges` after the episode. `steps` holds the step
    counts of the finished episodes, a failed one as max_steps + 1. `why`: the reason of the last question; `verdict`: what
    the gate makes of the episode that ended last, see `Verdict`. weighs: it is asked and given to take also where the
    budget is spent.
    """

    watches = weighs = False

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        self.settings, self.episodes, self.max_steps, self.around = settings, episodes, max_steps, around
        self.misleads = 0
        self.rejected = False
        self.converged = False
        self.why = Reason()
        self.verdict: Verdict = ""

    def opens(self, episode: int, steps: Steps) -> bool:
        """Whether episode n (from 1) may ask for advice."""
        return True

    def begins(self, state: int) -> None:
        """Hears in which state the episode begins."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether the learner asks in a state; `values` is what it knows there (`Update.gauge`)."""
        return True

    def takes(self, state: int, own: int, said: int | None) -> int:
        """The action of a step of an open episode; own: the learner's choice; said: the answer, None where nothing was said.

        Called in each of its steps, whether it was asked about or not, also when the budget is spent.
        """
        return own if said is None else said

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Hears of a step that was made, as the learner does (`Update.learn`)."""

    def judges(self, steps: Steps, opened: bool) -> None:
        """Assesses the episode that ended last, which was open for advice or not; may set `rejected`."""


class Never(Gate):
    """Never asks."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """No episode asks."""
        return False


GateClass = Callable[[GateSettings, int, int, Surroundings | None], Gate]


# ---- per step ---------------------------------------------------------------------------------------------------------


class PerStep(Gate):
    """From episode X on, whether to ask is decided at each step."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """Every episode from X on may ask."""
        return episode >= self.settings.first_episode


def width_of(values: Values) -> float:
    return max(values) - min(values)


class Introspection(PerStep):
    """Asks in each state whose values span at most Psi (Clouse 1996; thesis eq. 9.3)."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether the learner is unsure of its choice."""
        self.why = ValuesAlike(width_of(values), self.settings.psi)
        return unsure(width_of(values), self.settings.psi)


class Importance(PerStep):
    """Asks in each state whose values span at least Psi: there a wrong choice costs most (Torrey and Taylor 2013)."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether much depends on the choice."""
        self.why = ValuesApart(width_of(values), self.settings.psi)
        return width_of(values) >= self.settings.psi


class Random(PerStep):
    """Asks in a random share of the steps: what any rule must beat."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether chance says so."""
        assert self.around is not None
        self.why = ByChance(self.settings.rate)
        return self.around.draw() < self.settings.rate
