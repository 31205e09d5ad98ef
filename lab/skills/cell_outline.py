"""A task's cell seen from above, as far as it can be laid out and surveyed: also of a task that a check refuses."""

import re

import numpy as np

from lab.errors import BadInput
from lab.sim import kinematics, models
from lab.sim.ground_plan import (
    XY,
    Approach,
    Block,
    BlockedCells,
    CameraCells,
    GroundPlan,
    PlannedObstacle,
    PlannedSpot,
    PlannedStation,
)
from lab.sim.kinematics import ToolPose
from lab.sim.reach import ring_of
from lab.sim.scene import (
    APPLIER_BASE,
    NEAREST_M,
    Layout,
    Spot,
    beside,
    draw_layout,
    is_applier,
    spots,
    used_spots,
)
from lab.skills.surveys import INSERT_START, Surveys
from lab.tasks.task_file import Station, Task, fitting

TABLE = Block(0.35, 0.0, 2.2, 2.9)
SLAB_AROUND_M = (0.18, 0.10)


def outline(task: Task, toasts: int | None, seed: int, fault: str = "") -> GroundPlan:
    """The cell as a seed lays it out, for so many toasts; `fault` is what a check says of it."""
    toasts = fitting(task, toasts or 3)
    try:
        layout = draw_layout(task, toasts, np.random.default_rng([seed, 1]))
    except BadInput:  # an obstacle finds no place: all stand where the file has them
        layout = Layout(tuple(obstacle.position_m for obstacle in task.obstacles), ())
    try:
        surveys = Surveys(task, layout)
    except BadInput:  # what is out of reach is not surveyed
        surveys = None
    low = task.workspace.lower_m[2] + task.workspace.cell_m[2] / 2
    places = [s.name for s in task.stations] + [o.name for o in task.obstacles]
    return GroundPlan(
        title=task.title or task.name,
        table=TABLE,
        reach=ring_of(kinematics.inverse, low, NEAREST_M),
        height_m=low,
        stations=tuple(_station(station, toasts, low) for station in task.stations),
        obstacles=tuple(_obstacles(task, layout)),
        blocked=None if surveys is None else _blocked(surveys),
        cameras=(CameraCells(task.insert.origin_m, task.insert.cell_m, task.insert.shape, task.insert.start_m),),
        approaches=() if surveys is None else tuple(_approaches(surveys)),
        fault=fault,
        at_fault=frozenset(name for name in places if re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", fault)),
    )


def _station(station: Station, toasts: int, low: float) -> PlannedStation:
    used = len(used_spots(station, toasts))
    feet = tuple(
        PlannedSpot(Block(spot.x, spot.y, *models.SLICE[:2], spot.yaw), number < used, _reached(spot, low))
        for number, spot in enumerate(spots(station))
    )
    return PlannedStation(station.name, station.kind, _body(station, toasts), feet)


def _reached(spot: Spot, low: float) -> bool:
    pose = spot.grasp()
    poses = (pose, ToolPose(pose.x, pose.y, low, pose.yaw))
    return np.hypot(pose.x, pose.y) >= NEAREST_M and all(kinematics.inverse(at) is not None for at in poses)


def _body(station: Station, toasts: int) -> Block:
    x, y, yaw = station.pose
    if station.kind == "machine":
        length, width, off = APPLIER_BASE if is_applier(station) else (*models.TOASTER[:2], 0.0)
        return Block(*beside((x, y), yaw, (0.0, off)), length, width, yaw)
    feet = [beside((0.0, 0.0), -yaw, (spot.x - x, spot.y - y)) for spot in used_spots(station, toasts)]
    low, high = np.min(feet, axis=0), np.max(feet, axis=0)
    length, width = (high - low + SLAB_AROUND_M).tolist()
    return Block(*beside((x, y), yaw, ((low + high) / 2).tolist()), length, width, yaw)


def _obstacles(task: Task, layout: Layout) -> list[PlannedObstacle]:
    found = []
    for obstacle, (x, y) in zip(task.obstacles, layout.obstacles, strict=True):
        edge, (dx, dy) = obstacle.edge_m, obstacle.area
        around = Block(*obstacle.position_m, edge + 2 * dx, edge + 2 * dy)
        found.append(PlannedObstacle(obstacle.name, Block(x, y, edge, edge), around))
    return found


def _blocked(surveys: Surveys) -> BlockedCells:
    grid = surveys.task.workspace
    return BlockedCells(grid.lower_m[:2], grid.cell_m[:2], surveys.workspace(True).causes[:, :, 0])


def _approaches(surveys: Surveys) -> list[Approach]:
    found = []
    for place in [*(station.name for station in surveys.task.stations), INSERT_START]:
        at = surveys.approach(place)
        try:
            pose = surveys.cell_pose(surveys.dock(place, True))
        except BadInput:
            dock: XY | None = None
        else:
            dock = (pose.x, pose.y)
        found.append(Approach(place, (at.x, at.y), dock))
    return found
