"""Environments: where a learner acts, which state each episode begins in, what each step leads to, how a learned table is judged.

`TableEnvironment` makes one of a `TabularMDP`; Gymnasium's are in lab/gym, continuous worlds in lab/learning/physics.
"""

from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.learning.values import greedy_moves, values_of_shortest_paths
from lab.mdp import FloatArray, TabularMDP, greedy_path, optimal_values, shortest_steps

LARGE = 100_000  # states: beyond it value iteration begins with the values of shortest paths


class Step(NamedTuple):
    """The outcome of a step: the reward and the state entered.

    terminated: that state is terminal; reached: it is a goal; truncated: the episode is cut off although the state is not
    terminal.
    """

    reward: float
    state: int
    terminated: bool
    reached: bool = False
    truncated: bool = False


class Judged(NamedTuple):
    """The judgement of a learned table.

    final_steps: the steps of its greedy path, None if that misses the goal; optimal_steps: the fewest possible, None if unknown;
    solved: whether the table solves the problem.
    final_return, best_return: in a problem that is scored by return, the mean return of the greedy policy, and that of the best
    known policy, None if there is none; both are undiscounted.
    """

    final_steps: int | None
    optimal_steps: int | None
    solved: bool
    final_return: float | None = None
    best_return: float | None = None


class Environment(Protocol):
    """The interface of the world in which a session's learner acts."""

    @property
    def mdp(self) -> TabularMDP:
        """Its states and actions; if steps are stochastic, the table holds the likeliest outcomes."""

    def reset(self, episode: int, draw: Draw) -> int:
        """The state in which episode n (from 1) begins; all randomness comes from `draw`, and episode 1 resets everything."""

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """The outcome of an action."""

    def picture(self, state: int) -> str:
        """The environment's own drawing of a state as text; "" if the table's grid is to be drawn."""

    def values(self, discount: float) -> FloatArray:
        """The optimal action values (S, A), which simulated advisors know. Raises WorkFailed if they cannot be computed."""

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """The judgement of the greedy policy of a table (S, A)."""


def highest_reward(environment: Environment) -> float | None:
    """The highest reward of a step if sessions in the environment are scored by return, None if they are scored by steps.

    An environment without goals has it as the attribute `highest_reward`, at least 0 if its episodes may end early.
    """
    highest: float | None = getattr(environment, "highest_reward", None)
    return highest


class TableEnvironment:
    """The environment of a `TabularMDP`, whose steps are deterministic."""

    def __init__(self, mdp: TabularMDP):
        self.mdp = mdp

    @cached_property
    def _lists(self) -> tuple[list[list[int]], list[list[float]], list[bool], list[bool]]:
        """The table as lists, which are faster step by step; made with the first step, as compiled sessions make none here."""
        mdp = self.mdp
        return mdp.successor.tolist(), mdp.reward.tolist(), mdp.terminal.tolist(), mdp.goal.tolist()

    def check(self) -> None:
        """Raises NoPath if no goal can be reached from the start."""
        shortest_steps(self.mdp)

    def reset(self, episode: int, draw: Draw) -> int:
        """The problem's start; if it has several, one drawn at random."""
        starts = self.mdp.starts
        return starts[int(draw() * len(starts))] if starts else self.mdp.start

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """The outcome that the table holds."""
        successor, rewards, terminal, goal = self._lists
        entered = successor[state][action]
        return Step(rewards[state][action], entered, terminal[entered], goal[entered])

    def picture(self, state: int) -> str:
        """An empty string: the table's grid is drawn."""
        return ""

    def values(self, discount: float) -> FloatArray:
        """The optimal action values (S, A) by value iteration; for a large table from the values of shortest paths."""
        guess = values_of_shortest_paths(self.mdp, discount) if self.mdp.n_states > LARGE and discount < 1.0 else None
        return optimal_values(self.mdp, discount, guess)

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """Solved: the greedy path is a shortest one or, with several starts, that from each of them reaches the goal."""
        mdp, optimal = self.mdp, shortest_steps(self.mdp) + learner.count_start
        _, actions, reached = greedy_path(q, mdp, learner.max_steps)
        final = len(actions) + learner.count_start if reached else None
        everywhere = np.isfinite(greedy_moves(q, mdp)[list(mdp.starts)]).all() if mdp.starts else final == optimal
        return Judged(final, optimal, bool(everywhere))


def check_solvable(environment: Environment) -> None:
    """Raises NoPath if no goal of a problem whose table is known can be reached from its start."""
    if isinstance(environment, TableEnvironment):
        environment.check()
