"""Plain records of a cell seen from above: what stands where, what the arm reaches, which cells are blocked and by what.

Knows no simulator and no plot: `lab/skills/cell_outline.py` fills these, `lab/view/cell_plan.py` draws them. Metres, radians.
"""

from dataclasses import dataclass
from math import cos, sin
from typing import Literal

import numpy as np
from numpy.typing import NDArray

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
    """Where an arm's tool can be at one height: so far from its axis, and turned so far from ahead, clockwise and counter."""

    nearest_m: float
    farthest_m: float
    right_rad: float
    left_rad: float


@dataclass(frozen=True)
class PlannedSpot:
    """Where a part may stand; `used`: parts of this order do, `reached`: the arm can take it there."""

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
    """An obstacle where the seed has put it, and the rectangle that its whole body stays in, wherever a seed puts it."""

    name: str
    stands: Block
    stays_in: Block

    @property
    def moves(self) -> bool:
        """Whether another seed may put it elsewhere."""
        return bool(np.any(np.ptp(self.stays_in.corners(), axis=0) > np.ptp(self.stands.corners(), axis=0) + 1e-9))


@dataclass(frozen=True)
class BlockedCells:
    """A grid's cells (columns along x, rows along y) with what blocks each at its lowest level, '' where it is free."""

    origin: XY
    cell: XY
    causes: NDArray[np.str_]


@dataclass(frozen=True)
class CameraCells:
    """The grid that an overhead camera looks at, and where the tool comes to be before it goes through it."""

    origin: XY
    cell: float
    shape: tuple[int, int]
    start: XY


@dataclass(frozen=True)
class Approach:
    """Where a transfer to a station ends, and the middle of the cell that it comes from; None: there is no such cell."""

    station: str
    at: XY
    dock: XY | None


@dataclass(frozen=True)
class GroundPlan:
    """A cell from above, as far as it is known; `fault` says what is wrong with it, `at_fault` names what that is about."""

    title: str
    table: Block
    reach: Ring | None = None
    height_m: float = 0.0  # of the finger tips, where the reach is shown
    stations: tuple[PlannedStation, ...] = ()
    obstacles: tuple[PlannedObstacle, ...] = ()
    blocked: BlockedCells | None = None
    cameras: tuple[CameraCells, ...] = ()
    approaches: tuple[Approach, ...] = ()
    fault: str = ""
    at_fault: frozenset[str] = frozenset()
