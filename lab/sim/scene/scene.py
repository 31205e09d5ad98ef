"""A task's cell in physics: table, stations, machines, parts, obstacles and markers, where the seed puts them."""

from collections.abc import Sequence
from math import cos, sin

from lab.sim import models
from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import RobotArm
from lab.sim.frames import Rgba, Vector
from lab.sim.parts.holding import Load, grip_force_n, needs_fine
from lab.sim.parts.kinds import Kind, Spot, beside, comes_as, kinds_of
from lab.sim.scene import station_bodies
from lab.sim.scene.places import Layout, Places
from lab.sim.world import World
from lab.tasks.task import Order, Task, part_name
from lab.tasks.task_fields import CameraGrid, Obstacle, Station

TABLE, MARKER = "table", " marker"  # the name of the table; the ending of markers' names
TABLE_RGBA = (0.86, 0.85, 0.83, 1.0)
TABLE_M, TABLE_MIDDLE_M = (2.2, 2.9, 0.04), (0.35, 0.0, -0.02)
MARKER_ABOVE = 0.002  # [m] a marker's centre above what it lies on
STOPS_AT_N, STOPS_AT_GRIPS = 150.0, 6.0  # a protective stop's least force, and least multiple of the grip force
ABOVE_FOOT_M = 0.0005  # [m] initial height of a part above its spot


class Scene:
    """The cell of `task` with the parts of an order, laid out as `layout` says; the first part is called 'slice 1'."""

    def __init__(self, world: World, task: Task, order: Order, layout: Layout, parts: int = 0) -> None:
        """parts: the number of parts for which stations are built, if larger than that of the order."""
        self.world, self.task, self.order, self.layout = world, task, order, layout
        self._parts = max(parts, len(order))
        self.solid: list[str] = []  # names of the bodies that the arm must not touch
        self.kind_of: dict[str, Kind] = {}  # the kind of each part in the scene, by the part's name
        arm = arm_of(task.robot, task.folder)
        self.kinds = kinds_of(task, arm.gripper)
        self.places = Places(task, self.kinds)
        world.box(TABLE, TABLE_M, TABLE_MIDDLE_M, TABLE_RGBA)
        robot = task.robot
        self.grips_n = {name: grip_force_n(robot, Load.of(kind)) for name, kind in self.kinds.items()}
        firmest_n, fine = max(self.grips_n.values()), needs_fine(robot, self.kinds.values())
        self.robot = RobotArm(world, arm, robot.speed_m_s, robot.acceleration_m_s2, firmest_n, fine)
        self.stops_at_n = robot.force_limit_n or max(STOPS_AT_N, STOPS_AT_GRIPS * firmest_n)
        for station in task.stations:
            self._build_station(station)
        for obstacle, place in zip(task.obstacles, layout.obstacles, strict=True):
            self._build_obstacle(obstacle, place)
        begins = zip(self.places.begins(order), layout.parts, strict=True)
        for number, (spot, off) in enumerate(begins, start=1):
            self.add(part_name(order, number), comes_as(task.part(order[number - 1])), spot, off)

    def _build_station(self, station: Station) -> None:
        station_bodies.build(self.world, station, self.places.slab(station, self._parts), self.task.folder)
        if station.grid is not None:
            self._mark(station.name, marker_of(station, station.grid), models.MARKER_CYAN)
        self.solid.append(station.name)

    def _build_obstacle(self, obstacle: Obstacle, place: tuple[float, float]) -> None:
        size = obstacle.size
        self.world.box(obstacle.name, size, (*place, size[2] / 2), (*obstacle.color, 1.0), yaw=obstacle.yaw)
        self.solid.append(obstacle.name)
        if any(in_grid(station.grid, place) for station in self.task.stations if station.grid is not None):
            self._mark(obstacle.name, (*place, size[2] + MARKER_ABOVE), models.MARKER_GREEN)

    def _mark(self, name: str, at: Vector, rgba: Rgba) -> None:
        self.world.disc(f"{name}{MARKER}", models.MARKER_RADIUS, models.MARKER_THICK, at, rgba)

    def add(self, name: str, kind: str, spot: Spot, off: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        """Adds a part called `name` on `spot`, offset by x, y [m] and yaw [rad]; on its pallet if the kind includes one."""
        at = beside((spot.x, spot.y), spot.yaw, off)
        foot = Spot(*at, spot.z + ABOVE_FOOT_M, spot.yaw + off[2])
        for body, own in zip(self.bodies_of(name, kind), self.kinds[kind].stack(), strict=True):
            part, shape = own.part, own.shape
            self.world.part(body, shape, part.mass_kg, part.friction, (foot.x, foot.y, foot.z + shape.foot_m), foot.yaw)
            self.kind_of[body] = own
            foot = foot.raised(shape.height_m + ABOVE_FOOT_M)

    def remove_parts(self) -> None:
        """Takes all parts out of the scene, the last one first: those added next get the same numbers in the engine again."""
        for body in reversed(self.kind_of):
            self.world.remove(body)
        self.kind_of.clear()

    def body_of(self, name: str, kind: str) -> str:
        """The body that the gripper holds when it carries part `name` as this kind: the part itself, or its pallet."""
        return name if self.kinds[kind].part.routes else pallet_of(name)

    def bodies_of(self, name: str, kind: str) -> list[str]:
        """All bodies that are carried with part `name` as this kind, the one in the gripper first."""
        return [pallet_of(name), name] if self.kinds[kind].rider is not None else [self.body_of(name, kind)]

    def put(self, name: str, kind: str, pose: ToolPose) -> None:
        """Moves a part without physics to where the tool at `pose` would hold it, to survey or show a scene."""
        foot = self.kinds[kind].foot_at(pose)
        turn = (0.0, 0.0, sin(foot.yaw / 2), cos(foot.yaw / 2))
        for body, own in zip(self.bodies_of(name, kind), self.kinds[kind].stack(), strict=True):
            self.world.put(body, (foot.x, foot.y, foot.z + own.shape.foot_m), turn)
            foot = foot.raised(own.shape.height_m)


def pallet_of(name: str) -> str:
    """The name of a part's pallet."""
    return f"{name}'s pallet"


def in_grid(grid: CameraGrid, place: Sequence[float]) -> bool:
    """Whether a point (x, y) [m] lies in a grid that the camera looks at."""
    steps = [(p - o) / grid.cell_m for p, o in zip(place, grid.origin_m, strict=True)]
    return all(0 <= step < count for step, count in zip(steps, grid.shape, strict=True))


def marker_of(station: Station, grid: CameraGrid) -> Vector:
    """Where the marker of a station lies that is approached through the camera's grid [m]."""
    along, across, high = grid.marker_m
    return (*beside(station.pose, station.pose[2], (along, across)), high + MARKER_ABOVE)
