"""Records of an overhead picture: the camera's view of a grid, the markers in it and the grid that they define.

They connect the camera (`lab/sim`), the picture reader (`markers.py`) and the learner. A marker's pixel is projected along
its ray onto the plane at the marker's own height, so that a tall obstacle is not located beside its true place. Pixels
are (x, y) from the centre of the top left pixel, to the right and down.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import floor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput

Cell = tuple[int, int]
Window = tuple[int, int, int]  # a square part of a picture: its left column, top row and side [pixels]


@dataclass(frozen=True, eq=False)
class View:
    """The mapping between a picture and the grid.

    `pixel_from_world` (3, 4) maps homogeneous world points [m] to homogeneous pixels, the camera's pixel offsets included
    (`lab/sim/camera.py`). The grid has `shape` cells of `cell_m` [m] from the corner `origin_m` on, i along x and j along
    y. By kind of marker: `heights_m` above the world's z = 0, `offsets_m` (dx, dy) from the marker to the object that it
    stands for; 0 for a kind that is missing. `radius_m`: radius of every marker, with which partly hidden ones are found;
    0: unknown.
    Raises BadInput when the matrix is not finite, of another shape or of lower rank, or when the grid is empty.
    """

    pixel_from_world: NDArray[np.float64]
    origin_m: tuple[float, float]
    cell_m: float
    shape: Cell
    heights_m: Mapping[str, float] = field(default_factory=dict)
    offsets_m: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    radius_m: float = 0.0

    def __post_init__(self) -> None:
        matrix = np.asarray(self.pixel_from_world)
        if matrix.shape != (3, 4) or not np.isfinite(matrix).all() or np.linalg.matrix_rank(matrix) < 3:
            raise BadInput(f"view: pixel_from_world of shape {matrix.shape}: wanted (3, 4), finite and of rank 3")
        if min(self.shape) < 1 or not self.cell_m > 0:
            raise BadInput(
                f"view: a grid of {self.shape} cells of {self.cell_m} m: wanted at least (1, 1) and above 0 m"
            )

    def pixel(self, point: ArrayLike) -> NDArray[np.float64]:
        """The pixel (..., 2) of world points (..., 3) [m]."""
        points = np.asarray(point, dtype=np.float64)
        projected = points @ self.pixel_from_world[:, :3].T + self.pixel_from_world[:, 3]
        pixels: NDArray[np.float64] = projected[..., :2] / projected[..., 2:]
        return pixels

    def window(self, place_m: tuple[float, float], kind: str, reach_m: float) -> Window:
        """The window of the picture that shows the marker of an object at most `reach_m` from `place_m` along x and y."""
        (x, y), (dx, dy) = place_m, self.offsets_m.get(kind, (0.0, 0.0))
        at = np.array([x - dx, y - dy, self.heights_m.get(kind, 0.0)])
        far = reach_m + self.radius_m
        corners = self.pixel(at + np.array([[a, b, 0.0] for a in (-far, far) for b in (-far, far)]))
        low = np.floor(corners.min(axis=0)).astype(int) - 1
        side = int(np.ceil(corners.max(axis=0) - low).max()) + 2
        return int(low[0]), int(low[1]), side

    def within(self, window: Window) -> "View":
        """The same view for a picture that is cropped to `window`."""
        shift = np.array([[1.0, 0.0, -window[0]], [0.0, 1.0, -window[1]], [0.0, 0.0, 1.0]])
        return replace(self, pixel_from_world=shift @ self.pixel_from_world)

    def place(self, pixel: ArrayLike, kind: str) -> tuple[float, float]:
        """The world (x, y) [m] of the object whose marker of `kind` is at `pixel`, from the ray at the marker's height."""
        camera = self.pixel_from_world
        pixel_from_plane = camera[:, [0, 1, 3]].copy()  # at z = height a point is (x, y, 1)
        pixel_from_plane[:, 2] += camera[:, 2] * self.heights_m.get(kind, 0.0)
        x, y, w = np.linalg.solve(pixel_from_plane, np.append(np.asarray(pixel, dtype=np.float64), 1.0))
        dx, dy = self.offsets_m.get(kind, (0.0, 0.0))
        return float(x / w) + dx, float(y / w) + dy

    def radius_px(self, pixel: ArrayLike, kind: str) -> float:
        """The radius of a whole marker of `kind` at `pixel` in the picture [pixels], the mean of both axes."""
        dx, dy = self.offsets_m.get(kind, (0.0, 0.0))
        x, y = self.place(pixel, kind)
        r, at = self.radius_m, np.array([x - dx, y - dy, self.heights_m.get(kind, 0.0)])
        rim = self.pixel(at + np.array([[r, 0, 0], [-r, 0, 0], [0, r, 0], [0, -r, 0]]))
        return float(np.linalg.norm(rim[0] - rim[1]) + np.linalg.norm(rim[2] - rim[3])) / 4

    def cell(self, place_m: tuple[float, float]) -> Cell:
        """The cell of a world (x, y) [m]; outside the grid its indices lie outside `shape`."""
        i, j = ((value - start) / self.cell_m for value, start in zip(place_m, self.origin_m, strict=True))
        return floor(i), floor(j)

    def centre(self, cell: Cell) -> tuple[float, float]:
        """The world (x, y) [m] of a cell's middle."""
        i, j = cell
        return self.origin_m[0] + (i + 0.5) * self.cell_m, self.origin_m[1] + (j + 0.5) * self.cell_m

    def holds(self, cell: Cell) -> bool:
        """Whether `cell` lies in the grid."""
        return 0 <= cell[0] < self.shape[0] and 0 <= cell[1] < self.shape[1]

    @cached_property
    def cell_pixels(self) -> float:
        """The mean area of a cell in the picture [pixels], at z = 0."""
        rows, columns = self.shape
        corners = np.array([[0, 0], [rows, 0], [rows, columns], [0, columns]]) * self.cell_m + self.origin_m
        x, y = self.pixel(np.column_stack([corners, np.zeros(4)])).T
        return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2 / (rows * columns)


