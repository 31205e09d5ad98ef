"""A problem whose moves lead to several states by chance, as arrays: stepped by a session, or compiled."""

from collections.abc import Sequence

import numpy as np

from lab.errors import BadInput
from lab.learning.environment import Step, TableEnvironment
from lab.learning.selection import Draw
from lab.mdp import FloatArray, IntArray, TabularMDP

Outcome = tuple[float, int, float]  # chance, state entered, reward


class ChanceTable(TableEnvironment):
    """Moves left to chance: one uniform number a step decides.

    mdp: the likeliest moves, with the states where episodes end; below (S * A, K) float64: the cumulated chances of each move's
    outcomes, those that it has not as 2; entered (S * A, K) int32, reward (S * A, K) float64. best: the optimal values
    (S, A), which `values` gives, whatever the discount.
    Raises BadInput for outcomes whose chances do not sum to 1.
    """

    def __init__(self, mdp: TabularMDP, outcomes: Sequence[Sequence[Outcome]], best: FloatArray):
        super().__init__(mdp)
        width = max(len(one) for one in outcomes)
        shape = len(outcomes), width
        self.below: FloatArray = np.full(shape, 2.0)
        self.entered: IntArray = np.zeros(shape, np.int32)
        self.reward: FloatArray = np.zeros(shape)
        self._best = best
        for number, several in enumerate(outcomes):
            total = 0.0
            for k, (chance, entered, reward) in enumerate(several):
                total += chance
                self.below[number, k], self.entered[number, k], self.reward[number, k] = total, entered, reward
            if abs(total - 1.0) > 1e-9:
                raise BadInput(f"outcomes of move {number}: their chances sum to {total:g}: wanted 1")
            self.below[number, len(several) - 1] = 2.0  # whatever the rounding

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """One of the move's outcomes."""
        number, u, k = state * self.mdp.n_actions + action, draw(), 0
        while u >= self.below[number, k]:
            k += 1
        entered = int(self.entered[number, k])
        over, won = bool(self.mdp.terminal[entered]), bool(self.mdp.goal[entered])
        return Step(float(self.reward[number, k]), entered, over, won)

    def values(self, discount: float) -> FloatArray:
        """The optimal action values (S, A) that the table was made with."""
        return self._best
