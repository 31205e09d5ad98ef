"""The ground plan of a task's cell, as far as it can be laid out and surveyed, even if a check rejects the task."""

import re
from contextlib import suppress
from dataclasses import replace
from math import hypot

import numpy as np

from lab.errors import BadInput
from lab.sim.arms.arm import Arm
from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.kinds import comes_as
from lab.sim.scene.ground_plan import (
    Approach,
    Block,
    BlockedCells,
    CameraCells,
    GroundPlan,
    PlannedObstacle,
    PlannedSpot,
    PlannedStation,
    ring_of,
)
from lab.sim.scene.places import Layout, Places
from lab.sim.scene.scene import TABLE_M, TABLE_MIDDLE_M
from lab.sim.scene.scene_check import places_of
from lab.skills.prepared_scene import lay_out
from lab.skills.surveys import Surveys, way_to
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import Station

UNKNOWN_M = 0.1  # [m] width at which a station is drawn when only its pose is known


def outline(task: Task, toasts: int | None, seed: int, fault: str = "") -> GroundPlan:
    """The ground plan of the cell laid out with `seed`.

    toasts: how many parts of the first kind; None: the order in the file. fault: the message of a check; whatever it
    names is marked.
    """
    order = _order(task, toasts)
    arm: Arm | None = None
    places: Places | None = None
    with suppress(BadInput):  # the check reports the reason; everything else is still drawn
        arm = arm_of(task.robot, task.folder)
        places = places_of(task)
    layout = Layout(tuple(obstacle.position_m for obstacle in task.obstacles), ())
    with suppress(BadInput):  # an obstacle cannot be placed: all are drawn where the file puts them
        layout = lay_out(task, order, seed)
    low = task.workspace.lower_m[2] + task.workspace.cell_m[2] / 2
    surveys = None if places is None else Surveys(task, order, layout)
    names = [s.name for s in task.stations] + [o.name for o in task.obstacles]
    return GroundPlan(
        title=task.title or task.name,
        table=Block(*TABLE_MIDDLE_M[:2], *TABLE_M[:2]),
        reach=None if arm is None else ring_of(arm.inverse, low, arm.nearest_m),
        height_m=low,
        stations=tuple(_station(station, places, arm, len(order), low) for station in task.stations),
        obstacles=tuple(_obstacles(task, layout)),
        blocked=None if surveys is None else _blocked(surveys),
        cameras=tuple(_cameras(task)),
        approaches=() if surveys is None else tuple(_approaches(surveys)),
        fault=fault,
        at_fault=frozenset(name for name in names if re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", fault)),
    )


def _order(task: Task, toasts: int | None) -> Order:
    """The order; one part of each kind if that order is not possible."""
    try:
        return task.order(toasts)
    except BadInput:
        return tuple(part.name for part in task.made)


def _station(station: Station, places: Places | None, arm: Arm | None, parts: int, low: float) -> PlannedStation:
    if places is None:
        x, y, yaw = station.pose
        return PlannedStation(station.name, station.kind, Block(x, y, UNKNOWN_M, UNKNOWN_M, yaw), ())
    spots, used = places.spots(station), len(places.used_spots(station, parts))
    reached = [True] * len(spots)
    size = (UNKNOWN_M, UNKNOWN_M)
    if kinds := places.kinds_at(station.name):
        along, across = np.max([kind.footprint_m() for kind in kinds], axis=0).tolist()
        size = (2 * along, 2 * across)
        poses = [[kind.held_at(spot) for kind in kinds] for spot in spots]
        reached = [arm is None or all(_reached(arm, pose, low) for pose in each) for each in poses]
    return PlannedStation(
        station.name,
        station.kind,
        _block(places, station, parts),
        tuple(
            PlannedSpot(Block(spot.x, spot.y, *size, spot.yaw), number < used, reached[number])
            for number, spot in enumerate(spots)
        ),
    )


def _block(places: Places, station: Station, parts: int) -> Block:
    body = places.body(station, parts)
    return Block(body.x, body.y, 2 * body.half_along, 2 * body.half_across, body.yaw)


def _reached(arm: Arm, pose: ToolPose, low: float) -> bool:
    above = ToolPose(pose.x, pose.y, low, pose.yaw)
    return hypot(pose.x, pose.y) >= arm.nearest_m and all(arm.inverse(at) is not None for at in (pose, above))


def _obstacles(task: Task, layout: Layout) -> list[PlannedObstacle]:
    obstacles = []
    for obstacle, (x, y) in zip(task.obstacles, layout.obstacles, strict=True):
        own = Block(0.0, 0.0, *obstacle.size[:2], obstacle.yaw)
        wide, high = (np.ptp(own.corners(), axis=0) + 2 * np.array(obstacle.area)).tolist()
        around = Block(*obstacle.position_m, wide, high)
        obstacles.append(PlannedObstacle(obstacle.name, replace(own, x=x, y=y), around))
    return obstacles


def _blocked(surveys: Surveys) -> BlockedCells:
    """The cells of the lowest level that are blocked for some carried part."""
    grid, causes = surveys.task.workspace, None
    for part in surveys.task.made:
        lowest = surveys.workspace(comes_as(part)).causes[:, :, 0]
        causes = lowest if causes is None else np.where(causes == "", lowest, causes)
    assert causes is not None
    return BlockedCells(grid.lower_m[:2], grid.cell_m[:2], causes)


def _cameras(task: Task) -> list[CameraCells]:
    grids = [station.grid for station in task.stations if station.grid is not None]
    return [CameraCells(grid.origin_m, grid.cell_m, grid.shape, grid.start_m) for grid in grids]


def _approaches(surveys: Surveys) -> list[Approach]:
    """The approaches of each place with each kind carried there; if a kind cannot reach a place, only that approach."""
    task, approaches = surveys.task, []
    for station in task.stations:
        carried = [comes_as(part) for part in task.kinds_at(station.name)]
        for place in dict.fromkeys((station.name, way_to(task, station.name))):
            at = surveys.approach(place)
            try:
                docks = [surveys.cell_pose(surveys.dock(place, kind)) for kind in carried]
            except BadInput:
                approaches.append(Approach(place, (at.x, at.y), None))
            else:
                approaches += [Approach(place, (at.x, at.y), (dock.x, dock.y)) for dock in docks[:1]]
    return approaches
