"""A path of the tool: straight lines between poses, arcs at corners, timed so that the tool's acceleration keeps to a limit.

The time law is that of a path with a bounded acceleration: at each place the speed is at most what the bend there allows, and
what can be reached from the place before and braked to the next. Source: T. Kunz and M. Stilman, 2012 (arcs at corners);
J. Bobrow, S. Dubowsky and J. Gibson, 1985 (passes forward and backward).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, ceil, inf, sqrt, tan

import numpy as np
from numpy.typing import NDArray

from lab.sim.arms.kinematics import ToolPose
from lab.sim.world import TIME_STEP

YAW_ARM = 0.15  # [m/rad] path length that a turn of the tool counts as
COUNTED = np.array([1.0, 1.0, 1.0, YAW_ARM])  # of a tool pose
ROUNDINGS_M = (0.002, 0.004, 0.008, 0.015, 0.02, 0.03, 0.04, 0.05)  # the radii of a controller's position levels
_NEAR_M = 1e-9
_STRAIGHT_RAD = 1e-4  # a corner that bends less counts as straight
_BACK_RAD = 3.0  # at a corner that bends more, the path turns back
_TURNED_RAD = 0.01  # beside a line that turns the tool by more, a corner is not rounded
_PARTS = 8  # of an arc, each with one tangential acceleration

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Piece:
    """A straight line or a part of an arc, `length` [m] of a path; poses are weighted (4,) [m], see COUNTED.

    first: where it begins; ahead: the unit vector along it there; across: the unit vector to the arc's middle; radius [m]: inf
    of a line. stops: the tool comes to rest where it begins.
    """

    length: float
    first: Array
    ahead: Array
    across: Array
    radius: float = inf
    stops: bool = False


def way_of(points: Array) -> Array:
    """The path length (n,) [m] up to each of points (n, 4), with turns counted as length."""
    steps = np.linalg.norm(np.diff(points, axis=0) * COUNTED, axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def timed(poses: Sequence[ToolPose], speed: float, acceleration: float, blend: float | Sequence[float] = 0.0) -> Array:
    """The tool pose after each physics step (n, 4), x, y, z [m], yaw [rad], from rest at the first pose to rest at the last.

    The limits are `speed` [m/s] and `acceleration` [m/s2], along and across the path together, with turns counted as length.
    Each corner is an arc, see `roundings`, with a `blend` [m] for all poses or one each; without a blend, and where the
    path turns back, the tool stops at corners.
    """
    corners = np.array([[p.x, p.y, p.z, p.yaw] for p in poses])
    pieces = _pieces(corners * COUNTED, np.broadcast_to(np.asarray(blend, float), len(corners)))
    if not pieces:
        return corners[-1:]
    lengths = np.array([piece.length for piece in pieces])
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    way = _ticks(pieces, _squares(pieces, speed, acceleration), speed, acceleration)
    at = np.clip(np.searchsorted(starts, way, side="right") - 1, 0, len(pieces) - 1)
    since = np.minimum(way - starts[at], lengths[at])[:, None]
    first, ahead, across = (np.array([getattr(p, name) for p in pieces])[at] for name in ("first", "ahead", "across"))
    radius = np.array([piece.radius if piece.radius < inf else 1.0 for piece in pieces])[at][:, None]
    turned = since / radius
    arcs = radius * (np.sin(turned) * ahead + (1.0 - np.cos(turned)) * across)
    bent = np.array([piece.radius < inf for piece in pieces])[at][:, None]
    points = (first + np.where(bent, arcs, since * ahead)) / COUNTED
    points[-1] = corners[-1]
    return np.asarray(points)


def bending(corners: Array) -> list[int]:
    """The indices of the weighted poses (n, 4) at which a path bends, with its ends; the others lie on straight lines."""
    far = np.concatenate([[True], np.linalg.norm(np.diff(corners, axis=0), axis=1) > _NEAR_M])
    kept: list[int] = []
    for row in np.flatnonzero(far).tolist():
        if len(kept) > 1 and _turn(corners[[kept[-2], kept[-1], row]]) <= _STRAIGHT_RAD:
            kept.pop()
        kept.append(row)
    return kept


def _turn(corners: Array) -> float:
    """The angle [rad] by which a path through three points (3, n) turns at the second."""
    ahead = np.diff(corners, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    return 2.0 * atan2(float(np.linalg.norm(ahead[1] - ahead[0])), float(np.linalg.norm(ahead[1] + ahead[0])))


def roundings(corners: Array, blends: Array) -> Array:
    """The distance (n,) [m] from each of weighted poses (n, 4), all `bending`, at which its arc begins and ends; 0 at both ends.

    It is the largest of ROUNDINGS_M that is no more than half a blend (n,) [m] and half of the shorter line beside it, or 0
    where a line beside it turns the tool, or the path turns back.
    """
    halves = np.linalg.norm(np.diff(corners, axis=0), axis=1) / 2.0
    room = np.zeros(len(corners))
    room[1:-1] = np.minimum(blends[1:-1] / 2.0, np.minimum(halves[:-1], halves[1:])) + _NEAR_M
    turns = np.abs(np.diff(corners[:, 3])) > YAW_ARM * _TURNED_RAD
    back = [_turn(corners[at : at + 3]) > _BACK_RAD for at in range(len(corners) - 2)]
    room[1:-1][turns[:-1] | turns[1:] | np.array(back, bool)] = 0.0
    return np.array([0.0, *ROUNDINGS_M])[np.searchsorted(ROUNDINGS_M, room, side="right")]


def _pieces(corners: Array, blends: Array) -> list[_Piece]:
    """The pieces of the path along weighted poses (n, 4), with a blend each; empty if all poses are equal."""
    kept = bending(corners)
    corners = corners[kept]
    rooms = roundings(corners, blends[kept]).tolist()
    legs = np.diff(corners, axis=0)
    lengths = np.linalg.norm(legs, axis=1)
    ahead = legs / lengths[:, None]
    pieces: list[_Piece] = []
    begun, stops = 0.0, False  # where on the leg its line begins, and whether from rest
    none = np.zeros(4)
    for number, (corner, along, length) in enumerate(zip(corners[:-1], ahead, lengths.tolist(), strict=True)):
        if number == len(legs) - 1:
            pieces.append(_Piece(length - begun, corner + begun * along, along, none, stops=stops))
            break
        then, turn = ahead[number + 1], _turn(corners[number : number + 3])
        room = rooms[number + 1]
        radius = room / tan(turn / 2.0)
        cut = room if radius > _NEAR_M else 0.0
        if length - begun - cut > 0.0:
            pieces.append(_Piece(length - begun - cut, corner + begun * along, along, none, stops=stops))
        stops, begun = cut == 0.0, cut
        if cut:
            pieces += _arc(corner + (length - cut) * along, along, then, turn, radius)
    return pieces


def _arc(first: Array, along: Array, then: Array, turn: float, radius: float) -> list[_Piece]:
    """An arc from `first` by `turn` [rad], from the direction `along` to the direction `then`, in parts."""
    across = then - (along @ then) * along
    across = across / np.linalg.norm(across)
    parts = []
    for part in range(_PARTS):
        c, s = np.cos(turn * part / _PARTS), np.sin(turn * part / _PARTS)
        at = first + radius * (s * along + (1.0 - c) * across)
        parts.append(_Piece(radius * turn / _PARTS, at, c * along + s * across, c * across - s * along, radius))
    return parts


def _squares(pieces: Sequence[_Piece], speed: float, acceleration: float) -> list[float]:
    """The squared speeds at the beginnings of pieces and at the end of the last one; the first and the last are 0."""
    most = [min(speed**2, acceleration * piece.radius) for piece in pieces]
    caps = [
        0.0,
        *(0.0 if b.stops else min(one, other) for one, other, b in zip(most, most[1:], pieces[1:], strict=False)),
        0.0,
    ]
    forward = _pass(pieces, caps, acceleration)
    return _pass(pieces[::-1], forward[::-1], acceleration)[::-1]


def _pass(pieces: Sequence[_Piece], caps: Sequence[float], acceleration: float) -> list[float]:
    """The squared speeds, at most `caps`, that can be reached by accelerating from the previous ones."""
    squares = [caps[0]]
    for piece, cap in zip(pieces, caps[1:], strict=True):
        squares.append(min(cap, squares[-1] + 2.0 * piece.length * _gain(squares[-1], piece, acceleration)))
    return squares


def _gain(square: float, piece: _Piece, acceleration: float) -> float:
    """The tangential acceleration [m/s2] of a piece that keeps the total acceleration within its limit up to the piece's end."""
    if piece.radius == inf:
        return acceleration
    across, grows = square / piece.radius, 2.0 * piece.length / piece.radius
    left = acceleration**2 - across**2  # g^2 + (across + grows g)^2 = acceleration^2 where it ends
    if left <= 0.0:
        return 0.0
    a, b = 1.0 + grows**2, across * grows
    return (sqrt(b**2 + a * left) - b) / a


