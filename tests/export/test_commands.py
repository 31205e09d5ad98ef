"""A run as commands: few straight pieces that keep to the way driven, and transfers in their order."""

from itertools import pairwise
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.export.commands import (
    HELD_M,
    WITHIN_M,
    Await,
    Check,
    GripperOutput,
    JointMove,
    Path,
    Pause,
    Payload,
    Reset,
    Start,
    _needed,
    jobs_of,
    straightened,
    thinned,
)
from lab.export.program import Press, Program
from lab.sim.arms.tool_path import COUNTED, way_of


def test_a_straight_line_needs_two_rows_and_a_corner_one_more() -> None:
    """Ten steps along x, then ten along y."""
    line = np.array([[float(step), 0.0] for step in range(11)])
    corner = np.concatenate([line, [[10.0, float(step)] for step in range(1, 11)]])
    assert thinned(np.arange(11.0), line, 0.01) == [0, 10]
    assert thinned(np.arange(21.0), corner, 0.01) == [0, 10, 20]


def test_a_half_circle_of_10_cm_is_kept_within_two_tenths_of_a_millimetre_by_few_pieces() -> None:
    """A chord of a circle r misses it by r (1 - cos(a / 2)): at 0.2 mm it spans 7.25 degrees, so 25 pieces at the least."""
    angles = np.linspace(0.0, pi, 2001)
    circle = np.column_stack([0.1 * np.cos(angles), 0.1 * np.sin(angles), 0 * angles, 0 * angles])
    pieces = straightened(circle)
    assert 25 <= len(pieces) - 1 <= 50
    middles = (pieces[1:] + pieces[:-1])[:, :2] / 2
    assert np.abs(np.linalg.norm(middles, axis=1) - 0.1).max() <= WITHIN_M * 1.01


ways: st.SearchStrategy[np.ndarray] = st.lists(
    st.tuples(*[st.floats(-1.0, 1.0)] * 3, st.floats(-3.0, 3.0)), min_size=2, max_size=12
).map(np.array)


@given(ways)
def test_straight_pieces_keep_to_any_way_and_turn_the_short_way_round(corners: np.ndarray) -> None:
    poses = np.concatenate([corners[:-1] + (corners[1:] - corners[:-1]) * share for share in (0.0, 0.25, 0.5, 0.75)])
    poses = np.vstack([poses.reshape(4, -1, 4).transpose(1, 0, 2).reshape(-1, 4), corners[-1:]])
    pieces = straightened(poses)
    assert pieces[[0, -1]] == pytest.approx(poses[[0, -1]], abs=1e-12)
    assert np.abs(np.diff(pieces[:, 3])).max() <= pi / 2 + 1e-9
    way, along = way_of(poses), way_of(pieces)
    if way[-1] > 1e-6:
        flat = COUNTED
        ends = np.array([np.interp(way, along * way[-1] / along[-1], pieces[:, k]) for k in range(4)]).T
        assert np.linalg.norm((ends - poses) * flat, axis=1).max() < 20 * WITHIN_M  # their lengths differ a little


def test_two_transfers_become_two_jobs(up6: Program) -> None:
    first, second = jobs_of(up6)
    grips, lets_go = [GripperOutput, Pause, Check, Payload], [GripperOutput, Pause, Payload]
    assert [type(command) for command in first.commands] == [JointMove, Path, *grips, Path, *lets_go, Start]
    assert first.commands[-1] == Start(1, "toaster")
    assert [type(command) for command in second.commands] == [JointMove, Path, Await, Pause, Path, Pause, Start]
    assert [command.closed for command in first.commands if isinstance(command, GripperOutput)] == [True, False]
    assert second.commands[2] == Await(1, "toaster")
    assert [command.mass_kg for command in first.commands if isinstance(command, Payload)] == [0.04, 0.0]
    assert [command.seconds for command in second.commands if isinstance(command, Pause)] == pytest.approx([1.0, 0.25])


def test_a_job_begins_where_the_arm_is_and_a_way_ends_where_it_was_to(up6: Program) -> None:
    first, _ = jobs_of(up6)
    start, down = first.commands[:2]
    assert isinstance(start, JointMove)
    assert isinstance(down, Path)
    assert start.joints == pytest.approx(tuple(up6.joints[0]))
    assert down.points == pytest.approx(np.array([[0.5, 0.1, 0.15, 0.0]]), abs=1e-3)
    assert down.speeds == pytest.approx([0.3], rel=0.01)
    assert down.roundings.tolist() == [0.0]


def test_motions_that_lead_nowhere_are_left_out(up6: Program) -> None:
    """The same program with its first motion ended before it moved."""
    motions = up6.motions
    still = motions[0].model_copy(update={"last": motions[0].first + 1})
    actions = (still, *up6.carried.actions[1:])
    cut = Program(up6.carried.model_copy(update={"actions": actions}), *_arrays(up6))
    assert [sum(len(job.ways) for job in jobs_of(one)) for one in (up6, cut)] == [len(motions), len(motions) - 1]
    words = [type(command) for command in jobs_of(cut)[0].commands]
    assert words == [GripperOutput, Pause, Check, Payload, JointMove, Path, GripperOutput, Pause, Payload, Start]


