"""The base class of all gates, the rules that kernel and gates share, and the gates that decide at each step."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import log
from typing import NamedTuple

from lab.learning.requests import ByChance, Reason, ValuesAlike, ValuesApart
from lab.learning.selection import Draw
from lab.learning.session_events import Improvement, Verdict
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates.update import Update

Steps = Sequence[
    float
]  # step counts of the finished episodes; for orders of transfers, their makespans [s]; see `by_return`

OPENS_NEVER, OPENS_ALWAYS, OPENS_FROM_X, OPENS_WHILE_SLOW, OPENS_WHILE_LONG, OPENS_BY_RULE = range(6)
WEIGHS_NOTHING, WEIGHS_NOVELTY, WEIGHS_FADING, WEIGHS_SHAPING, WEIGHS_RELIABILITY, WEIGHS_WORTH, WEIGHS_TRUST = range(7)
WEIGHS_REUSE, WEIGHS_IMITATION, WEIGHS_POLICY, WEIGHS_VALUES = range(7, 11)
ASKS_ALWAYS, ASKS_WHERE_ALIKE, ASKS_WHERE_APART, ASKS_BY_CHANCE, ASKS_WHERE_TABLES_DIFFER, ASKS_BY_RULE = range(6)

TIMES_LONGER = 3.0  # how much longer than its own a learner's episodes are with an advisor that is to be rejected
ENOUGH_EVIDENCE = log(50.0)  # Wald's bound: a useful advisor is rejected with a chance of about 2 %


class CompiledGate(NamedTuple):
    """A gate's form in the kernel.

    opens: which episodes it opens (OPENS_...); asks: which of their steps it asks about (ASKS_...); judges: whether it judges
    episodes as CCRL does; weighs: how it weighs answers (WEIGHS_...).
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
    return previous_mean == 0.0 or current_mean / previous_mean > 1.0 - threshold


def misled(result: float, mean_before: float) -> bool:
    """Whether an episode was not better than the mean of the K before it. Source: thesis eq. 6.3 and listing."""
    return result >= mean_before


def evidence(before: float, result: float, own: float, reached: int, failed: bool, throughout: bool) -> float:
    """The evidence against an advisor after another advised episode: a log-likelihood ratio, at least -ENOUGH_EVIDENCE.

    The learner reaches the goal at a constant rate per step: its own rate if the advisor does no harm, a TIMES_LONGER-th of it if
    the advisor is to be rejected. before: the evidence so far; result: the steps of the episode; own, reached: the steps of the
    learner's last own episodes, summed, and how many of them reached the goal; failed: whether the advised one did not.
    throughout: whether each of its moves was advised; such an episode that fails counts as at least TIMES_LONGER own ones,
    because the learner alone may not have reached the goal yet either. Source: Wald 1945, with a floor so that an advisor whose
    answers become worse is rejected, too.
    """
    times = result * reached / own if own > 0.0 else 0.0
    if failed and throughout:
        times = max(times, TIMES_LONGER)
    gained = times * (1.0 - 1.0 / TIMES_LONGER)
    if not failed:
        gained -= log(TIMES_LONGER)
    return max(before + gained, -ENOUGH_EVIDENCE)


def unsure(width: float, psi: float) -> bool:
    """Whether the values of a state span at most Psi. Source: Clouse 1996; thesis eq. 9.3 (<), listing (<=)."""
    return width <= psi


def improvement(steps: Steps, window: int) -> Improvement | None:
    """The improvement of the last `window` steps over those before, None for fewer than 2 * window. Source: thesis eq. 6.1."""
    n = len(steps)
    if n < 2 * window:
        return None
    current, previous = window_mean(steps, n, window), window_mean(steps, n - window, window)
    return Improvement(1.0 - current / previous if previous else 0.0, current, previous)


# ---- the base class -------------------------------------------------------------------------------------------------


Values = Sequence[float]


@dataclass(frozen=True)
class Surroundings:
    """What a gate may use besides its settings.

    draw: returns uniform numbers; learners: returns as many independent learners as asked for, with random start values;
    several_starts: whether episodes may begin in different states; values: the learner's values of a state (`Update.gauge`);
    size: (S, A); learner: the learner's settings; by_return: whether the problem has no goal, so that what is given as the
    steps of an episode is the shortfall of its return; update: the learner itself.
    """

    draw: Draw
    learners: Callable[[int], Sequence[Update]]
    several_starts: bool = False
    values: Callable[[int], Values] = lambda state: ()
    size: tuple[int, int] = (0, 0)
    learner: LearnerSettings = field(default_factory=LearnerSettings)
    by_return: bool = False
    update: Update = field(default_factory=Update)


class Gate:
    """The base class of gates, and the gate "always", which asks about every step and rejects nobody.

    A session calls `opens` before each episode, `begins` with its first state, `asks` before each step of an open episode,
    `takes` with the answer, `saw` after each step (if `watches`), and `judges` after the episode. A subclass overrides what it
    decides.

    settings: of the gate, a `GateSettings`; episodes, max_steps: of the session; around: what else a gate may use, None outside
    sessions.
    watches: class attribute, whether `saw` is called; weighs: class attribute, whether `asks` and `takes` are also called when
    the budget is spent.
    misleads: episodes that misled; rejected: whether the advisor is rejected; converged: whether the gate has stopped asking for
    good; why: the `Reason` for the last question, which people read as text; verdict: on the last episode: "better" than those
    before it, "best", "misled", or "" for none.

        >>> import lab
        >>> class EveryOther(lab.Gate):
        ...     '''Asks in every other episode.'''
        ...     def opens(self, episode: int, steps: lab.Steps) -> bool:
        ...         return episode % 2 == 0
        >>> from lab.testing import check_gate
        >>> check_gate(EveryOther)
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
        """Whether episode n (from 1) may ask; steps: of the finished episodes, failed ones as max_steps + 1."""
        return True

    def begins(self, state: int) -> None:
        """Receives the first state of the episode."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether the learner asks in a state; values: (A,), the learner's values there (`Update.gauge`)."""
        return True

    def takes(self, state: int, own: int, said: int | None) -> int:
        """The action to carry out in a step of an open episode.

        own: the learner's choice; said: the answer, None if there is none. It is called in each step, asked about or not, and
        also when the budget is spent if `weighs`.
        """
        return own if said is None else said

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Receives a step after the learner has learned from it; the arguments are those of `Update.learn`."""

    def judges(self, steps: Steps, opened: bool) -> None:
        """Judges the last episode; opened: whether it counts as advised. May set misleads, rejected, converged and verdict."""


class Never(Gate):
    """Never asks."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """No episode asks."""
        return False


GateClass = Callable[[GateSettings, int, int, Surroundings | None], Gate]


# ---- gates that decide at each step ---------------------------------------------------------------------------------


class PerStep(Gate):
    """The base class of gates that open every episode from X on and decide at each step."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """Every episode from X on may ask."""
        return episode >= self.settings.first_episode


def width_of(values: Values) -> float:
    """The span of values: the highest minus the lowest."""
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
        """Whether the values span at least Psi."""
        self.why = ValuesApart(width_of(values), self.settings.psi)
        return width_of(values) >= self.settings.psi


class Random(PerStep):
    """Asks in a random share of the steps: the baseline for any rule."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether this step is in the random share."""
        assert self.around is not None
        self.why = ByChance(self.settings.rate)
        return self.around.draw() < self.settings.rate
