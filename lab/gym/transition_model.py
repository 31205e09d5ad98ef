"""Models of stochastic problems as tables of outcomes: optimal values, and the exact worth of policies."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from lab.errors import WorkFailed
from lab.mdp import MAX_SWEEPS, BoolArray, FloatArray, IntArray

SETTLED = 1e-12  # changes of values, and probabilities, below this count as 0
SAME_REWARD = 1e-9

Transition = tuple[float, int, float, bool]  # probability, state entered, reward, whether the episode ends
Transitions = Mapping[int, Mapping[int, Sequence[Transition]]]  # [state][action], as Gymnasium's toy texts hold it
Actions = NDArray[np.int64]  # (S,) the action of a policy in each state


class Worth(NamedTuple):
    """The worth of a policy: the undiscounted mean return, the probability of reaching a goal, the mean steps to it."""

    mean_return: float
    reaches: float
    steps: float


class TransitionModel:
    """A stochastic problem: the outcomes of all actions, and the distribution (S,) of the starts.

    live: (S,) bool, the states in which an episode can continue; terminal: (S,) bool, the states in which episodes end, and
    absorbing states; best: the highest reward of a step that ends an episode, -inf if there is none; highest: that of any
    step; goal: (S,) bool, the terminal states entered with the reward `best`; certain: whether all steps are deterministic.
    """

    def __init__(self, outcomes: Transitions, starts: FloatArray, n_actions: int):
        """Raises KeyError, IndexError, TypeError or ValueError if the outcomes do not form such a problem."""
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
        self.highest = float(self._reward[self.live[state]].max())
        wins = ends & (self._reward >= self.best - SAME_REWARD)
        self.goal = np.zeros(self.n_states, bool)
        self.goal[self._entered[wins]] = True
        self.goal &= self.terminal
        self._wins = self._summed(wins.astype(np.float64))  # (S, A) the probability that this step reaches a goal
        self.gain = self._summed(self._reward)  # (S, A) the expected reward
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
        """The states that can be reached without ending the episode, starts included."""
        goes = ~self._over
        origin, entered = self._row[goes] // self.n_actions, self._entered[goes]
        live = self.starts > 0.0
        count = 0
        while count < (count := int(live.sum())):
            live[entered[live[origin]]] = True
        return live

    @cached_property
    def certain(self) -> bool:
        """Whether each action has one outcome in each reachable state."""
        met = self.live[self._row // self.n_actions]
        keys = np.stack([self._row, self._entered, self._over], axis=1)[met]
        return len(np.unique(keys, axis=0)) == len(np.unique(self._row[met]))

    def allows(self, state: int, action: int, entered: int, reward: float, over: bool) -> bool:
        """Whether an observed step is an outcome of the model."""
        row = state * self.n_actions + action
        first, end = np.searchsorted(self._row, (row, row + 1))
        those = slice(int(first), int(end))
        same = (self._entered[those] == entered) & (self._over[those] == over)
        return bool((same & (np.abs(self._reward[those] - reward) <= SAME_REWARD)).any())

    def likeliest(self) -> IntArray:
        """The most probable successor (S, A) of each action; terminal states lead to themselves.

        Of equally probable ones it is the middle one in the model's order, because Gymnasium lists the intended move of a
        slippery step between the two slips.
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
        """The probabilities (S * A, S) of continuing in each state, as a scipy.sparse array."""
        goes = ~self._over & ~self.terminal[self._row // self.n_actions]
        size = (self.n_states * self.n_actions, self.n_states)
        return scipy.sparse.csr_array((self._chance[goes], (self._row[goes], self._entered[goes])), shape=size)

    def optimal(self, discount: float) -> FloatArray:
        """The optimal action values (S, A) by value iteration, 0 in terminal states. Raises WorkFailed if they diverge."""
        q: FloatArray = self.gain
        for _ in range(MAX_SWEEPS):
            updated = self.gain + discount * (self._onward @ q.max(axis=1)).reshape(q.shape)
            change = float(np.abs(updated - q)[self.live].max())
            q = updated
            if change < SETTLED * max(1.0, float(np.abs(q).max())):
                return q
        raise WorkFailed(f"value iteration with discount {discount} did not settle in {MAX_SWEEPS} sweeps")

    def worth(self, policy: Actions, horizon: int) -> Worth:
        """The worth of a policy (S,) in episodes of at most `horizon` steps."""
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
