"""A grid world as bodies: a board (two axes) or a room (three) with obstacles, start, goal, a path and the axes' names."""

from collections.abc import Sequence
from itertools import pairwise
from math import radians
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import ArrayLike

from lab.lazy import trimesh
from lab.mdp import FloatArray
from lab.sim.frames import IDENTITY, Body, Frame, Quaternion, Recording, Rgba, Shape, Vector, Viewpoint
from lab.tasks.grid_world import GridWorld
from lab.view.scene_data import camera_for, corners, vector

WORLD_M = 2.0  # [m] longest side of a drawn world
MOST_BOXES = 400  # obstacles up to which each is a box of its own; more become one mesh
MOST_OBSTACLES = {2: 6000, 3: 1500}  # largest number drawn, by the world's number of axes
MOST_LINES = 25  # on the ground along one side
BALL_M = 0.03  # [m] least radius of the robot, which is larger than its cell in a world of many cells
FLAT = 0.04  # thickness of lines and marks on the ground, as a share of a cell's edge
BLUE: Rgba = (0.16, 0.38, 0.78, 1.0)
GREEN: Rgba = (0.16, 0.62, 0.30, 0.5)
GREY: Rgba = (0.45, 0.50, 0.58, 0.5)
GROUND: Rgba = (0.93, 0.93, 0.92, 1.0)
LINE: Rgba = (0.76, 0.77, 0.79, 1.0)
EDGE: Rgba = (0.50, 0.53, 0.58, 0.45)
WOOD: Rgba = (0.72, 0.53, 0.33, 1.0)
GLASS: Rgba = (0.72, 0.53, 0.33, 0.62)  # of obstacles in a room, which must not hide the robot
HAZE: Rgba = (0.72, 0.53, 0.33, 0.25)  # of many obstacles
VIEW: Rgba = (0.95, 0.75, 0.20, 0.14)
INK: Rgba = (0.25, 0.29, 0.34, 1.0)
_FULL = 0.9  # width of a box that fills a cell, as a share of the cell's edge
_LOW = 0.5  # its height on a board, as a share of its width
_TUBE, _TUBE_M = 0.14, 0.008  # radius of a path: as a share of a cell's edge, and at least [m]
_LETTER, _LETTER_M = 0.6, 0.12  # height of an axis's name: as a share of a cell's edge, and at least [m]
_SIGNS = ((-1, -1), (-1, 1), (1, -1), (1, 1))
_HALF = 0.5**0.5
_ALONG: tuple[Quaternion, ...] = (
    (0.0, _HALF, 0.0, _HALF),
    (_HALF, 0.0, 0.0, _HALF),
    (0.0, 0.0, 0.0, 1.0),
)  # z to x, y, z


