"""The surveys of one scene, each made once: the workspace, the space around a station's part, the camera's grids.

`corners` shortens a path to straight lines through free space.
"""

from collections.abc import Callable, Hashable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial, reduce
from math import ceil, hypot, pi

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, LabError
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.tool_path import COUNTED, bending, way_of
from lab.sim.parts.kinds import Spot, beside, comes_as
from lab.sim.scene.blocked_cells import OUT_OF_REACH, Survey, Surveyor, in_the_way
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.scene.scene_check import places_of
from lab.sim.world import World
from lab.skills.camera_grids import RELEASE_ABOVE, TOUCH_CLEARANCE, Made, SurveyedGrid, once
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import CameraGrid, Station
from lab.workers import Workers

Free = Callable[[Sequence[ToolPose]], bool]  # whether the tool can be at all of these poses


def corners(path: Sequence[ToolPose], step_m: float, free: Free) -> tuple[int, ...]:
    """The indices of the poses that remain when a path is cut to the fewest free lines, among these the shortest.

    Both ends remain. A line is checked at poses at most `step_m` apart, turns counted as length; the lines of the path
    itself are taken as free.
    """
    points = np.array([[p.x, p.y, p.z, p.yaw] for p in path])
    rows = bending(points * COUNTED)
    best: list[tuple[int, float, tuple[int, ...]]] = [(0, 0.0, (rows[0],))]  # to each corner: lines, length [m], poses
    for at, row in enumerate(rows[1:], 1):
        candidates = []
        for before, (lines, length, kept) in enumerate(best):
            line_m = float(way_of(points[[rows[before], row]])[-1])
            if before == at - 1 or free(_straight(points[rows[before]], points[row], step_m, line_m)):
                candidates.append((lines + 1, length + line_m, (*kept, row)))
        best.append(min(candidates))
    return best[-1][2]


def _straight(start: np.ndarray, end: np.ndarray, step_m: float, line_m: float) -> list[ToolPose]:
    """The poses on a line of length `line_m`, at most `step_m` apart, both ends included."""
    shares = np.linspace(0.0, 1.0, ceil(line_m / step_m) + 1)
    return [ToolPose(*map(float, start + share * (end - start))) for share in shares]


# ---- the surveys of one scene -------------------------------------------------------------------------------------------


Cell = tuple[int, ...]
SurveyName = tuple[Hashable, ...]  # a method of Surveys and its arguments

NEAR_SHAPE = (5, 5, 6)  # x, y, z around a part; z from the grasp upwards
NEAR_STEP_M = (0.012, 0.012, 0.030)
NEAR_YAWS = 5
NEAR_YAW_STEP = 0.06  # [rad]
OUT_M = NEAR_STEP_M[2] * (NEAR_SHAPE[2] - 1)  # distance of the approach in front of a station entered from the side
LIFT_M = 0.006  # by which a part is lifted before it is taken out sideways
_TRAVEL_MARGIN = 0.01  # [m] beyond half a cell: a move between free cells then touches nothing
_DOCK_CLEARANCE = 0.012  # [m]
_NEAR_STEP_M = 0.003  # distance between the checked poses of a line around a part
FINGER_SHARE = 0.6  # clearance around a wide part, as a share of the gap between it and an open finger
INSERT = "insert"  # the name of a camera grid's start as the target of a transfer


def grid_of(task: Task, place: str) -> CameraGrid | None:
    """The camera's grid that begins at a place; None for a station."""
    return next((station.grid for station in task.stations if place == _start_of(task, station.name)), None)


def way_to(task: Task, station: str) -> str:
    """The place at which a transfer to a station ends: the station itself, or the start of its camera grid."""
    return station if task.station(station).grid is None else _start_of(task, station)


def _start_of(task: Task, station: str) -> str:
    grids = [one.name for one in task.stations if one.grid is not None]
    return INSERT if grids == [station] else f"{INSERT} at {station}" if station in grids else ""


