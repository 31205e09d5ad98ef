"""Environments with stochastic moves that are known, and which environments the kernel knows."""

from collections.abc import Sequence

import numpy as np

from lab.errors import BadInput
from lab.learning.environment import Environment, Judged, Step, TableEnvironment, highest_reward
from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.mdp import FloatArray, IntArray, NoPath, TabularMDP

Outcome = tuple[float, int, float]  # chance, state entered, reward


class ChanceTable(TableEnvironment):
    """An environment with stochastic moves; one uniform number per step decides the outcome.

    mdp: the likeliest outcome of each move, and the terminal states; outcomes: those of each of the S * A moves, at most K;
    best: the optimal values (S, A), which `values` returns for any discount.
    below: (S * A, K) float64, the cumulative probabilities, 2 where a move has fewer outcomes; entered: (S * A, K) int32; reward:
    (S * A, K) float64. Raises BadInput for outcomes whose probabilities do not sum to 1.
    """

    def __init__(self, mdp: TabularMDP, outcomes: Sequence[Sequence[Outcome]], best: FloatArray):
        super().__init__(mdp)
        width = max(len(row) for row in outcomes)
        shape = len(outcomes), width
        self.below: FloatArray = np.full(shape, 2.0)
        self.entered: IntArray = np.zeros(shape, np.int32)
        self.reward: FloatArray = np.zeros(shape)
        self._best = best
        for number, row_outcomes in enumerate(outcomes):
            total = 0.0
            for k, (chance, entered, reward) in enumerate(row_outcomes):
                total += chance
                self.below[number, k], self.entered[number, k], self.reward[number, k] = total, entered, reward
            if abs(total - 1.0) > 1e-9:
                raise BadInput(f"outcomes of move {number}: their chances sum to {total:g}: wanted 1")
            self.below[number, len(row_outcomes) - 1] = 2.0  # the last outcome, even if the sum was rounded down

    def check(self) -> None:
        """Raises NoPath if no goal can be reached from a start, by whatever outcomes."""
        mdp, reached = self.mdp, np.zeros(self.mdp.n_states, bool)
        possible = np.diff(self.below, axis=1, prepend=0.0) > 0.0
        further = [*mdp.starts] or [mdp.start]
        while len(further):
            reached[further] = True
            if (reached & mdp.goal).any():
                return
            moves = np.repeat(reached & ~mdp.terminal, mdp.n_actions)
            entered = self.entered[moves][possible[moves]]
            further = np.unique(entered[~reached[entered]]).tolist()
        raise NoPath(f"no goal can be reached from {mdp.state_label(mdp.start)}", (), "goal")

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """The judgement by the likeliest outcomes; not solved, of unknown fewest steps, where these reach no goal."""
        try:
            return super().judge(q, learner)
        except NoPath:
            return Judged(None, None, False)

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """The step that one uniform number selects among the move's outcomes."""
        number, u, k = state * self.mdp.n_actions + action, draw(), 0
        while u >= self.below[number, k]:
            k += 1
        entered = int(self.entered[number, k])
        over, won = bool(self.mdp.terminal[entered]), bool(self.mdp.goal[entered])
        return Step(float(self.reward[number, k]), entered, over, won)

    def values(self, discount: float) -> FloatArray:
        """The optimal action values (S, A) that the table was made with."""
        return self._best


def keeps_steps(place: Environment) -> bool:
    """Whether an environment begins and steps by the methods of its table, which are the only ones that the kernel knows."""
    kind = type(place)
    begins = isinstance(place, TableEnvironment) and kind.reset is TableEnvironment.reset
    counted = highest_reward(place) is None  # the kernel scores by steps
    return begins and counted and kind.step in (TableEnvironment.step, ChanceTable.step)
