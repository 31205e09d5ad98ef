"""Joint positions for any arm's level tool: those of the hanging tool, turned up about the wrist in steps of Newton's method.

The wrist is the point of the tool's axis that is nearest to the last but one joint. Each step is small, so that joints are a
function of the pose alone, and neighbouring poses have neighbouring joints. There is no solution where the wrist cannot follow.
"""

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from lab.sim.arms.chain import Chain
from lab.sim.arms.numeric_kinematics import damped, turn_to

STEPS = 6  # number of steps from the hanging tool to the level one
TRIES, LAST_TRIES = 3, 12  # of Newton's method, at each step and at the last
EXACT = 1e-7  # [m], [rad] error at which a solution is accepted
MOST_RAD = 2.4  # limit of the turn of an inner joint: beyond it, the arm has changed its branch of solutions

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LevelTool:
    """The kinematics of one arm's level tool. chain: ends in the finger tips; wrist_m: distance of the wrist behind them [m]."""

    chain: Chain
    wrist_m: float

    @classmethod
    def of(cls, chain: Chain, home: Array) -> "LevelTool":
        """The level tool of an arm, with joints `home` (k,) that hold it hanging."""
        at, axes, origins, _ = chain.along(home[None])
        return cls(chain, float((at[0] - origins[0, -2]) @ axes[0, :, 0]))

    def hanging(self, poses: Array) -> Array:
        """The hanging tool poses (n, 4) with the wrist where level tool poses x, y, z [m], yaw [rad] (n, 4) have it."""
        back = self.wrist_m * np.column_stack([np.cos(poses[:, 3]), np.sin(poses[:, 3]), np.ones(len(poses))])
        return np.column_stack([poses[:, :3] - back, poses[:, 3]])

    def raised(self, joints: Array, poses: Array) -> Array:
        """The joints (n, k) for level tool poses (n, 4) in the foot's frame, from hanging ones (n, k); NaN: unsolvable."""
        solved = np.full_like(joints, np.nan)
        known = ~np.isnan(joints[:, 0])
        begun, poses = joints[known], poses[known]
        now, wrist = begun.copy(), poses[:, :3] - self.wrist_m * _axes(poses[:, 3], pi / 2)[:, :, 0]
        missed = np.zeros((len(now), 6))
        for step in range(1, STEPS + 1):
            axes = _axes(poses[:, 3], step / STEPS * pi / 2)
            tips = wrist + self.wrist_m * axes[:, :, 0]
            for _ in range(LAST_TRIES if step == STEPS else TRIES):
                at, own, moved = self.chain.jacobian(now)
                missed = np.concatenate([tips - at, turn_to(own, axes)], axis=1)
                if not len(now) or np.abs(missed).max() < EXACT:
                    break
                by = damped(moved, missed)
                now = now + by * np.minimum(1.0, 0.4 / np.maximum(np.abs(by).max(axis=1), 1e-12))[:, None]
        good = (np.abs(missed) < EXACT).all(axis=1) & (np.abs(now - begun)[:, 1:-1].max(axis=1) < MOST_RAD)
        if len(self.chain.names) == 6:  # at a straight wrist a continuous path would be singular
            good &= np.sign(self._volume(now)) == np.sign(self._volume(begun))
        solved[known] = np.where(good[:, None], now, np.nan)
        return solved

    def tools(self, joints: Array) -> Array:
        """The tool poses x, y, z [m], yaw [rad] (n, 4) that joints (n, k) hold, in the foot's frame."""
        at, axes = self.chain.ends(joints)
        return np.column_stack([at, np.arctan2(-axes[:, 0, 1], axes[:, 1, 1])])

    def _volume(self, joints: Array) -> Array:
        """The determinant (n,) of the Jacobian of a tool with six joints (n, 6): its sign changes at singularities."""
        return np.asarray(np.linalg.det(self.chain.jacobian(joints)[2]))


def _axes(yaw: Array, pitch: float) -> Array:
    """The tool's axes (n, 3, 3), columns: it hangs at pitch 0 [rad] and is level at pi / 2, along yaw (n,) [rad]."""
    c, s, none = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)
    up, out = np.sin(pitch), np.cos(pitch)
    ahead = np.stack([up * c, up * s, none - out], axis=1)
    across = np.stack([-s, c, none], axis=1)
    return np.stack([ahead, across, np.stack([out * c, out * s, none + up], axis=1)], axis=2)
