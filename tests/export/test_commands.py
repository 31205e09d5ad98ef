"""A run as commands: few straight pieces that keep to the way driven, and transfers in their order."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.export.commands import (
    WITHIN_M,
    Await,
    Check,
    Grip,
    Joint,
    Path,
    Pause,
    Payload,
    Reset,
    Start,
    _needed,
    jobs_of,
    moving,
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


def test_a_half_circle_of_10_cm_is_kept_within_three_tenths_of_a_millimetre_by_few_pieces() -> None:
    """A chord of a circle r misses it by r (1 - cos(a / 2)): at 0.3 mm it spans 8.9 degrees, so 21 pieces at the least."""
    angles = np.linspace(0.0, pi, 2001)
    circle = np.column_stack([0.1 * np.cos(angles), 0.1 * np.sin(angles), 0 * angles, 0 * angles])
    pieces = straightened(circle)
    assert 21 <= len(pieces) - 1 <= 42
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
    grips, lets_go = [Grip, Pause, Check, Payload], [Grip, Pause, Payload]
    assert [type(command) for command in first.commands] == [Joint, Path, *grips, Path, *lets_go, Start]
    assert first.commands[-1] == Start(1, "toaster")
    assert [type(command) for command in second.commands] == [Joint, Path, Await, Pause, Path, Pause, Start]
    assert [command.closed for command in first.commands if isinstance(command, Grip)] == [True, False]
    assert second.commands[2] == Await(1, "toaster")
    assert [command.mass_kg for command in first.commands if isinstance(command, Payload)] == [0.04, 0.0]
    assert [command.seconds for command in second.commands if isinstance(command, Pause)] == pytest.approx([1.0, 0.25])


def test_a_job_begins_where_the_arm_is_and_a_way_ends_where_it_was_to(up6: Program) -> None:
    first, _ = jobs_of(up6)
    start, down = first.commands[:2]
    assert isinstance(start, Joint)
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
    assert len(moving(up6)) == len(motions)
    assert len(moving(cut)) == len(motions) - 1
    words = [type(command) for command in jobs_of(cut)[0].commands]
    assert words == [Grip, Pause, Check, Payload, Joint, Path, Grip, Pause, Payload, Start]


def test_a_corner_is_one_pose_with_its_rounding(up6: Program) -> None:
    """Up by 15 cm, aside by 20 and ahead by 10 with a blend of 10 cm."""
    way = [command for command in jobs_of(up6)[0].commands if isinstance(command, Path)][1]
    wanted = [[0.5, 0.1, 0.3, 0.0], [0.5, -0.1, 0.3, 0.0], [0.6, -0.1, 0.3, 0.0]]
    assert way.points == pytest.approx(np.array(wanted), abs=1e-6)
    assert way.roundings.tolist() == [0.05, 0.05, 0.0]


def test_motions_on_one_line_are_one_move_unless_their_speeds_differ() -> None:
    """Three steps ahead, a corner, then a step of the same line at a third of the speed."""
    points = np.array([[0.1 * x, 0.1 * y, 0.3, 0.0] for x, y in ((0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (3, 2))])
    assert _needed(points, [0.0] * 6, [0.3] * 6) == [0, 3, 5]
    assert _needed(points, [0.0] * 6, [0.3] * 5 + [0.1]) == [0, 3, 4, 5]


def test_a_machine_is_reset_once_its_part_is_out(up6: Program) -> None:
    """The second transfer, had it gripped: it waits, takes hold, leads away, and says so."""
    first, second = up6.carried.transfers
    presses = [action for action in up6.carried.actions if isinstance(action, Press)]
    grip = presses[0].model_copy(update={"at_s": second.reach_s + 0.5})
    actions = sorted([*up6.carried.actions, grip], key=lambda action: action.at_s)
    carried = up6.carried.model_copy(update={"actions": tuple(actions), "transfers": (first, second)})
    job = jobs_of(Program(carried, *_arrays(up6)))[1]
    words = [type(command) for command in job.commands]
    assert words == [Joint, Path, Await, Pause, Grip, Pause, Check, Payload, Path, Reset, Pause, Start]
    assert job.commands[9] == Reset(1, "toaster")


def _arrays(program: Program) -> tuple[np.ndarray, ...]:
    return program.at_s, program.joints, program.closed, program.seen_at_s, program.seen
