"""The grip of a two-finger gripper on a part: computed from the part's shape, or checked where a file gives it.

The fingers come straight down on both sides. Those of a level tool come along the part's x axis, with the palm behind it, which
equals a grip from above on the part laid on its front. A flat pad that closes on a convex body touches it where that is widest
across the pad; where this is at the pad's edge the body slopes away, and slips out unless friction holds it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import atan, atan2, cos, degrees, inf, pi, sin

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.lazy import scipy
from lab.sim.arms.fingers import Gripper
from lab.sim.parts.part_shape import PartShape
from lab.tasks.part_fields import GripFields

HEADINGS = 36  # headings of the fingers that are tried over half a turn
DEEP_M = 0.030  # [m] depth of the finger tips below the top of a part with flat sides
PAD_M = 0.024  # [m] length of the pads that touch, upwards from the tips
OVER_FLOOR_M = 0.005  # [m] least height of the finger tips above the foot
HOLD_M = 0.006  # [m] least length of the pads that is on the part
BESIDE_M = 0.004  # [m] least clearance between an open finger and the part as it comes down
PALM_M = 0.002  # [m] least clearance between the palm and the part's top
UNDER_PALM_M = 0.006  # the same for a chosen grip: the clearance of surveys, and the margin of the hull
FLAT_M = 0.0004  # [m] places narrower than the widest one by at most this touch the pad, too
FLAT_WIDE_M = 0.006  # [m] least width of the pad along which a flat side touches
SHARE = 0.8  # the share of the theoretical friction that is relied on
LEVELS, ACROSS = 7, 7  # points on a pad, upwards and across, at which the part is measured

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Grip:
    """The tool's pose on a standing part: yaw [rad], height up_m of the tips above its foot, and x, y [m] off the part's axis.

    width_m: between the fingers. period: the turn after which the grip is the same again [rad]; 0: any turn.
    """

    yaw: float
    up_m: float
    x: float
    y: float
    width_m: float
    period: float


def grip_of(shape: PartShape, gripper: Gripper, friction: float, given: GripFields | None = None) -> Grip:
    """The grip on a standing part, at a narrow place with upright sides from which the part hangs stably.

    Raises BadInput, with the part's widths, for a part that cannot be gripped, and for a `given` grip that does not fit.
    """
    if gripper.level:
        return _level(shape, gripper, friction, given)
    if given is not None:
        return _as_given(shape, gripper, given)
    sections = _Sections(shape)
    if shape.height_m < OVER_FLOOR_M + HOLD_M:
        raise BadInput(
            f"part '{shape.name}' is {shape.height_m:.4f} m high as it stands, too flat for the fingers: at least "
            f"{OVER_FLOOR_M + HOLD_M:.3f} m needed"
        )
    slopes: list[float] = []
    headings = [0.0] if _is_round(shape) else [pi * n / HEADINGS for n in range(HEADINGS)]
    for number, up_m in enumerate(_heights(shape, gripper)):
        rated_grips: list[tuple[tuple[float, ...], Grip]] = []
        for yaw in headings:
            pads = sections.between(yaw, up_m, gripper.width_m, gripper.opening_m - 2 * BESIDE_M)
            if pads is None:
                continue
            if pads.slope > atan(SHARE * friction):
                slopes.append(pads.slope)
            elif pads.flat or number > 0:  # a part without flat sides swings if it is held near its top
                rated_grips.append(
                    (
                        (not pads.flat, round(pads.slope, 3), round(pads.width_m, 4), min(yaw, pi - yaw)),
                        _grip(shape, pads, yaw, up_m),
                    )
                )
        if rated_grips:
            return min(rated_grips, key=lambda rated: rated[0])[1]
    raise BadInput(_refusal(sections, gripper, friction, slopes))


def _level(shape: PartShape, gripper: Gripper, friction: float, given: GripFields | None) -> Grip:
    """The grip of a level tool: as near to the middle as possible, with the pads' middle at the part's axis."""
    if given is not None:
        raise BadInput(
            f"part '{shape.name}': grip is for a tool that hangs; here it is level, by robot.tool "
            "or an approach = 'side': remove grip"
        )
    laid = replace(shape, hull=shape.hull[:, [2, 1, 0]] * [1.0, 1.0, -1.0])  # x up, and its front, +x, below
    deep_m = max(laid.foot_m - PAD_M / 2, laid.height_m - gripper.depth_m + UNDER_PALM_M)  # the tips, behind the front
    low, high = gripper.width_m / 2 + OVER_FLOOR_M, max(shape.height_m - HOLD_M, shape.foot_m)
    if high < low:
        raise BadInput(
            f"part '{shape.name}' is {shape.height_m:.4f} m high as it stands, too flat for the fingers of a level tool: at "
            f"least {low + HOLD_M:.3f} m needed"
        )
    slopes: list[float] = []
    for up_m in [min(max(shape.foot_m, low), high), *np.linspace(low, high, 6).tolist()]:
        sections = _Sections(laid, (up_m - shape.foot_m, 0.0))
        pads = sections.between(0.0, deep_m, gripper.width_m, gripper.opening_m - 2 * BESIDE_M)
        if pads is not None and pads.slope <= atan(SHARE * friction) and deep_m <= laid.height_m - HOLD_M:
            return Grip(0.0, up_m, laid.foot_m - deep_m, pads.middle_m, pads.width_m, 2 * pi)
        slopes += [] if pads is None else [pads.slope]
    raise BadInput(_level_refusal(shape, laid, gripper, friction, slopes))


def _level_refusal(
    shape: PartShape, laid: PartShape, gripper: Gripper, friction: float, slopes: Sequence[float]
) -> str:
    long_m, wide_m = (shape.high - shape.low)[:2].tolist()
    what = f"part '{shape.name}' cannot be gripped level, along its x axis: it is {wide_m:.3f} m wide and {long_m:.3f} m long"
    if slopes:
        least, holds = degrees(min(slopes)), degrees(atan(SHARE * friction))
        return f"{what}, and its sides slope by {least:.0f} degrees: friction {friction:g} holds {holds:.0f}"
    return (
        f"{what}; the gripper takes up to {gripper.opening_m - 2 * BESIDE_M:.3f} m, and "
        f"{gripper.depth_m - UNDER_PALM_M:.3f} m from its tips to its palm"
    )


def _as_given(shape: PartShape, gripper: Gripper, given: GripFields) -> Grip:
    """The grip that a file gives; BadInput when the fingers do not go around the part there."""
    most = gripper.opening_m - 2 * BESIDE_M
    below = given.up_m < shape.height_m
    pads = _Sections(shape, given.at_m).between(given.yaw, given.up_m, gripper.width_m) if below else None
    where = f"part '{shape.name}': grip.yaw {given.yaw:g}, up_m {given.up_m:g}"
    if pads is None:
        raise BadInput(f"{where}: between the fingers is nothing; the part is {shape.height_m:.3f} m high")
    if pads.passing_m > most:
        raise BadInput(f"{where}: it is {pads.passing_m:.3f} m wide there; the gripper takes up to {most:.3f} m")
    if shape.height_m - given.up_m > gripper.depth_m - PALM_M:
        least = shape.height_m - gripper.depth_m + PALM_M
        raise BadInput(f"{where}: the part's top would be in the palm; at least {least:.3f} m needed")
    x, y = given.at_m
    return Grip(given.yaw, given.up_m, x, y, pads.width_m, _period(shape))


def _heights(shape: PartShape, gripper: Gripper) -> list[float]:
    """Heights [m] of the finger tips above the foot to try: near the top, for flat sides; near the middle; all others."""
    low = max(OVER_FLOOR_M, shape.height_m - gripper.depth_m + UNDER_PALM_M)
    high = shape.height_m - HOLD_M
    if high < low - 1e-9:
        return []
    high = max(high, low)
    usual = min(max(shape.height_m - DEEP_M, low), high)
    middle = min(max(shape.foot_m - PAD_M / 2, low), high)
    return [usual, middle, *np.linspace(low, high, 6).tolist()]


def _grip(shape: PartShape, pads: "_Pads", yaw: float, up_m: float) -> Grip:
    x, y = -sin(yaw) * pads.middle_m + 0.0, cos(yaw) * pads.middle_m + 0.0  # no -0.0
    return Grip(
        yaw if yaw <= pi / 2 else yaw - pi, up_m, x, y, pads.width_m, _period(shape)
    )  # half a turn on is the same


def _is_round(shape: PartShape) -> bool:
    """Whether the shape is an upright cylinder, which is equal from all sides."""
    x, y, _, _ = shape.turn
    return shape.solid == "cylinder" and abs(x) < 1e-6 and abs(y) < 1e-6


def _period(shape: PartShape) -> float:
    return 0.0 if _is_round(shape) else pi


def _refusal(sections: "_Sections", gripper: Gripper, friction: float, slopes: list[float]) -> str:
    shape, most = sections.shape, gripper.opening_m - 2 * BESIDE_M
    widths = {pi * n / HEADINGS: sections.wide(pi * n / HEADINGS) for n in range(HEADINGS)}
    narrow, wide = min(widths, key=lambda yaw: widths[yaw]), max(widths, key=lambda yaw: widths[yaw])
    what = (
        f"part '{shape.name}' cannot be gripped: it is {widths[narrow]:.3f} m wide where it is narrowest (at yaw {narrow:.2f}) "
        f"and {widths[wide]:.3f} m where it is widest; the gripper takes up to {most:.3f} m"
    )
    if slopes:
        least, holds = degrees(min(slopes)), degrees(atan(SHARE * friction))
        return f"{what}, and where it is no wider its sides slope by {least:.0f} degrees: friction {friction:g} holds {holds:.0f}"
    if widths[narrow] <= most:
        room = gripper.depth_m - UNDER_PALM_M
        return f"{what}; it is {shape.height_m:.3f} m high, too wide below {room:.3f} m under its top, where palm and fingers end"
    return what


@dataclass(frozen=True)
class _Pads:
    """The contact of two pads that close on a part.

    width_m: between the pads; middle_m: their middle, relative to the part's axis. passing_m: the opening that they need as
    they come down. slope: of the part's sides at the pads [rad], 0 where they touch flat. flat: whether they touch along a width.
    """

    width_m: float
    middle_m: float
    passing_m: float
    slope: float
    flat: bool


class _Sections:
    """Horizontal sections of a part's hull, seen along headings."""

    def __init__(self, shape: PartShape, at: tuple[float, float] = (0.0, 0.0)) -> None:
        self.shape, self.at = shape, np.array(at)
        self._known: dict[float, Array | None] = {}

    @cached_property
    def _edges(self) -> tuple[Array, Array]:
        """The hull's edges (m, 3), from and to; diagonals of its faces among them."""
        corners = self.shape.hull
        sides = scipy.spatial.ConvexHull(corners).simplices  # (k, 3)
        edges = np.unique(
            np.sort(np.concatenate([sides[:, [0, 1]], sides[:, [1, 2]], sides[:, [2, 0]]]), axis=1), axis=0
        )
        return corners[edges[:, 0]], corners[edges[:, 1]]

    def at_height(self, up_m: float) -> Array | None:
        """The corners (n, 2) of the section at a height above the foot, in order; None if it is empty."""
        key = round(up_m, 6)
        if key not in self._known:
            z = up_m - self.shape.foot_m
            one, other = self._edges
            low, high = np.minimum(one[:, 2], other[:, 2]), np.maximum(one[:, 2], other[:, 2])
            cut = (low <= z) & (z <= high) & (high > low)
            share = ((z - one[cut, 2]) / (other[cut, 2] - one[cut, 2]))[:, None]
            points = one[cut, :2] + share * (other[cut, :2] - one[cut, :2]) - self.at
            self._known[key] = _around(np.unique(points.round(7), axis=0))
        return self._known[key]

    def wide(self, yaw: float) -> float:
        """The part's width across a heading [m]."""
        return float(np.ptp(self.shape.hull[:, :2] @ _across(yaw)))

    def between(self, yaw: float, up_m: float, wide_m: float, most_m: float = inf) -> _Pads | None:
        """The contact of pads at a heading and a height; None if the part is not between them or is wider than `most_m`."""
        top = self.shape.height_m
        above = self._profile(yaw, np.linspace(up_m, top - 1e-5, LEVELS), wide_m)
        if above is None or np.nanmax(above[..., 1]) - np.nanmin(above[..., 0]) > most_m:
            return None
        pad = self._profile(yaw, np.linspace(up_m, min(up_m + PAD_M, top - 1e-5), LEVELS), wide_m)
        if pad is None:
            return None
        low, high = float(np.nanmin(pad[..., 0])), float(np.nanmax(pad[..., 1]))
        middle = (low + high) / 2
        passing = 2 * max(float(np.nanmax(above[..., 1])) - middle, middle - float(np.nanmin(above[..., 0])))
        if passing > most_m:
            return None
        sides = (-pad[..., 0], pad[..., 1])
        step = wide_m / (ACROSS - 1), (min(up_m + PAD_M, top) - up_m) / (LEVELS - 1)
        slope = max(_slope(side, step) for side in sides)
        flat = all(_is_flat(side, step[0]) for side in sides)
        return _Pads(high - low, middle, passing, slope, flat)

    def _profile(self, yaw: float, heights: Array, wide_m: float) -> Array | None:
        """The part's extent (levels, ACROSS, 2) [m] across a heading, NaN where it is absent; None if it is nowhere."""
        extent = np.full((len(heights), ACROSS, 2), np.nan)
        at = np.linspace(-wide_m / 2, wide_m / 2, ACROSS)
        for level, up_m in enumerate(heights):
            section = self.at_height(float(up_m))
            if section is not None:
                extent[level] = _crossed(section @ np.array([cos(yaw), sin(yaw)]), section @ _across(yaw), at)
        return None if np.isnan(extent).all() else extent


