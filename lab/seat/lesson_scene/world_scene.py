"""The scene of a grid world: the robot is a ball on a board (two axes) or in a room (three)."""

from math import radians
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import ArrayLike

from lab.mdp import FloatArray, TabularMDP
from lab.seat.lesson_scene.camera_placement import camera_for, corners, vector
from lab.seat.lesson_scene.episode_trail import GREEN, STEP_S, EpisodeTrail, upright
from lab.sim.frames import Body, Frame, Rgba, Shape, Vector, Viewpoint
from lab.tasks.grid_world import GridWorld

WORLD_M = 2.0  # [m] the longest side of a drawn world
MOST_BOXES = 400  # obstacles drawn one by one, more of them as one mesh
MOST_OBSTACLES = {2: 6000, 3: 1500}  # that are drawn at all, by the world's axes
MOST_LINES = 25  # on the ground along one side
BLUE: Rgba = (0.16, 0.38, 0.78, 1.0)
SHADE: Rgba = (0.30, 0.36, 0.46, 0.55)
GREY: Rgba = (0.45, 0.50, 0.58, 0.5)
GROUND: Rgba = (0.93, 0.93, 0.92, 1.0)
LINE: Rgba = (0.76, 0.77, 0.79, 1.0)
EDGE: Rgba = (0.50, 0.53, 0.58, 0.45)
WOOD: Rgba = (0.72, 0.53, 0.33, 1.0)
GLASS: Rgba = (0.72, 0.53, 0.33, 0.62)  # in a room, obstacles must not hide the robot
HAZE: Rgba = (0.72, 0.53, 0.33, 0.25)  # many of them neither
_FULL = 0.9  # of a cell's edge: so wide is a box that fills it
_LOW = 0.5  # of that: so high it is on a board
_SIGNS = ((-1, -1), (-1, 1), (1, -1), (1, 1))
_BALL_M = 0.03  # [m] radius at least: in a world of many cells the robot is larger than its cell
_FLAT = 0.04  # of a cell's edge: so thick are lines and marks on the ground


