"""Problems whose steps are left to chance, in tables: what each action may lead to, the best that can be had, exactly."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.errors import WorkFailed
from lab.mdp import MAX_SWEEPS, BoolArray, FloatArray, IntArray

SETTLED = 1e-12  # changes of a value, and chances, below this are none
SAME_REWARD = 1e-9

Transition = tuple[float, int, float, bool]  # chance, state entered, reward, the episode is over
Transitions = Mapping[int, Mapping[int, Sequence[Transition]]]  # [state][action], as Gymnasium's toy texts hold it
Actions = NDArray[np.int64]  # (S,) the one that a policy takes in each state


class Worth(NamedTuple):
    """What a policy brings: its mean return (not discounted), the chance of a goal, the mean steps of the way to one."""

    mean_return: float
    reaches: float
    steps: float


class TransitionModel:
    """A problem left to chance: its outcomes side by side, and the chance (S,) of starting in each state.

    live (S,) bool: states in which an episode can go on; terminal (S,) bool: those it can only end in, and
    those that hold an ended one; best: the highest reward of a step that ends an episode, -inf when none does; goal (S,)
    bool: terminal states entered with it; certain: no step is left to chance.
    """

    def __init__(self, outcomes: Transitions, starts: FloatArray, n_actions: int):
        """Raises KeyError, IndexError, TypeError or ValueError when the outcomes are none of such a problem."""
        self.starts, self.n_states, self.n_actions = starts, len(starts), n_actions
        rows = [
            (state * n_actions + action, *outcome)
            for state in range(self.n_states)
            for action in range(n_actions)
            for outcome in outcomes[state][action]
            if outcome[0] > 0.0
        ]
        table = np.array(rows, np.float64)
        row, self._chance, entered, self._reward, over = table.reshape(len(rows), 5).T
        self._row, self._entered, self._over = row.astype(np.int64), entered.astype(np.int64), over.astype(bool)
        self._check()
        state = self._row // n_actions
        self.live = self._live()
        ends = self._over & self.live[state]
        self.terminal = np.bincount(state, ~(self._over & (self._entered == state)), self.n_states) == 0.0
        self.terminal[self._entered[ends]] = True
        self.terminal &= ~self.live
        self.best = float(self._reward[ends].max(initial=-np.inf))
        wins = ends & (self._reward >= self.best - SAME_REWARD)
        self.goal = np.zeros(self.n_states, bool)
        self.goal[self._entered[wins]] = True
        self.goal &= self.terminal
        self._wins = self._summed(wins.astype(np.float64))  # (S, A) the chance of a goal at this very step
        self.gain = self._summed(self._reward)  # (S, A) the reward to be expected
        self.gain[self.terminal] = 0.0

    def _check(self) -> None:
        chances = np.bincount(self._row, self._chance, self.n_states * self.n_actions)
        if not np.allclose(chances, 1.0) or not np.isfinite(self._reward).all():
            raise ValueError("chances that do not sum to 1, or rewards that are not finite")
        if self._entered.min() < 0 or self._entered.max() >= self.n_states:
            raise ValueError("a state that does not exist")
        if self.starts.min() < 0.0 or not np.isclose(self.starts.sum(), 1.0):
            raise ValueError("chances of starting that do not sum to 1")

    def _summed(self, values: FloatArray) -> FloatArray:
        """The mean over each action's outcomes, (S, A)."""
        size = self.n_states * self.n_actions
        return np.bincount(self._row, self._chance * values, size).reshape(self.n_states, -1).astype(np.float64)

    def _live(self) -> BoolArray:
        """The states that can be reached without an end, those of the start among them."""
        goes = ~self._over
        origin, entered = self._row[goes] // self.n_actions, self._entered[goes]
        live = self.starts > 0.0
        count = 0
        while count < (count := int(live.sum())):
            live[entered[live[origin]]] = True
        return live

    @cached_property
    def certain(self) -> bool:
        """Whether each action of a state that can be met has one outcome."""
        met = self.live[self._row // self.n_actions]
        keys = np.stack([self._row, self._entered, self._over], axis=1)[met]
        return len(np.unique(keys, axis=0)) == len(np.unique(self._row[met]))

    def allows(self, state: int, action: int, entered: int, reward: float, over: bool) -> bool:
        """Whether a step that was seen is one that the model knows."""
        row = state * self.n_actions + action
        first, end = np.searchsorted(self._row, (row, row + 1))
        those = slice(int(first), int(end))
        same = (self._entered[those] == entered) & (self._over[those] == over)
        return bool((same & (np.abs(self._reward[those] - reward) <= SAME_REWARD)).any())

    def likeliest(self) -> IntArray:
        """The state (S, A) that each action most likely leads to; a terminal one leads to itself.

        Of several that are equally likely it is the middle one in the model's order: where an agent slips, Gymnasium
        lists the intended move between the two slips.
        """
        likeliest: IntArray = np.repeat(np.arange(self.n_states, dtype=np.int32)[:, None], self.n_actions, axis=1)
        steps = zip(self._row.tolist(), self._entered.tolist(), self._chance.tolist(), strict=True)
        for row, outcomes in groupby(steps, key=itemgetter(0)):
            chances: dict[int, float] = {}  # in the model's order
            for _, entered, chance in outcomes:
                chances[entered] = chances.get(entered, 0.0) + chance
            tied = [entered for entered, chance in chances.items() if chance >= max(chances.values()) - SETTLED]
            if not self.terminal[row // self.n_actions]:
                likeliest.flat[row] = tied[(len(tied) - 1) // 2]
        return likeliest

    @cached_property
    def _onward(self) -> Any:
        """The chances (S * A, S) of going on in a state, as a scipy.sparse array."""
        from scipy.sparse import csr_array

        goes = ~self._over & ~self.terminal[self._row // self.n_actions]
        size = (self.n_states * self.n_actions, self.n_states)
        return csr_array((self._chance[goes], (self._row[goes], self._entered[goes])), shape=size)

    def optimal(self, discount: float) -> FloatArray:
        """The optimal action values (S, A) by value iteration; 0 in terminal states. WorkFailed when they do not settle."""
        q: FloatArray = self.gain
        for _ in range(MAX_SWEEPS):
            updated = self.gain + discount * (self._onward @ q.max(axis=1)).reshape(q.shape)
            change = float(np.abs(updated - q)[self.live].max())
            q = updated
            if change < SETTLED * max(1.0, float(np.abs(q).max())):
                return q
        raise WorkFailed(f"value iteration with discount {discount} did not settle in {MAX_SWEEPS} sweeps")

    def worth(self, policy: Actions, horizon: int) -> Worth:
        """What following a policy (S,) brings in episodes of at most so many steps."""
        states = np.arange(self.n_states)
        goes = self._onward[states * self.n_actions + policy].T.tocsr()  # (S, S), to state row from state column
        gain, wins = self.gain[states, policy], self._wins[states, policy]
        at, returned, reached, steps = self.starts, 0.0, 0.0, 0.0
        for step in range(1, horizon + 1):
            now = float(at @ wins)
            returned, reached, steps = returned + float(at @ gain), reached + now, steps + step * now
            at = goes @ at
            if at.sum() < SETTLED:
                break
        return Worth(returned, reached, steps / reached if reached else np.inf)