def test_a_corner_is_one_pose_with_its_rounding(up6: Program) -> None:
    """Up by 15 cm, aside by 20 and ahead by 10 with a blend of 10 cm."""
    way = [command for command in jobs_of(up6)[0].commands if isinstance(command, Path)][1]
    wanted = [[0.5, 0.1, 0.3, 0.0], [0.5, -0.1, 0.3, 0.0], [0.6, -0.1, 0.3, 0.0]]
    assert way.points == pytest.approx(np.array(wanted), abs=1e-6)
    assert way.roundings.tolist() == [0.05, 0.05, 0.0]


def needed(*corners: tuple[float, float], rounded: float = 0.0, speeds: tuple[float, ...] = ()) -> list[int]:
    """The rows of places [mm] that lines need, all inner ones rounded by so much [mm], at 0.3 m/s if no speeds are said."""
    points = np.array([[x / 1000, y / 1000, 0.3, 0.0] for x, y in corners])
    cuts = np.array([0.0, *[rounded / 1000] * (len(points) - 2), 0.0])
    return _needed(points, cuts, speeds or (0.3,) * len(points))


def test_motions_on_one_line_are_one_move_unless_their_speeds_differ() -> None:
    """Three steps ahead, a corner, then a step of the same line at a third of the speed."""
    steps = ((0, 0), (100, 0), (200, 0), (300, 0), (300, 100), (300, 200))
    assert needed(*steps) == [0, 3, 5]
    assert needed(*steps, speeds=(0.3, 0.3, 0.3, 0.3, 0.3, 0.1)) == [0, 3, 4, 5]


def test_a_pose_is_left_away_where_a_line_holds_it_within_seven_tenths_of_a_millimetre() -> None:
    """In the middle of 200 mm, so far beside the line."""
    assert needed((0, 0), (100, 0.6), (200, 0)) == [0, 2]
    assert needed((0, 0), (100, 0.8), (200, 0)) == [0, 1, 2]


def test_so_is_one_in_a_step_aside_whatever_its_brief_motion_says_of_speed() -> None:
    """Half a millimetre aside, never faster than 0.02 m/s, after 200 mm and before a rounded corner of 100 mm."""
    corners, speeds = ((0, 0), (200, 0), (200, 0.5), (300, 0.5), (300, 100)), (0.3, 0.3, 0.02, 0.3, 0.3)
    assert needed(*corners, rounded=2.0, speeds=speeds) == [0, 3, 4]


def test_a_degree_counts_as_a_millimetre() -> None:
    """A tool that turns by 0.6 degrees and back on 200 mm, and one that turns by 0.8."""
    for degrees, kept in ((0.6, [0, 2]), (0.8, [0, 1, 2])):
        points = np.array([[0.0, 0.0, 0.3, 0.0], [0.1, 0.0, 0.3, np.radians(degrees)], [0.2, 0.0, 0.3, 0.0]])
        assert _needed(points, np.zeros(3), (0.3,) * 3) == kept


def test_a_way_there_and_back_and_there_again_is_gone_as_often() -> None:
    assert needed((0, 0), (100, 0), (0, 0), (100, 0)) == [0, 1, 2, 3]


@given(st.lists(st.tuples(*[st.integers(-3, 3)] * 2), min_size=2, max_size=7), st.sampled_from([0.0, 4.0, 15.0]))
def test_what_is_left_away_is_no_farther_off_than_that(corners: list[tuple[int, int]], rounded: float) -> None:
    """Of corners on a grid of 0.4 mm and of 20 mm by turns; all of them lie near the lines between those kept."""
    places = [(x * (20 if k % 2 else 0.4), y * (20 if k % 2 else 0.4)) for k, (x, y) in enumerate(corners)]
    kept = needed(*places, rounded=rounded)
    assert [kept[0], kept[-1]] == [0, len(places) - 1]
    for first, last in pairwise(kept):
        (x, y), end = places[first], places[last]
        far = np.hypot(end[0] - x, end[1] - y)
        for place in places[first + 1 : last]:
            ahead = [(end[0] - x) / far, (end[1] - y) / far] if far else [0.0, 0.0]
            along = np.clip((place[0] - x) * ahead[0] + (place[1] - y) * ahead[1], 0.0, far)
            off = np.hypot(place[0] - x - along * ahead[0], place[1] - y - along * ahead[1])
            assert off <= 1000 * HELD_M + rounded + 0.1


def test_a_machine_is_reset_once_its_part_is_out(up6: Program) -> None:
    """The second transfer, had it gripped: it waits, takes hold, leads away, and says so."""
    first, second = up6.carried.transfers
    presses = [action for action in up6.carried.actions if isinstance(action, Press)]
    grip = presses[0].model_copy(update={"at_s": second.reach_s + 0.5})
    actions = sorted([*up6.carried.actions, grip], key=lambda action: action.at_s)
    carried = up6.carried.model_copy(update={"actions": tuple(actions), "transfers": (first, second)})
    job = jobs_of(Program(carried, *_arrays(up6)))[1]
    words = [type(command) for command in job.commands]
    assert words == [JointMove, Path, Await, Pause, GripperOutput, Pause, Check, Payload, Path, Reset, Pause, Start]
    assert job.commands[9] == Reset(1, "toaster")


def _arrays(program: Program) -> tuple[np.ndarray, ...]:
    return program.at_s, program.joints, program.closed, program.seen_at_s, program.seen