def near_pose(goal: ToolPose, cell: Cell, into: float | None = None) -> ToolPose:
    """The tool pose of a cell of the grid around a part; `goal` is the pose of the goal cell (2, 2, 0[, 2]).

    The third axis points upwards. At a station entered from the side, along the yaw `into` [rad], the third axis points
    back out of the station and the first axis points upwards.
    """
    first, across, out = (
        (cell[k] - middle) * step for k, (middle, step) in enumerate(zip((2, 2, 0), NEAR_STEP_M, strict=True))
    )
    turn = (cell[3] - NEAR_YAWS // 2) * NEAR_YAW_STEP if len(cell) > 3 else 0.0
    if into is None:
        return goal.local(first, across, out, turn)
    x, y = beside((goal.x, goal.y), into, (-out, across))
    return ToolPose(x, y, goal.z + first, goal.yaw + turn)


class Surveys:
    """The surveys of one task in one layout."""

    def __init__(self, task: Task, order: Order, layout: Layout) -> None:
        self.task, self.order, self.layout, self.parts = task, order, Layout(layout.obstacles, ()), len(order)
        self.places = places_of(task)
        self.kinds = self.places.kinds
        self.made: Made = {}

    def make(self, names: Iterable[SurveyName], workers: Workers) -> None:
        """Make surveys in parallel, each once; one that fails is skipped, and raises its error when it is asked for."""
        missing = [name for name in dict.fromkeys(names) if name not in self.made]
        made = zip(missing, workers.each(partial(_survey, self), missing), strict=True)
        self.made |= {name: survey for name, survey in made if survey is not None}

    # ---- for transfers: the whole workspace -------------------------------------------------------------------------

    def cell_pose(self, cell: Cell) -> ToolPose:
        """The tool pose in the middle of a cell of the workspace."""
        grid = self.task.workspace
        x, y, z = (low + (i + 0.5) * size for low, i, size in zip(grid.lower_m, cell, grid.cell_m, strict=True))
        return ToolPose(x, y, z, 0.0)

    @once
    def workspace(self, carried: str) -> Survey:
        grid = self.task.workspace
        with World() as world:
            survey = self._traveller(world, carried).grid(grid.shape, self.cell_pose)
        for cell in np.ndindex(*grid.shape):
            if self._is_behind(self.cell_pose(cell)) and not survey.causes[cell]:
                survey.causes[cell] = OUT_OF_REACH
        return survey

    @once
    def travel_corners(self, carried: str, path: tuple[ToolPose, ...]) -> tuple[int, ...]:
        """The indices of the poses that remain when a path through the workspace is cut where straight lines are free."""
        with World() as world:
            surveyor, step_m = self._traveller(world, carried), min(self.task.workspace.cell_m) / 2
            return corners(path, step_m, lambda line: not any(map(self._is_behind, line)) and surveyor.free(line))

    def _traveller(self, world: World, carried: str) -> Surveyor:
        """A surveyor with so much clearance that moves between free cells touch nothing."""
        clearance = max(self.task.workspace.cell_m) / 2 + _TRAVEL_MARGIN
        return Surveyor(self._cell(world), carried or None, clearance=clearance)

    def _is_behind(self, pose: ToolPose) -> bool:
        """Whether a pose is directly behind the arm, through which no arm turns from one side to the other."""
        return pose.x < 0 and abs(pose.y) <= self.task.workspace.cell_m[1] / 2 + 1e-9

    @once
    def dock(self, place: str, carried: str) -> Cell:
        """The workspace cell from which a straight move to the approach of `place` is free. BadInput names what blocks it."""
        near, approach = self.cells_near(place), self.approach(place)
        survey = self.workspace(carried)
        with World() as world:
            scene = self._cell(world)
            surveyor = Surveyor(scene, carried or None, clearance=_DOCK_CLEARANCE)
            cause = next(filter(None, map(surveyor.cause, self._turned(approach))), "")
            for cell in [] if cause else near:
                way = _between(self.cell_pose(cell), approach)
                if not survey.blocked[cell] and not any(surveyor.cause(pose) for pose in way):
                    return cell
        why = in_the_way([cause] if cause else survey.names(near), place)
        raise BadInput(f"station '{place}' cannot be approached{f' with {carried}' if carried else ''}: {why}")

    def _cell(self, world: World) -> Scene:
        """The scene without parts; for a level tool, whose wrist is low, with the highest part on each spot in use."""
        scene = Scene(world, self.task, (), self.layout)
        for station in self.task.stations if self.task.robot.tool == "level" else ():
            kind = max(self.places.kinds_at(station.name), key=lambda kind: kind.height_m, default=None)
            for number, spot in enumerate(self.places.used_spots(station, self.parts), 1):
                if kind is not None:
                    self._stand(scene, f"part {number} at {station.name}", kind.name, spot)
        return scene

    def _turned(self, approach: ToolPose) -> list[ToolPose]:
        """The poses through which a level tool turns from the workspace's yaw at an approach; [] for a hanging tool."""
        if self.task.robot.tool != "level":
            return [approach]
        yaw = (approach.yaw + pi) % (2 * pi) - pi
        return [replace(approach, yaw=share * yaw) for share in (1.0, 0.75, 0.5, 0.25, 0.0)]

    def cells_near(self, place: str) -> list[Cell]:
        """The cells of the workspace's lowest level within 1.6 cells of an approach, nearest first. BadInput for none."""
        grid, approach = self.task.workspace, self.approach(place)
        reach = 1.6 * max(grid.cell_m[:2])
        at = {cell: self.cell_pose(cell) for cell in np.ndindex(*grid.shape[:2], 1)}
        far = {cell: hypot(p.x - approach.x, p.y - approach.y) for cell, p in at.items()}
        if near := sorted((cell for cell in far if far[cell] <= reach), key=lambda cell: (far[cell], cell)):
            return near
        high_x, high_y = (
            low + n * cell for low, n, cell in zip(grid.lower_m, grid.shape[:2], grid.cell_m, strict=False)
        )
        raise BadInput(
            f"workspace.shape = {list(grid.shape)}: it has no cell near '{place}' at ({approach.x:.2f}, {approach.y:.2f}) m: "
            f"it goes from ({grid.lower_m[0]:.2f}, {grid.lower_m[1]:.2f}) to ({high_x:.2f}, {high_y:.2f}) m"
        )

    def approach(self, place: str) -> ToolPose:
        """The pose at which a transfer to or from `place` ends: above a station, or above the start of a camera's grid."""
        grid, settings = self.task.workspace, grid_of(self.task, place)
        low = grid.lower_m[2] + grid.cell_m[2] / 2
        if settings is not None:
            return ToolPose(*settings.start_m, low, 0.0)
        x, y, yaw = self.task.station(place).pose
        ahead = 0.0 if self.into(place) is None else OUT_M
        return ToolPose(*beside((x, y), yaw, (-ahead, 0.0)), low, yaw)

    def into(self, place: str) -> float | None:
        """The yaw [rad] along which parts enter a station from the side; None for a station entered from above."""
        station = self.task.station(place)
        return station.pose[2] if station.approach == "side" else None

    def exit_path(self, station: str, pose: ToolPose) -> list[ToolPose]:
        """The poses from the grasp or release pose at a station to its approach: up, or out sideways and up."""
        into, approach = self.into(station), self.approach(station)
        if into is None:
            return [ToolPose(pose.x, pose.y, approach.z, pose.yaw), approach]
        lifted = pose.shifted(dz=LIFT_M)
        x, y = beside((lifted.x, lifted.y), into, (-OUT_M, 0.0))
        return [lifted, ToolPose(x, y, lifted.z, pose.yaw), ToolPose(x, y, approach.z, pose.yaw), approach]

    # ---- for grasp and place: around one part ------------------------------------------------------------------------

    @once
    def around(self, station_name: str, kind: str, loaded: bool) -> Survey:
        """The survey around the part that stands (or, loaded, is to be set down) at a station, with neighbours beside it.

        A cell is free if it is free on every spot that the order uses. BadInput names what blocks the path above a spot.
        """
        station, into = self.task.station(station_name), self.into(station_name)
        shape = NEAR_SHAPE if loaded else (*NEAR_SHAPE, NEAR_YAWS)
        surveyed = list[NDArray[np.str_]]()
        for spot in self.spots_in_use(station, kind, loaded):
            with World() as world:
                surveyor, goal = self._around(world, station, kind, loaded, spot)
                line = [] if into is not None else _between(self.approach(station.name), goal)
                if cause := next(filter(None, map(surveyor.cause, line)), ""):
                    raise BadInput(
                        f"station '{station.name}': the tool cannot go over its spot at ({spot.x:.2f}, {spot.y:.2f}) m: "
                        f"{in_the_way([cause], station.name)}"
                    )
                surveyed.append(surveyor.grid(shape, partial(near_pose, goal, into=into)).causes)
        return Survey(reduce(lambda first, second: np.where(first == "", second, first), surveyed))

    def _may_stand(self, station: Station, kind: str, spot: Spot, own: str, loaded: bool) -> bool:
        """Whether a part of `kind` may stand on a spot while its neighbour of the kind `own` is grasped or, `loaded`, placed.

        The widest kind may stand on any spot. Other kinds count on the spots where they begin, while parts that begin there
        are grasped, and at every station along a route; at the end of its route a part is grasped again only after a fault.
        """
        made = self.task.made_as(own)
        if kind == max(self.places.kinds_at(station.name), key=lambda candidate: candidate.footprint_m()).name:
            return True
        if loaded or self.task.starts(made.name) != station.name:
            return loaded or all(route[-1].station != station.name for route in made.routes)
        begins = zip(self.order, self.places.begins(self.order), strict=True)
        stand = [at for name, at in begins if comes_as(self.task.part(name)) == kind]
        return any(hypot(at.x - spot.x, at.y - spot.y) < NEAR_STEP_M[0] for at in stand)

    def spots_in_use(self, station: Station, kind: str, loaded: bool) -> tuple[Spot, ...]:
        """The spots of a station where the order's parts of a kind are grasped or, loaded, placed; the first if none.

        A station is filled from its first spot on. In a buffer, parts wait only while another part is at the station.
        """
        task, made = self.task, self.task.made_as(kind).name
        first, *others = self.places.spots(station, kind)
        if not loaded and task.starts(made) == station.name:
            begins = (
                spot for name, spot in zip(self.order, self.places.begins(self.order), strict=True) if name == made
            )
            return tuple(begins) or (first,)
        routes = {name: task.part(name).routes for name in self.order}
        parts = sum(
            station.name in task.part(n).places and task.share_places(station.name, n, made) for n in self.order
        )
        waits = all(stage.station != station.name for own in routes.values() for route in own for stage in route)
        return first, *others[: max(0, parts - 1 - waits)]

    @once
    def around_corners(self, station_name: str, kind: str, loaded: bool, cells: tuple[Cell, ...]) -> tuple[int, ...]:
        """The indices of the cells that remain when a path around a part is cut where straight lines are free."""
        station, into = self.task.station(station_name), self.into(station_name)
        with ExitStack() as worlds:
            around = [
                self._around(worlds.enter_context(World()), station, kind, loaded, spot)
                for spot in self.spots_in_use(station, kind, loaded)
            ]
            first = around[0][1]

            def free(line: Sequence[ToolPose]) -> bool:
                turned = [0.0 if into is not None else goal.yaw - first.yaw for _, goal in around]
                return all(
                    surveyor.free([_as_at(pose, first, goal, turn) for pose in line])
                    for (surveyor, goal), turn in zip(around, turned, strict=True)
                )

            return corners([near_pose(first, cell, into) for cell in cells], _NEAR_STEP_M, free)

    def _around(self, world: World, station: Station, kind: str, loaded: bool, spot: Spot) -> tuple[Surveyor, ToolPose]:
        """The surveyor for the space around a part on a spot, and the tool pose at which the fingers act."""
        own, scene = self.kinds[kind], Scene(world, self.task, (), self.layout)
        for name, (neighbour, other) in self.places.neighbours(station, spot).items():
            if self._may_stand(station, neighbour, other, kind, loaded):
                self._stand(scene, name, neighbour, other)
        foot = self.places.raised(kind, station, spot)
        if foot != spot:
            self._stand(scene, "the part", str(self.task.part(kind).pallet), spot)
        goal = own.held_at(foot)
        if loaded:
            goal = goal.shifted(dz=RELEASE_ABOVE)
        else:
            self._stand(scene, "the part", kind, foot)
        beside_finger = (scene.robot.arm.gripper.opening_m - own.grip.width_m) / 2
        clearance = min(TOUCH_CLEARANCE[loaded], FINGER_SHARE * beside_finger)
        return Surveyor(scene, kind if loaded else None, clearance=clearance), goal

    def check_free(self, what: str, poses: Sequence[ToolPose]) -> None:
        """Raise BadInput, naming what is in the way, when the empty tool cannot be at one of these poses."""
        with World() as world:
            surveyor = Surveyor(Scene(world, self.task, (), self.layout), None, clearance=TOUCH_CLEARANCE[False])
            for pose in poses:
                if cause := surveyor.cause(pose):
                    why = cause if cause == OUT_OF_REACH else f"in the way: {cause}"
                    raise BadInput(f"{what}: at ({pose.x:.2f}, {pose.y:.2f}, {pose.z:.2f}) m {why}")

    def _stand(self, scene: Scene, name: str, kind: str, spot: Spot) -> None:
        """Add a part to the scene that nothing may touch."""
        scene.add(name, kind, spot)
        scene.solid += scene.bodies_of(name, kind)

    @once
    def camera_grid(self, station: str, kind: str) -> SurveyedGrid:
        """The camera's grid in front of a station, for a part of a kind, with its picture taken."""
        grid = SurveyedGrid(self.task, self.layout, self.places, station, kind, self.parts)
        grid.picture()
        return grid


def _survey(surveys: Surveys, name: SurveyName) -> object:
    """The result of a survey, given by its name; None when it cannot be made."""
    method, *arguments = name
    try:
        return getattr(surveys, str(method))(*arguments)
    except LabError:
        return None


def _between(start: ToolPose, end: ToolPose) -> list[ToolPose]:
    """Eight poses on the level line from `start` to the point above or below `end`."""
    shares = np.linspace(0.0, 1.0, 8)
    x, y = end.x - start.x, end.y - start.y
    return [ToolPose(start.x + share * x, start.y + share * y, start.z, start.yaw) for share in shares]


def _as_at(pose: ToolPose, goal: ToolPose, other: ToolPose, turn: float) -> ToolPose:
    """The pose relative to `other` that `pose` is relative to `goal`; `other` is turned by `turn` [rad]."""
    x, y = beside((other.x, other.y), turn, (pose.x - goal.x, pose.y - goal.y))
    return ToolPose(x, y, pose.z - goal.z + other.z, pose.yaw - goal.yaw + other.yaw)
