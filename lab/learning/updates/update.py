"""What a session asks of a learner, and what the learners that keep action values have in common.

A table is a list of rows, one list of action values per state: in plain Python much faster than an array.
"""

from collections.abc import Sequence

import numpy as np

from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.mdp import FloatArray, TabularMDP

Row = list[float]
Table = Sequence[Row]

ACTION_VALUES, STATE_VALUES = range(2)  # the learners' forms that the kernel knows


def towards(value: float, target: float, alpha: float) -> float:
    """The value moved by the share alpha towards its target."""
    return value + alpha * (target - value)


class Update:
    """What a session asks of a learner.

    lookahead: learning needs the next action chosen first; chained: a step is learned from together with those before
    or after it in the episode, so that none of them may be left out; q: its action values now, `q[state][action]`.
    """

    lookahead = chained = False
    q: Table

    def begin(self) -> None:
        """Starts an episode."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Learns from one step; discount_t is 0 when s_t is terminal; a_t matters only with `lookahead`."""
        raise NotImplementedError

    def end(self) -> None:
        """Ends an episode, whether it reached a terminal state or was broken off."""

    def gauge(self, state: int) -> Row:
        """The values whose width says how sure the learner is in a state (what introspection looks at)."""
        return self.q[state]

    def table(self) -> FloatArray:
        """The action values of all states, (S, A)."""
        return np.array(list(self.q), np.float64)

    def scatter(self, draw: Draw) -> None:
        """Sets every value that it keeps to one drawn within +-0.5."""
        for row in self.q:
            row[:] = [draw() - 0.5 for _ in row]


class OnTable(Update):
    """What the learners that keep a value per state and action have in common."""

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        self.q: list[Row] = q
        self._settings = settings
        self._alpha = settings.alpha
