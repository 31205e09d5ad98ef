"""Grids that the overhead camera looks at, one a station and kind of part: picture, view and survey, each made once (`once`)."""

from collections.abc import Callable, Hashable
from functools import wraps
from math import hypot
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.files import beside_or_asset
from lab.sim import models
from lab.sim.arms.kinematics import ToolPose
from lab.sim.camera import Camera, TableCamera
from lab.sim.parts.kinds import Spot, beside
from lab.sim.scene.blocked_cells import OUT_OF_REACH, Survey, Surveyor
from lab.sim.scene.places import Layout, Places
from lab.sim.scene.scene import MARKER_ABOVE, Scene, in_grid
from lab.sim.world import World
from lab.tasks.task import Task
from lab.tasks.task_fields import CameraGrid, Station
from lab.vision import View
from lab.vision.calibration import read_calibration

Made = dict[tuple[Hashable, ...], Any]  # by the method's name and its arguments
Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


class Holder(Protocol):
    """An object that keeps the results of its own methods in `made`."""

    made: Made


Self = TypeVar("Self", bound=Holder)


def once(
    method: Callable[Concatenate[Self, Arguments], Result],
) -> Callable[Concatenate[Self, Arguments], Result]:
    """The method, memoized in the object's `made` by its positional arguments.

    Unlike `functools.cache` it keeps no object alive, and an object with results can be pickled.
    """

    def made_once(self: Self, /, *args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        if kwargs:
            raise TypeError(f"{method.__name__} takes its arguments by their places")
        key = (method.__name__, *args)
        if key not in self.made:
            self.made[key] = method(self, *args, **kwargs)
        result: Result = self.made[key]
        return result

    return wraps(method)(made_once)


# ---- a station's grid under the overhead camera ------------------------------------------------------------------------


RELEASE_ABOVE = 0.002  # [m] height above its spot at which a part is released
TOUCH_CLEARANCE = {True: 0.0012, False: 0.004}  # [m] near a station, by whether a part is carried
OUT_OF_SIGHT = "out of the camera's sight"
_MARGIN = 0.005  # [m] beyond half a cell: a move between free cells then touches nothing
_WAITING_WITHIN = 0.25  # [m] of the grid: a part farther off cannot collide with the carried one
_MARKER = (
    models.MARKER_RADIUS + 0.003
)  # [m] half the side of the square around the gripper's marker that must be visible


class SurveyedGrid:
    """The camera's grid in front of a station, for a carried part of one kind; each survey is made once."""

    def __init__(self, task: Task, layout: Layout, places: Places, station: str, kind: str, parts: int) -> None:
        self.task, self.layout, self.places, self.station, self.kind, self.parts = (
            task,
            layout,
            places,
            station,
            kind,
            parts,
        )
        self.settings = settings_of(task.station(station))
        self.made: Made = {}

    def camera(self, pixels: int | None = None) -> Camera:
        """The overhead camera, its picture `pixels` wide and high if given."""
        return overhead_camera(self.task, pixels)

    def view(self, pixels: int | None = None) -> View:
        """The mapping from the overhead picture to this grid."""
        return camera_view(self.task, self.station, pixels, self.layout)

    def pose(self, cell: tuple[int, ...]) -> ToolPose:
        """The tool pose over the middle of a cell, at the grid's height."""
        grid = self.settings
        x, y = ((o + (i + 0.5) * grid.cell_m) for o, i in zip(grid.origin_m, cell, strict=True))
        return ToolPose(x, y, grid.height_m, 0.0)

    @once
    def picture(self) -> NDArray[np.uint8]:
        """The overhead picture with the arm at the grid's start, (pixels, pixels, 3) uint8 RGB."""
        x, y = self.settings.start_m
        start = ToolPose(x, y, self.settings.height_m, 0.0)
        with World() as world:
            scene = Scene(world, self.task, (), self.layout)
            cause = Surveyor(scene, self.kind, clearance=TOUCH_CLEARANCE[True]).cause(start)
        if cause:
            why = (
                "out of the arm's reach"
                if cause == OUT_OF_REACH
                else f"{cause} is in the way of a carried {self.kind} there"
            )
            raise BadInput(f"station '{self.station}': grid.start_m {[x, y]}: {why}")
        with World() as world:
            scene = Scene(world, self.task, (), self.layout)
            scene.robot.stand(start)
            scene.robot.open_at_once(scene.kinds[self.kind].grip.width_m / 2)
            return self.camera().picture(world)

    @once
    def survey(self, seen: frozenset[str]) -> Survey:
        """The cells that a carried part or the arm cannot enter; obstacles that the camera has `seen` are ignored."""
        with World() as world:
            scene = Scene(world, self.task, (), self.layout)
            for name, (kind, spot) in self._waiting().items():
                scene.add(name, kind, spot)
                scene.solid += scene.bodies_of(name, kind)
            clearance = self.settings.cell_m / 2 + _MARGIN
            surveyor = Surveyor(scene, self.kind, clearance=clearance, ignore=[*seen, self.station])
            survey = surveyor.grid(self.settings.shape, self.pose)
        for cell in np.ndindex(*survey.causes.shape):
            if not survey.causes[cell] and not self._in_sight(self.pose(cell)):
                survey.causes[cell] = OUT_OF_SIGHT
        return survey

    def _in_sight(self, pose: ToolPose) -> bool:
        """Whether the gripper's marker lies wholly in the overhead picture when the tool is at `pose`."""
        camera = self.camera()
        x, y, z = pose.x + models.MARKER_OUT, pose.y, pose.z + models.MARKER_UP
        edges = [(x + dx, y + dy, z, 1.0) for dx in (-_MARKER, _MARKER) for dy in (-_MARKER, _MARKER)]
        across, down, far = camera.pixel_from_world() @ np.array(edges).T
        pixels = np.concatenate([across / far, down / far])
        return bool(pixels.min() >= 0.0 and pixels.max() <= camera.width - 1)

    def _waiting(self) -> dict[str, tuple[str, Spot]]:
        """Kind and spot, by name, of each part that may stand nearby while another is carried through the grid."""
        waiting = {}
        for station in self.task.stations:
            tallest = max(self.places.kinds_at(station.name), key=lambda kind: kind.height_m, default=None)
            if station.grid is not None or tallest is None:
                continue
            for number, spot in enumerate(self.places.used_spots(station, self.parts), start=1):
                if _far_from(self.settings, spot) < _WAITING_WITHIN:
                    waiting[f"{tallest.name} {number} at {station.name}"] = (tallest.name, spot)
        return waiting


def settings_of(station: Station) -> CameraGrid:
    """The grid through which a station is approached; BadInput for a station without one."""
    if station.grid is None:
        raise BadInput(f"station '{station.name}' is approached from {station.approach}, not through the camera's grid")
    return station.grid


def overhead_camera(task: Task, pixels: int | None = None) -> Camera:
    """The task's overhead camera, its picture `pixels` wide and high if given; BadInput when the task has none."""
    if task.camera is None:
        raise BadInput(f"task '{task.name}' has no [camera]")
    own = task.camera
    strength = float(task.perception == "camera")
    if own.calibration is None:
        camera = Camera.overhead(own.position_m, own.field_of_view_rad, pixels or own.pixels)
        return camera if not strength else TableCamera(**vars(camera), strength=strength)
    path = beside_or_asset(own.calibration, task.folder, f"[camera] calibration = '{own.calibration}'")
    return TableCamera.calibrated(read_calibration(path), pixels, strength)


def camera_view(task: Task, station: str, pixels: int | None = None, layout: Layout | None = None) -> View:
    """The mapping from the overhead picture to a station's grid: projection, grid, heights and offsets of markers [m].

    Without a layout, obstacles are assumed to be where the task file puts them.
    """
    place = task.station(station)
    grid, upper = settings_of(place), models.MARKER_THICK / 2
    places = [o.position_m for o in task.obstacles] if layout is None else layout.obstacles
    stand = zip(task.obstacles, places, strict=True)
    heights = [obstacle.size[2] + MARKER_ABOVE for obstacle, at in stand if in_grid(grid, at)]
    if len({round(height, 6) for height in heights}) > 1:
        raise BadInput(
            f"station '{station}': obstacles in the camera's grid must be equally high, got {sorted(set(heights))} m"
        )
    along, across = beside((0.0, 0.0), place.pose[2], grid.marker_m[:2])
    return View(
        pixel_from_world=overhead_camera(task, pixels).pixel_from_world(),
        origin_m=grid.origin_m,
        cell_m=grid.cell_m,
        shape=grid.shape,
        heights_m={
            "gripper": grid.height_m + models.MARKER_UP + upper,
            "obstacle": (heights or [0.18])[0] + upper,
            "toaster": grid.marker_m[2] + MARKER_ABOVE + upper,
        },
        offsets_m={"gripper": (-models.MARKER_OUT, 0.0), "toaster": (-along, -across)},
        radius_m=models.MARKER_RADIUS,
    )


def _far_from(grid: CameraGrid, spot: Spot) -> float:
    """The distance of a spot from the grid [m]; 0 inside it."""
    sides = zip((spot.x, spot.y), grid.origin_m, grid.shape, strict=True)
    return hypot(*(max(low - at, at - (low + count * grid.cell_m), 0.0) for at, low, count in sides))
