"""A level tool of any arm: where joints hold it, by the chain and in physics; neighbours; and what no wrist can do."""

from math import atan2, cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sim.arms.arm import Arm
from lab.sim.arms.arm_models import ARMS, arm_named
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME, RobotArm
from lab.sim.urdf_reader import rotation
from lab.sim.world import World

names = st.sampled_from(sorted(ARMS))
ASIDE = {
    "up6": 1.57,
    "panda": 1.2,
    "iiwa": 0.0,
    "xarm6": 0.8,
}  # [rad] off straight ahead, where its wrist can hold it level
OUT = {"up6": (0.8, 1.1), "panda": (0.4, 0.6), "iiwa": (0.8, 0.95), "xarm6": (0.45, 0.7)}  # [m]


def pose_of(arm: Arm, turn: float, share: float, z: float, yaw: float) -> ToolPose:
    low, high = OUT[arm.name]
    out = low + share * (high - low)
    return ToolPose(out * cos(turn), out * sin(turn), z, turn + ASIDE[arm.name] + yaw)


@given(names, st.floats(-1.0, 1.0), st.floats(0, 1), st.floats(0.25, 0.35), st.floats(-0.2, 0.2), st.floats(-pi, pi))
def test_the_tool_is_level_where_it_was_asked_for(
    name: str, turn: float, share: float, z: float, yaw: float, way: float
) -> None:
    """Within 0.01 mm, within the joints' ranges; 4 mm on, no joint has moved by more than 0.12 rad."""
    arm = arm_named(name, "level")
    pose = pose_of(arm, turn, share, z, yaw)
    joints = arm.inverse(pose)
    assert joints is not None
    assert np.all((joints >= arm.lower) & (joints <= arm.upper))
    assert arm.level is not None
    at, axes = arm.level.chain.ends(joints[None])
    assert at[0] == pytest.approx([pose.x, pose.y, pose.z], abs=1e-5)
    heading = atan2(axes[0, 1, 0], axes[0, 0, 0])
    assert abs((heading - pose.yaw + pi) % (2 * pi) - pi) < 1e-5
    assert abs(axes[0, 2, 0]) < 1e-5
    assert abs(axes[0, 2, 1]) < 1e-5  # it closes level, too
    there = arm.inverse(pose.shifted(0.004 * cos(way), 0.004 * sin(way)))
    if there is not None:
        steps = np.abs(joints - there)
        assert steps[:-1].max() < 0.12
        assert abs((steps[-1] + pi / 2) % pi - pi / 2) < 0.12


@pytest.mark.parametrize("name", sorted(ARMS))
def test_physics_has_the_level_tool_where_the_formulas_say(name: str) -> None:
    arm = arm_named(name, "level")
    rng = np.random.default_rng(3)
    with World() as world:
        robot = RobotArm(world, arm, 0.5, 2.0, 25.0)
        for turn, share, z, yaw in rng.uniform([-1.0, 0.0, 0.25, -0.2], [1.0, 1.0, 0.35, 0.2], (30, 4)):
            pose = pose_of(arm, turn, share, z, yaw)
            assert robot.stand(pose)
            tool = robot.tool()
            assert hypot(tool.x - pose.x, tool.y - pose.y, tool.z - pose.z) < 5e-4
            assert abs((tool.yaw - pose.yaw + pi) % (2 * pi) - pi) < 0.0087
            axes = rotation(world.pose(NAME, arm.tool_link)[1]) @ arm.tip[:3, :3]
            assert abs(float(axes[2, 0])) < 0.0087


def test_a_wrist_that_does_not_turn_so_far_has_no_joints() -> None:
    """The UP6's wrist turns up by 45 degrees: ahead of it the forearm is steeper; the hanging tool reaches there."""
    pose = ToolPose(0.8, 0.0, 0.3, 0.0)
    assert arm_named("up6", "level").inverse(pose) is None
    assert arm_named("up6").inverse(pose) is not None
    assert arm_named("iiwa", "level").inverse(ToolPose(2.0, 0.0, 0.3)) is None
