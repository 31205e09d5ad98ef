"""Learners with eligibility traces, whose every step corrects the moves before it, too."""

from lab.learning.settings import LearnerSettings
from lab.learning.updates.one_step import q_target, sarsa_target
from lab.learning.updates.update import OnTable, Row
from lab.mdp import TabularMDP

TRACE_FLOOR = 1e-6  # an eligibility below this moves no value noticeably, and dropping it keeps a step cheap


def is_greedy(q_t: Row, a_t: int) -> bool:
    """Whether a' is a best action of s'; a tie counts as best. Source: thesis fig. 2.3."""
    return q_t[a_t] == max(q_t)


class Traced(OnTable):
    """A learner with eligibility traces: accumulating ones grow by 1 on a visit, replacing ones are set to 1.

    Source: Singh and Sutton 1996; thesis fig. 2.3.
    """

    lookahead = chained = True

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        super().__init__(q, settings, mdp)
        self._decay = settings.discount * settings.trace
        self._growing = not settings.replacing
        self._traces: dict[int, tuple[Row, int, float]] = {}

    def begin(self) -> None:
        """Forgets the traces of the last episode."""
        self._traces.clear()

    def _spread(self, s_tm1: int, a_tm1: int, error: float, follow: bool) -> None:
        """Moves every value that led here by its eligibility; then lets the traces fade, or cuts them."""
        row, traces, decay = self.q[s_tm1], self._traces, self._decay
        step = self._alpha * error
        key = s_tm1 * len(row) + a_tm1
        earlier = traces.pop(key, None)  # put back last, so that the oldest traces stay in front
        traces[key] = (row, a_tm1, earlier[2] + 1.0 if earlier and self._growing else 1.0)
        for trace_row, action, eligibility in traces.values():
            trace_row[action] += step * eligibility
        if follow and decay > 0.0:
            self._traces = {
                k: (trace_row, action, eligibility * decay)
                for k, (trace_row, action, eligibility) in traces.items()
                if eligibility > TRACE_FLOOR
            }
        else:
            traces.clear()


class WatkinsQLambda(Traced):
    """Watkins's Q(lambda): traces are cut when the next action is not greedy. Source: thesis fig. 2.3."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """One update of every value that led here, by its eligibility."""
        q_t = self.q[s_t]
        error = q_target(r_t, discount_t, q_t) - self.q[s_tm1][a_tm1]
        self._spread(s_tm1, a_tm1, error, discount_t > 0.0 and is_greedy(q_t, a_t))


class SarsaLambda(Traced):
    """SARSA(lambda): traces follow whatever is done. Source: Sutton and Barto 1998, fig. 7.11."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """One update of every value that led here, by its eligibility."""
        error = sarsa_target(r_t, discount_t, self.q[s_t], a_t) - self.q[s_tm1][a_tm1]
        self._spread(s_tm1, a_tm1, error, discount_t > 0.0)
