"""Update rules on action-value tables: the bare equations, and the learners that apply them step by step.

A table is a list of rows, one list of action values per state: in plain Python much faster than an array.
"""

from collections.abc import Callable
from typing import Protocol

from lab.learning.settings import LearnerSettings

Row = list[float]
Table = list[Row]

TRACE_FLOOR = 1e-6  # an eligibility below this moves no value noticeably, and dropping it keeps a step cheap


def q_target(r_t: float, discount_t: float, q_t: Row) -> float:
    """r + gamma max_a Q(s', a); discount_t is 0 when s' is terminal. Source: Watkins 1989, thesis fig. 2.2."""
    return r_t + discount_t * max(q_t)


def sarsa_target(r_t: float, discount_t: float, q_t: Row, a_t: int) -> float:
    """r + gamma Q(s', a'); discount_t is 0 when s' is terminal. Source: thesis fig. 2.1."""
    return r_t + discount_t * q_t[a_t]


def is_greedy(q_t: Row, a_t: int) -> bool:
    """Whether a' is a best action of s'; a tie counts as best. Source: thesis fig. 2.3."""
    return q_t[a_t] == max(q_t)


class Update(Protocol):
    """What a session asks of a learner: `lookahead` says whether learning needs the next action chosen first."""

    lookahead: bool

    def begin(self) -> None:
        """Starts an episode."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Learns from one step; discount_t is 0 when s_t is terminal; a_t matters only with `lookahead`."""


class QLearning:
    """One-step Q-learning: Q(s,a) += alpha (r + gamma max Q(s',.) - Q(s,a)). Source: thesis fig. 2.2."""

    lookahead = False

    def __init__(self, q: Table, settings: LearnerSettings):
        self._q, self._alpha = q, settings.alpha

    def begin(self) -> None:
        """Nothing is carried from episode to episode."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """One update of Q(s, a)."""
        row = self._q[s_tm1]
        row[a_tm1] += self._alpha * (q_target(r_t, discount_t, self._q[s_t]) - row[a_tm1])


class Sarsa:
    """One-step SARSA: Q(s,a) += alpha (r + gamma Q(s',a') - Q(s,a)). Source: thesis fig. 2.1."""

    lookahead = True

    def __init__(self, q: Table, settings: LearnerSettings):
        self._q, self._alpha = q, settings.alpha

    def begin(self) -> None:
        """Nothing is carried from episode to episode."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """One update of Q(s, a)."""
        row = self._q[s_tm1]
        row[a_tm1] += self._alpha * (sarsa_target(r_t, discount_t, self._q[s_t], a_t) - row[a_tm1])


class WatkinsQLambda:
    """Watkins's Q(lambda) with accumulating traces, cut when the next action is not greedy. Source: thesis fig. 2.3."""

    lookahead = True

    def __init__(self, q: Table, settings: LearnerSettings):
        self._q, self._alpha = q, settings.alpha
        self._decay = settings.discount * settings.trace
        self._actions = len(q[0])
        self._traces: dict[int, tuple[Row, int, float]] = {}

    def begin(self) -> None:
        """Forgets the traces of the last episode."""
        self._traces.clear()

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """One update of every value that led here, by its eligibility."""
        row, q_t, traces, decay = self._q[s_tm1], self._q[s_t], self._traces, self._decay
        step = self._alpha * (q_target(r_t, discount_t, q_t) - row[a_tm1])
        follow = decay > 0.0 and discount_t > 0.0 and is_greedy(q_t, a_t)
        key = s_tm1 * self._actions + a_tm1
        earlier = traces.pop(key, None)  # put back last, so that the oldest traces stay in front
        traces[key] = (row, a_tm1, earlier[2] + 1.0 if earlier else 1.0)
        for trace_row, action, eligibility in traces.values():
            trace_row[action] += step * eligibility
        if follow:
            self._traces = {
                k: (trace_row, action, eligibility * decay)
                for k, (trace_row, action, eligibility) in traces.items()
                if eligibility > TRACE_FLOOR
            }
        else:
            traces.clear()


UPDATES: dict[str, Callable[[Table, LearnerSettings], Update]] = {
    "q": QLearning,
    "sarsa": Sarsa,
    "q-lambda": WatkinsQLambda,
}
