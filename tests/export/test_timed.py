"""The points in time of a run: few enough, near enough to what was driven, with the gripper and waits where they belong."""

import numpy as np
import pytest

from lab.export.program import Program
from lab.export.timed import WITHIN_RAD, timed


def test_straight_lines_between_the_points_keep_to_what_was_driven(program: Program) -> None:
    points = timed(program).points
    times = np.array([point.t_s for point in points])
    joints = np.array([point.joints for point in points])
    assert np.all(np.diff(times) >= 0.0)
    for motion in program.motions:
        rows = slice(motion.first, motion.last)
        line = [np.interp(program.at_s[rows], times, column) for column in joints.T]
        assert np.abs(np.array(line).T - program.joints[rows]).max() < 1.5 * WITHIN_RAD
    assert len(points) < len(program.joints) / 2


def test_each_point_holds_the_tool_that_its_joints_hold(program: Program) -> None:
    for point in timed(program).points[::20]:
        tool = program.arm.forward(np.array(point.joints))
        assert point.tool == pytest.approx((tool.x, tool.y, tool.z, tool.yaw), abs=1e-5)


def test_a_wait_is_told_once_where_it_begins(up6: Program) -> None:
    first, second = up6.carried.transfers
    waits = [point for point in timed(up6).points if point.waits_for]
    assert [(point.waits_for, point.job) for point in waits] == [("toaster", 2)]
    assert waits[0].t_s == pytest.approx(second.reach_s, abs=1e-6)
    assert {point.job for point in timed(up6).points if point.t_s < first.drop_s} == {1}
