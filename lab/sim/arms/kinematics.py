"""The arm's geometry and its inverse kinematics in closed form, for a tool that points straight down.

An approximate model of the Motoman UP6 class (reach 1.37 m to the wrist, 6 kg): lengths, joint ranges and speeds are the
class's published ones, rounded; it is no vendor's model. Axes: S turns the base, L and U lift upper arm and forearm, R rolls
the forearm, B pitches the wrist, T turns the tool. All tasks of this lab hold the tool vertical, so R stays at 0 and the rest
is a planar arm, solved exactly: no iteration, no flips between branches.
"""

from dataclasses import dataclass
from math import atan2, cos, hypot, pi, radians, sin
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

SHOULDER_OUT, SHOULDER_UP = 0.15, 0.45  # [m] S axis to L axis
UPPER_ARM = 0.57  # [m] L axis to U axis
FOREARM, ELBOW_UP = 0.64, 0.13  # [m] U axis to wrist centre, along and across the forearm
FLANGE = 0.095  # [m] wrist centre to flange
TOOL = 0.17  # [m] flange to finger tips
TOOL_DOWN = FLANGE + TOOL  # [m] the wrist centre above the finger tips

JOINTS = ("joint_s", "joint_l", "joint_u", "joint_r", "joint_b", "joint_t")
LOWER = np.radians([-170.0, -90.0, -170.0, -180.0, -45.0, -360.0])  # [rad]
UPPER = np.radians([170.0, 155.0, 190.0, 180.0, 225.0, 360.0])  # [rad]
SPEED = np.radians([140.0, 160.0, 170.0, 335.0, 335.0, 500.0])  # [rad/s]
HOME = np.array([0.0, 0.0, 0.0, 0.0, radians(90.0), 0.0])  # upper arm up, forearm level, tool down

_FOREARM_LENGTH = hypot(FOREARM, ELBOW_UP)
_FOREARM_TILT = atan2(ELBOW_UP, FOREARM)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ToolPose:
    """A vertical tool: finger tips at (x, y, z) [m] in the world, turned by `yaw` [rad]; at yaw 0 the fingers close along y."""

    x: float
    y: float
    z: float
    yaw: float = 0.0

    def shifted(self, dx: float = 0.0, dy: float = 0.0, dz: float = 0.0, dyaw: float = 0.0) -> "ToolPose":
        """This pose moved by the given amounts [m], [rad], in world axes."""
        return ToolPose(self.x + dx, self.y + dy, self.z + dz, self.yaw + dyaw)

    def local(self, dx: float, dy: float, dz: float = 0.0, dyaw: float = 0.0) -> "ToolPose":
        """This pose moved by (dx, dy) [m] along its own yawed axes, dz [m] up and dyaw [rad]."""
        c, s = cos(self.yaw), sin(self.yaw)
        return self.shifted(c * dx - s * dy, s * dx + c * dy, dz, dyaw)


class ClosedForm:
    """The exact kinematics of the arm between its first joint, which turns it, and its last, which turns its tool."""

    home: ClassVar[Array] = HOME
    spins: ClassVar[tuple[float, float]] = (1.0, -1.0)  # of the first and the last joint: how the tool turns with them
    aside: ClassVar[Array] = np.zeros(2)  # the tool is on the last joint's axis

    def bent(self, out: Array, up: Array) -> Array:
        """The joints (n, 6) for a tool `out` (n,) [m] off the S axis, `up` (n,) [m], at yaw 0, elbow up; NaN: unsolvable."""
        out, up = out - SHOULDER_OUT, up + TOOL_DOWN - SHOULDER_UP
        distance = np.hypot(out, up)
        with np.errstate(invalid="ignore", divide="ignore"):  # out of reach
            cosine = (UPPER_ARM**2 + distance**2 - _FOREARM_LENGTH**2) / (2.0 * UPPER_ARM * distance)
            reached = (out >= 0.0) & (abs(UPPER_ARM - _FOREARM_LENGTH) < distance)
            reached &= distance < UPPER_ARM + _FOREARM_LENGTH
            elevation = np.arctan2(up, out) + np.arccos(cosine)
        pitch = _FOREARM_TILT - np.arctan2(up - UPPER_ARM * np.sin(elevation), out - UPPER_ARM * np.cos(elevation))
        none = np.zeros_like(elevation)
        joints = np.stack([none, pi / 2 - elevation, pitch - (pi / 2 - elevation), none, pi / 2 - pitch, none], axis=1)
        return np.where(reached[:, None], joints, np.nan)

    def tools(self, joints: Array) -> Array:
        """The vertical tool poses x, y, z [m], yaw [rad] (n, 4) that joints (n, 6) from `bent` hold (R = 0, tool down)."""
        turn, lean, bend, tool = joints[:, 0], joints[:, 1], joints[:, 2], joints[:, 5]
        elevation, forearm = pi / 2 - lean, _FOREARM_TILT - lean - bend
        out = SHOULDER_OUT + UPPER_ARM * np.cos(elevation) + _FOREARM_LENGTH * np.cos(forearm)
        up = SHOULDER_UP + UPPER_ARM * np.sin(elevation) + _FOREARM_LENGTH * np.sin(forearm)
        return np.stack([out * np.cos(turn), out * np.sin(turn), up - TOOL_DOWN, turn - tool], axis=1)