class WorldBodies:
    """A world around the origin on z = 0, with WORLD_M as its longest side; it must be closed, because its mesh is a file."""

    def __init__(self, world: GridWorld) -> None:
        """Of more than MOST_OBSTACLES obstacles, those nearest to the shortest paths are drawn; `drawn`: their number."""
        self._world = world
        self.size = WORLD_M / max(world.shape)
        self.flat = len(world.shape) == 2
        self.drawn = min(len(world.obstacles), MOST_OBSTACLES[len(world.shape)])
        self._folder = TemporaryDirectory(prefix="lab-world-")
        self.bodies = (*self._ground(), *self._room(), *self._obstacles(), *self._ends())

    def centres(self, cells: ArrayLike) -> FloatArray:
        """The centres (n, 3) [m] of cells (n, axes)."""
        at = np.asarray(cells, dtype=np.float64).reshape(-1, len(self._world.shape))
        at = at - (np.array(self._world.shape) - 1) / 2
        if self.flat:  # rows run down, columns to the right
            at = np.stack([at[:, 1], -at[:, 0], np.zeros(len(at))], axis=1)
        else:
            at[:, 2] += (self._world.shape[2] - 1) / 2
        return np.asarray((at + np.array([0.0, 0.0, 0.5])) * self.size)

    def camera(self, around_m: float = 0.0) -> Viewpoint:
        """A camera in front of the world with `around_m` [m] of margin: steeply above a board, from the right into a room."""
        x, y, z = self._extent
        seen = corners((-x / 2 - around_m, -y / 2 - around_m, 0.0), (x / 2 + around_m, y / 2 + around_m, z))
        return camera_for(seen, -radians(90.0 if self.flat else 75.0), radians(62.0 if self.flat else 30.0))

    def still(self, way: Sequence[tuple[int, ...]]) -> Recording:
        """A still recording of the world, with a path through it, the region that an advisor sees, and the axes' names."""
        bodies = (*self.bodies, *self._way(way), *self._region(), *self._axes())
        frame = Frame(0.0, {body.name: IDENTITY for body in bodies})
        return Recording(bodies, [frame], self.camera(1.5 * self._letter))

    def _way(self, cells: Sequence[tuple[int, ...]]) -> tuple[Body, ...]:
        """A tube through the centres of consecutive cells; no body for fewer than two cells."""
        if len(cells) < 2:
            return ()
        radius = max(_TUBE * self.size, _TUBE_M)
        steps = np.diff(cells, axis=0)
        turns = np.flatnonzero(np.any(steps[1:] != steps[:-1], axis=1)) + 1
        points = self.centres([cells[at] for at in (0, *turns.tolist(), len(cells) - 1)])
        shapes = [Shape("sphere", (radius,), None, BLUE, vector(point)) for point in points[1:-1]]
        shapes += [Shape("sphere", (1.8 * radius,), None, BLUE, vector(points[0]))]
        for one, other in pairwise(points):
            axis, length = int(np.argmax(abs(other - one))), float(abs(other - one).max())
            middle = vector((one + other) / 2)
            shapes.append(Shape("cylinder", (radius, length), None, BLUE, middle, _ALONG[axis]))
        return (Body("shortest path", tuple(shapes)),)

    def _region(self) -> tuple[Body, ...]:
        """A transparent box around the region in which an advisor with a limited view sees the robot; no body without one."""
        if self._world.view is None:
            return ()
        ends = self.centres([self._world.view.lower, self._world.view.upper])
        edges = vector(abs(ends[1] - ends[0]) + self.size * (1.0 if not self.flat else np.array([1.0, 1.0, _LOW])))
        return (Body("limited view", (Shape("box", edges, None, VIEW, vector(ends.mean(axis=0))),)),)

    def _axes(self) -> tuple[Body, ...]:
        """The axes' names, each at the far end of an edge along its axis."""
        x, y, z = self._extent
        high, low = self._letter, self._letter / 2
        ends: dict[str, Vector] = {"x": (x / 2, -y / 2 - high, low), "y": (x / 2 + high, y / 2, low)}
        ends["z"] = (-x / 2 - high, -y / 2, z)
        if self.flat:
            ends = {"column": (x / 2 - high, -y / 2 - high, low), "row": (-x / 2 - 1.2 * high, -y / 2 + high, low)}
        shapes = (Shape("label", (high,), None, INK, at, text=name) for name, at in ends.items())
        return (Body("axes", tuple(shapes)),)

    @property
    def _extent(self) -> Vector:
        """The world's lengths along x, y, z [m]."""
        shape = self._world.shape
        return vector(np.array([shape[1], shape[0], 1] if self.flat else shape) * self.size)

    @property
    def _box(self) -> Vector:
        """The edges [m] of a box that fills a cell; low on a board, where it must not hide what is behind it."""
        edge = _FULL * self.size
        return (edge, edge, edge * (_LOW if self.flat else 1.0))

    @property
    def _letter(self) -> float:
        """The height of the axes' names [m]."""
        return max(_LETTER * self.size, _LETTER_M)

    def _ground(self) -> tuple[Body, ...]:
        """A plate with lines between the cells."""
        (x, y, _), size = self._extent, self.size
        thick, wide = 0.1 * size, FLAT * size
        shapes = [Shape("box", (x + size / 4, y + size / 4, thick), None, GROUND, (0.0, 0.0, -thick / 2 - wide / 2))]
        for along, length in ((0, x), (1, y)):
            cells = round(length / size)
            for number in range(0, cells + 1, -(-cells // MOST_LINES)):
                at = number * size - length / 2
                edges = (wide, y, wide) if along == 0 else (x, wide, wide)
                shapes.append(
                    Shape("box", edges, None, LINE, (at, 0.0, -wide / 2) if along == 0 else (0.0, at, -wide / 2))
                )
        return (Body("ground", tuple(shapes)),)

    def _room(self) -> tuple[Body, ...]:
        """The other edges of a room, by which the heights of its obstacles are judged."""
        if self.flat:
            return ()
        (x, y, z), wide = self._extent, FLAT * self.size
        edges = [Shape("box", (wide, wide, z), None, EDGE, (a * x / 2, b * y / 2, z / 2)) for a, b in _SIGNS]
        edges += [Shape("box", (x, wide, wide), None, EDGE, (0.0, b * y / 2, z)) for b in (-1, 1)]
        edges += [Shape("box", (wide, y, wide), None, EDGE, (a * x / 2, 0.0, z)) for a in (-1, 1)]
        return (Body("room", tuple(edges)),)

    def _obstacles(self) -> tuple[Body, ...]:
        """The obstacles as boxes of one body, or as one mesh when there are many."""
        cells = np.array(self._world.obstacles)
        if not len(cells):
            return ()
        if len(cells) > self.drawn:
            ends = np.array([self._world.start, self._world.goal])
            detour = np.abs(cells[:, None] - ends).sum(axis=(1, 2))  # moves from start to goal by way of the obstacle
            cells = cells[np.argsort(detour, kind="stable")[: self.drawn]]
        centres = self.centres(cells)
        centres[:, 2] += (self._box[2] - _FULL * self.size) / 2
        if len(cells) > MOST_BOXES:
            return (Body("obstacles", (Shape("mesh", (), self._mesh(centres), WOOD if self.flat else HAZE),)),)
        rgba = WOOD if self.flat else GLASS
        return (Body("obstacles", tuple(Shape("box", self._box, None, rgba, vector(at)) for at in centres)),)

    def _mesh(self, centres: FloatArray) -> Path:
        """A mesh file with all boxes, because thousands of separate bodies would make the page slow."""
        path = Path(self._folder.name) / "obstacles.stl"
        boxes = trimesh.voxel.ops.multibox(centres / self._box, pitch=1.0)  # type: ignore[no-untyped-call]
        boxes.apply_scale(self._box)
        boxes.export(path)
        return path

    def _ends(self) -> tuple[Body, ...]:
        """A tile at the start, and a transparent box at the goal."""
        start, goal = self.centres([self._world.start, self._world.goal])
        edge, flat = max(_FULL * self.size, 2 * BALL_M), FLAT * self.size
        start[2] += (flat - self.size) / 2
        tile = Shape("box", (edge, edge, flat), None, GREY, vector(start))
        return (Body("start", (tile,)), Body("goal", (Shape("box", (edge, edge, edge), None, GREEN, vector(goal)),)))

    def close(self) -> None:
        """Remove the mesh's file; safe to call again."""
        self._folder.cleanup()
