"""Transfer: the tool's way through the workspace between two approaches, with or without a slice in the fingers."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import NoPath, grid
from lab.sim.kinematics import ToolPose
from lab.sim.scene import is_toaster
from lab.skills.skill import Bench, Skill, SkillFailed, learned_path, no_way
from lab.skills.surveys import INSERT_START, Surveys
from lab.tasks.task_file import Task

if TYPE_CHECKING:
    from lab.toolbox.policy import Policy

ACTIONS = ("left", "right", "backward", "forward", "down", "up")  # -x, +x, -y, +y, -z, +z, as seen from above
_BLEND_M = 0.10


class Transfer(Skill):
    """From one approach to another; a place is a station or the start of the insert grid."""

    subtask: ClassVar[str] = "transfer"
    help: ClassVar[str] = "the tool's way through the workspace from one station to another"

    def __init__(self, origin: str, target: str, *, loaded: bool) -> None:
        super().__init__(f"transfer {origin} to {target}{' with slice' if loaded else ''}")
        self.origin, self.target, self.loaded = origin, target, loaded
        self.carries = loaded

    @classmethod
    def on_carry(cls, task: Task, origin: str, target: str) -> "Transfer":
        """First of all, to where the slice is set down, or on through the camera's grid."""
        return cls(origin, INSERT_START if is_toaster(task.station(target)) else target, loaded=True)

    @classmethod
    def on_travel(cls, task: Task, origin: str, target: str) -> "Transfer":
        """All of it."""
        return cls(origin, target, loaded=False)

    def setup(self, surveys: Surveys) -> Problem:
        """The workspace as a 3D grid: cells that are out of reach or too near to something are blocked."""
        self.surveys = surveys
        survey = surveys.workspace(self.loaded)
        start, goal = surveys.dock(self.origin, self.loaded), surveys.dock(self.target, self.loaded)
        if start == goal:
            raise BadInput(
                f"{self.name}: both ends are approached from the same cell {goal} of the workspace: "
                "move the stations apart, or make workspace.cell_m smaller"
            )
        try:
            mdp = grid(
                survey.causes.shape, survey.blocked, start, goal, surveys.task.subtask("transfer").rewards, ACTIONS
            )
        except NoPath as error:
            raise no_way(self.name, error, survey.names(error.enclosing)) from None
        self.problem = Problem(self.name, self.subtask, mdp)
        return self.problem

    def pose(self, state: int) -> ToolPose:
        """In the middle of the workspace's cell."""
        return self.surveys.cell_pose(self.problem.mdp.state_cell(state))

    def begins_at(self) -> ToolPose:
        """At the origin's approach."""
        return self.surveys.approach(self.origin)

    def motion(self, bench: Bench, policy: "Policy") -> Iterator[None]:
        """Along the learned cells from where the tool is, then to the target's approach."""
        mdp = self.problem.mdp
        poses = [self.pose(state) for state in learned_path(policy, mdp, mdp.start)]
        end = self.surveys.approach(self.target)
        robot = bench.scene.robot
        yield from robot.follow(
            [_still(robot.tool(), poses[0]), *poses, ToolPose(end.x, end.y, end.z, 0.0)], blend=_BLEND_M
        )
        if end.yaw:
            yield from robot.follow([end])
        if self.target == INSERT_START:
            yield from robot.follow([ToolPose(end.x, end.y, self.surveys.task.insert.height_m, 0.0)])
        if self.loaded and (bench.held is None or not bench.holds(bench.held)):
            raise SkillFailed(f"the slice is not in the gripper on the way to '{self.target}'")


def _still(tool: ToolPose, first: ToolPose) -> ToolPose:
    """Where the tool is, already at the path's yaw: it turns on the spot, not on the way."""
    return ToolPose(tool.x, tool.y, tool.z, first.yaw)
