"""The base classes of learners: `Update`, the interface that a session uses, and `OnTable`, for those that keep action values.

A table is a list of rows, one list of action values per state, because plain Python reads lists much faster than arrays.
"""

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, overload

import numpy as np

from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.mdp import FloatArray, TabularMDP

Row = list[float]
Table = Sequence[Row]


class ComputedRows(Sequence[Row]):
    """The base class of tables whose rows are computed on lookup, from less than a value per state and action."""

    @abstractmethod
    def row(self, state: int) -> Row:
        """The action values (A,) of a state."""

    @overload
    def __getitem__(self, state: int) -> Row: ...
    @overload
    def __getitem__(self, state: slice) -> list[Row]: ...
    def __getitem__(self, state: int | slice) -> Row | list[Row]:
        if isinstance(state, slice):
            return [self.row(s) for s in range(*state.indices(len(self)))]
        return self.row(state)


Q, AFTERSTATE, SARSA, Q_TRACES, SARSA_TRACES, DYNA, OWN_RULE = range(7)  # the learners of the kernel


def towards(value: float, target: float, alpha: float) -> float:
    """value + alpha * (target - value)."""
    return value + alpha * (target - value)


class Update:
    """The base class of learners, which a session creates with (q, settings, mdp) and calls in the order `begin`, `learn`, `end`.

    q: the start values, `q[state][action]`, S lists of A floats, which `learn` changes in place; settings: a `LearnerSettings`;
    mdp: the problem, a `TabularMDP`. A subclass has to keep `q`; the values of terminal states stay 0.
    lookahead: class attribute, whether `learn` needs the next action, as SARSA does; chained: class attribute, whether a step is
    learned from together with others of its episode, so that none may be left out.

        >>> import lab
        >>> class Slow(lab.Update):
        ...     '''Q-learning with half of the learning rate.'''
        ...     def __init__(self, q, settings, mdp):
        ...         self.q, self.alpha = q, 0.5 * settings.alpha
        ...     def learn(self, s_tm1, a_tm1, r_t, discount_t, s_t, a_t):
        ...         target = r_t + discount_t * max(self.q[s_t])
        ...         self.q[s_tm1][a_tm1] += self.alpha * (target - self.q[s_tm1][a_tm1])
        >>> from lab.testing import check_learner
        >>> check_learner(Slow)
    """

    lookahead = chained = False
    q: Table

    def begin(self) -> None:
        """Begins an episode; by default does nothing."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Learns from the step from s_tm1 by action a_tm1 to s_t with reward r_t.

        discount_t: 0 if s_t is terminal, otherwise gamma; a_t: the next action, 0 without `lookahead`.
        """
        raise NotImplementedError

    def end(self) -> None:
        """Ends an episode, terminated or truncated; by default does nothing."""

    def gauge(self, state: int) -> Row:
        """The values (A,) of a state whose span shows how sure the learner is there; gates read them."""
        return self.q[state]

    def replay(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int) -> None:
        """Learns again from a known step; by default only where a step can be learned from by itself."""
        if not (self.lookahead or self.chained):
            self.learn(s_tm1, a_tm1, r_t, discount_t, s_t, 0)

    def leads_to(self, state: int, action: int) -> int:
        """The state that a move leads to, if the learner knows that before it is made, otherwise -1."""
        return -1

    def prefer(self, state: int, action: int, margin: float) -> None:
        """Lowers the values of the other actions in a state to at most that of `action` minus `margin`.

        Nothing changes in tables whose rows are computed.
        """
        row = self.q[state]
        most = row[action] - margin
        row[:] = [value if a == action else min(value, most) for a, value in enumerate(row)]

    def table(self) -> FloatArray:
        """The action values of all states, (S, A) float64."""
        return np.array(list(self.q), np.float64)

    def scatter(self, draw: Draw) -> None:
        """Draws every value within +-0.5; draw: returns uniform numbers in [0, 1)."""
        for row in self.q:
            row[:] = [draw() - 0.5 for _ in row]


class OnTable(Update):
    """The base class of learners that keep a value per state and action."""

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        self.q: list[Row] = q
        self._settings = settings
        self._alpha = settings.alpha


class RuleUpdate(OnTable):
    """The base class of learners whose update is one function, `rule`, which the kernel compiles for many sessions at once.

    rule: a static method, called as rule(q, settings, s_tm1, a_tm1, r_t, discount_t, s_t, a_t), which changes the values
    `q[state][action]` in place; settings: the numbers of `LearnerSettings`, by name; the rest is as in `learn`. It is written in
    the Python that numba compiles, makes no list and no array, and calls nothing but what numba knows.
    A subclass that overrides another method runs in the session only.

        >>> import lab
        >>> class Halfway(lab.RuleUpdate):
        ...     '''As q, by half of the learning rate.'''
        ...     @staticmethod
        ...     def rule(q, settings, s_tm1, a_tm1, r_t, discount_t, s_t, a_t):
        ...         target = r_t + discount_t * max(q[s_t])
        ...         q[s_tm1][a_tm1] += 0.5 * settings.alpha * (target - q[s_tm1][a_tm1])
        >>> from lab.testing import check_learner
        >>> check_learner(Halfway)
    """

    rule: ClassVar[Any]

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Applies the rule to a step."""
        plain_rule(type(self))(self.q, self._settings, s_tm1, a_tm1, r_t, discount_t, s_t, a_t)


def plain_rule(learner: type[RuleUpdate]) -> Any:
    """The rule of a class as a plain function, also if it is decorated with `numba.njit`."""
    return getattr(learner.rule, "py_func", learner.rule)


def is_rule_only(learner: Any) -> bool:
    """Whether a class is a `RuleUpdate` that adds nothing but its rule."""
    if not (isinstance(learner, type) and issubclass(learner, RuleUpdate) and hasattr(learner, "rule")):
        return False
    methods = ("__init__", "begin", "learn", "end", "gauge", "table", "scatter", "replay", "prefer", "leads_to")
    return not learner.chained and all(getattr(learner, name) is getattr(RuleUpdate, name) for name in methods)
