"""Paths of a table of tool poses as velocities: from any tool pose to the goal, along free cells."""

from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from lab.control.controlled_skill import ControlledSkill
from lab.mdp import FloatArray
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.tool_path import COUNTED

GAIN = 5.0  # [1/s] velocity per distance
FAST_M_S = 1.0  # before the environment's limit
SLOW_M_S = 0.15  # of a tool that goes down into a slot
ALIGNED_M, ALIGNED_RAD = 0.003, 0.02  # beside the line on which the tool then goes down, or along cells
LINE_M = 0.006  # the distance beside a line of cells at which the tool no longer goes along it
SIDE_M = 0.012  # beside the goal at which a tool below the path's height still goes down
OVER_M = 0.005  # height of the tool above the highest cells at which it counts as above them

Array = NDArray[np.float64]


class TablePaths:
    """The straight runs of a skill's greedy paths, and the velocities that follow them.

    Poses are x, y, z [m], yaw [rad] (4,), in the goal's axes if the table is `around_goal`, else in the world's.
    """

    def __init__(self, skill: ControlledSkill, q: FloatArray) -> None:
        self.skill, self.poses = skill, skill.poses
        mdp = skill.mdp
        states, action = np.arange(mdp.n_states), np.argmax(q, axis=1)
        after = np.where(mdp.terminal, states, mdp.successor[states, action])
        self.left_m, self.ends = self._runs(after, action)
        self.known = np.flatnonzero(np.isfinite(self.left_m))
        self.starts = np.array([s for s in mdp.starts or (mdp.start,) if np.isfinite(self.left_m[s])])
        self.flat = bool(np.ptp(self.poses[:, 2]) < 1e-9)  # the table's cells are all at one height
        self.half = self._half_cell()
        self.clear_m = float(self.poses[self.known, 2].max()) if skill.around_goal else self._clear_m()

    def _runs(self, after: NDArray[np.int64], action: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
        """By state: the greedy path's length [m], inf if it misses the goal, and the last state of its first straight run."""
        goal, n = self.skill.mdp.goal, len(after)
        left, ends = np.where(goal, 0.0, np.inf), np.arange(n)
        waiting = np.flatnonzero(~self.skill.mdp.terminal)
        while len(ready := waiting[np.isfinite(left[after[waiting]])]):
            to = after[ready]
            left[ready] = left[to] + np.linalg.norm(_weighted(self.poses[ready] - self.poses[to]), axis=1)
            goes_on = ~goal[to] & (action[to] == action[ready])
            ends[ready] = np.where(goes_on, ends[to], to)
            waiting = np.setdiff1d(waiting, ready)
        return left, ends

    def _half_cell(self) -> Array:
        """Half the distance (4,) between neighbouring cells along each axis; inf along an axis with one cell."""
        halves = []
        for column in self.poses.T:
            levels = np.unique(column.round(6))
            halves.append(float(np.diff(levels).min()) / 2 if len(levels) > 1 else np.inf)
        return np.array(halves)

    def _clear_m(self) -> float:
        """The height [m] of the tool at which it, and its part, is above the obstacles near the table's cells."""
        skill = self.skill
        return (
            float(skill.surveys.approach(skill.skill.station).z)
            if self.flat
            else float(self.poses[self.known, 2].max())
        )

    # ---- velocities --------------------------------------------------------------------------------------------------

    def velocity(self, tool: ToolPose, goal: ToolPose) -> Array:
        """The velocity (4,) [m/s], [rad/s] in the world's axes that leads a tool towards the goal pose."""
        here, end = np.array([tool.x, tool.y, tool.z, tool.yaw]), np.array([goal.x, goal.y, goal.z, goal.yaw])
        if not self.skill.around_goal:
            return self._over_cells(here, end)
        c, s = cos(goal.yaw), sin(goal.yaw)
        turn = np.array([[c, s, 0, 0], [-s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
        return np.asarray(turn.T @ self._around(turn @ (here - end)))

    def _around(self, here: Array) -> Array:
        """The velocity in the goal's axes: above the part towards the best start, below along the path or up."""
        if here[2] >= self.clear_m - OVER_M:
            far = np.linalg.norm(_weighted(self.poses[self.starts] - here), axis=1) + self.left_m[self.starts]
            start = int(self.starts[np.argmin(far)])
            if not _is_beside(here, self.poses[start]):
                return _towards(
                    here, np.append(self.poses[start][:2], [max(here[2], self.clear_m), self.poses[start][3]])
                )
            return self._along(here, start)
        cell = self._cell(here)
        if cell is None:
            return _up()
        return self._along(here, cell)

    def _over_cells(self, here: Array, end: Array) -> Array:
        """The velocity in the world's axes, for a table of cells in the world, at whose goal the tool goes on to `end`."""
        level = float(self.poses[0, 2]) if self.flat else None
        if level is not None and end[2] < level and _is_beside(here, end, SIDE_M):  # over the goal, or on the way down
            down = _towards(here, end)
            down[2] = np.clip(down[2], -SLOW_M_S, SLOW_M_S) if _is_beside(here, end) else 0.0
            return down
        if level is not None and here[2] < level - 2 * OVER_M:
            return _up()
        cell = self._cell(here)
        if cell is None:
            if here[2] < self.clear_m - OVER_M:
                return _up()
            near = self.known[np.argmin(np.linalg.norm(_weighted(self.poses[self.known] - here)[:, :2], axis=1))]
            return _towards(here, np.array([*self.poses[near, :2], self.clear_m, end[3]]))
        if self.skill.mdp.goal[cell]:
            return _towards(here, end if level is None else np.array([*end[:2], level, end[3]]))
        if not self.flat:
            return self._along(here, cell)
        velocity = self._along(np.append(here[:3], self.poses[cell, 3]), cell)  # which turns on its way
        velocity[3] = _towards(here, end)[3]
        return velocity

    def _cell(self, here: Array) -> int | None:
        """The free state in whose cell a pose is; None if it is in a blocked cell or outside."""
        off = np.abs(self.poses - here)
        inside = np.flatnonzero((off <= self.half * 1.05).all(axis=1) & np.isfinite(self.left_m))
        if not len(inside):
            return None
        return int(inside[np.argmin(np.linalg.norm(_weighted(off[inside]), axis=1))])

    def _along(self, here: Array, cell: int) -> Array:
        """The velocity along the straight run that begins in a cell: first onto its line, then along it."""
        begin, end = self.poses[cell], self.poses[self.ends[cell]]
        line = _weighted(end - begin)
        length = float(np.linalg.norm(line))
        if length == 0.0:
            return _towards(here, end)
        ahead, off = line / length, _weighted(here - begin)
        along = float(off @ ahead)
        beside = off - along * ahead
        share = max(0.0, 1.0 - float(np.linalg.norm(beside)) / LINE_M)
        speed = np.clip(GAIN * (length - along), -FAST_M_S, FAST_M_S)
        return np.asarray((share * speed * ahead - GAIN * beside) / COUNTED)


def _weighted(poses: Array) -> Array:
    """Poses (..., 4) whose yaw counts as a length [m]."""
    return np.asarray(poses * COUNTED)


def _towards(here: Array, there: Array) -> Array:
    return np.asarray(GAIN * (there - here))


def _up() -> Array:
    return np.array([0.0, 0.0, FAST_M_S, 0.0])


def _is_beside(here: Array, there: Array, within_m: float = ALIGNED_M) -> bool:
    """Whether two poses are above one another, and equally turned."""
    near = np.hypot(*(here - there)[:2]) < within_m
    return bool(near and abs(here[3] - there[3]) < ALIGNED_RAD * within_m / ALIGNED_M)
