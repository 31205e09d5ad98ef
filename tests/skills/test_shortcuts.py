"""Of a path's corners those are left that straight, free lines need: by hand, on a floor of one metre a cell."""

from collections.abc import Sequence

import pytest

from lab.sim.arms.kinematics import ToolPose
from lab.skills.surveys import Surveys, corners

STAIRS = [(0, 0), (1, 0), (1, 1), (2, 1), (2, 2), (3, 2)]


def path(*places: tuple[float, float]) -> list[ToolPose]:
    return [ToolPose(x, y, 0.0) for x, y in places]


def everywhere(line: Sequence[ToolPose]) -> bool:
    return True


def nowhere(line: Sequence[ToolPose]) -> bool:
    return False


def test_a_staircase_is_one_line_where_that_is_free() -> None:
    assert corners(path(*STAIRS), 0.1, everywhere) == (0, 5)


def test_where_no_shortcut_is_free_the_path_keeps_its_corners_and_loses_what_lies_straight_on() -> None:
    assert corners(path(*STAIRS), 0.1, nowhere) == (0, 1, 2, 3, 4, 5)
    assert corners(path((0, 0), (1, 0), (2, 0), (2, 1), (2, 2)), 0.1, nowhere) == (0, 2, 4)


def test_round_a_wall_the_way_stays_on_the_side_that_was_learned() -> None:
    """A wall from (1, 0) to (1, 2): the path goes round its end at y = 3, and so do the two lines that are left."""
    way = path((0, 0), (0, 1), (0, 2), (0, 3), (1, 3), (2, 3), (2, 2), (2, 1), (2, 0))

    def off_the_wall(line: Sequence[ToolPose]) -> bool:
        return not any(0.5 < pose.x < 1.5 and pose.y < 2.5 for pose in line)

    assert corners(way, 0.1, off_the_wall) == (0, 3, 5, 8)


def test_of_as_few_lines_the_shortest_are_taken() -> None:
    """From (0, 0) to (2, 2) only one of the corners (2, 0) and (1, 1) can be gone by: 4 m by the one, 2.8 m by the other."""
    way = path((0, 0), (2, 0), (1, 1), (2, 2))
    assert corners(way, 0.1, lambda line: not (line[0].x == 0 and line[-1].y == 2)) == (0, 2, 3)


def test_a_line_is_asked_about_from_end_to_end_at_poses_no_farther_apart_than_said() -> None:
    asked: list[Sequence[ToolPose]] = []

    def heard(line: Sequence[ToolPose]) -> bool:
        asked.append(line)
        return True

    corners([ToolPose(0, 0, 0), ToolPose(0.3, 0, 0), ToolPose(0.3, 0.4, 0, 1.0)], 0.3, heard)
    (line,) = asked  # 0.5 m, and a turn of 1 rad counts as 0.15 m: 0.52 m
    assert [(pose.x, pose.y, pose.yaw) for pose in line] == [(0, 0, 0), (0.15, 0.2, 0.5), (0.3, 0.4, 1.0)]


@pytest.mark.parametrize("far", [((0, 0),), ((0, 0), (0, 0))])
def test_a_path_that_leads_nowhere_is_one_pose(far: tuple[tuple[float, float], ...]) -> None:
    assert corners(path(*far), 0.1, nowhere) == (0,)


def test_behind_the_arm_no_shortcut_leads_from_one_side_to_the_other(surveys: Surveys) -> None:
    """Round the front of the arm from left behind it to right behind it; the straight line would lead through behind it."""
    way = tuple(ToolPose(x, y, 0.42) for x, y in ((-0.3, 0.6), (0.6, 0.6), (0.6, -0.6), (-0.3, -0.6)))
    kept = [way[n] for n in surveys.travel_corners("", way)]
    assert kept[0] == way[0]
    assert kept[-1] == way[-1]
    assert max(pose.x for pose in kept) == 0.6


def test_around_a_part_no_shortcut_leads_through_it(surveys: Surveys) -> None:
    """Over a slice that stands along x and down; the slanted line from aside would meet its edge with a finger."""
    aside, above = ((2, 4, 2, 2), (2, 2, 2, 2), (2, 2, 0, 2)), ((0, 2, 2, 2), (2, 2, 2, 2), (2, 2, 0, 2))
    assert surveys.around_corners("toaster", "slice", False, aside) == (0, 1, 2)
    assert surveys.around_corners("toaster", "slice", False, above) == (0, 2)
