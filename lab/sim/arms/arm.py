"""The record of an arm: its URDF, joints and gripper, and its inverse and forward kinematics."""

from dataclasses import dataclass, replace
from math import cos, pi, sin
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.sim.arms.fingers import Fingers, Gripper
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.level_tool import LevelTool

Array = NDArray[np.float64]
_WAYS_ROUND = (0, 1, -1, 2, -2, 3, -3, 4, -4)  # the half turns of the tool that are tried, in order
_ASIDE = (0.0, 0.4, -0.4, 0.8, -0.8, 1.2, -1.2, 1.6, -1.6)  # [rad] a level tool's waiting directions


class Kinematics(Protocol):
    """The kinematics of an arm between its first joint, which turns it, and its last, which turns its tool."""

    @property
    def home(self) -> Array:
        """The joint positions (k,) in which the arm waits, with its tool pointing down."""

    @property
    def spins(self) -> tuple[float, float]:
        """The signs, 1 or -1, of the tool's turn with the first and with the last joint, seen from above."""

    @property
    def aside(self) -> Array:
        """Where the tool is beside the last joint's axis (2,) [m], along the tool's y and z axes."""

    def bent(self, out: Array, up: Array) -> Array:
        """The joints (n, k) for a last axis `out` (n,) [m] off the first, tips `up` (n,) [m], at yaw 0; NaN: unsolvable."""

    def tools(self, joints: Array) -> Array:
        """The tool poses x, y, z [m], yaw [rad] (n, 4) that joints (n, k) hold."""


