"""The worlds of the deep student: a room of MiniGrid and CartPole; what is seen in them, and the learners' settings."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from lab.gym.environment_name import make, parse_name
from lab.learning.environment import Environment, Step, TableEnvironment
from lab.learning.physics import PHYSICS
from lab.learning.physics.environment import PhysicsEnvironment
from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.mdp import FloatArray, optimal_values, shortest_steps
from lab_studies.comparisons.advice_bench.problems import Benched
from lab_studies.comparisons.deep_student.dqn import Sight

STUDY, LEARNER = "study deep-student", "dqn"
EXPLORING: Mapping[str, Any] = {"selection": "epsilon-greedy", "exploration": 1.0, "beta": 0.5}
EMPTY, POLE = PLACES = ("empty", "cart-pole")
MINIGRID = "gym:MiniGrid-Empty-6x6-v0"
POLE_STEPS = 200  # of an episode, as in CartPole-v0, so that a session takes seconds
POLE_SCALE = np.array([2.4, 3.0, PHYSICS["CartPole-v1"].bounds.high[2], 3.5])  # the ends of its cells


@dataclass(frozen=True)
class Place:
    """A world: as the bench has it for its advisors, where sessions run, what the student sees, and the least steps.

    psi: the span of values at which `ia` and `importance` decide, a few hundredths of the best value.
    """

    benched: Benched
    environment: Environment
    sight: Sight
    par: float
    psi: float

    def points(self, steps: Any) -> FloatArray:
        """The points of episodes by their steps: 100 for the best, 0 for one that fails at once or misses the goal."""
        most = self.benched.learner.max_steps + 1
        points: FloatArray = 100.0 * (most - np.asarray(steps, np.float64)) / (most - self.par)
        return points


@lru_cache
def place(name: str) -> Place:
    """The place of that name, with an environment of its own. Raises BadInput if MiniGrid is not installed."""
    return _pole() if name == POLE else _empty()


def _empty() -> Place:
    """MiniGrid's room by its symbolic view, of which each field that varies is seen one-hot."""
    world: Any = make(parse_name(MINIGRID, STUDY), STUDY).unwrapped
    mdp = world.mdp
    learner = LearnerSettings(LEARNER, discount=0.95, episodes=60, max_steps=world.max_episode_steps, **EXPLORING)
    fields = np.array(
        [[*cells, x, y, direction] for cells, x, y, direction, _ in world.keys]
    )  # nothing is carried here
    rows = np.concatenate([column[:, None] == np.unique(column) for column in fields.T if np.ptp(column)], axis=1)
    rows = rows.astype(np.float32)
    benched = Benched(EMPTY, mdp, learner, optimal_values(mdp, learner.discount))
    see = rows.__getitem__
    return Place(benched, TableEnvironment(mdp), Sight(rows.shape[1], see, see), shortest_steps(mdp), 0.03)


class PoleEnvironment(PhysicsEnvironment):
    """CartPole, whose exact points are seen; a gate that counts by state counts by cell."""

    def __init__(self) -> None:
        super().__init__(PHYSICS["CartPole-v1"])
        self._left: list[float] = []

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """The outcome of one step from the exact point, which is kept."""
        self._left = [*self.point]
        return super().step(state, action, draw)

    def now(self, state: int) -> FloatArray:
        """The exact point if it lies in this cell, otherwise the cell's centre; scaled."""
        return self._seen(self._shown(state))

    def left(self, state: int) -> FloatArray:
        """The exact point that the last step left, scaled."""
        return self._seen(self._left)

    @staticmethod
    def _seen(point: Any) -> FloatArray:
        return np.asarray(np.array(point) / POLE_SCALE, np.float32)


def _pole() -> Place:
    world = PoleEnvironment()
    learner = LearnerSettings(LEARNER, discount=0.99, episodes=60, max_steps=POLE_STEPS, **EXPLORING)
    values = PhysicsEnvironment(world.physics).values(learner.discount)
    benched = Benched(POLE, world.mdp, learner, values, world)
    return Place(benched, world, Sight(4, world.now, world.left), 1.0, 1.0)
