"""Plain records of a cell seen from above: its bodies, the arm's reach, and the blocked cells with their causes.

Knows no simulator and no plot: `lab/skills/cell_outline.py` fills these, `lab/view/cell_plan.py` draws them. Metres, radians.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lab.sim.arms.kinematics import ToolPose

XY = tuple[float, float]


@dataclass(frozen=True)
class Block:
    """A rectangle on the table: its middle, its length along its own x axis and its width, turned by yaw."""

    x: float
    y: float
    length: float
    width: float
    yaw: float = 0.0

    def corners(self) -> NDArray[np.float64]:
        """The four corners (4, 2), counter-clockwise."""
        along, across = np.array([cos(self.yaw), sin(self.yaw)]), np.array([-sin(self.yaw), cos(self.yaw)])
        signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
        off = signs[:, :1] * self.length * along + signs[:, 1:] * self.width * across
        return np.asarray(np.add(off, (self.x, self.y)), dtype=np.float64)


@dataclass(frozen=True)
class Ring:
    """The reach of an arm's tool at one height: distances from the arm's axis, and turns to both sides."""

    nearest_m: float
    farthest_m: float
    right_rad: float
    left_rad: float


@dataclass(frozen=True)
class PlannedSpot:
    """A spot for a part; used: a part of this order stands there; reached: the arm can take it there."""

    block: Block
    used: bool = True
    reached: bool = True


@dataclass(frozen=True)
class PlannedStation:
    """A station's body and the spots for parts at it."""

    name: str
    kind: Literal["storage", "buffer", "machine"]
    body: Block
    spots: tuple[PlannedSpot, ...]


@dataclass(frozen=True)
class PlannedObstacle:
    """An obstacle at the place drawn from the seed, and the rectangle that contains its body for every seed."""

    name: str
    stands: Block
    stays_in: Block

    @property
    def moves(self) -> bool:
        """Whether another seed may place it elsewhere."""
        return bool(np.any(np.ptp(self.stays_in.corners(), axis=0) > np.ptp(self.stands.corners(), axis=0) + 1e-9))


@dataclass(frozen=True)
class BlockedCells:
    """A grid's cells (columns along x, rows along y) with what blocks each at its lowest level, '' where it is free."""

    origin: XY
    cell: XY
    causes: NDArray[np.str_]


@dataclass(frozen=True)
class CameraCells:
    """The grid that an overhead camera looks at, and the tool's position before it enters the grid."""

    origin: XY
    cell: float
    shape: tuple[int, int]
    start: XY


@dataclass(frozen=True)
class Approach:
    """The end of a transfer to a station, and the middle of the last cell before it; None without such a cell."""

    station: str
    at: XY
    dock: XY | None


@dataclass(frozen=True)
class GroundPlan:
    """A cell from above, as far as it is known; fault: its error in words; at_fault: the names that the error is about."""

    title: str
    table: Block
    reach: Ring | None = None
    height_m: float = 0.0  # height of the finger tips for which the reach is shown
    stations: tuple[PlannedStation, ...] = ()
    obstacles: tuple[PlannedObstacle, ...] = ()
    blocked: BlockedCells | None = None
    cameras: tuple[CameraCells, ...] = ()
    approaches: tuple[Approach, ...] = ()
    fault: str = ""
    at_fault: frozenset[str] = frozenset()


# ---- The reach of an arm ----------------------------------------------------------------------------------------------


Inverse = Callable[[ToolPose], NDArray[np.float64] | None]

MOST_M = 2.5  # upper limit of the reach of an arm on a table
STEP_M, STEP_RAD = 0.04, pi / 18
HALVINGS = 8  # bisections of a step: the ring's edges are exact to 0.2 mm and 0.04 degrees


def ring_of(inverse: Inverse, height_m: float, nearest_m: float = 0.0) -> Ring | None:
    """The ring around the arm's axis that a vertical tool reaches at a height; None if it reaches nothing.

    nearest_m: the least distance of the tool from the arm's axis. The distances are searched straight ahead, the turns in the
    ring's middle; of several rings the widest is returned.
    """

    def ahead(far: float) -> bool:
        return far >= nearest_m and inverse(ToolPose(far, 0.0, height_m)) is not None

    steps = [far for far in np.arange(0.0, MOST_M, STEP_M).tolist() if ahead(far)]
    runs = np.split(np.array(steps), np.flatnonzero(np.diff(steps) > 1.5 * STEP_M) + 1)
    widest = max(runs, key=len)
    if not len(widest):
        return None
    first, last = float(widest[0]), float(widest[-1])
    nearest, farthest = _edge(ahead, first, first - STEP_M), _edge(ahead, last, last + STEP_M)
    middle = (first + last) / 2

    def turned(angle: float) -> bool:
        return inverse(ToolPose(middle * cos(angle), middle * sin(angle), height_m, angle)) is not None

    right, left = (_turn(lambda angle, way=way: turned(way * angle)) for way in (-1, 1))  # type: ignore[misc]
    return Ring(nearest, farthest, right, left)


def _turn(turned: Callable[[float], bool]) -> float:
    for angle in np.arange(STEP_RAD, pi + STEP_RAD / 2, STEP_RAD).tolist():
        if not turned(angle):
            return _edge(turned, angle - STEP_RAD, angle)
    return pi


def _edge(holds: Callable[[float], bool], inside: float, outside: float) -> float:
    """The boundary of `holds` between a value for which it is true and one for which it is false, on the true side."""
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside
