"""Any arm's tool: where joints hold it, the same joints for the same pose, and half a turn where the wrist ends."""

from math import atan2, cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sim.arms.arm import Arm
from lab.sim.arms.arm_models import ARMS, arm_named
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import RobotArm
from lab.sim.world import World

names = st.sampled_from(sorted(ARMS))
turns, yaws = st.floats(-2.9, 2.9), st.floats(-3.2, 3.2)  # [rad]
shares, heights = st.floats(0.0, 1.0), st.floats(0.05, 0.5)  # of the reach; [m]
NEAREST = {"up6": 0.36, "panda": 0.30, "iiwa": 0.42, "xarm6": 0.25}
FARTHEST = {"up6": 1.2, "panda": 0.62, "iiwa": 0.65, "xarm6": 0.45}  # [m] at every height


def pose_of(arm: Arm, turn: float, share: float, z: float, yaw: float) -> ToolPose:
    reach = NEAREST[arm.name] + share * (FARTHEST[arm.name] - NEAREST[arm.name])
    return ToolPose(reach * cos(turn), reach * sin(turn), z, yaw)


def apart(one: float, other: float, period: float) -> float:
    return abs((one - other + period / 2) % period - period / 2)


@given(names, turns, shares, heights, yaws)
def test_the_tool_is_where_it_was_asked_for(name: str, turn: float, share: float, z: float, yaw: float) -> None:
    """Within 0.5 mm and 0.5 degrees, within the joints' ranges; the gripper looks the same after half a turn."""
    arm = arm_named(name)
    pose = pose_of(arm, turn, share, z, yaw)
    joints = arm.inverse(pose)
    assert joints is not None
    assert np.all((joints >= arm.lower) & (joints <= arm.upper))
    tool = arm.forward(joints)
    assert hypot(tool.x - pose.x, tool.y - pose.y, tool.z - pose.z) < 5e-4
    assert apart(tool.yaw, yaw, pi) < 0.0087
    assert arm.is_half_on(joints, pose) == (apart(tool.yaw, yaw, 2 * pi) > 1.0)
    again = arm.inverse(pose)
    assert again is not None
    assert np.array_equal(joints, again)


@given(names, turns, shares, heights, st.floats(-pi, pi))
def test_neighbouring_poses_have_neighbouring_joints(
    name: str, turn: float, share: float, z: float, way: float
) -> None:
    """4 mm on, no joint but the last moves by more than 0.12 rad, and the last by more only where it goes round."""
    arm = arm_named(name)
    pose = pose_of(arm, turn, share, z, 0.0)
    there = pose.shifted(0.004 * cos(way), 0.004 * sin(way))
    one, other = arm.inverse(pose), arm.inverse(there)
    if one is None or other is None or abs(atan2(there.y, there.x) - atan2(pose.y, pose.x)) > 1.0:
        return  # over the edge of the reach, or behind the arm
    steps = np.abs(one - other)
    assert steps[:-1].max() < 0.12
    assert apart(one[-1], other[-1], pi) < 0.05


@given(names, st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), shares, st.floats(-3.0, 3.0))
def test_a_path_turns_the_tool_without_jumps(name: str, start: float, end: float, share: float, yaw: float) -> None:
    arm = arm_named(name)
    angles = np.linspace(start, end, 200)
    reach = NEAREST[name] + share * (FARTHEST[name] - NEAREST[name])
    path = np.column_stack([reach * np.cos(angles), reach * np.sin(angles), np.full(200, 0.3), np.full(200, yaw)])
    joints = arm.inverse_path(path)
    assert np.isfinite(joints).all()
    assert np.all((joints >= arm.lower) & (joints <= arm.upper))
    assert np.abs(np.diff(joints, axis=0)).max() < 0.05
    again = arm.inverse_path(path, joints[-1])  # it comes from the same turn: it keeps to it if it can
    assert np.isfinite(again).all()


def test_a_wrist_that_ends_goes_half_a_turn_on() -> None:
    """The Panda's last joint turns by 170 degrees each way from 45: 2.4 rad are out of its range, 2.4 - pi are not."""
    arm = arm_named("panda")
    exact, half = ToolPose(0.5, 0.0, 0.3, -2.0), ToolPose(0.5, 0.0, 0.3, -2.4)
    for pose, is_half in ((exact, False), (half, True)):
        joints = arm.inverse(pose)
        assert joints is not None
        assert arm.is_half_on(joints, pose) == is_half
    assert arm.inverse(exact)[-1] == pytest.approx(pi / 4 + 2.0, abs=1e-6)  # type: ignore[index]
    assert arm.inverse(half)[-1] == pytest.approx(pi / 4 + 2.4 - pi, abs=1e-6)  # type: ignore[index]
    both = np.array([[0.5, 0.0, 0.3, yaw] for yaw in np.linspace(-2.0, -2.4, 20)])
    path = arm.inverse_path(both)  # all of it half a turn on: no jump where the range ends
    assert path[0, -1] == pytest.approx(pi / 4 + 2.0 - pi, abs=1e-6)
    assert np.abs(np.diff(path[:, -1])).max() < 0.05


@pytest.mark.parametrize("name", sorted(ARMS))
def test_what_is_out_of_reach_has_no_joints(name: str) -> None:
    arm = arm_named(name)
    for pose in (
        ToolPose(2.0, 0.0, 0.3),
        ToolPose(0.4, 0.0, 2.5),
        ToolPose(float("nan"), 0.0, 0.3),
        ToolPose(1e9, 0, 0),
    ):
        assert arm.inverse(pose) is None
    each = arm.inverse_each(np.array([[0.5, 0.0, 0.3, 0.0], [2.0, 0.0, 0.3, 0.0], [0.5, 0.1, 0.3, 0.0]]))
    assert np.isnan(each[:, 0]).tolist() == [False, True, False]
    assert each[2] == pytest.approx(arm.inverse(ToolPose(0.5, 0.1, 0.3)))


@pytest.mark.parametrize("name", sorted(ARMS))
def test_physics_has_the_tool_where_the_formulas_say(name: str) -> None:
    arm = arm_named(name)
    rng = np.random.default_rng(3)
    with World() as world:
        robot = RobotArm(world, arm, 0.5, 2.0, 25.0)
        for turn, share, z, yaw in rng.uniform([-2.9, 0.0, 0.05, -3.2], [2.9, 1.0, 0.5, 3.2], (60, 4)):
            pose = pose_of(arm, turn, share, z, yaw)
            assert robot.stand(pose)
            tool = robot.tool()
            assert hypot(tool.x - pose.x, tool.y - pose.y, tool.z - pose.z) < 5e-4
            assert apart(tool.yaw, pose.yaw, 2 * pi) < 0.0087  # half a turn on is not counted


def test_an_arm_says_how_far_it_reaches() -> None:
    assert arm_named("iiwa").reach_in_words(0.1) == "reaches 0.42 to 0.79 m at a height of 0.10 m"
    assert arm_named("xarm6").reach_in_words(1.5) == "reaches nothing at a height of 1.50 m"
