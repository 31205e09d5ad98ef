"""A task's cell in physics: table, stations, machines, slices, cubes and markers, where the seed puts them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from math import ceil, cos, hypot, pi, sin

import numpy as np

from lab.errors import BadInput
from lab.files import assets_folder
from lab.sim import models
from lab.sim.arm_models import arm_of
from lab.sim.frames import Rgba, Vector
from lab.sim.kinematics import ToolPose
from lab.sim.robot import Robot
from lab.sim.world import World
from lab.tasks.task_file import NEAREST_STATIONS_M, Obstacle, Station, Task

SLAB = 0.012  # [m] plates and buffers are slabs this thick
GRASP_DEPTH = 0.03  # [m] how far the fingers reach below a slice's top
COLUMN_M, ROW_M = 0.14, 0.055  # [m] between spots, along and across the slices
COLUMNS = 4  # of a plate
WOOD, TABLE_RGBA = (0.72, 0.53, 0.33, 1.0), (0.86, 0.85, 0.83, 1.0)
PLATE_RGBA, BUFFER_RGBA = (0.97, 0.97, 0.98, 1.0), (0.55, 0.57, 0.6, 1.0)
FOOTPRINT = (0.07, 0.05)  # [m] a slice and the gripper around it reach this far from its spot, along and across
APPLIER_BASE = (0.18, 0.34, -0.07)  # [m] of the applier: along and across the slice, its middle off the slice across
MAX_DRAWS = 100  # of an obstacle's place
MARKER_ABOVE = 0.002  # [m] a marker's centre above what it lies on


@dataclass(frozen=True)
class Spot:
    """Where one slice stands: the middle of its foot at x, y, z [m], turned by yaw [rad]."""

    x: float
    y: float
    z: float
    yaw: float

    def grasp(self) -> ToolPose:
        """The tool pose that holds a slice standing here."""
        return ToolPose(self.x, self.y, self.z + models.SLICE[2] - GRASP_DEPTH, self.yaw)


@dataclass(frozen=True)
class Layout:
    """What the seed decides: obstacle centres, and how far each slice stands off its spot (x, y [m], yaw [rad])."""

    obstacles: tuple[tuple[float, float], ...]
    slices: tuple[tuple[float, float, float], ...]


def draw_layout(task: Task, toasts: int, rng: np.random.Generator) -> Layout:
    """A layout drawn uniformly within the areas that the task gives its obstacles and slices.

    An obstacle drawn onto a station is drawn again; BadInput names both when its area leaves no room beside the station.
    """
    kept = _kept_free(task, toasts)
    places = [_draw_place(obstacle, kept, rng) for obstacle in task.obstacles]
    offsets = [tuple(map(float, rng.uniform(-1, 1, 3) * task.slices.area)) for _ in range(toasts)]
    return Layout(tuple(places), tuple(offsets))  # type: ignore[arg-type]


def _draw_place(
    obstacle: Obstacle, kept: "Sequence[tuple[str, Rectangle]]", rng: np.random.Generator
) -> tuple[float, float]:
    half = obstacle.edge_m / 2
    for _ in range(MAX_DRAWS):
        dx, dy = rng.uniform(-1, 1, 2) * obstacle.area
        x, y = obstacle.position_m[0] + float(dx), obstacle.position_m[1] + float(dy)
        square = Rectangle(x, y, half, half, 0.0)
        hit = next((station for station, taken in kept if taken.meets(square)), None)
        if hit is None:
            return x, y
    raise BadInput(
        f"obstacle '{obstacle.name}' stands on station '{hit}' or too near for the gripper: at ({x:.2f}, {y:.2f}) m "
        f"its {obstacle.edge_m} m square meets where slices are set down; move one of them"
    )


def is_applier(station: Station) -> bool:
    """Whether the station is the applier, whose process is learned."""
    return station.process is not None


def is_toaster(station: Station) -> bool:
    """Whether the station is the toaster, which slices reach through the camera's grid: a machine with a time of its own."""
    return station.kind == "machine" and not is_applier(station)


def floor(station: Station) -> float:
    """How high a slice's foot is above the table at this station [m]."""
    if station.kind != "machine":
        return SLAB
    return models.APPLIER_FLOOR if is_applier(station) else models.TOASTER_FLOOR