class WorldScene:
    """A world that stands on z = 0 around the origin, its longest side WORLD_M."""

    def __init__(self, world: GridWorld, mdp: TabularMDP) -> None:
        """`mdp` is the world's problem. Of more than MOST_OBSTACLES those nearest to the shortest ways are drawn."""
        self._world, self._mdp, self._frames = world, mdp, 0
        self._size = WORLD_M / max(world.shape)
        self._flat = len(world.shape) == 2
        self._ball = max(0.36 * self._size, _BALL_M)
        self._marks = EpisodeTrail(mdp, self.place, 0.3 * self._ball, 1.6 * self._ball)
        self._folder = TemporaryDirectory(prefix="lab-scene-")  # of the mesh, until the scene is closed
        made = (self._ground(), self._room(), self._obstacles(), self._ends(), self._robot(), self._marks.bodies())
        self.bodies = tuple(body for bodies in made for body in bodies)
        self.camera = self._camera()

    def centres(self, cells: ArrayLike) -> FloatArray:
        """The middles (n, 3) [m] of cells (n, axes)."""
        at = np.asarray(cells, dtype=np.float64).reshape(-1, len(self._world.shape))
        at = at - (np.array(self._world.shape) - 1) / 2
        if self._flat:  # rows run down, columns to the right
            at = np.stack([at[:, 1], -at[:, 0], np.zeros(len(at))], axis=1)
        else:
            at[:, 2] += (self._world.shape[2] - 1) / 2
        return np.asarray((at + np.array([0.0, 0.0, 0.5])) * self._size)

    def place(self, state: int) -> Vector:
        """The middle of a state's cell [m]."""
        return vector(self.centres([self._mdp.state_cell(state)])[0])

    @property
    def _extent(self) -> Vector:
        """The world's edges along x, y, z [m]."""
        shape = self._world.shape
        return vector(np.array([shape[1], shape[0], 1] if self._flat else shape) * self._size)

    @property
    def _box(self) -> Vector:
        """The edges of what fills a cell [m]; low on a board, where it must not hide what is behind it."""
        edge = _FULL * self._size
        return (edge, edge, edge * (_LOW if self._flat else 1.0))

    def _camera(self) -> Viewpoint:
        """From the front: steeply onto a board, a little from the right into a room."""
        x, y, z = self._extent
        seen = corners((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z))
        return camera_for(seen, -radians(90.0 if self._flat else 75.0), radians(62.0 if self._flat else 30.0))

    def _ground(self) -> tuple[Body, ...]:
        """A plate with lines between the cells."""
        (x, y, _), size = self._extent, self._size
        thick, wide = 0.1 * size, _FLAT * size
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
        """The other edges of a room: it is clear then how far up its obstacles are."""
        if self._flat:
            return ()
        (x, y, z), wide = self._extent, _FLAT * self._size
        edges = [Shape("box", (wide, wide, z), None, EDGE, (a * x / 2, b * y / 2, z / 2)) for a, b in _SIGNS]
        edges += [Shape("box", (x, wide, wide), None, EDGE, (0.0, b * y / 2, z)) for b in (-1, 1)]
        edges += [Shape("box", (wide, y, wide), None, EDGE, (a * x / 2, 0.0, z)) for a in (-1, 1)]
        return (Body("room", tuple(edges)),)

    def _obstacles(self) -> tuple[Body, ...]:
        """The obstacles as boxes of one body, or as one mesh when there are many."""
        cells = np.array(self._world.obstacles)
        if not len(cells):
            return ()
        most = MOST_OBSTACLES[len(self._world.shape)]
        if len(cells) > most:
            ends = np.array([self._world.start, self._world.goal])
            detour = np.abs(cells[:, None] - ends).sum(axis=(1, 2))  # moves from start to goal by way of the obstacle
            cells = cells[np.argsort(detour, kind="stable")[:most]]
        centres = self.centres(cells)
        centres[:, 2] += (self._box[2] - _FULL * self._size) / 2
        if len(cells) > MOST_BOXES:
            return (Body("obstacles", (Shape("mesh", (), self._mesh(centres), WOOD if self._flat else HAZE),)),)
        rgba = WOOD if self._flat else GLASS
        return (Body("obstacles", tuple(Shape("box", self._box, None, rgba, vector(at)) for at in centres)),)

    def _mesh(self, centres: FloatArray) -> Path:
        """A file of boxes: thousands of bodies, each drawn by itself, would make the page slow."""
        from trimesh.voxel.ops import multibox

        path = Path(self._folder.name) / "obstacles.stl"
        boxes = multibox(centres / self._box, pitch=1.0)  # type: ignore[no-untyped-call]
        boxes.apply_scale(self._box)
        boxes.export(path)
        return path

    def _ends(self) -> tuple[Body, ...]:
        """A tile at the start, a glassy box at the goal."""
        start, goal = self.centres([self._world.start, self._world.goal])
        edge, flat = max(_FULL * self._size, 2 * _BALL_M), _FLAT * self._size
        start[2] += (flat - self._size) / 2
        tile = Shape("box", (edge, edge, flat), None, GREY, vector(start))
        return (Body("start", (tile,)), Body("goal", (Shape("box", (edge, edge, edge), None, GREEN, vector(goal)),)))

    def _robot(self) -> tuple[Body, ...]:
        """A ball, and in a room a disc on the ground below it, which tells how far back it is."""
        ball = Body("robot", (Shape("sphere", (self._ball,), None, BLUE),))
        if self._flat:
            return (ball,)
        return (ball, Body("below", (Shape("cylinder", (self._ball, _FLAT * self._size), None, SHADE),)))

    def frame(self, state: int) -> Frame:
        """The robot in the cell of `state`."""
        poses, visible = self._marks.at(state)
        x, y, z = self.place(state)
        poses["robot"] = upright((x, y, z))
        if not self._flat:
            poses["below"] = upright((x, y, _FLAT * self._size))
        self._frames += 1
        return Frame(self._frames * STEP_S, poses, {}, visible)

    def close(self) -> None:
        """Remove the mesh's file."""
        self._folder.cleanup()
