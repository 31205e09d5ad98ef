"""Keyframes of a recording: frames that interpolation reproduces are dropped.

Numpy only. Positions are interpolated linearly, quaternions (xyzw) by slerp, as three.js does in the page.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.sim.frames import IDENTITY, Recording, Rgba

POSITION_TOLERANCE_M = 0.0002
ANGLE_TOLERANCE_RAD = np.deg2rad(0.2)

Floats = NDArray[np.float64]
Between = Callable[[Floats, Floats, Floats], Floats]
Apart = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True, eq=False)
class KeyframeTrack:
    """Keys of one property: `times_s` (k,) seconds since the first frame, `values` (k, width)."""

    times_s: Floats
    values: Floats


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """The motion of one body; properties that never change are None (position, rotation) or empty (steps)."""

    start: tuple[float, ...]
    position: KeyframeTrack | None
    quaternion: KeyframeTrack | None
    colors: tuple[tuple[float, Rgba], ...]  # (seconds since the first frame, colour from then on)
    visible: tuple[tuple[float, bool], ...]


def motions(recording: Recording) -> dict[str, BodyMotion]:
    """The motion of every body, with as few keys as stay within 0.2 mm and 0.2 degrees of every frame."""
    times, last = _times(recording)
    return {body.name: _motion(recording, body.name, times, last) for body in recording.bodies}


def _times(recording: Recording) -> tuple[Floats, list[int]]:
    """The distinct times [s] since the first frame, and each frame's row; frames with equal times share a row."""
    stamps = [frame.time_s for frame in recording.frames]
    unique, rows = np.unique(stamps, return_inverse=True)
    return unique - unique[:1], rows.tolist()


def _motion(recording: Recording, name: str, times: Floats, rows: list[int]) -> BodyMotion:
    poses = np.full((max(len(times), 1), 7), np.nan)
    colors: list[tuple[float, Rgba]] = []
    visible: list[tuple[float, bool]] = []
    for row, frame in zip(rows, recording.frames, strict=True):
        if name in frame.poses:
            poses[row] = frame.poses[name]
        if name in frame.colors and (not colors or colors[-1][1] != frame.colors[name]):
            colors.append((float(times[row]), frame.colors[name]))
        if name in frame.visible and (visible[-1][1] if visible else True) != frame.visible[name]:
            visible.append((float(times[row]), bool(frame.visible[name])))
    poses = _held(poses)
    places, turns = poses[:, :3], continuous(poses[:, 3:])
    return BodyMotion(
        start=(*places[0].tolist(), *turns[0].tolist()),
        position=_track(times, places, lerp, distance, POSITION_TOLERANCE_M),
        quaternion=_track(times, turns, slerp, angle, ANGLE_TOLERANCE_RAD),
        colors=tuple(colors),
        visible=tuple(visible),
    )


def _held(poses: Floats) -> Floats:
    """The poses with missing rows (NaN) filled from the row before, leading ones from the first pose."""
    given = ~np.isnan(poses[:, 0])
    if not given.any():
        return np.tile(np.array(IDENTITY), (len(poses), 1))
    source = np.maximum.accumulate(np.where(given, np.arange(len(poses)), np.argmax(given)))
    return np.asarray(poses[source])


def continuous(quaternions: Floats) -> Floats:
    """The unit quaternions (n, 4) with signs chosen so that neighbours are close; q and -q are the same rotation."""
    units = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    flips = np.where((units[1:] * units[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    return np.asarray(units * np.concatenate(([1.0], np.cumprod(flips)))[:, None])


def _track(times: Floats, values: Floats, between: Between, apart: Apart, tolerance: float) -> KeyframeTrack | None:
    """The keys from which the interpolation `between` stays within `tolerance` of all values, measured by `apart`.

    None when nothing moves.
    """

    def off(first: int, last: int) -> Floats:
        share = (times[first + 1 : last] - times[first]) / (times[last] - times[first])
        return apart(values[first + 1 : last], between(values[first], values[last], share[:, None]))

    kept = sparse(len(times), off, tolerance)
    if len(kept) < 2 or (len(kept) == 2 and apart(values[-1:], values[:1])[0] <= tolerance):
        return None
    return KeyframeTrack(times[kept], values[kept])


def sparse(count: int, off: Callable[[int, int], Floats], tolerance: float) -> list[int]:
    """The rows to keep (Ramer-Douglas-Peucker over time): first, last, and those where `off` exceeds the tolerance.

    `off(i, j)`: the deviations of the rows strictly between i and j from the interpolation between i and j.
    """
    kept = {0, count - 1} if count else set()
    pending = [(0, count - 1)]
    while pending:
        first, last = pending.pop()
        if last - first < 2:
            continue
        errors = off(first, last)
        worst = int(np.argmax(errors))
        if errors[worst] > tolerance:
            middle = first + 1 + worst
            kept.add(middle)
            pending += [(first, middle), (middle, last)]
    return sorted(kept)


def distance(one: Floats, other: Floats) -> Floats:
    """The distances (n,) [m] between positions (n, 3)."""
    return np.asarray(np.linalg.norm(one - other, axis=1))


def angle(one: Floats, other: Floats) -> Floats:
    """The angles (n,) [rad] between unit quaternions (n, 4)."""
    return np.asarray(2 * np.arccos(np.clip(np.abs((one * other).sum(axis=1)), 0, 1)))


def lerp(one: Floats, other: Floats, share: Floats) -> Floats:
    """The positions (n, 3) at `share` (n, 1) of the line from `one` (3,) to `other` (3,)."""
    return one + share * (other - one)


def slerp(one: Floats, other: Floats, share: Floats) -> Floats:
    """The quaternions (n, 4) at `share` (n, 1) of the shorter rotation from `one` (4,) to `other` (4,)."""
    cosine = float(one @ other)
    if cosine < 0:
        other, cosine = -other, -cosine
    whole = np.arccos(min(cosine, 1.0))
    mixed = lerp(one, other, share)
    if whole > 1e-6:
        mixed = np.sin((1 - share) * whole) * one + np.sin(share * whole) * other
    return np.asarray(mixed / np.linalg.norm(mixed, axis=1, keepdims=True))
