"""Grasp: the gripper comes to a part, aligns itself, closes, and lifts the part."""

from collections.abc import Iterator
from dataclasses import replace
from math import hypot
from typing import ClassVar

from lab.sim.arms.kinematics import ToolPose
from lab.skills.around_part import SLOW, AroundPart
from lab.skills.free_way import FAR_M, by_free_cells, look_at
from lab.skills.sight import SkillFailed
from lab.skills.skill import Bench
from lab.skills.state_words import plain
from lab.tasks.task import Task
from lab.toolbox.policy import Policy

ACTIONS = ("left", "right", "backward", "forward", "down", "up", "turn right", "turn left")  # of the part's axes
GOAL = (2, 2, 0, 2)
ASTRAY_M = (
    0.15  # [m] a part farther from every spot of the station counts as astray, and is approached above everything
)


class Grasp(AroundPart):
    """Grasp a part at one station; a state is the tool's pose relative to the part (x, y, z, yaw)."""

    subtask: ClassVar[str] = "grasp"
    help: ClassVar[str] = "the gripper comes to a part, closes and lifts it"
    doing: ClassVar[str] = "takes {part} up"
    tried: ClassVar[bool] = True
    actions: ClassVar[tuple[str, ...]] = ACTIONS
    goal: ClassVar[tuple[int, ...]] = GOAL

    @classmethod
    def at_pick(cls, task: Task, kind: str, station: str) -> "Grasp":
        """The skill that grasps a part of a kind at a station: any station has one."""
        return cls(task, kind, station)

    def way_in_words(self) -> tuple[str, str]:
        """The open fingers, and the place where they close on the part."""
        return "The open fingers are", f"where they close on {plain(self.kind)}"

    def motion(self, bench: Bench, policy: Policy) -> Iterator[None]:
        """Open, move above the part, follow the learned path down, close, lift, and check that the part is held."""
        robot, body = bench.scene.robot, bench.scene.body_of(self.part, self.kind)
        if robot.closed:
            yield from robot.release()
        spot = self.stands_on() if bench.sight is None else bench.sight.where.get(body, self.stands_on())
        yield from look_at(bench, self.surveys, self.station, body, spot)
        goal = bench.part_pose(body, self.goal_pose().yaw)
        if robot.arm.inverse(goal) is None:
            raise SkillFailed(f"{body} is out of reach at ({goal.x:.2f}, {goal.y:.2f}) m")
        tool, approach = robot.tool(), self.surveys.approach(self.station)
        if tool.z < approach.z - 0.01 or hypot(tool.x - approach.x, tool.y - approach.y) > FAR_M:
            yield from by_free_cells(bench, self.surveys, approach)
        astray = self._is_astray(goal)
        if astray:
            yield from by_free_cells(bench, self.surveys, replace(goal, z=approach.z))
        yield from self.down(bench, policy, goal)
        yield from robot.grip(bench.scene.grips_n[self.kind])
        bench.held = body
        if astray:
            yield from by_free_cells(bench, self.surveys, approach, self.kind)
        else:
            for pose in self.surveys.exit_path(self.station, goal):
                yield from robot.follow([pose], slow=SLOW)
        if not bench.holds(body):
            bench.held = None
            raise SkillFailed(f"{body} is not in the gripper after grasping at '{self.station}'")

    def _is_astray(self, goal: ToolPose) -> bool:
        """Whether the part stands farther than ASTRAY_M from every spot of the station."""
        spots = self.surveys.places.spots(self.surveys.task.station(self.station))
        return all(hypot(goal.x - spot.x, goal.y - spot.y) > ASTRAY_M for spot in spots)
