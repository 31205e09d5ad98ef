"""Where a learner acts: what an episode begins with, what a step leads to, and how a learned table is judged.

A `TabularMDP` is such an environment by its table; others, such as Gymnasium's, are stepped (see lab/gym).
"""

from typing import NamedTuple, Protocol

import numpy as np

from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.learning.values import greedy_moves, values_of_ways
from lab.mdp import FloatArray, TabularMDP, greedy_path, optimal_values, shortest_steps

LARGE = 100_000  # states: sweeps through as many take long


class Step(NamedTuple):
    """What a step led to: the reward, the state entered, whether the episode is over (`terminated`: no future) and won."""

    reward: float
    state: int
    terminated: bool
    reached: bool = False
    truncated: bool = False


class Judged(NamedTuple):
    """A learned table: the steps of its greedy way (None: it misses the goal), the fewest known (None: unknown), the verdict."""

    final_steps: int | None
    optimal_steps: int | None
    solved: bool


class Environment(Protocol):
    """What a session asks of the world that its learner acts in."""

    @property
    def mdp(self) -> TabularMDP:
        """Its states and actions by name; where steps are left to chance, the table holds the likeliest."""

    def reset(self, episode: int, draw: Draw) -> int:
        """The state in which episode n (from 1) begins; all chance comes from `draw`, and episode 1 begins anew."""

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """What an action leads to."""

    def picture(self, state: int) -> str:
        """The environment's own drawing of where the learner is; "" when the table's grid is drawn."""

    def values(self, discount: float) -> FloatArray:
        """The optimal action values (S, A) that simulated advisors know; raises WorkFailed when they cannot be known."""

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """How good the greedy policy of a table (S, A) is."""


class TableEnvironment:
    """A `TabularMDP`: every step is certain."""

    def __init__(self, mdp: TabularMDP):
        self.mdp = mdp
        self._successor: list[list[int]] = mdp.successor.tolist()
        self._reward: list[list[float]] = mdp.reward.tolist()
        self._terminal: list[bool] = mdp.terminal.tolist()
        self._goal: list[bool] = mdp.goal.tolist()

    def reset(self, episode: int, draw: Draw) -> int:
        """The problem's start, or one of its several ones."""
        starts = self.mdp.starts
        return starts[int(draw() * len(starts))] if starts else self.mdp.start

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """The table's row."""
        entered = self._successor[state][action]
        return Step(self._reward[state][action], entered, self._terminal[entered], self._goal[entered])

    def picture(self, state: int) -> str:
        """An empty string: it has no drawing of its own."""
        return ""

    def values(self, discount: float) -> FloatArray:
        """By value iteration; a large table's begins with the ways to the goal."""
        guess = values_of_ways(self.mdp, discount) if self.mdp.n_states > LARGE and discount < 1.0 else None
        return optimal_values(self.mdp, discount, guess)

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """Solved: the greedy path from the start is a shortest one, or, with several starts, each one's reaches the goal."""
        mdp, optimal = self.mdp, shortest_steps(self.mdp) + learner.count_start
        _, actions, reached = greedy_path(q, mdp, learner.max_steps)
        final = len(actions) + learner.count_start if reached else None
        everywhere = np.isfinite(greedy_moves(q, mdp)[list(mdp.starts)]).all() if mdp.starts else final == optimal
        return Judged(final, optimal, bool(everywhere))


def check_solvable(environment: Environment) -> None:
    """Raises NoPath when no goal of a certain problem can be reached from its start."""
    if isinstance(environment, TableEnvironment):
        shortest_steps(environment.mdp)
