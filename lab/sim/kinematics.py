"""The arm's geometry and its inverse kinematics in closed form, for a tool that points straight down.

An approximate model of the Motoman UP6 class (reach 1.37 m to the wrist, 6 kg): lengths, joint ranges and speeds are the
class's published ones, rounded; it is no vendor's model. Axes: S turns the base, L and U lift upper arm and forearm, R rolls
the forearm, B pitches the wrist, T turns the tool. All tasks of this lab hold the tool vertical, so R stays at 0 and the rest
is a planar arm, solved exactly: no iteration, no flips between branches.
"""

from dataclasses import dataclass
from math import acos, atan2, cos, hypot, pi, radians, sin

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

_FOREARM_LENGTH = hypot(FOREARM, ELBOW_UP)
_FOREARM_TILT = atan2(ELBOW_UP, FOREARM)


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


def inverse(pose: ToolPose) -> NDArray[np.float64] | None:
    """The six joint angles [rad], shape (6,), that hold the tool at `pose`, elbow up; None when out of reach or range."""
    out = hypot(pose.x, pose.y) - SHOULDER_OUT
    up = pose.z + TOOL_DOWN - SHOULDER_UP
    distance = hypot(out, up)
    if out < 0.0 or not abs(UPPER_ARM - _FOREARM_LENGTH) < distance < UPPER_ARM + _FOREARM_LENGTH:
        return None
    at_shoulder = acos((UPPER_ARM**2 + distance**2 - _FOREARM_LENGTH**2) / (2.0 * UPPER_ARM * distance))
    elevation = atan2(up, out) + at_shoulder
    to_wrist_out, to_wrist_up = out - UPPER_ARM * cos(elevation), up - UPPER_ARM * sin(elevation)
    pitch = _FOREARM_TILT - atan2(to_wrist_up, to_wrist_out)
    turn = atan2(pose.y, pose.x)
    tool = (turn - pose.yaw + pi) % (2.0 * pi) - pi
    joints = np.array([turn, pi / 2 - elevation, pitch - (pi / 2 - elevation), 0.0, pi / 2 - pitch, tool])
    within = bool(np.all(joints >= LOWER) and np.all(joints <= UPPER))
    return joints if within else None


def forward(joints: NDArray[np.float64]) -> ToolPose:
    """The vertical tool pose that `joints` [rad], shape (6,), hold; for joints that `inverse` gave (R = 0, tool down)."""
    turn, lean, bend, tool = float(joints[0]), float(joints[1]), float(joints[2]), float(joints[5])
    elevation, forearm = pi / 2 - lean, _FOREARM_TILT - lean - bend
    out = SHOULDER_OUT + UPPER_ARM * cos(elevation) + _FOREARM_LENGTH * cos(forearm)
    up = SHOULDER_UP + UPPER_ARM * sin(elevation) + _FOREARM_LENGTH * sin(forearm)
    return ToolPose(out * cos(turn), out * sin(turn), up - TOOL_DOWN, turn - tool)


HOME = np.array([0.0, 0.0, 0.0, 0.0, radians(90.0), 0.0])  # upper arm up, forearm level, tool down