def _across(yaw: float) -> Array:
    """The direction (2,) along which the fingers close."""
    return np.array([-sin(yaw), cos(yaw)])


def _around(points: Array) -> Array | None:
    """The corners of the convex hull of points (n, 2), in order; None when they enclose nothing."""
    if len(points) < 3:
        return None
    try:
        return np.asarray(points[scipy.spatial.ConvexHull(points).vertices])
    except scipy.spatial.QhullError:
        return None


def _crossed(along: Array, across: Array, at: Array) -> Array:
    """The extent (m, 2) of a convex outline (n,), (n,) across, at places `at` (m,) along; NaN where it is absent."""
    after, beyond = np.roll(along, -1), np.roll(across, -1)
    level = after == along
    share = (at[:, None] - along) / np.where(level, 1.0, after - along)  # (m, n)
    values = np.where((share >= 0) & (share <= 1) & ~level, across + share * (beyond - across), np.nan)
    reached = ~np.isnan(values).all(axis=1)
    extent = np.full((len(at), 2), np.nan)
    if reached.any():
        extent[reached] = np.stack([np.nanmin(values[reached], axis=1), np.nanmax(values[reached], axis=1)], axis=1)
    return extent


def _slope(side: Array, step: tuple[float, float]) -> float:
    """The slope [rad] of a side (levels, across) [m] at a pad's edge; 0 if the pad touches it within its area."""
    touching = np.nan_to_num(side, nan=-np.inf)
    level, column = np.unravel_index(int(np.argmax(touching)), side.shape)
    near = touching > touching[level, column] - FLAT_M
    steepest = 0.0
    for axis, own in ((0, step[1]), (1, step[0])):
        places = np.flatnonzero(near.any(axis=1 - axis))
        last = side.shape[axis] - 1
        if places[0] > 0 and places[-1] < last:
            continue  # it bulges: the pad touches it in between
        if places[0] == 0 and places[-1] == last:
            continue  # flat
        inner = places[-1] + 1 if places[0] == 0 else places[0] - 1
        line = touching.max(axis=1 - axis)
        if np.isfinite(line[inner]):
            edge = 0 if places[0] == 0 else last
            steepest = max(steepest, atan2(float(line[edge] - line[inner]), own * abs(inner - edge)))
    return steepest


def _is_flat(side: Array, step: float) -> bool:
    """Whether a pad touches a side (levels, across) along enough of its width, in most of its height."""
    touching = np.nan_to_num(side, nan=-np.inf)
    wide = (touching > touching.max() - FLAT_M).sum(axis=1) * step
    return bool((wide >= FLAT_WIDE_M).mean() > 0.7)
