"""Commanded velocities as joint targets: ramps within an acceleration, and the limits of reach, joints and box."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.sim.arms.arm import Arm
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import Trajectory
from lab.sim.world import TIME_STEP

PHYSICS_STEPS = 24  # in a control step of 0.1 s
_SHARES = (1.0, 0.5, 0.0)  # of a command that are tried until the arm can follow; the last one brakes
_JUMP_RAD = 0.5  # a larger change of a joint in one physics step means another branch of solutions

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Limits:
    """The limits of commands: velocities and accelerations (d,), and the lowest and highest positions (d,)."""

    speeds: Array
    accelerations: Array
    low: Array
    high: Array


class StreamedMotion:
    """The targets of one arm, which follow velocities of its joints; `joints` (k,) [rad] are the last ones."""

    def __init__(self, arm: Arm, limits: Limits, joints: Array) -> None:
        self.arm, self.limits, self.joints = arm, limits, joints
        self.velocity = np.zeros(len(limits.speeds))

    def follow(self, wanted: Array) -> Trajectory:
        """The targets of the next PHYSICS_STEPS steps for velocities (d,), shares of the limits from -1 to 1.

        A command that leaves the limits is followed by half or braked; if the arm cannot even brake, it stays where it is.
        """
        for share in _SHARES:
            ramp = self._ramp(share * wanted * self.limits.speeds)
            joints = self._joints(ramp)
            velocities = np.diff(np.concatenate([self.joints[None], joints]), axis=0) / TIME_STEP
            if np.isfinite(velocities).all() and (np.abs(velocities) <= self.arm.speed).all():
                self._keep(ramp, joints)
                return Trajectory(joints, velocities)
        self.velocity = np.zeros_like(self.velocity)
        return Trajectory(
            np.repeat(self.joints[None], PHYSICS_STEPS, axis=0), np.zeros((PHYSICS_STEPS, len(self.joints)))
        )

    def _ramp(self, wanted: Array) -> Array:
        """The commanded positions (PHYSICS_STEPS, d), whose velocity changes to `wanted` (d,) within the accelerations."""
        most = np.arange(1, PHYSICS_STEPS + 1)[:, None] * self.limits.accelerations * TIME_STEP
        velocities = self.velocity + np.clip(wanted - self.velocity, -most, most)
        return np.clip(self._position() + np.cumsum(velocities, axis=0) * TIME_STEP, self.limits.low, self.limits.high)

    def _keep(self, ramp: Array, joints: Array) -> None:
        before = ramp[-2]
        self.velocity, self.joints = (ramp[-1] - before) / TIME_STEP, joints[-1]

    def _position(self) -> Array:
        return self.joints

    def _joints(self, ramp: Array) -> Array:
        return ramp


class StreamedTool(StreamedMotion):
    """The same for velocities x, y, z [m/s] and yaw [rad/s] of a hanging tool, which starts at `pose`."""

    def __init__(self, arm: Arm, limits: Limits, joints: Array, pose: ToolPose) -> None:
        super().__init__(arm, limits, joints)
        self.pose = np.array([pose.x, pose.y, pose.z, pose.yaw])

    def _keep(self, ramp: Array, joints: Array) -> None:
        super()._keep(ramp, joints)
        self.pose = ramp[-1]

    def _position(self) -> Array:
        return self.pose

    def _joints(self, ramp: Array) -> Array:
        """The joints (PHYSICS_STEPS, k) of tool poses; NaN where one is out of reach, too near, or needs another branch."""
        joints = self.arm.inverse_path(ramp, self.joints)
        jumps = np.abs(np.diff(np.concatenate([self.joints[None], joints]), axis=0)).max() > _JUMP_RAD
        near = (np.hypot(ramp[:, 0], ramp[:, 1]) < self.arm.nearest_m).any()
        return np.full_like(joints, np.nan) if jumps or near else joints
