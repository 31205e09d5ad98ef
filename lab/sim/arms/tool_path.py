"""A path of tool poses: sampled, rounded at its corners, and timed."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lab.sim.arms.kinematics import ToolPose
from lab.sim.world import TIME_STEP

YAW_ARM = 0.15  # [m/rad] a turn of the tool counts as this much way
COUNTED = np.array([1.0, 1.0, 1.0, YAW_ARM])  # of a tool pose
_SAMPLE_M = 0.004  # between points of a path before it is timed
_NEAR_M = 1e-9

Array = NDArray[np.float64]


def sampled(poses: Sequence[ToolPose]) -> Array:
    """Points (n, 4) along the straight ways between poses: x, y, z [m], yaw [rad]."""
    corners = np.array([[p.x, p.y, p.z, p.yaw] for p in poses])
    rows = [corners[:1]]
    for start, end in pairwise(corners):
        count = max(1, int(np.ceil(lengths(np.array([start, end]))[0] / _SAMPLE_M)))
        rows.append(start + (end - start) * (np.arange(1, count + 1) / count)[:, None])
    return np.concatenate(rows)


def rounded(points: Array, blend: float) -> Array:
    """A moving average along the path cuts its corners by about blend / 2; the ends stay."""
    half = int(blend / _SAMPLE_M / 2)
    if half < 1 or len(points) < 3:
        return points
    padded = np.concatenate([np.repeat(points[:1], half, 0), points, np.repeat(points[-1:], half, 0)])
    kernel = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    smooth = np.stack([np.convolve(padded[:, k], kernel, mode="valid") for k in range(4)], axis=1)
    smooth[0], smooth[-1] = points[0], points[-1]
    return smooth


def lengths(points: Array) -> Array:
    """How far it is from each of points (n, 4) to the next [m], a turn counted as way."""
    return np.asarray(np.linalg.norm(np.diff(points, axis=0) * COUNTED, axis=1))


def way_of(points: Array) -> Array:
    """How far along they are (n,) [m], for points (n, 4)."""
    return np.concatenate([[0.0], np.cumsum(lengths(points))])


def evenly(length: float, speed: float, acceleration: float) -> Array:
    """Way [m] after each physics step when speeding up, cruising and slowing down over `length` [m]."""
    if length < 1e-9:
        return np.array([0.0])
    ramp = min(speed**2 / acceleration, length) / 2.0
    top = np.sqrt(2.0 * acceleration * ramp)
    speeding, cruising = top / acceleration, (length - 2.0 * ramp) / top
    total = 2.0 * speeding + cruising
    t = np.minimum(np.arange(1, int(np.ceil(total / TIME_STEP)) + 1) * TIME_STEP, total)
    left = np.maximum(total - t, 0.0)
    slowing = np.where(left < speeding, length - acceleration * left**2 / 2.0, ramp + top * (t - speeding))
    return np.asarray(np.where(t < speeding, acceleration * t**2 / 2.0, slowing))


def slowed(points: Array, speed: float, acceleration: float) -> Array:
    """Way [m] after each physics step along points (n, 4), as fast as `acceleration` along and across the way allows."""
    points = points[np.concatenate([[True], lengths(points) > _NEAR_M])]
    steps, way = lengths(points), way_of(points)
    if len(points) < 3:
        return evenly(float(way[-1]), speed, acceleration)
    speeds = np.sqrt(_squares(points, steps, speed, acceleration))
    seconds = 2.0 * steps / np.maximum(speeds[:-1] + speeds[1:], _NEAR_M)
    times = np.concatenate([[0.0], np.cumsum(seconds)])
    t = np.minimum(np.arange(1, int(np.ceil(times[-1] / TIME_STEP - _NEAR_M)) + 1) * TIME_STEP, times[-1])
    at = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(steps) - 1)
    since, gained = t - times[at], np.diff(speeds) / np.maximum(seconds, _NEAR_M)
    return np.asarray(np.minimum(way[at] + speeds[at] * since + gained[at] * since**2 / 2.0, way[at + 1]))


def _squares(points: Array, steps: Array, speed: float, acceleration: float) -> Array:
    """The squares (n,) of the speeds at points (n, 4) that are `steps` (n - 1,) [m] apart; at rest at both ends."""
    ahead = np.diff(points, axis=0) * COUNTED / np.maximum(steps, _NEAR_M)[:, None]
    between = np.maximum((steps[:-1] + steps[1:]) / 2.0, _NEAR_M)
    bends = np.linalg.norm(np.diff(ahead, axis=0), axis=1) / between  # [1/m]
    squares = np.concatenate([[0.0], np.minimum(speed**2, acceleration / np.maximum(bends, _NEAR_M)), [0.0]])
    gained = 2.0 * acceleration * np.concatenate([[0.0], np.cumsum(steps)])  # by speeding up all the way
    squares = np.minimum.accumulate(squares - gained) + gained
    squares = np.minimum.accumulate((squares + gained)[::-1])[::-1] - gained
    return np.asarray(np.maximum(squares, 0.0))
