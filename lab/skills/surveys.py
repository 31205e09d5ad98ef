"""What the sub-tasks survey of one scene, each survey made once: the workspace, the surroundings of a station, the picture."""

from functools import cache
from math import hypot

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.sim import models
from lab.sim.blocked_cells import OUT_OF_REACH, Survey, Surveyor
from lab.sim.camera import Camera
from lab.sim.kinematics import ToolPose
from lab.sim.scene import (
    COLUMN_M,
    MARKER_ABOVE,
    ROW_M,
    Layout,
    Scene,
    Spot,
    check_scene,
    in_camera_grid,
    is_toaster,
    marker_offset_of_toaster,
    spots,
    used_spots,
)
from lab.sim.world import World
from lab.tasks.task_file import InsertGrid, Station, Task
from lab.vision import View

Cell = tuple[int, ...]

NEAR_SHAPE = (5, 5, 6)  # x, y, z around a slice; z from the grasp upwards
NEAR_STEP_M = (0.012, 0.012, 0.030)
NEAR_YAWS = 5
NEAR_YAW_STEP = 0.06  # [rad]
_TRAVEL_MARGIN = 0.01  # [m] beyond half a cell: a move between free cells then touches nothing
_GRID_MARGIN = 0.005  # [m] the same on the way through the insert grid
_WAITING_WITHIN = 0.25  # [m] of the insert grid: no slice farther off can meet the carried one
_DOCK_CLEARANCE = 0.012  # [m]
_TOUCH_CLEARANCE = {True: 0.0012, False: 0.004}  # [m] near a station, by whether a slice is carried
RELEASE_ABOVE = 0.002  # [m] a slice is let go this high above its foot