@dataclass(frozen=True)
class Marker:
    """A round marker in a picture: its sub-pixel centre, and the position [m] and cell of the object it stands for."""

    kind: str
    pixel: tuple[float, float]
    world_m: tuple[float, float]
    cell: Cell


@dataclass(frozen=True, eq=False)
class GridView:
    """The grid read from a picture: start (gripper), goal (toaster) and blocked cells of a grid of `shape`."""

    shape: Cell
    start: Cell
    goal: Cell
    obstacles: tuple[Cell, ...]
    markers: tuple[Marker, ...]
    view: View

    @property
    def goal_marker(self) -> Marker:
        """The marker of the machine in the goal's cell."""
        return next(m for m in self.markers if m.kind == "toaster" and m.cell == self.goal)

    def to_json(self) -> dict[str, Any]:
        """The record for `lab see --json`: '.' free, 'S' start, 'G' goal, '#' an obstacle's marker."""
        rows, columns = self.shape
        cells = [["." for _ in range(columns)] for _ in range(rows)]
        for i, j in self.obstacles:
            cells[i][j] = "#"
        cells[self.start[0]][self.start[1]], cells[self.goal[0]][self.goal[1]] = "S", "G"
        markers = [
            {"kind": m.kind, "pixel": list(m.pixel), "world_m": list(m.world_m), "cell": list(m.cell)}
            for m in self.markers
        ]
        return {
            "grid": ["".join(row) for row in cells],
            "start": list(self.start),
            "goal": list(self.goal),
            "obstacles": [list(cell) for cell in self.obstacles],
            "markers": markers,
        }


def plain_view(picture: tuple[int, int], shape: Cell) -> View:
    """The view of a picture of (height, width) pixels that is itself the grid: row i downwards, column j to the right.

    Such a picture has no scale: a cell counts as 1 m.
    """
    down, right = (pixels / max(cells, 1) for pixels, cells in zip(picture, shape, strict=True))
    return View(
        np.array([[0.0, right, 0.0, -0.5], [down, 0.0, 0.0, -0.5], [0.0, 0.0, 0.0, 1.0]]), (0.0, 0.0), 1.0, shape
    )
