"""The learner that waits for the end of the episode."""

from lab.learning.settings import LearnerSettings
from lab.learning.updates.update import OnTable, Row, towards
from lab.mdp import TabularMDP


class MonteCarlo(OnTable):
    """First-visit Monte Carlo with a constant step: Q(s,a) += alpha (G - Q(s,a)) when the episode is over.

    A broken-off episode counts as if the start value came after it: nothing, where that is 0.
    Source: Sutton and Barto 1998, section 5.4.
    """

    chained = True

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        super().__init__(q, settings, mdp)
        self._episode: list[tuple[int, int, float]] = []
        self._after = 0.0

    def begin(self) -> None:
        """Forgets the last episode."""
        self._episode.clear()

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Remembers the step."""
        self._after = self._settings.start_value if discount_t else 0.0
        self._episode.append((s_tm1, a_tm1, r_t))

    def end(self) -> None:
        """Learns from the returns that followed the first visits."""
        outcome, returns = self._after, dict[tuple[int, int], float]()
        for state, action, reward in reversed(self._episode):
            outcome = reward + self._settings.discount * outcome
            returns[state, action] = outcome  # the last one written is that of the first visit
        for (state, action), outcome in returns.items():
            self.q[state][action] = towards(self.q[state][action], outcome, self._alpha)
        self._episode.clear()
