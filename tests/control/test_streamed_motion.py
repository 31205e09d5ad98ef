"""Commanded velocities as joint targets: ramps by hand, and limits that no command leaves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.control.streamed_motion import PHYSICS_STEPS, Limits, StreamedMotion, StreamedTool
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.kinematics import ToolPose
from lab.sim.world import TIME_STEP

ARM = arm_named("up6")
START = ToolPose(0.6, 0.1, 0.3, 0.2)
LOW, HIGH = np.array([0.5, -0.1, 0.2, -1.0]), np.array([0.7, 0.3, 0.4, 1.0])
shares = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).map(np.array)


def tool(low: np.ndarray = LOW, high: np.ndarray = HIGH) -> StreamedTool:
    limits = Limits(np.array([0.24, 0.24, 0.24, 1.2]), np.array([4.8, 4.8, 4.8, 24.0]), low, high)
    joints = ARM.inverse(START)
    assert joints is not None
    return StreamedTool(ARM, limits, joints, START)


def test_a_command_is_reached_by_a_ramp() -> None:
    """From rest to 0.24 m/s with 4.8 m/s2 takes 12 of 24 steps of 1/240 s: (1 + ... + 12) + 12 * 12 steps of 0.02 m/s."""
    motion = tool()
    way = motion.follow(np.array([1.0, 0.0, 0.0, 0.0]))
    assert motion.pose[0] == pytest.approx(0.6 + 0.02 * TIME_STEP * (78 + 144))
    assert motion.velocity == pytest.approx([0.24, 0.0, 0.0, 0.0])
    end = ARM.forward(way.positions[-1])
    assert (end.x, end.y, end.z, end.yaw) == pytest.approx((motion.pose[0], 0.1, 0.3, 0.2))


def test_the_velocities_are_those_of_the_positions() -> None:
    motion = tool()
    before = motion.joints
    way = motion.follow(np.array([0.3, -0.5, 0.2, 1.0]))
    assert before + way.velocities.sum(axis=0) * TIME_STEP == pytest.approx(way.positions[-1])
    assert len(way.positions) == PHYSICS_STEPS


@given(st.lists(shares, min_size=1, max_size=12))
def test_no_command_leaves_the_box_or_the_arms_limits(commands: list[np.ndarray]) -> None:
    motion = tool()
    for command in commands:
        way = motion.follow(command)
        assert ((motion.pose >= LOW) & (motion.pose <= HIGH)).all()
        assert ((way.positions >= ARM.lower) & (way.positions <= ARM.upper)).all()
        assert (np.abs(way.velocities) <= ARM.speed + 1e-9).all()


def test_a_tool_at_the_end_of_its_reach_stays_there_and_comes_back() -> None:
    far = np.array([9.0, 9.0, 9.0, 9.0])
    motion = tool(-far, far)
    for _ in range(100):
        motion.follow(np.array([1.0, 0.0, 0.0, 0.0]))
    out = float(motion.pose[0])
    assert 0.6 < out < 2.0
    assert ARM.inverse(ToolPose(*map(float, motion.pose))) is not None
    assert ARM.inverse(ToolPose(out + 0.03, *map(float, motion.pose[1:]))) is None
    motion.follow(np.array([-1.0, 0.0, 0.0, 0.0]))
    assert motion.pose[0] < out


def test_joints_are_ramped_and_kept_in_their_ranges() -> None:
    limits = Limits(np.full(6, 0.6), np.full(6, 1e9), ARM.lower, ARM.lower + 0.01)
    motion = StreamedMotion(ARM, limits, ARM.lower.copy())
    way = motion.follow(np.array([0.1, 1.0, -1.0, 0.0, 0.0, 0.0]))
    assert way.positions[-1] - ARM.lower == pytest.approx([0.006, 0.01, 0.0, 0.0, 0.0, 0.0], abs=1e-12)
