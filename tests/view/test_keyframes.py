"""Keyframes: few of them, and what is left out comes back by interpolation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sim.frames import IDENTITY, Body, Frame, Pose, Recording, Shape
from lab.view.keyframes import (
    ANGLE_TOLERANCE_RAD,
    POSITION_TOLERANCE_M,
    BodyMotion,
    Floats,
    KeyframeTrack,
    angle,
    continuous,
    motions,
    slerp,
)

BODY = Body("slice", (Shape("box", (0.12, 0.015, 0.12)),))


def at(x: float, yaw: float = 0.0) -> Pose:
    return (x, 0.0, 0.0, 0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2)))


def motion(*frames: Frame) -> BodyMotion:
    return motions(Recording((BODY,), list(frames)))["slice"]


def moves(times: list[float], poses: list[Pose]) -> BodyMotion:
    return motion(*(Frame(time, {"slice": pose}) for time, pose in zip(times, poses, strict=True)))


def played(track: KeyframeTrack | None, times: list[float], start: Floats) -> Floats:
    """What the page shows of a track at these times: linear for places, slerp for turns."""
    if track is None:
        return np.tile(start, (len(times), 1))
    rows = []
    for time in times:
        after = int(np.clip(np.searchsorted(track.times_s, time), 1, len(track.times_s) - 1))
        share = (time - track.times_s[after - 1]) / (track.times_s[after] - track.times_s[after - 1])
        one, other = track.values[after - 1], track.values[after]
        rows.append(slerp(one, other, np.array([[share]]))[0] if len(one) == 4 else one + share * (other - one))
    return np.array(rows)


def test_a_straight_move_needs_its_ends_only() -> None:
    found = moves([0, 1, 2, 3], [at(0), at(1), at(2), at(3)])
    assert found.position is not None
    assert found.position.times_s.tolist() == [0, 3]
    assert found.position.values[:, 0].tolist() == [0, 3]
    assert found.quaternion is None


def test_a_stop_keeps_its_corners() -> None:
    found = moves([0, 1, 2, 3, 4], [at(0), at(1), at(1), at(1), at(2)])
    assert found.position is not None
    assert found.position.times_s.tolist() == [0, 1, 3, 4]


def test_an_even_turn_needs_its_ends_only() -> None:
    found = moves([10, 11, 12, 13], [at(0, 0.0), at(0, 0.5), at(0, 1.0), at(0, 1.5)])
    assert found.position is None
    assert found.quaternion is not None
    assert found.quaternion.times_s.tolist() == [0, 3]


@pytest.mark.parametrize("shake", [0.0, 0.9 * POSITION_TOLERANCE_M])
def test_what_stands_still_has_no_keys(shake: float) -> None:
    found = moves([0, 1, 2], [at(0.5), at(0.5 + shake), at(0.5)])
    assert found.position is None
    assert found.quaternion is None
    assert found.start == at(0.5)


def test_a_body_without_pose_stands_at_the_origin() -> None:
    assert motion(Frame(0, {}), Frame(1, {})).start == IDENTITY
    assert motion().start == IDENTITY


def test_a_body_left_out_stays_and_is_from_the_beginning_where_it_first_is() -> None:
    frames = [Frame(0, {}), Frame(1, {"slice": at(1)}), Frame(2, {}), Frame(3, {}), Frame(4, {"slice": at(2)})]
    found = motion(*frames)
    assert found.start == at(1)
    assert found.position is not None
    assert found.position.times_s.tolist() == [0, 3, 4]
    assert found.position.values[:, 0].tolist() == [1, 1, 2]


def test_of_two_frames_at_one_time_the_later_counts() -> None:
    found = moves([0, 1, 1], [at(0), at(1), at(5)])
    assert found.position is not None
    assert found.position.values[:, 0].tolist() == [0, 5]


def test_only_changes_of_colour_and_visibility_are_kept() -> None:
    white, brown = (1.0, 1.0, 1.0, 1.0), (0.4, 0.2, 0.1, 1.0)
    found = motion(
        Frame(5, {}, {"slice": white}, {"slice": True}),
        Frame(6, {}, {"slice": white}, {"slice": False}),
        Frame(7, {}, {"slice": brown}, {"slice": False}),
    )
    assert found.colors == ((0.0, white), (2.0, brown))
    assert found.visible == ((1.0, False),)


def test_signs_of_quaternions_do_not_jump() -> None:
    turns = np.array([at(0, yaw)[3:] for yaw in np.linspace(0, 4 * np.pi, 9)])
    turns[3] *= -1
    smooth = continuous(turns)
    assert ((smooth[1:] * smooth[:-1]).sum(axis=1) > 0).all()
    assert angle(smooth, turns) == pytest.approx(0, abs=1e-7)


def test_slerp_goes_the_shorter_way() -> None:
    half = slerp(np.array(at(0, 0.0)[3:]), -np.array(at(0, 1.0)[3:]), np.array([[0.5]]))
    assert angle(half, np.array([at(0, 0.5)[3:]])) == pytest.approx(0, abs=1e-7)


numbers = st.floats(-2, 2)
steps = st.lists(st.tuples(st.floats(0.05, 1), numbers, st.floats(-10, 10)), min_size=1, max_size=30)


@given(steps)
def test_every_frame_comes_back_within_the_tolerance(path: list[tuple[float, float, float]]) -> None:
    times = np.cumsum([0.0, *(step[0] for step in path[1:])]).tolist()
    poses = [at(x, yaw) for _, x, yaw in path]
    found = moves(times, poses)
    start = np.array(found.start)
    places = played(found.position, times, start[:3])
    turns = played(found.quaternion, times, start[3:])
    assert np.linalg.norm(places - np.array(poses)[:, :3], axis=1).max() <= POSITION_TOLERANCE_M + 1e-9
    assert angle(turns, np.array(poses)[:, 3:]).max() <= ANGLE_TOLERANCE_RAD + 1e-6
