"""When a learner asks for advice, and when it stops: per episode, per step, or both.

The rules that the compiled kernel follows too are plain functions of numbers and arrays, which numba compiles as well.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf

from lab.learning.events import Improvement, Verdict
from lab.learning.reasons import Both, ByChance, Reason, TablesDiffer, TooLong, TooSlow, ValuesAlike, ValuesApart
from lab.learning.selection import Draw
from lab.learning.settings import GateSettings
from lab.learning.updates import Update

Values = Sequence[float]
Steps = Sequence[float]  # whole numbers, unless the high level compares makespans


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


def _width(values: Values) -> float:
    return max(values) - min(values)


@dataclass(frozen=True)
class Surroundings:
    """What a gate may be built with beside its settings.

    draw: uniform numbers; learners: so many tables that learn as the learner does, each with start values of its own;
    several_starts: episodes may begin in different states.
    """

    draw: Draw
    learners: Callable[[int], Sequence[Update]]
    several_starts: bool = False


class Gate:
    """The base of all gates, and the gate "always": every step of every episode asks, and nothing is ever rejected.

    A session calls `opens` before each episode, `begins` where it begins, `asks` before each step of an open one, `saw`
    after each step (if `watches`), and `judges` after the episode. `steps` holds the step counts of the finished
    episodes, a failed one as max_steps + 1. `why`: the reason of the last question; `verdict`: what the gate makes of
    the episode that ended last, see `Verdict`.
    """

    watches = False

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

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Hears of a step that was made, as the learner does (`Update.learn`)."""

    def judges(self, steps: Steps, opened: bool) -> None:
        """Assesses the episode that ended last, which was open for advice or not; may set `rejected`."""


class Never(Gate):
    """Never asks."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """No episode asks."""
        return False


class _PerStep(Gate):
    """From episode X on, whether to ask is decided at each step."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """Every episode from X on may ask."""
        return episode >= self.settings.first_episode


class Introspection(_PerStep):
    """Asks in each state whose values span at most Psi (Clouse 1996; thesis eq. 9.3)."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether the learner is unsure of its choice."""
        self.why = ValuesAlike(_width(values), self.settings.psi)
        return unsure(_width(values), self.settings.psi)


class Importance(_PerStep):
    """Asks in each state whose values span at least Psi: there a wrong choice costs most (Torrey and Taylor 2013)."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether much depends on the choice."""
        self.why = ValuesApart(_width(values), self.settings.psi)
        return _width(values) >= self.settings.psi


class Random(_PerStep):
    """Asks in a random share of the steps: what any rule must beat."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether chance says so."""
        assert self.around is not None
        self.why = ByChance(self.settings.rate)
        return self.around.draw() < self.settings.rate


