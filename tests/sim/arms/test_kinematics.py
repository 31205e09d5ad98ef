"""The arm's closed-form kinematics: its own inverse, and PyBullet's opinion."""

from math import cos, hypot, nextafter, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sim.arms import kinematics as arm
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import RobotArm

inverse, forward = arm_named("up6").inverse, arm_named("up6").forward
turns = st.floats(-2.9, 2.9)  # [rad] within the S axis
reaches = st.floats(0.36, 1.2)  # [m]
heights = st.floats(0.0, 0.5)  # [m]
yaws = st.floats(-3.0, 3.0)
anything = st.floats(allow_nan=True, allow_infinity=True)


def near(one: ToolPose, other: ToolPose, within: float) -> bool:
    turned = (one.yaw - other.yaw + pi) % (2 * pi) - pi
    return hypot(one.x - other.x, one.y - other.y, one.z - other.z) < within and abs(turned) < 10 * within


def test_the_home_position_by_hand() -> None:
    tool = forward(arm.HOME)  # upper arm up, forearm level
    assert tool.x == pytest.approx(0.15 + 0.64)
    assert tool.y == pytest.approx(0.0)
    assert tool.z == pytest.approx(0.45 + 0.57 + 0.13 - 0.095 - 0.17)
    assert inverse(tool) == pytest.approx(arm.HOME, abs=1e-9)


@given(turns, reaches, heights, yaws)
def test_inverse_and_forward_undo_each_other(turn: float, reach: float, z: float, yaw: float) -> None:
    pose = ToolPose(reach * cos(turn), reach * sin(turn), z, yaw)
    joints = inverse(pose)
    if joints is None:  # only far and high, or the wrist is out of its range
        assert hypot(reach - arm.SHOULDER_OUT, z + arm.TOOL_DOWN - arm.SHOULDER_UP) > 0.9 or reach < 0.45
        return
    assert near(forward(joints), pose, 1e-9)
    assert np.all((joints >= arm.LOWER) & (joints <= arm.UPPER))
    assert joints[3] == 0.0
    assert joints[1] + joints[2] + joints[4] == pytest.approx(pi / 2)  # the tool points straight down


@given(anything, anything, anything, anything)
def test_any_numbers_give_joints_in_range_or_none(x: float, y: float, z: float, yaw: float) -> None:
    joints = inverse(ToolPose(x, y, z, yaw))
    assert joints is None or bool(np.all((joints >= arm.LOWER) & (joints <= arm.UPPER)))


@pytest.mark.parametrize(
    "pose",
    [
        ToolPose(1.6, 0.0, 0.2),  # too far
        ToolPose(0.9, 0.9, 1.2),  # too high
        ToolPose(0.05, 0.0, 0.3),  # at the arm's own foot
        ToolPose(-0.8, 0.0, 0.3),  # behind: the S axis stops at 170 degrees
        ToolPose(float("nan"), 0.0, 0.3),
    ],
)
def test_what_is_out_of_reach_has_no_joints(pose: ToolPose) -> None:
    assert inverse(pose) is None


@given(st.floats(-1.2, 1.2), st.integers(0, 60))
def test_the_border_of_the_reach_is_no_error(slope: float, steps: int) -> None:
    distance = arm.UPPER_ARM + hypot(arm.FOREARM, arm.ELBOW_UP)
    for _ in range(steps):
        distance = nextafter(distance, 0.0)
    z = arm.SHOULDER_UP - arm.TOOL_DOWN + distance * sin(slope)
    joints = inverse(ToolPose(arm.SHOULDER_OUT + distance * cos(slope), 0.0, z))
    assert joints is None or bool(np.isfinite(joints).all())


def test_local_moves_go_along_the_turned_axes() -> None:
    pose = ToolPose(1.0, 2.0, 3.0, pi / 2).local(0.1, 0.2, 0.3, 0.4)
    assert (pose.x, pose.y, pose.z, pose.yaw) == pytest.approx((0.8, 2.1, 3.3, pi / 2 + 0.4))
    assert ToolPose(1, 2, 3, 4).shifted(0.5, dyaw=-1) == ToolPose(1.5, 2, 3, 3)


def test_pybullet_holds_the_tool_where_the_formulas_say(robot: RobotArm) -> None:
    rng = np.random.default_rng(7)
    checked = 0
    while checked < 150:
        turn, reach, z, yaw = rng.uniform([-2.9, 0.36, 0.0, -3.0], [2.9, 1.2, 0.5, 3.0])
        pose = ToolPose(reach * cos(turn), reach * sin(turn), z, yaw)
        if robot.stand(pose):
            assert near(robot.tool(), pose, 1e-4)
            checked += 1