@dataclass(frozen=True, eq=False)
class Arm:
    """One arm with its gripper, its foot `base_up_m` [m] above the origin.

    urdf: the checked URDF that physics loads; joints (k,) from the foot to the tool, their ranges lower, upper (k,) [rad] and
    speed (k,) [rad/s]; tool_link, tip (4, 4): the finger tips' frame in it, x out of the gripper, y across; nearest_m: the least
    distance of the tool from the first axis, so that it clears the arm. level: the level tool's kinematics; None: it hangs.
    torque_nm: the largest torque of a joint's motor [Nm]; None: it has no limit.
    """

    name: str
    urdf: Path
    joints: tuple[str, ...]
    lower: Array
    upper: Array
    speed: Array
    fingers: Fingers
    tool_link: str
    tip: Array
    nearest_m: float
    base_up_m: float
    kinematics: Kinematics
    level: LevelTool | None = None
    torque_nm: float | None = None

    @property
    def gripper(self) -> Gripper:
        """The dimensions of its gripper."""
        return replace(self.fingers.gripper, level=self.level is not None)

    @property
    def home(self) -> Array:
        """The joint positions (k,) in which the arm waits: its tool hangs, or is level with the wrist at the same place."""
        if self.level is None:
            return self.kinematics.home
        x, y, z, yaw = self.kinematics.tools(self.kinematics.home[None])[0].tolist()
        ahead = self.level.wrist_m
        for aside in _ASIDE:
            way = ahead * cos(yaw + aside), ahead * sin(yaw + aside)
            solution = self.inverse(ToolPose(x + way[0], y + way[1], z + ahead + self.base_up_m, yaw + aside))
            if solution is not None:
                return solution
        raise BadInput(f"robot.tool = 'level': the wrist of arm '{self.name}' cannot hold its tool so in front of it")

    def inverse(self, pose: ToolPose) -> Array | None:
        """The joint positions (k,) that hold the tool at `pose`, a function of it alone; None if it is out of reach or range.

        A gripper is symmetric under half a turn: where the last joint cannot reach the yaw, the tool is turned by half a turn.
        """
        joints = self.inverse_each(np.array([[pose.x, pose.y, pose.z, pose.yaw]]))[0]
        return None if np.isnan(joints[0]) else joints

    def inverse_each(self, poses: Array) -> Array:
        """The joints (n, k) of `inverse` for each of many poses x, y, z [m], yaw [rad] (n, 4); NaN without a solution."""
        both = self._both_ways(poses)
        best = np.full_like(both[0], np.nan)
        for half in sorted(_WAYS_ROUND, key=lambda half: (half % 2, abs(half))):
            turned = both[half % 2][:, -1] + half * pi
            chosen = np.isnan(best[:, -1]) & (turned >= self.lower[-1]) & (turned <= self.upper[-1])
            best[chosen] = both[half % 2][chosen]
            best[chosen, -1] = turned[chosen]
        return best

    def inverse_path(self, poses: Array, before: Array | None = None) -> Array:
        """The joints (n, k) along a path of poses (n, 4), on which the tool turns without jumps; NaN without a solution.

        before (k,): the joints before the path; the tool continues its turn from there if it can. If the last joint cannot turn
        through the whole path, the tool is turned by half a turn along all of it; one beside the last joint's axis stays turned.
        """
        both = self._both_ways(poses)
        reached = [~np.isnan(joints[:, 0]) for joints in both]
        turns = [np.unwrap(joints[known, -1]) for joints, known in zip(both, reached, strict=True)]
        halves = [half for half in _WAYS_ROUND if turns[half % 2].size]
        if not halves:
            return both[0]
        begun = turns[halves[0] % 2][0] if before is None else float(before[-1])
        stays = before is not None and self.kinematics.aside.any()  # half a turn would move its other joints, too

        def preferred(half: int) -> tuple[float, float, int]:
            far = round(abs(turns[half % 2][0] + half * pi - begun), 9)
            return (far, half % 2, half) if stays else (half % 2, far, half)

        for half in sorted(halves, key=preferred):
            turned = turns[half % 2] + half * pi
            if turned.min() >= self.lower[-1] and turned.max() <= self.upper[-1]:
                joints = both[half % 2].copy()
                joints[reached[half % 2], -1] = turned
                return joints
        return np.full_like(both[0], np.nan)

    def spun(self, joints: Array, turns: Array) -> Array:
        """The joints (n, k) that turn the tool on the spot from positions `joints` (k,), its last one by `turns` (n,) [rad].

        The last joint moves a little more or less if the tool is beside its axis. NaN where the other joints cannot follow.
        """
        if not self.kinematics.aside.any():
            rows = np.repeat(joints[None], len(turns), axis=0)
            rows[:, -1] += turns
            return rows
        pose = self.forward(joints)
        poses = np.array([[pose.x, pose.y, pose.z, pose.yaw]]) + np.outer(turns, [0, 0, 0, self.kinematics.spins[1]])
        rows = self._bent(poses)
        near = joints[-1] + turns
        rows[:, -1] = near + (rows[:, -1] - near + pi) % (2 * pi) - pi
        return rows

    def _both_ways(self, poses: Array) -> tuple[Array, Array]:
        """The results of `_bent` for the tool as asked for, and turned by half a turn, which is taken off the last joint again.

        They are equal, one array, if the tool is on the last joint's axis.
        """
        joints = self._bent(poses)
        if not self.kinematics.aside.any():
            return joints, joints
        turned = self._bent(poses + np.array([0.0, 0.0, 0.0, pi]))
        turned[:, -1] -= pi
        return joints, turned

    def forward(self, joints: Array) -> ToolPose:
        """The tool pose at joint positions (k,), which `inverse` returned or that are close to such."""
        x, y, z, yaw = (float(number) for number in self.tools(joints[None])[0])
        return ToolPose(x, y, z + self.base_up_m, yaw)

    def tools(self, joints: Array) -> Array:
        """The tool poses x, y, z [m], yaw [rad] (n, 4) that joints (n, k) hold, in the foot's frame."""
        return (self.kinematics if self.level is None else self.level).tools(joints)

    def is_half_on(self, joints: Array, pose: ToolPose) -> bool:
        """Whether the tool at these joint positions is half a turn away from the yaw of `pose`."""
        return abs((self.forward(joints).yaw - pose.yaw + pi) % (2 * pi) - pi) > pi / 2

    def reach_in_words(self, z: float) -> str:
        """The nearest and farthest reach of the tool ahead of the arm at a height [m], in words."""
        out = np.arange(self.nearest_m, 3.0, 0.01)
        solutions = self.inverse_each(np.stack([out, 0 * out, 0 * out + z, 0 * out], axis=1))
        reached = out[~np.isnan(solutions[:, 0])]
        at = f"at a height of {z:.2f} m{'' if self.level is None else ', its tool level and straight ahead'}"
        return f"reaches {reached[0]:.2f} to {reached[-1]:.2f} m {at}" if len(reached) else f"reaches nothing {at}"

    def _bent(self, poses: Array) -> Array:
        """Joint positions (n, k), the last within half a turn of zero, the others within their ranges; NaN: unsolvable."""
        with np.errstate(invalid="ignore"):
            poses = np.where(np.abs(poses).max(axis=1, keepdims=True) < 1e3, poses, np.nan)
            asked, poses = poses, poses if self.level is None else self.level.hanging(poses)
            first, last = self.kinematics.spins
            (across, ahead), c, s = self.kinematics.aside, np.cos(poses[:, 3]), np.sin(poses[:, 3])
            x, y = (
                poses[:, 0] - (c * ahead - s * across),
                poses[:, 1] - (s * ahead + c * across),
            )  # of the last joint's axis
            turn = np.arctan2(y, x)
            joints = self.kinematics.bent(np.hypot(x, y), poses[:, 2] - self.base_up_m)
            joints[:, 0] += first * turn
            joints[:, -1] = (joints[:, -1] + last * (poses[:, 3] - turn) + pi) % (2 * pi) - pi
            if self.level is not None:
                joints = self.level.raised(joints, asked - [0.0, 0.0, self.base_up_m, 0.0])
                joints[:, -1] = (joints[:, -1] + pi) % (2 * pi) - pi
            under, over = joints[:, :-1] < self.lower[:-1], joints[:, :-1] > self.upper[:-1]
            inside = ~np.any(under | over, axis=1)
        joints[~inside] = np.nan
        return joints
