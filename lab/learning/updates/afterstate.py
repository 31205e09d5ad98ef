"""The learner that keeps a value per state, and judges a move by where it led."""

from collections.abc import Sequence
from typing import overload

from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.learning.updates.update import Row, Table, towards
from lab.mdp import TabularMDP


def afterstate_value(step_reward: float, discount: float, v_t: float) -> float:
    """r + gamma V(s'): a move is worth what the state after it is. Source: thesis App. VII; Sutton and Barto, 6.8."""
    return step_reward + discount * v_t


class AfterstateRows(Sequence[Row]):
    """Action values read off a value per state: row s is r + gamma V(s') over the actions; zeros where episodes end."""

    def __init__(self, mdp: TabularMDP, discount: float, values: Row):
        self.values = values
        self._step_reward, self._discount = mdp.step_reward, discount
        self._successor: list[list[int]] = mdp.successor.tolist()
        self._over: list[bool] = mdp.terminal.tolist()

    def __len__(self) -> int:
        return len(self._successor)

    @overload
    def __getitem__(self, state: int) -> Row: ...
    @overload
    def __getitem__(self, state: slice) -> list[Row]: ...
    def __getitem__(self, state: int | slice) -> Row | list[Row]:
        if isinstance(state, slice):
            return [self[s] for s in range(*state.indices(len(self)))]
        if self._over[state]:
            return [0.0] * len(self._successor[state])
        reward, discount, values = self._step_reward, self._discount, self.values
        return [afterstate_value(reward, discount, values[entered]) for entered in self._successor[state]]

    def after(self, state: int) -> Row:
        """The values of the states that the actions lead to."""
        return [self.values[entered] for entered in self._successor[state]]


class Afterstate:
    """TD(0) on afterstates: V(s) += alpha (r + gamma V(s') - V(s)), s' being where the chosen action led.

    A terminal state is worth 0 until it is first entered, then its reward. All ordinary moves must have one reward.
    Raises BadInput where they do not, or where entering a terminal state is worth more from one side.
    Source: thesis App. VII (the text speaks of Q(s,a), the listing keeps a value per state).
    """

    lookahead = chained = False

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        self._alpha, self._discount = settings.alpha, settings.discount
        self._step_reward = mdp.step_reward
        self._arrival: Row = mdp.arrival.tolist()
        self._values = _values_behind(q, mdp, settings.discount)
        self._rows = AfterstateRows(mdp, settings.discount, self._values)
        self.q: Table = self._rows

    def begin(self) -> None:
        """Nothing is carried from episode to episode."""

    def end(self) -> None:
        """Nothing is left to learn."""

    def gauge(self, state: int) -> Row:
        """The values of the states that the actions lead to, as the listing compares them."""
        return self._rows.after(state)

    def scatter(self, draw: Draw) -> None:
        """Every state's value."""
        self._values[:] = [draw() - 0.5 for _ in self._values]

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """One update of V(s); entering a terminal state shows its worth."""
        values = self._values
        target = afterstate_value(self._step_reward, self._discount, values[s_t])
        values[s_tm1] = towards(values[s_tm1], target, self._alpha)
        if not discount_t:
            values[s_t] = self._arrival[s_t]


def _values_behind(q: list[Row], mdp: TabularMDP, discount: float) -> Row:
    """The values per state that a table of action values was read off; zeros for a table of zeros."""
    values = [0.0] * mdp.n_states
    if any(map(any, q)):
        for row, entered, over in zip(q, mdp.successor.tolist(), mdp.terminal.tolist(), strict=True):
            if not over:
                for value, state in zip(row, entered, strict=True):
                    values[state] = (value - mdp.step_reward) / discount
    return values
