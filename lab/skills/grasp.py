"""Grasp: the gripper comes to a slice, aligns itself, closes, and lifts the slice."""

from collections.abc import Iterator
from math import hypot
from typing import TYPE_CHECKING, ClassVar

from lab.sim.kinematics import ToolPose
from lab.sim.scene import spots
from lab.skills.around_slice import SLOW, AroundSlice
from lab.skills.skill import Bench, SkillFailed, over_everything
from lab.tasks.task_file import Task

if TYPE_CHECKING:
    from lab.toolbox.policy import Policy

ACTIONS = ("left", "right", "backward", "forward", "down", "up", "turn right", "turn left")  # of the slice's axes
GOAL = (2, 2, 0, 2)
FAR_M = 0.2  # [m] a tool farther from the station's approach, as when trying again, comes over everything


class Grasp(AroundSlice):
    """Take a slice at one station: the table holds the tool's pose relative to the slice (x, y, z, yaw)."""

    subtask: ClassVar[str] = "grasp"
    help: ClassVar[str] = "the gripper comes to a slice, closes and lifts it"
    tried: ClassVar[bool] = True
    actions: ClassVar[tuple[str, ...]] = ACTIONS
    goal: ClassVar[tuple[int, ...]] = GOAL

    @classmethod
    def at_pick(cls, task: Task, station: str) -> "Grasp":
        """It takes slices up everywhere."""
        return cls(station)

    def goal_pose(self) -> ToolPose:
        """That of a slice on the station's first spot."""
        return spots(self.surveys.task.station(self.station))[0].grasp()

    def motion(self, bench: Bench, policy: "Policy") -> Iterator[None]:
        """Open, go above the slice, follow the learned cells down, close, lift, and see that the slice came along."""
        robot, name = bench.scene.robot, self.slice
        if robot.closed:
            yield from robot.release()
        goal = bench.slice_pose(name)
        if robot.arm.inverse(goal) is None:
            raise SkillFailed(f"{name} is out of reach at ({goal.x:.2f}, {goal.y:.2f}) m")
        tool, approach = robot.tool(), self.surveys.approach(self.station)
        if tool.z < approach.z - 0.01 or hypot(tool.x - approach.x, tool.y - approach.y) > FAR_M:
            yield from over_everything(bench, approach)
        yield from self.down(bench, policy, goal)
        yield from robot.grip()
        bench.held = name
        yield from robot.follow([ToolPose(goal.x, goal.y, approach.z, goal.yaw)], slow=SLOW)
        yield from robot.follow([approach], slow=SLOW)
        if not bench.holds(name):
            bench.held = None
            raise SkillFailed(f"{name} is not in the gripper after grasping at '{self.station}'")
