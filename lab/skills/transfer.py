"""Transfer: move the tool through the workspace from one approach to another, with or without a part in the fingers."""

from collections.abc import Iterator
from typing import ClassVar

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import NoPath, grid
from lab.sim.arms.kinematics import ToolPose
from lab.skills.sight import SkillFailed
from lab.skills.skill import Bench, Skill, learned_path, no_path_error
from lab.skills.state_words import plain
from lab.skills.surveys import SurveyName, Surveys, grid_of, way_to
from lab.tasks.task import Task
from lab.toolbox.policy import Policy

ACTIONS = ("left", "right", "backward", "forward", "down", "up")  # -x, +x, -y, +y, -z, +z, as seen from above
_BLEND_M = 0.10


class Transfer(Skill):
    """Move from one approach to another; a place is a station or the start of a camera's grid."""

    subtask: ClassVar[str] = "transfer"
    help: ClassVar[str] = "the tool's path through the workspace from one station to another"

    doing: ClassVar[str] = "carries {part}"

    def __init__(self, origin: str, target: str, kind: str = "") -> None:
        """kind: of the part that is carried; "": the gripper is empty."""
        super().__init__(f"transfer {origin} to {target}{f' with {kind}' if kind else ''}", kind)
        self.origin, self.target = origin, target
        self.carries = bool(kind)

    @classmethod
    def on_carry(cls, task: Task, kind: str, origin: str, target: str) -> "Transfer":
        """The transfer to the approach of the target, or to the start of its camera's grid."""
        return cls(origin, way_to(task, target), kind)

    @classmethod
    def on_travel(cls, task: Task, origin: str, target: str) -> "Transfer":
        """The transfer with an empty gripper, which is the whole travel."""
        return cls(origin, target)

    @property
    def needs(self) -> tuple[SurveyName, ...]:
        """The survey of the workspace, and those of the docks at both ends."""
        return ("workspace", self.kind), ("dock", self.origin, self.kind), ("dock", self.target, self.kind)

    def setup(self, surveys: Surveys) -> Problem:
        """The problem on the workspace as a 3D grid; cells out of reach or too close to a body are blocked."""
        self.surveys = surveys
        for place in (self.origin, self.target):
            surveys.cells_near(place)  # before the workspace is surveyed, which may take long
        survey = surveys.workspace(self.kind)
        self.blocking = survey.causes
        start, goal = surveys.dock(self.origin, self.kind), surveys.dock(self.target, self.kind)
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
            raise no_path_error(self.name, error, survey.names(error.enclosing)) from None
        self.problem = Problem(self.name, self.subtask, mdp)
        return self.problem

    def pose(self, state: int) -> ToolPose:
        """The tool pose in the middle of the state's cell of the workspace."""
        return self.surveys.cell_pose(self.problem.mdp.state_cell(state))

    def does(self, name: str) -> str:
        """A predicate: the robot carries the part from origin to target, or moves there empty."""
        return f"{self.doing.format(part=name) if self.carries else 'goes'} from '{self.origin}' to '{self.target}'"

    def begins_at(self) -> ToolPose:
        """The approach pose of the origin."""
        return self.surveys.approach(self.origin)

    def way_in_words(self) -> tuple[str, str]:
        """The gripper, and the place where the next skill begins."""
        what = f"The gripper with {plain(self.kind)} is" if self.carries else "The empty gripper is"
        camera = grid_of(self.surveys.task, self.target) is not None
        return (
            what,
            f"the end of its path{', where the camera takes over' if camera else f' over {plain(self.target)}'}",
        )

    def motion(self, bench: Bench, policy: Policy) -> Iterator[None]:
        """Follow the learned path from the tool's pose to the target's approach; its corners are cut where that is free."""
        mdp, robot = self.problem.mdp, bench.scene.robot
        poses = [self.pose(state) for state in learned_path(policy, mdp, mdp.start)]
        begin, end = self.surveys.approach(self.origin), self.surveys.approach(self.target)
        path = (_still(begin, poses[0]), *poses, _still(end, poses[-1]))
        _, *kept = self.surveys.travel_corners(self.kind, path)
        yield from robot.follow([_still(robot.tool(), poses[0]), *(path[n] for n in kept)], blend=_BLEND_M)
        if end.yaw:
            yield from robot.follow([end])
        grid = grid_of(self.surveys.task, self.target)
        if grid is not None:
            yield from robot.follow([ToolPose(end.x, end.y, grid.height_m, 0.0)])
        if self.carries and (bench.held is None or not bench.holds(bench.held)):
            raise SkillFailed(f"the part is not in the gripper on the way to '{self.target}'")
        if self.carries and (lost := bench.fallen_off(self.part, self.kind)):
            raise SkillFailed(f"{lost} has fallen off {bench.held} on the way to '{self.target}'")


def _still(tool: ToolPose, first: ToolPose) -> ToolPose:
    """The tool's position with the yaw of the path's first pose, so that the tool turns before it moves."""
    return ToolPose(tool.x, tool.y, tool.z, first.yaw)