class Uncertainty(_PerStep):
    """Asks where an ensemble of tables disagrees: their values' standard deviation is at least `spread`.

    Each table starts with values of its own within +-0.5 and learns as the learner does, each step with probability
    1/2, or where steps are learned from together (`Update.chained`), each whole episode. The deviation is the root of
    the mean variance over the actions. Source: da Silva et al. 2020 (RCMP), for tables.
    """

    watches = True

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self._tables = [] if around is None else around.learners(settings.ensemble)
        self._learning: list[Update] = []  # those with steps that belong together, that learn this episode

    def begins(self, state: int) -> None:
        """Each table begins the episode; where its steps belong together, it learns all of them or none."""
        assert self.around is not None
        for table in self._tables:
            table.begin()
        self._learning = [table for table in self._tables if table.chained and self.around.draw() < 0.5]

    def asks(self, state: int, values: Values) -> bool:
        """Whether the tables disagree about this state."""
        spread = deviation([table.gauge(state) for table in self._tables])
        self.why = TablesDiffer(len(self._tables), spread, self.settings.spread)
        return spread >= self.settings.spread

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Each table learns the step, or not."""
        assert self.around is not None
        draw = self.around.draw
        for table in self._tables:
            if table in self._learning if table.chained else draw() < 0.5:
                table.learn(s_tm1, a_tm1, r_t, discount_t, s_t, a_t)

    def judges(self, steps: Steps, opened: bool) -> None:
        """The episode is over: the tables learn what is learned at its end."""
        for table in self._tables:
            table.end()


def deviation(rows: Sequence[Values]) -> float:
    """The root of the mean over actions of the variance over tables."""
    total = 0.0
    for column in zip(*rows, strict=True):
        mean = sum(column) / len(column)
        total += sum([(value - mean) * (value - mean) for value in column]) / len(column)
    return float((total / len(rows[0])) ** 0.5)


class ConstantPerformance(Gate):
    """Asks for whole episodes while the mean of the last K is above a constant (CQ(lambda): Kartoun et al. 2006)."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """Whether performance is not good enough yet."""
        settings = self.settings
        if episode < settings.first_episode or len(steps) < settings.window:
            return False
        mean = window_mean(steps, len(steps), settings.window)
        self.why = TooLong(settings.window, mean, settings.enough_steps)
        return mean > settings.enough_steps


class Ccrl(Gate):
    """Asks for whole episodes while improvement is too slow, and rejects an advisor that misleads (thesis fig. 6.2).

    From episode X on it asks when current/previous mean > 1 - Lambda. It stops for good after more than 2K equal
    results below the step limit, and never asks in the last episode, which shows what was learned. An episode that
    was open for advice and is not better than the mean of the K before it is a mislead, also where the advisor's
    limited view let it say nothing (listing); more than Omega of them reject the advisor.

    Not in the thesis, whose episodes all begin in one state: where they begin in different ones, each count before is
    moved by how much farther the goal is from where the judged episode began. How far that is, the learner knows from
    its own walks alone: the fewest steps by which it has seen the goal reached from a state, parts of different walks
    put together. Nobody tells it the shortest way, so that is too many at first, and where steps are left to chance, it
    is the luckiest. A failed episode keeps its count. With one start nothing is moved. When to ask is decided by the
    plain counts. `settings.spare_best`: an episode of the fewest steps known from its start is no mislead, for no
    advice could have made it better; the thesis counts it.
    """

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self.watches = around is not None and around.several_starts
        self._slow = Reason()
        self._last_result: float = 0
        self._equal_results = 0
        self._starts: dict[int, int] = {}  # where each episode began
        self._start = 0
        self._walk = [0]  # the states that this episode left; only its first one where all begin in one
        self._fewest: dict[int, float] = {}  # known steps to the goal

    def begins(self, state: int) -> None:
        """Another walk begins."""
        self._start, self._walk = state, [] if self.watches else [state]

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """The walk goes on."""
        self._walk.append(s_tm1)

    def opens(self, episode: int, steps: Steps) -> bool:
        """Whether the improvement rate is below Lambda."""
        improved = improvement(steps, self.settings.window)
        if self.rejected or episode < self.settings.first_episode or improved is None:
            return False
        self._watch_convergence(steps[-1])
        slow = too_slow(improved.current_mean, improved.previous_mean, self.settings.lambda_threshold)
        self.why = self._slow = TooSlow(improved.rate, self.settings.lambda_threshold)
        return slow and not self.converged and episode < self.episodes

    def _watch_convergence(self, result: float) -> None:
        if result == self._last_result and result < self.max_steps:
            self._equal_results += 1
            self.converged = self.converged or self._equal_results > 2 * self.settings.window
        else:
            self._last_result, self._equal_results = result, 0

    def judges(self, steps: Steps, opened: bool) -> None:
        """Counts a mislead and rejects the advisor after more than Omega (eqs. 6.3 and 6.4)."""
        n, window, result = len(steps), self.settings.window, steps[-1]
        self._starts[n - 1] = self._start
        self._knows(result)
        self.verdict = ""
        if opened and not self.rejected and n > window:
            if not misled(result, window_mean(self._alike(steps), window, window)):
                self.verdict = "better"
            elif self.settings.spare_best and result <= min(self._fewest[self._start], self.max_steps):
                self.verdict = "best"
            else:
                self.verdict = "misled"
                self.misleads += 1
            self.rejected = self.misleads > self.settings.omega

    def _knows(self, result: float) -> None:
        """Takes in how far the goal was from each state of the walk."""
        left = result - len(self._walk) if result <= self.max_steps else inf
        for state in reversed(self._walk):
            left = self._fewest[state] = min(left + 1, self._fewest.get(state, inf))

    def _alike(self, steps: Steps) -> Steps:
        """The K counts before the last one, as if they had begun where it began."""
        found, here = [], self._fewest[self._start]
        for i in range(len(steps) - 1 - self.settings.window, len(steps) - 1):
            start = self._starts.get(i, self._start)
            moved = start != self._start and here < inf and steps[i] <= self.max_steps
            found.append(steps[i] - self._fewest[start] + here if moved else steps[i])
        return found


class Combined(Ccrl):
    """Asks only when both CCRL and introspection would, and rejects as CCRL does (thesis, section 9.6)."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether the learner is unsure of its choice."""
        self.why = Both(self._slow, ValuesAlike(_width(values), self.settings.psi))
        return unsure(_width(values), self.settings.psi)


GATES: dict[str, Callable[[GateSettings, int, int, Surroundings | None], Gate]] = {
    "ccrl": Ccrl,
    "ia": Introspection,
    "combined": Combined,
    "cq": ConstantPerformance,
    "always": Gate,
    "never": Never,
    "random": Random,
    "importance": Importance,
    "uncertainty": Uncertainty,
}
