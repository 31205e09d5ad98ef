"""Moves without a learned path: to a pose by way of free cells of the workspace, and above a part to look at it."""

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from math import hypot

import numpy as np

from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.kinds import Spot
from lab.sim.scene.blocked_cells import Survey
from lab.skills.sight import ABOVE_M, SkillFailed
from lab.skills.skill import Bench
from lab.skills.surveys import Cell, Surveys

_BLEND_M = 0.10


def by_free_cells(bench: Bench, surveys: Surveys, end: ToolPose, carried: str = "") -> Iterator[None]:
    """Bring the tool to `end` from anywhere, as before a second attempt: up, through free cells, and down.

    carried: the kind of part in the gripper, "" for none. If no free cells connect both ends, the tool crosses in a
    straight line at the highest level.
    """
    robot, tool = bench.scene.robot, bench.scene.robot.tool()
    survey = surveys.workspace(carried)
    first, last = (_nearest(surveys, survey, pose) for pose in (tool, end))
    cells = shortest(survey, first, last) or [first, last]
    way = [surveys.cell_pose(cell) for cell in cells]
    yield from robot.follow([ToolPose(tool.x, tool.y, max(tool.z, way[0].z), tool.yaw)])
    high = robot.tool()
    yield from robot.follow([ToolPose(high.x, high.y, high.z, way[0].yaw)])
    yield from robot.follow([*way, ToolPose(end.x, end.y, way[-1].z, way[-1].yaw)], blend=_BLEND_M)
    yield from robot.follow([ToolPose(end.x, end.y, way[-1].z, end.yaw), end])


def _nearest(surveys: Surveys, survey: Survey, pose: ToolPose) -> Cell:
    """The free cell nearest to a pose as seen from above, the lowest of those that are not below it."""
    free = [tuple(map(int, cell)) for cell in np.argwhere(~survey.blocked)]

    def far(cell: Cell) -> tuple[float, bool, float]:
        at = surveys.cell_pose(cell)
        return round(hypot(at.x - pose.x, at.y - pose.y), 6), at.z < pose.z - 1e-6, abs(at.z - pose.z)

    return min(free, key=far)


def shortest(survey: Survey, first: Cell, last: Cell) -> list[Cell]:
    """The cells of a shortest path between two free cells, neighbour by neighbour; [] when there is no path."""
    blocked, before = survey.blocked, dict[Cell, Cell]({first: first})
    pending = deque([first])
    while pending and last not in before:
        cell = pending.popleft()
        for axis in (2, 0, 1):
            for step in (1, -1):
                to = tuple(n + step * (k == axis) for k, n in enumerate(cell))
                inside = all(0 <= n < size for n, size in zip(to, blocked.shape, strict=True))
                if inside and not blocked[to] and to not in before:
                    before[to] = cell
                    pending.append(to)
    if last not in before:
        return []
    way = [last]
    while way[-1] != first:
        way.append(before[way[-1]])
    return way[::-1]


# ---- looking at a part with the camera in the hand ----------------------------------------------------------------------


FAR_M = 0.2  # [m] a tool farther from the station's approach, as before a second attempt, first moves above everything
SLOW = 0.6


def look_at(bench: Bench, surveys: Surveys, station: str, body: str, spot: Spot) -> Iterator[None]:
    """Locate, with the camera in the hand, a part expected at `spot`; does nothing in a task without such a camera.

    Raises SkillFailed when the part is not seen.
    """
    if bench.sight is None:
        return
    robot, approach = bench.scene.robot, surveys.approach(station)
    at = _over(bench, surveys, station, body, spot)
    tool = robot.tool()
    if tool.z < approach.z - 0.01 or hypot(tool.x - approach.x, tool.y - approach.y) > FAR_M:
        yield from by_free_cells(bench, surveys, at)
    elif hypot(tool.x - at.x, tool.y - at.y, tool.z - at.z) > 0.001:
        yield from robot.follow([at], slow=SLOW)
    if bench.sight.look(body, spot) is None:
        raise SkillFailed(f"the camera in the hand does not see {body} at '{station}'")


def _over(bench: Bench, surveys: Surveys, station: str, body: str, spot: Spot) -> ToolPose:
    """The pose above the part if the arm reaches it and the station is entered from above, else the station's approach."""
    approach = surveys.approach(station)
    if surveys.into(station) is not None:
        return approach
    kind = bench.scene.kind_of[body]
    held = kind.held_at(spot)
    yaw = kind.turned_like(held.yaw, approach.yaw)
    above = replace(held, z=max(approach.z, held.z + ABOVE_M), yaw=yaw)
    return approach if bench.scene.robot.arm.inverse(above) is None else above