def spots(station: Station) -> list[Spot]:
    """The places for slices at a station, the middle ones first; as many as its capacity."""
    x, y, yaw = station.pose
    if station.kind == "machine":
        offsets: list[tuple[float, float]] = [(0.0, 0.0)] * station.capacity
    else:
        columns = min(COLUMNS, station.capacity) if station.kind == "storage" else 1
        rows = ceil(station.capacity / columns)
        grid = product(range(columns), range(rows))
        offsets = [((c - (columns - 1) / 2) * COLUMN_M, (r - (rows - 1) // 2) * ROW_M) for c, r in grid]
        offsets.sort(key=lambda at: (round(hypot(*at), 6), at))
    return [Spot(*beside((x, y), yaw, off), floor(station), yaw) for off in offsets[: station.capacity]]


def beside(at: Sequence[float], yaw: float, off: Sequence[float]) -> tuple[float, float]:
    """The point (x, y) [m] that lies `off` along and across from `at`, by axes that are turned by `yaw` [rad]."""
    c, s = cos(yaw), sin(yaw)
    return at[0] + c * off[0] - s * off[1], at[1] + s * off[0] + c * off[1]


def used_spots(station: Station, toasts: int) -> list[Spot]:
    """The spots that so many toasts can ever need, and one more row's worth for a plate."""
    return spots(station)[: max(toasts, 4)]


@dataclass(frozen=True)
class Rectangle:
    """A turned rectangle on the table: its middle, half its length and half its width [m], and yaw [rad]."""

    x: float
    y: float
    half_along: float
    half_across: float
    yaw: float

    def meets(self, other: "Rectangle") -> bool:
        """Whether the two overlap: no side of either has the other wholly beyond it."""
        dx, dy = other.x - self.x, other.y - self.y
        for yaw in (self.yaw, self.yaw + pi / 2, other.yaw, other.yaw + pi / 2):
            apart = abs(cos(yaw) * dx + sin(yaw) * dy)
            if apart >= self._reach(yaw) + other._reach(yaw):
                return False
        return True

    def _reach(self, yaw: float) -> float:
        turn = yaw - self.yaw
        return abs(cos(turn)) * self.half_along + abs(sin(turn)) * self.half_across


def _kept_free(task: Task, toasts: int) -> list[tuple[str, Rectangle]]:
    """What no obstacle may stand on: the machines' bodies, and around the spots in use a slice and the gripper; by station."""
    kept = []
    for station in task.stations:
        x, y, yaw = station.pose
        if station.kind == "machine":
            length, width, off = APPLIER_BASE if is_applier(station) else (*models.TOASTER[:2], 0.0)
            body = Rectangle(x - sin(yaw) * off, y + cos(yaw) * off, length / 2, width / 2, yaw)
            kept.append((station.name, body))
            continue
        # only where they start do slices stand off their spots: the robot sets them down on them
        off_x, off_y = task.slices.area[:2] if station.name == task.route[0].station else (0.0, 0.0)
        along, across = FOOTPRINT[0] + off_x, FOOTPRINT[1] + off_y
        kept += [(station.name, Rectangle(s.x, s.y, along, across, s.yaw)) for s in used_spots(station, toasts)]
    return kept


class Scene:
    """The cell of `task` with `toasts` slices, laid out as `layout` says. Slices are named 'slice 1'..., obstacles by name."""

    def __init__(self, world: World, task: Task, toasts: int, layout: Layout) -> None:
        self.world, self.task, self.toasts, self.layout = world, task, toasts, layout
        robot = task.robot
        self.solid: list[str] = []  # what the arm must not touch
        world.box("table", (2.2, 2.9, 0.04), (0.35, 0.0, -0.02), TABLE_RGBA)
        self.robot = Robot(
            world, arm_of(robot, task.folder), robot.speed_m_s, robot.acceleration_m_s2, robot.grip_force_n
        )
        for station in task.stations:
            self._build_station(station)
        for obstacle, place in zip(task.obstacles, layout.obstacles, strict=True):
            self._build_obstacle(obstacle, place)
        start = next(stage.station for stage in task.route)
        for number, (spot, off) in enumerate(zip(spots(task.station(start)), layout.slices, strict=False), start=1):
            self.add_slice(f"slice {number}", spot, off)

    def _build_station(self, station: Station) -> None:
        x, y, yaw = station.pose
        if station.kind == "machine":
            model = "applier" if is_applier(station) else "toaster"
            self.world.load(station.name, assets_folder() / f"{model}.urdf", (x, y, 0.0), yaw)
            self.world.friction(station.name, 0.5)
            if model == "toaster":
                self._mark(station.name, marker_of_toaster(station), models.MARKER_CYAN)
        else:
            self._build_slab(station)
        self.solid.append(station.name)

    def _build_slab(self, station: Station) -> None:
        x, y, yaw = station.pose
        feet = [beside((0.0, 0.0), -yaw, (f.x - x, f.y - y)) for f in used_spots(station, self.toasts)]
        low, high = np.min(feet, axis=0), np.max(feet, axis=0)  # (2,) [m] along and across
        middle, size = ((high + low) / 2).tolist(), (*(high - low + [0.18, 0.10]).tolist(), SLAB)
        rgba = PLATE_RGBA if station.kind == "storage" else BUFFER_RGBA
        self.world.box(station.name, size, (*beside(station.pose, yaw, middle), SLAB / 2), rgba, yaw=yaw)
        self.world.friction(station.name, 0.8)

    def _build_obstacle(self, obstacle: Obstacle, place: tuple[float, float]) -> None:
        edge = obstacle.edge_m
        self.world.box(obstacle.name, (edge, edge, edge * obstacle.cubes), (*place, edge * obstacle.cubes / 2), WOOD)
        self.solid.append(obstacle.name)
        if in_camera_grid(self.task, place):
            self._mark(obstacle.name, (*place, edge * obstacle.cubes + MARKER_ABOVE), models.MARKER_GREEN)

    def _mark(self, name: str, at: Vector, rgba: Rgba) -> None:
        self.world.disc(f"{name} marker", models.MARKER_RADIUS, models.MARKER_THICK, at, rgba)

    def add_slice(self, name: str, spot: Spot, off: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        """Stand a slice called `name` on `spot`, `off` it by x, y [m] and yaw [rad]."""
        at = (*beside((spot.x, spot.y), spot.yaw, off), spot.z + models.SLICE[2] / 2 + 0.0005)
        self.world.load(name, assets_folder() / "slice.urdf", at, spot.yaw + off[2], fixed=False)
        self.world.mass(name, self.task.slices.mass_kg)
        self.world.friction(name, self.task.slices.friction, spinning=0.001)

    def put_slice(self, name: str, pose: ToolPose) -> None:
        """Put a slice at once to where the tool at `pose` would hold it: to survey or show a scene, without physics."""
        up = pose.z + GRASP_DEPTH - models.SLICE[2] / 2
        turn = (0.0, 0.0, float(np.sin(pose.yaw / 2)), float(np.cos(pose.yaw / 2)))
        self.world.put(name, (pose.x, pose.y, up), turn)


def in_camera_grid(task: Task, place: Sequence[float]) -> bool:
    """Whether a point (x, y) [m] lies in the grid that the camera looks at."""
    grid = task.insert
    steps = [(p - o) / grid.cell_m for p, o in zip(place, grid.origin_m, strict=True)]
    return all(0 <= step < count for step, count in zip(steps, grid.shape, strict=True))


def marker_of_toaster(station: Station) -> tuple[float, float, float]:
    """Where the toaster's marker is [m]: on its body, beside the slot's middle."""
    at = beside(station.pose, station.pose[2], marker_offset_of_toaster())
    return (*at, models.TOASTER[2] + MARKER_ABOVE)


def marker_offset_of_toaster() -> tuple[float, float]:
    """The toaster's marker off its slot's middle, along and across the slot [m]."""
    return (0.0, (models.TOASTER[1] + models.TOASTER_SLOT[1]) / 4)


def check_scene(task: Task) -> None:
    """BadInput when spots are out of the arm's reach, a machine holds more than a slice, or transfers would sweep slices."""
    low = task.workspace.lower_m[2] + task.workspace.cell_m[2] / 2
    size = models.SLICE
    highest = max(floor(s) for s in task.stations) + size[2]
    if low - (size[2] - GRASP_DEPTH) < highest + 0.01:
        raise BadInput(
            f"workspace.lower_m: the lowest tool height {low:.3f} m would sweep a carried slice through standing ones"
        )
    _check_toaster(task)
    arm = arm_of(task.robot, task.folder)
    for station in task.stations:
        if station.kind == "machine" and station.capacity > 1:
            raise BadInput(
                f"machine '{station.name}' has the capacity {station.capacity}: the machines of this cell hold 1 slice"
            )
        for spot in spots(station):
            pose = spot.grasp()
            for at in (pose, ToolPose(pose.x, pose.y, low, pose.yaw)):
                if arm.inverse(at) is None or hypot(at.x, at.y) < arm.nearest_m:
                    raise BadInput(
                        f"station '{station.name}' is out of reach: its spot at ({at.x:.2f}, {at.y:.2f}) m is "
                        f"{hypot(at.x, at.y):.2f} m from the robot; the arm '{arm.name}' {arm.reach_in_words(at.z)}"
                    )


def _check_toaster(task: Task) -> None:
    """BadInput for a second toaster, which the camera's grid has no room for, or one that a carried slice would hit."""
    toasters = [s.name for s in task.stations if is_toaster(s)]
    if len(toasters) > 1:
        raise BadInput(
            f"machines '{toasters[0]}' and '{toasters[1]}' both have processing_s: the camera's grid leads to one toaster"
        )
    lowest = models.TOASTER[2] + models.SLICE[2] - GRASP_DEPTH + 0.005
    if toasters and task.insert.height_m < lowest:
        raise BadInput(
            f"insert.height_m {task.insert.height_m}: a carried slice would hit the toaster, at least {lowest:.3f} needed"
        )


def check_apart(task: Task, toasts: int) -> None:
    """BadInput when slices at two stations would stand in each other's place, with so many toasts under way."""
    feet = [(station.name, spot) for station in task.stations for spot in spots(station)[:toasts]]
    for (one, a), (other, b) in combinations(feet, 2):
        apart = hypot(a.x - b.x, a.y - b.y)
        if one != other and apart < NEAREST_STATIONS_M:
            raise BadInput(
                f"stations '{one}' and '{other}' overlap: with {toasts} toasts, slices may stand {apart:.3f} m apart, "
                f"at least {NEAREST_STATIONS_M} m needed"
            )
