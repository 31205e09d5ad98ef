"""The circle along which the arm of `lerobot_rollout_check` stirs, and how arm, policy and leader move.

Numbers are degrees of two joints; the third is a gripper that never moves. The policy knows the circle's surroundings alone,
and stands still elsewhere. Both sides of the check use it: it imports neither the lab nor LeRobot.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Joints = NDArray[np.float64]
JOINTS = ("shoulder.pos", "elbow.pos", "gripper.pos")
RADIUS, TURN = 40.0, 0.05  # [degrees of the joints], [rad] a step
START = (RADIUS, 0.0, 50.0)
NOISE, FASTEST = 0.3, 6.0  # degrees a step
KNOWN, PUSH = 8.0, 20.0  # how far off the circle the policy knows what to do; how far the arm is pushed


def off(joints: NDArray[Any]) -> float:
    """How far the joints are off the circle."""
    return abs(float(np.hypot(joints[0], joints[1])) - RADIUS)


def on_circle(joints: Joints) -> Joints:
    """The point of the circle a step further than the nearest one."""
    angle = np.arctan2(joints[1], joints[0]) + TURN
    return np.array([RADIUS * np.cos(angle), RADIUS * np.sin(angle), START[2]])


def reached(joints: Joints, goal: Joints, noise: Joints) -> Joints:
    """Where the arm is a step after it was told a goal; noise (2,): of the joints."""
    return np.asarray(joints + np.clip(goal - joints, -FASTEST, FASTEST) + np.append(noise, 0.0))


def pushed(joints: Joints) -> Joints:
    """Where the arm is after somebody pushed it outwards."""
    return np.asarray(joints * [*[1.0 + PUSH / np.hypot(joints[0], joints[1])] * 2, 1.0])


def chosen(joints: Joints) -> Joints:
    """The goal that the policy chooses."""
    return on_circle(joints) if off(joints) < KNOWN else joints


def led_back(joints: Joints) -> Joints:
    """The goal that the leader gives: two degrees nearer to the circle, or along it."""
    goal = on_circle(joints)
    return np.asarray(joints + (goal - joints) * min(1.0, 2.0 / float(np.linalg.norm(goal - joints))))
