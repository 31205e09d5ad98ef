"""A floor for any schedule: positions and looks of stations, and the paths of vehicles or an arm between them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, cos, hypot, pi, radians, sin, sqrt
from typing import Protocol

import numpy as np

from lab.mdp import FloatArray
from lab.sim.frames import Body, Pose, Rgba, Shape, Vector

PART_M, PITCH_M = 0.13, 0.16  # [m] a part's edge, and the distance between places of parts
WIDE_M, DEEP_M, HIGH_M = 0.72, 0.56, 0.34  # [m] a station's table
ACROSS_M, DOWN_M = 1.25, 1.5  # [m] distance between stations in a row, and between rows
COLUMNS = 4  # of parts that wait at a station's front edge; further parts are stacked
TILE_M = 0.02
CARRIER_M = 0.26  # [m] height of a vehicle
OPENING = radians(80.0)  # of the ring of stations around an arm, towards the viewer
HAND_M, LIFT_M = 1.05, 0.22  # [m] height of the arm's links, and by how much it lifts parts
PAPER: Rgba = (0.91, 0.92, 0.93, 1.0)
STEEL: Rgba = (0.62, 0.66, 0.71, 1.0)
PANEL: Rgba = (0.74, 0.78, 0.83, 1.0)
DARK: Rgba = (0.30, 0.34, 0.39, 1.0)
IDLE: Rgba = (0.55, 0.58, 0.62, 1.0)
WORKS: Rgba = (0.16, 0.72, 0.36, 1.0)
BLUE: Rgba = (0.16, 0.38, 0.78, 1.0)
INK: Rgba = (0.20, 0.24, 0.29, 1.0)


@dataclass(frozen=True)
class FloorSpot:
    """A station: its middle on the floor [m], its rotation [rad] (0: its front faces the viewer at -y), and its kind.

    kind: "machine", "store" (a table), or "tile" (a place on the floor for `parts` parts).
    """

    name: str
    x: float
    y: float
    turn: float = 0.0
    kind: str = "machine"
    parts: int = 1

    @property
    def columns(self) -> int:
        """The number of parts side by side on a tile."""
        return max(2, ceil(sqrt(self.parts)))

    @property
    def edges(self) -> tuple[float, float]:
        """Its width and depth [m]."""
        edge = self.columns * PITCH_M + 0.08
        return (edge, edge) if self.kind == "tile" else (WIDE_M, DEEP_M)

    def at(self, x: float, y: float, z: float) -> Vector:
        """The floor's coordinates [m] of a point in the station's frame."""
        c, s = cos(self.turn), sin(self.turn)
        return (self.x + c * x - s * y, self.y + s * x + c * y, z)

    def place(self, number: int, works: bool) -> Vector:
        """The middle [m] of the `number`th place for parts: in the row where they are processed, or in front, where they wait."""
        if self.kind == "tile":
            row, column = divmod(number, self.columns)
            middle = (self.columns - 1) / 2
            return self.at((column - middle) * PITCH_M, (middle - row) * PITCH_M, TILE_M + PART_M / 2)
        if works or self.kind == "store":
            level, number = divmod(number, COLUMNS)
            aside = (number + 1) // 2 * (1 if number % 2 else -1) * PITCH_M
            return self.at(aside, 0.02, HIGH_M + PART_M * (level + 0.5))
        level, column = divmod(number, COLUMNS)
        return self.at((column - (COLUMNS - 1) / 2) * PITCH_M, -0.19, HIGH_M + PART_M * (level + 0.5))

    def bodies(self, number: int) -> tuple[Body, ...]:
        """The visible bodies in the station's frame, a machine's lamp among them."""
        wide, deep = self.edges
        if self.kind == "tile":
            tile = Shape("box", (wide, deep, TILE_M), None, PAPER, (0.0, 0.0, TILE_M / 2))
            name = Shape("label", (0.13,), None, INK, (0.0, -deep / 2 - 0.1, 0.06), text=self.name)
            return (Body(f"station {number}", (tile, name)),)
        shapes = [
            Shape("box", (wide - 0.06, deep - 0.06, HIGH_M - 0.04), None, STEEL, (0.0, 0.0, HIGH_M / 2 - 0.02)),
            Shape("box", (wide, deep, 0.04), None, PAPER, (0.0, 0.0, HIGH_M - 0.02)),
        ]
        back = deep / 2 - 0.04
        panel = 0.0 if self.kind != "machine" else 0.34 if cos(self.turn) > 0 else 0.1  # it must not hide the part
        if panel:
            shapes.append(Shape("box", (wide, 0.08, panel), None, PANEL, (0.0, back, HIGH_M + panel / 2)))
        high = HIGH_M + panel + 0.17
        below = (-0.58 * sin(self.turn), -0.58 * cos(self.turn), 0.06)  # on the floor, towards the viewer
        over = (0.0, back, high)
        shapes.append(Shape("label", (0.15,), None, INK, over if cos(self.turn) > 0 else below, text=self.name))
        station = Body(f"station {number}", tuple(shapes))
        if not panel:
            return (station,)
        lamp = Shape("sphere", (0.05,), None, IDLE, (wide / 2 - 0.08, back, HIGH_M + panel + 0.03))
        return station, Body(f"lamp {number}", (lamp,))

    @property
    def pose(self) -> Pose:
        """The pose of its bodies."""
        return (self.x, self.y, 0.0, 0.0, 0.0, sin(self.turn / 2), cos(self.turn / 2))


def laid_out(
    kinds: Mapping[str, str], places_m: Mapping[str, tuple[float, float]], parts: int, around: bool, wide: float
) -> dict[str, FloorSpot]:
    """A spot for each station, by name: at its given place, on a ring around an arm, or in rows from the back.

    places_m are scaled so that no two stations overlap; stations without a place stand in a row in front. parts: their
    number. wide: approximate ratio of the floor's width to its depth.
    """
    names = [name for name, kind in kinds.items() if kind != "tile"]
    said = {name: places_m[name] for name in names if name in places_m}
    tile = FloorSpot("", 0.0, 0.0, 0.0, "tile", parts).edges[0]
    at: dict[str, tuple[float, float, float]] = {}
    if said:
        xy = np.array(list(said.values()))
        apart = [hypot(*(one - other)) for k, one in enumerate(xy) for other in xy[:k]]
        scale = 1.1 / least if (least := min((d for d in apart if d > 0), default=1.1)) else 1.0
        xy = (xy - (xy.min(axis=0) + xy.max(axis=0)) / 2) * scale
        at = {name: (x, y, 0.0) for name, (x, y) in zip(said, xy.tolist(), strict=True)}
    elif around:
        step = (2 * pi - OPENING) / len(names)
        radius = max(0.95, 0.98 / step)
        for number, name in enumerate(names):
            angle = -pi / 2 - OPENING / 2 - (number + 0.5) * step  # from the left of the opening, clockwise
            at[name] = (radius * cos(angle), radius * sin(angle), angle - pi / 2)
    rest = [name for name in names if name not in at]
    columns = ceil(sqrt(wide * len(rest)))
    front = min((y for _, y, _ in at.values()), default=DOWN_M) - DOWN_M
    for number, name in enumerate(rest):
        row, column = divmod(number, columns)
        full = min(columns, len(rest) - row * columns)
        at[name] = ((column - (full - 1) / 2) * ACROSS_M, front - row * DOWN_M, 0.0)
    left, right = (side(x for x, _, _ in at.values()) for side in (min, max))
    middle = sum(side(y for _, y, _ in at.values()) for side in (min, max)) / 2
    aside = WIDE_M / 2 + tile / 2 + 0.55
    spots = {name: FloorSpot(name, *at[name], kinds[name], parts) for name in names}
    for name, x in (("start", left - aside), ("finished", right + aside)):
        if kinds.get(name) == "tile":
            spots[name] = FloorSpot(name, x, middle, 0.0, "tile", parts)
    return spots


class Carrier(Protocol):
    """A carrier of parts: its bodies, and its path from one stop to another."""

    bodies: tuple[Body, ...]
    handling: float  # share of a transport's time for grasping a part; setting it down takes as long

    def way(self, start: "CarrierStop", end: "CarrierStop") -> FloatArray:
        """The points (n, 4) of its hand: the share of the time, 0 to 1, and x, y, z [m]."""

    def poses(self, hands: FloatArray) -> dict[str, FloatArray]:
        """The poses (n, 7) of its bodies, by name, for points (n, 3) of its hand."""


@dataclass(frozen=True)
class CarrierStop:
    """A stop of a carrier: the station, and the point of its hand, the middle of a part [m]."""

    spot: FloorSpot
    hand: Vector


class Vehicle:
    """A vehicle that drives in the aisles in front of stations; its hand is the middle of the part on it."""

    handling = 0.12

    def __init__(self, number: int, name: str, of: int, straight: bool) -> None:
        """The `number`th of `of` vehicles; straight: it drives directly, without aisles."""
        self.name, self._straight = f"vehicle {number}", straight
        self._aside = (number - (of - 1) / 2) * min(0.48, 1.2 / of)
        wheel = Shape("box", (0.07, 0.05, 0.07), None, DARK)
        wheels = [Shape(wheel.kind, wheel.size, None, DARK, (x, y, 0.035)) for x in (-0.1, 0.1) for y in (-0.13, 0.13)]
        deck = Shape("box", (0.32, 0.26, CARRIER_M - 0.05), None, BLUE, (0.0, 0.0, CARRIER_M / 2 + 0.025))
        label = Shape("label", (0.11,), None, INK, (0.0, -0.28, 0.02), text=name)
        self.bodies: tuple[Body, ...] = (Body(self.name, (deck, *wheels, label)),)

    def dock(self, spot: FloorSpot) -> Vector:
        """The middle [m] of a part on the vehicle when it stands in front of a station."""
        front = -spot.edges[1] / 2 - 0.28
        return spot.at(self._aside, front, CARRIER_M + PART_M / 2)

    def way(self, start: CarrierStop, end: CarrierStop) -> FloatArray:
        """The path along the aisle, across between two stations, and along the other aisle; see `Carrier.way`."""
        one, other = np.array(self.dock(start.spot)), np.array(self.dock(end.spot))
        points = [one, other]
        if not self._straight and abs(one[1] - other[1]) > 0.3:
            across = start.spot.x + (ACROSS_M / 2 if other[0] >= one[0] else -ACROSS_M / 2)
            points = [one, np.array([across, *one[1:]]), np.array([across, *other[1:]]), other]
        return _paced(points)

    def poses(self, hands: FloatArray) -> dict[str, FloatArray]:
        """The vehicle's poses (n, 7), below the part."""
        poses = np.zeros((len(hands), 7))
        poses[:, :2], poses[:, 6] = hands[:, :2], 1.0
        return {self.name: poses}


