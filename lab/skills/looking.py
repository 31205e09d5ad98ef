"""A look at a part with the camera in the hand: the tool goes over where the part should stand, and a picture is taken."""

from collections.abc import Iterator
from dataclasses import replace
from math import hypot

from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.kinds import Spot
from lab.skills.free_way import by_free_cells
from lab.skills.sight import ABOVE_M, SkillFailed
from lab.skills.skill import Bench
from lab.skills.surveys import Surveys

FAR_M = 0.2  # [m] a tool farther from the station's approach, as when trying again, comes over everything
SLOW = 0.6


def look_at(bench: Bench, surveys: Surveys, station: str, body: str, spot: Spot) -> Iterator[None]:
    """See where a part is that should stand at `spot`; nothing is done where the task does not look. Raises SkillFailed."""
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
    """Above the part, where the arm reaches that; else, and where parts are taken from the side, the station's approach."""
    approach = surveys.approach(station)
    if surveys.into(station) is not None:
        return approach
    kind = bench.scene.kind_of[body]
    held = kind.held_at(spot)
    yaw = kind.turned_like(held.yaw, approach.yaw)
    above = replace(held, z=max(approach.z, held.z + ABOVE_M), yaw=yaw)
    return approach if bench.scene.robot.arm.inverse(above) is None else above