def _ticks(pieces: Sequence[_Piece], squares: Sequence[float], speed: float, acceleration: float) -> Array:
    """The path length [m] after each physics step."""
    begun, way = [0.0], [0.0]
    speeds, gains = list[float](), list[float]()

    def goes(length: float, before: float, after: float) -> None:
        if length > 0.0:
            speeds.append(sqrt(before))
            gains.append((after - before) / (2.0 * length))
            begun.append(begun[-1] + 2.0 * length / (sqrt(before) + sqrt(after)))
            way.append(way[-1] + length)

    for piece, before, after in zip(pieces, squares, squares[1:], strict=False):
        if piece.radius < inf:
            goes(piece.length, before, after)
            continue
        top = min(max(speed**2, before, after), (before + after) / 2.0 + acceleration * piece.length)
        up, down = (max(0.0, top - square) / (2.0 * acceleration) for square in (before, after))
        goes(up, before, top)
        goes(piece.length - up - down, top, top)
        goes(down, top, after)
    end = begun[-1]
    t = np.minimum(np.arange(1, ceil(end / TIME_STEP - 1e-9) + 1) * TIME_STEP, end)
    at = np.clip(np.searchsorted(begun, t, side="right") - 1, 0, len(speeds) - 1)
    since = t - np.array(begun)[at]
    went = np.array(way)[at] + np.array(speeds)[at] * since + np.array(gains)[at] * since**2 / 2.0
    return np.asarray(np.minimum(went, np.array(way)[at + 1]))