def near_pose(goal: ToolPose, cell: Cell) -> ToolPose:
    """The tool pose of a cell of the grid around a slice; `goal` is the pose of the goal cell (2, 2, 0[, 2])."""
    dx, dy, dz = (
        (cell[k] - middle) * step for k, (middle, step) in enumerate(zip((2, 2, 0), NEAR_STEP_M, strict=True))
    )
    return goal.local(dx, dy, dz, (cell[3] - NEAR_YAWS // 2) * NEAR_YAW_STEP if len(cell) > 3 else 0.0)


class Surveys:
    """The surveys of one task in one layout."""

    def __init__(self, task: Task, layout: Layout) -> None:
        check_scene(task)
        self.task, self.layout, self.toasts = task, Layout(layout.obstacles, ()), len(layout.slices)
        self.workspace = cache(self._workspace)
        self.dock = cache(self._dock)
        self.around = cache(self._around)
        self.picture = cache(self._picture)
        self.over_grid = cache(self._over_grid)

    # ---- transfer: the whole workspace --------------------------------------------------------------------------

    def cell_pose(self, cell: Cell) -> ToolPose:
        """The tool pose in the middle of a cell of the workspace."""
        grid = self.task.workspace
        x, y, z = (low + (i + 0.5) * size for low, i, size in zip(grid.lower_m, cell, grid.cell_m, strict=True))
        return ToolPose(x, y, z, 0.0)

    def _workspace(self, loaded: bool) -> Survey:
        grid = self.task.workspace
        with World() as world:
            scene = Scene(world, self.task, 0, self.layout)
            surveyor = Surveyor(scene, loaded=loaded, clearance=max(grid.cell_m) / 2 + _TRAVEL_MARGIN)
            return surveyor.grid(grid.shape, self.cell_pose)

    def _dock(self, place: str, loaded: bool) -> Cell:
        """The workspace cell from which the tool goes straight to the approach of `place`; BadInput names what blocks it."""
        survey = self.workspace(loaded)
        with World() as world:
            scene = Scene(world, self.task, 0, self.layout)
            approach = self.approach(place)
            surveyor = Surveyor(scene, loaded=loaded, clearance=_DOCK_CLEARANCE)
            cause = surveyor.cause(approach)
            for cell in [] if cause else self._cells_near(survey, approach):
                way = _between(self.cell_pose(cell), approach)
                if not survey.blocked[cell] and not any(surveyor.cause(pose) for pose in way):
                    return cell
        if not cause:
            cause = ", ".join(survey.names(self._cells_near(survey, approach))) or "the workspace's border"
        raise BadInput(
            f"station '{place}' cannot be approached{' with a slice' if loaded else ''}: in the way: {cause}"
        )

    def _cells_near(self, survey: Survey, pose: ToolPose) -> list[Cell]:
        """The cells of the lowest level within 1.6 cells of a pose, nearest first."""
        reach = 1.6 * max(self.task.workspace.cell_m[:2])
        at = {cell: self.cell_pose(cell) for cell in np.ndindex(*survey.causes.shape[:2], 1)}
        far = {cell: hypot(p.x - pose.x, p.y - pose.y) for cell, p in at.items()}
        return sorted((cell for cell in far if far[cell] <= reach), key=lambda cell: (far[cell], cell))

    def approach(self, place: str) -> ToolPose:
        """Where a transfer to or from `place` ends: above a station, or above the start of the insert grid ('insert')."""
        grid = self.task.workspace
        low = grid.lower_m[2] + grid.cell_m[2] / 2
        if place == INSERT_START:
            return ToolPose(*self.task.insert.start_m, low, 0.0)
        x, y, yaw = self.task.station(place).pose
        return ToolPose(x, y, low, yaw)

    # ---- grasp and place: around one slice ----------------------------------------------------------------------

    def _around(self, station_name: str, loaded: bool) -> Survey:
        """Around the slice that stands (or, loaded, is to stand) on a station's first spot, with neighbours on all sides."""
        station = self.task.station(station_name)
        spot = spots(station)[0]
        with World() as world:
            scene = Scene(world, self.task, 0, Layout(self.layout.obstacles, ()))
            for name, beside in neighbours(station, spot).items():
                scene.add_slice(name, beside)
                scene.solid.append(name)
            goal = spot.grasp()
            if loaded:
                goal = goal.shifted(dz=RELEASE_ABOVE)
            else:
                scene.add_slice("the slice", spot)
                scene.solid.append("the slice")
            surveyor = Surveyor(scene, loaded=loaded, clearance=_TOUCH_CLEARANCE[loaded])
            shape = NEAR_SHAPE if loaded else (*NEAR_SHAPE, NEAR_YAWS)
            return surveyor.grid(shape, lambda cell: near_pose(goal, cell))

    # ---- insert: the overhead camera ----------------------------------------------------------------------------

    def _picture(self) -> NDArray[np.uint8]:
        """The overhead picture with the arm at the insert grid's start, (pixels, pixels, 3) uint8 RGB."""
        x, y = self.task.insert.start_m
        start = ToolPose(x, y, self.task.insert.height_m, 0.0)
        with World() as world:
            scene = Scene(world, self.task, 0, self.layout)
            cause = Surveyor(scene, loaded=True, clearance=_TOUCH_CLEARANCE[True]).cause(start)
        if cause:
            why = (
                "out of the arm's reach" if cause == OUT_OF_REACH else f"{cause} is in the way of a carried slice there"
            )
            raise BadInput(f"insert.start_m {[x, y]}: {why}")
        with World() as world:
            scene = Scene(world, self.task, 0, self.layout)
            scene.robot.stand(start)
            scene.robot.open_at_once(models.SLICE[1] / 2)
            return overhead_camera(self.task).picture(world)

    def grid_pose(self, cell: Cell) -> ToolPose:
        """The tool pose on the way through the insert grid, over the middle of a cell."""
        grid = self.task.insert
        x, y = ((o + (i + 0.5) * grid.cell_m) for o, i in zip(grid.origin_m, cell, strict=True))
        return ToolPose(x, y, grid.height_m, 0.0)

    def _over_grid(self, seen: frozenset[str]) -> Survey:
        """The insert grid's cells that a carried slice or the arm cannot be in, whatever the camera has `seen` left out."""
        with World() as world:
            scene = Scene(world, self.task, 0, self.layout)
            for name, spot in self._waiting().items():
                scene.add_slice(name, spot)
                scene.solid.append(name)
            toasters = [s.name for s in self.task.stations if is_toaster(s)]
            clearance = self.task.insert.cell_m / 2 + _GRID_MARGIN
            surveyor = Surveyor(scene, loaded=True, clearance=clearance, ignore=[*seen, *toasters])
            survey = surveyor.grid(self.task.insert.shape, self.grid_pose)
        for cell in np.ndindex(*survey.causes.shape):
            if not survey.causes[cell] and not self._in_sight(self.grid_pose(cell)):
                survey.causes[cell] = OUT_OF_SIGHT
        return survey

    def _in_sight(self, pose: ToolPose) -> bool:
        """Whether the gripper's marker lies wholly in the overhead picture when the tool is at `pose`."""
        camera = overhead_camera(self.task)
        x, y, z = pose.x + models.MARKER_OUT, pose.y, pose.z + models.MARKER_UP
        edges = [(x + dx, y + dy, z, 1.0) for dx in (-_MARKER, _MARKER) for dy in (-_MARKER, _MARKER)]
        across, down, far = camera.pixel_from_world() @ np.array(edges).T
        pixels = np.concatenate([across / far, down / far])
        return bool(pixels.min() >= 0.0 and pixels.max() <= camera.width - 1)

    def _waiting(self) -> dict[str, Spot]:
        """Where slices may stand while another is carried through the insert grid, as far as they are near it."""
        waiting = {}
        for station in self.task.stations:
            if is_toaster(station):
                continue
            for number, spot in enumerate(used_spots(station, self.toasts), start=1):
                if _far_from_grid(self.task.insert, spot) < _WAITING_WITHIN:
                    waiting[f"slice {number} at {station.name}"] = spot
        return waiting


INSERT_START = "insert"
OUT_OF_SIGHT = "out of the camera's sight"
_MARKER = models.MARKER_RADIUS + 0.003  # [m] half of what the camera must see around the gripper's marker


def overhead_camera(task: Task, pixels: int | None = None) -> Camera:
    """The task's overhead camera, with `pixels` a side if given."""
    return Camera.overhead(task.camera.position_m, task.camera.field_of_view_rad, pixels or task.camera.pixels)


def camera_view(task: Task, pixels: int | None = None, layout: Layout | None = None) -> View:
    """How the overhead picture maps to the insert grid: projection, grid, the markers' heights and offsets [m].

    Without a layout the obstacles are taken to stand where the task file has them.
    """
    grid, upper = task.insert, models.MARKER_THICK / 2
    places = [o.position_m for o in task.obstacles] if layout is None else layout.obstacles
    stand = zip(task.obstacles, places, strict=True)
    heights = [o.edge_m * o.cubes + MARKER_ABOVE for o, place in stand if in_camera_grid(task, place)]
    if len({round(height, 6) for height in heights}) > 1:
        raise BadInput(
            f"task '{task.name}': obstacles in the camera's grid must be equally high, got {sorted(set(heights))} m"
        )
    return View(
        pixel_from_world=overhead_camera(task, pixels).pixel_from_world(),
        origin_m=grid.origin_m,
        cell_m=grid.cell_m,
        shape=grid.shape,
        heights_m={
            "gripper": grid.height_m + models.MARKER_UP + upper,
            "obstacle": (heights or [0.18])[0] + upper,
            "toaster": models.TOASTER[2] + MARKER_ABOVE + upper,
        },
        offsets_m={"gripper": (-models.MARKER_OUT, 0.0), "toaster": _toaster_offset(task)},
    )


def _toaster_offset(task: Task) -> tuple[float, float]:
    yaw = next((s.pose[2] for s in task.stations if is_toaster(s)), 0.0)
    along, across = marker_offset_of_toaster()
    return (np.sin(yaw) * across - np.cos(yaw) * along, -np.sin(yaw) * along - np.cos(yaw) * across)


def neighbours(station: Station, spot: Spot) -> dict[str, Spot]:
    """The spots beside one spot: slices may stand there, except in a machine."""
    if station.kind == "machine":
        return {}
    steps = {"in front": (0.0, -ROW_M), "behind": (0.0, ROW_M)}
    if station.kind == "storage":
        steps |= {"to the left": (-COLUMN_M, 0.0), "to the right": (COLUMN_M, 0.0)}
    c, s = np.cos(spot.yaw), np.sin(spot.yaw)
    return {
        f"slice {where}": Spot(spot.x + c * dx - s * dy, spot.y + s * dx + c * dy, spot.z, spot.yaw)
        for where, (dx, dy) in steps.items()
    }


def _far_from_grid(grid: InsertGrid, spot: Spot) -> float:
    """How far a spot is from the insert grid [m], 0 within it."""
    sides = zip((spot.x, spot.y), grid.origin_m, grid.shape, strict=True)
    return hypot(*(max(low - at, at - (low + count * grid.cell_m), 0.0) for at, low, count in sides))


def _between(one: ToolPose, other: ToolPose) -> list[ToolPose]:
    parts = np.linspace(0.0, 1.0, 8)
    return [ToolPose(one.x + t * (other.x - one.x), one.y + t * (other.y - one.y), one.z, one.yaw) for t in parts]
