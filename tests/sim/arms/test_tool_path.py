"""The tool's path in time: its shape, and that no acceleration exceeds what was asked for."""

from math import hypot, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.tool_path import COUNTED, roundings, timed, way_of
from lab.sim.world import TIME_STEP

at = st.floats(-1.0, 1.0) | st.sampled_from([-0.1, 0.0, 0.1, 0.1001])  # corners of all angles, and ways back
corners = st.lists(st.builds(ToolPose, at, at, at, st.floats(-3.0, 3.0) | st.just(0.0)), min_size=1, max_size=8)
CORNER = [ToolPose(0.6, -0.2, 0.3), ToolPose(0.9, -0.2, 0.3), ToolPose(0.9, 0.2, 0.3)]


def felt(points: np.ndarray, start: ToolPose) -> tuple[float, float]:
    """The largest speed [m/s] and acceleration [m/s2] of points (n, 4), one a physics step, from rest to rest."""
    first = [[start.x, start.y, start.z, start.yaw]] * 2
    counted = np.vstack([first, points, points[-1:], points[-1:]]) * COUNTED
    speeds = np.diff(counted, axis=0) / TIME_STEP
    return float(np.linalg.norm(speeds, axis=1).max()), float(
        np.linalg.norm(np.diff(speeds, axis=0), axis=1).max() / TIME_STEP
    )


@given(corners, st.sampled_from([1e-4, 0.01, 1.0]), st.floats(0.02, 1.5), st.floats(0.1, 10.0), st.floats(0.0, 0.3))
def test_no_shape_of_path_is_gone_faster_than_asked(
    path: list[ToolPose], scale: float, speed: float, acceleration: float, blend: float
) -> None:
    path = [ToolPose(scale * p.x, scale * p.y, scale * p.z, scale * p.yaw) for p in path]
    points = timed(path, speed, acceleration, blend)
    fastest, hardest = felt(points, path[0])
    assert fastest <= speed * (1 + 1e-6)
    assert hardest <= acceleration * (1 + 1e-6) + 1e-6
    end = path[-1]
    assert points[-1].tolist() == [end.x, end.y, end.z, end.yaw]


@given(corners, st.floats(0.0, 0.3))
def test_a_path_keeps_near_the_lines_between_its_poses(path: list[ToolPose], blend: float) -> None:
    """An arc that begins c before a corner leaves it by less than c."""
    lines = np.array([[p.x, p.y, p.z, p.yaw] for p in path]) * COUNTED
    for point in timed(path, 1.0, 2.0, blend) * COUNTED:
        starts, steps = lines[:-1], np.diff(lines, axis=0)
        share = ((point - starts) * steps).sum(axis=1) / np.maximum((steps**2).sum(axis=1), 1e-300)
        nearest = starts + np.clip(share, 0.0, 1.0)[:, None] * steps
        gaps = np.linalg.norm(nearest - point, axis=1)
        assert min(gaps, default=0.0) <= blend / 2.0 + 1e-8


def test_a_corner_is_an_arc_that_the_acceleration_holds() -> None:
    """From 50 mm before to 50 mm behind: a quarter circle of 50 mm, at sqrt(2 m/s2 x 0.05 m) = 0.316 m/s."""
    points = timed(CORNER, 0.5, 2.0, blend=0.1)
    bent = points[(points[:, 0] > 0.851) & (points[:, 1] < -0.151)]
    assert np.hypot(bent[:, 0] - 0.85, bent[:, 1] + 0.15) == pytest.approx(0.05)
    assert np.diff(way_of(bent)).max() / TIME_STEP <= sqrt(2.0 * 0.05)
    assert np.diff(way_of(bent)).max() / TIME_STEP == pytest.approx(sqrt(2.0 * 0.05), rel=0.01)
    assert len(points) < len(timed(CORNER, 0.5, 2.0))


def test_corners_are_rounded_by_few_radii_and_where_the_tool_turns_by_none() -> None:
    """A room of 35 mm holds 30; one of 1 mm none; lines that turn the tool meet in a stop."""
    places = np.array([[0.0, 0.0, 0.0, 0.0], [0.3, 0.0, 0.0, 0.0], [0.3, 0.07, 0.0, 0.0], [0.302, 0.07, 0.0, 0.0]])
    assert roundings(places, np.full(4, 0.1)).tolist() == [0.0, 0.03, 0.0, 0.0]
    assert roundings(places, np.full(4, 0.01)).tolist() == [0.0, 0.004, 0.0, 0.0]
    places[2:, 3] = 0.01
    assert roundings(places, np.full(4, 0.1)).tolist() == [0.0, 0.0, 0.0, 0.0]


def test_without_a_blend_it_stops_at_a_corner_but_not_on_a_straight_line() -> None:
    """0.3 m and 0.4 m at 0.5 m/s and 2 m/s2 take 0.85 s and 1.05 s."""
    points = timed(CORNER, 0.5, 2.0)
    assert len(points) * TIME_STEP == pytest.approx(0.85 + 1.05, abs=TIME_STEP)
    assert min(hypot(x - 0.9, y + 0.2) for x, y, _, _ in points) < 1e-5
    straight = [ToolPose(0.6, 0.0, 0.3), ToolPose(0.7, 0.0, 0.3), ToolPose(1.1, 0.0, 0.3)]
    assert timed(straight, 0.5, 2.0) == pytest.approx(timed([straight[0], straight[2]], 0.5, 2.0))


def test_a_way_back_is_a_stop() -> None:
    """Also where it turns back by a hair less than half a turn: no arc of 50 mm stands for that."""
    for off in (0.0, 1e-5):
        points = timed([CORNER[0].shifted(dy=off), CORNER[1], CORNER[0]], 0.5, 2.0, blend=0.1)
        assert points[:, 0].max() == pytest.approx(0.9, abs=1e-4)
    assert points[-1].tolist() == [0.6, -0.2, 0.3, 0.0]


def test_a_mere_turn_is_timed_as_the_way_that_it_counts() -> None:
    turned = timed([ToolPose(0.6, 0.0, 0.3), ToolPose(0.6, 0.0, 0.3, 1.0)], 0.3, 1.5)
    moved = timed([ToolPose(0.6, 0.0, 0.3), ToolPose(0.75, 0.0, 0.3)], 0.3, 1.5)
    assert turned[:, 3] * 0.15 == pytest.approx(moved[:, 0] - 0.6)


def test_corners_closer_than_the_blend_share_the_way_between_them() -> None:
    """A stair of 40 mm steps: arcs of 20 mm radius that meet half-way, at sqrt(2 m/s2 x 0.02 m) = 0.2 m/s."""
    stair = [ToolPose(0.04 * ((n + 1) // 2), 0.04 * (n // 2), 0.3) for n in range(9)]
    points = timed(stair, 0.5, 2.0, blend=0.1)
    speeds = np.diff(way_of(points)) / TIME_STEP
    middle = slice(len(speeds) // 3, 2 * len(speeds) // 3)
    assert speeds[middle] == pytest.approx(0.2, rel=0.01)
