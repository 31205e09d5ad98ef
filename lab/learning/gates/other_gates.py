"""Two more gates: "cq", which asks while episodes are too long, and "uncertainty", which asks where an ensemble disagrees."""

from collections.abc import Sequence

from lab.learning.gates.gate import Gate, PerStep, Steps, Surroundings, Values, window_mean
from lab.learning.requests import TablesDiffer, TooLong
from lab.learning.settings import GateSettings
from lab.learning.updates.update import Update


class ConstantPerformance(Gate):
    """Asks for whole episodes while the mean step count of the last K is above a constant (CQ(lambda): Kartoun et al. 2006)."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """Whether performance is not good enough yet."""
        settings = self.settings
        if episode < settings.first_episode or len(steps) < settings.window:
            return False
        mean = window_mean(steps, len(steps), settings.window)
        self.why = TooLong(settings.window, mean, settings.enough_steps)
        return mean > settings.enough_steps


# ---- disagreement of an ensemble of tables --------------------------------------------------------------------------


class Uncertainty(PerStep):
    """Asks where the standard deviation of the values of an ensemble of tables is at least `spread`.

    Each table starts with random values within +-0.5 and learns by the learner's rule from each step with probability 1/2, or, if
    that rule learns from connected steps (`Update.chained`), from each whole episode. The deviation is the root of the variance,
    averaged over the actions. Source: da Silva et al. 2020 (RCMP), for tables.
    """

    watches = True

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self._tables = [] if around is None else around.learners(settings.ensemble)
        self._learning: list[Update] = []  # the tables with a chained rule that learn from this episode

    def begins(self, state: int) -> None:
        """Begins the episode for each table, and draws whether tables with a chained rule learn from it."""
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
        """Lets each table learn from the step with probability 1/2, or as drawn for the episode."""
        assert self.around is not None
        draw = self.around.draw
        for table in self._tables:
            if table in self._learning if table.chained else draw() < 0.5:
                table.learn(s_tm1, a_tm1, r_t, discount_t, s_t, a_t)

    def judges(self, steps: Steps, opened: bool) -> None:
        """Ends the episode for each table."""
        for table in self._tables:
            table.end()


def deviation(rows: Sequence[Values]) -> float:
    """The root of the mean over actions of the variance over tables."""
    total = 0.0
    for column in zip(*rows, strict=True):
        mean = sum(column) / len(column)
        total += sum([(value - mean) * (value - mean) for value in column]) / len(column)
    return float((total / len(rows[0])) ** 0.5)
