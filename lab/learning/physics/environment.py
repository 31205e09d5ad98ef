"""A world of continuous states as the place where the lab's learners act: its states are the numbers of its cells."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lab.learning import splitmix
from lab.learning.environment import Judged, Step
from lab.learning.physics import Physics
from lab.learning.physics.cells import CellTable
from lab.learning.physics.pictures import Shape, drawn, shapes
from lab.learning.selection import Draw
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import FloatArray

JUDGED = 200  # starts from which a policy is tried
MASTERS = 8  # sessions alone, of the seeds 0, 1, ..., whose best table is what an advisor knows
JUDGES_SEED = 0
SOBER = -50.0
GOOD_ENOUGH = 0.5  # of the starts: a policy that gets to the goal from fewer has no way there


class PhysicsEnvironment:
    """The `Environment` that a world of continuous states is. The learner sees the cell, the world goes on from the point."""

    def __init__(self, physics: Physics):
        self.physics, self.mdp = physics, CellTable.of(physics)
        self.point: list[float] = []  # where the episode under way is
        self._known: dict[float, FloatArray] = {}

    def reset(self, episode: int, draw: Draw) -> int:
        """Where the world lets episodes begin."""
        self.point = [draw() for _ in self.physics.axes]
        self.physics.begin(self.point)
        return self.physics.bounds.number(self.point)

    def step(self, state: int, action: int, draw: Draw) -> Step:
        """One step of the point."""
        over = self.physics.step(self.point, action)
        reward = self.physics.last_reward if over else self.physics.reward
        return Step(reward, self.physics.bounds.number(self.point), over, over and not self.physics.longer_is_better)

    def picture(self, state: int) -> str:
        """The world in lines of text: as it is, or where the learner is not, as it would be in the middle of the cell."""
        return drawn(self.physics.name, self._shown(state))

    def shapes(self, state: int) -> list[Shape]:
        """As `picture`, as lines, areas and discs in a drawing of 100 x 50: see `pictures.shapes`."""
        return shapes(self.physics.name, self._shown(state))

    def _shown(self, state: int) -> Sequence[float]:
        here = bool(self.point) and self.physics.bounds.number(self.point) == state
        return self.point if here else self.physics.bounds.centre(state)

    def values(self, discount: float) -> FloatArray:
        """What the best of MASTERS sessions alone has learned, compiled: (S, A)."""
        if discount not in self._known:
            from lab.learning.batch import run_sessions

            learner = replace(fitting(self.physics), discount=discount)
            seeds = np.arange(MASTERS, dtype=np.uint64)
            found = run_sessions(self, learner, GateSettings("never"), None, seeds, keep_tables=True)
            best = min(found.q, key=lambda q: float(np.abs(self.played(q, self.physics.limit)).mean()) * self._better)
            best.flags.writeable = False
            self._known[discount] = best
        return self._known[discount]

    @property
    def _better(self) -> float:
        return -1.0 if self.physics.longer_is_better else 1.0

    def played(self, q: FloatArray, most: int) -> Any:
        """The moves (JUDGED,) of the greedy policy of a table from drawn starts, negative where they did not end it."""
        from lab.learning.batch import play

        axes = len(self.physics.axes)
        drawn = np.array([splitmix.uniform(JUDGES_SEED, n) for n in range(JUDGED * axes)]).reshape(JUDGED, axes)
        return play(self.mdp, q.argmax(axis=1), drawn, most)

    def judge(self, q: FloatArray, learner: LearnerSettings) -> Judged:
        """From JUDGED drawn starts: the mean steps, nobody knows the fewest, and whether they reach the world's threshold."""
        physics, counted = self.physics, learner.count_start
        most = min(physics.limit, learner.max_steps - counted)
        moves = self.played(q, most)
        over, made = moves > 0, np.abs(moves)
        returned = physics.reward * made + over * (physics.last_reward - physics.reward)
        solved = bool(returned.mean() >= physics.threshold)
        if physics.longer_is_better:
            return Judged(round(float(np.where(over, most - made + 2, 1).mean())) + counted, 1 + counted, solved)
        if over.mean() < GOOD_ENOUGH:
            return Judged(None, None, solved)
        return Judged(round(float(made[over].mean())) + counted, None, solved)


def fitting(physics: Physics) -> LearnerSettings:
    """How a world is learned alone: SARSA(lambda) on tiles with replacing traces; the numbers come from sessions in them.

    Where steps cost, every move is thought to be worth about half of an early way to the goal at first: with zeros whatever
    was not tried yet looks better than what was shown. Source: Sutton and Barto 2018, example 10.1 and figure 12.10.
    """
    learner = LearnerSettings(
        "sarsa-lambda",
        alpha=0.3,
        discount=1.0,
        trace=0.9,
        replacing=True,
        tilings=physics.tilings,
        start_value=SOBER,
        selection="epsilon-greedy",
        exploration=0.1,
        beta=1.5,
        episodes=500,
        max_steps=physics.limit,
    )
    if physics.longer_is_better:
        return replace(learner, alpha=0.8, discount=0.99, trace=0.8, start_value=0.0, beta=0.5)
    return learner