class PlanarArm:
    """An arm in the middle of the floor: two links that turn in a plane, and a tool that moves up and down."""

    handling = 0.0

    def __init__(self, name: str, spots: Sequence[FloorSpot]) -> None:
        reach = max((hypot(spot.x, spot.y) + 0.3 for spot in spots), default=1.0)
        self._link = max(0.55 * reach, 0.4)
        link, high = self._link, HAND_M
        column = [
            Shape("cylinder", (0.16, 0.06), None, DARK, (0.0, 0.0, 0.03)),
            Shape("cylinder", (0.09, high), None, STEEL, (0.0, 0.0, high / 2)),
            Shape("label", (0.13,), None, INK, (0.0, -0.34, 0.02), text=name),
        ]
        upper = Shape("box", (link + 0.12, 0.12, 0.1), None, BLUE, (link / 2, 0.0, high + 0.05))
        fore = Shape("box", (link + 0.1, 0.1, 0.08), None, BLUE, (link / 2, 0.0, high + 0.14))
        joint = Shape("cylinder", (0.08, 0.2), None, DARK, (0.0, 0.0, high + 0.1))
        rod = 0.75
        tool = [
            Shape("cylinder", (0.025, rod), None, STEEL, (0.0, 0.0, PART_M / 2 + 0.04 + rod / 2)),
            Shape("cylinder", (0.06, 0.04), None, DARK, (0.0, 0.0, PART_M / 2 + 0.02)),
        ]
        self.bodies: tuple[Body, ...] = (
            Body("arm", tuple(column)),
            Body("upper link", (upper, joint)),
            Body("fore link", (fore, joint)),
            Body("tool", tuple(tool)),
        )

    def way(self, start: CarrierStop, end: CarrierStop) -> FloatArray:
        """The path up, around the middle, and down; see `Carrier.way`."""
        share = np.linspace(0.0, 1.0, 25)
        over = np.clip((share - 0.12) / 0.76, 0.0, 1.0)
        over = over * over * (3 - 2 * over)
        (x1, y1, z1), (x2, y2, z2) = start.hand, end.hand
        first, last = np.arctan2(y1, x1), np.arctan2(y2, x2)
        turn = (last - first + pi) % (2 * pi) - pi
        angle = first + turn * over
        radius = hypot(x1, y1) + (hypot(x2, y2) - hypot(x1, y1)) * over
        up = LIFT_M * np.minimum(1.0, np.minimum(share, 1 - share) / 0.12)
        z = z1 + (z2 - z1) * over + up
        return np.stack([share, radius * np.cos(angle), radius * np.sin(angle), z], axis=1)

    def poses(self, hands: FloatArray) -> dict[str, FloatArray]:
        """The links' and the tool's poses (n, 7), with the tool above the hand."""
        radius = np.hypot(hands[:, 0], hands[:, 1])
        bend = np.arccos(np.clip(radius / (2 * self._link), -1.0, 1.0))
        towards = np.arctan2(hands[:, 1], hands[:, 0])
        one, other = towards + bend, towards - bend
        upper, fore, tool = (np.zeros((len(hands), 7)) for _ in range(3))
        for poses, angle in ((upper, one), (fore, other)):
            poses[:, 5], poses[:, 6] = np.sin(angle / 2), np.cos(angle / 2)
        fore[:, 0], fore[:, 1] = self._link * np.cos(one), self._link * np.sin(one)
        tool[:, :3], tool[:, 6] = hands, 1.0
        return {"upper link": upper, "fore link": fore, "tool": tool}


def _paced(points: Sequence[FloatArray]) -> FloatArray:
    """The corners (n, 4) of a path at constant speed: the share of the time, and the point."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    share = np.concatenate([[0.0], np.cumsum(steps)])
    share = share / share[-1] if share[-1] > 0 else np.linspace(0.0, 1.0, len(points))
    return np.column_stack([share, points])
