"""Grasp: the gripper comes to a slice, aligns itself, closes, and lifts the slice."""

from collections.abc import Iterator
from math import hypot
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import NoPath, TabularMDP, grid
from lab.sim.blocked_cells import Survey
from lab.sim.kinematics import ToolPose, inverse
from lab.sim.scene import spots
from lab.skills.skill import Bench, Skill, SkillFailed, learned_path, no_way, over_everything
from lab.skills.surveys import NEAR_SHAPE, NEAR_STEP_M, NEAR_YAW_STEP, NEAR_YAWS, Surveys, near_pose
from lab.tasks.task_file import Task

if TYPE_CHECKING:
    from lab.toolbox.policy import Policy

ACTIONS = ("left", "right", "backward", "forward", "down", "up", "turn right", "turn left")  # of the slice's axes
GOAL = (2, 2, 0, 2)
FAR_M = 0.2  # [m] a tool farther from the station's approach, as when trying again, comes over everything
_SLOW = 0.6
_BLEND_M = 0.008


class Grasp(Skill):
    """Take a slice at one station: the table holds the tool's pose relative to the slice (x, y, z, yaw)."""

    subtask: ClassVar[str] = "grasp"
    help: ClassVar[str] = "the gripper comes to a slice, closes and lifts it"
    near: ClassVar[bool] = True
    tried: ClassVar[bool] = True
    looks_from: ClassVar[tuple[float, float]] = (-60.0, 28.0)

    def __init__(self, station: str) -> None:
        super().__init__(f"grasp at {station}")
        self.station = station

    @classmethod
    def at_pick(cls, task: Task, station: str) -> "Grasp":
        """It takes slices up everywhere."""
        return cls(station)

    def setup(self, surveys: Surveys) -> Problem:
        """The poses around a slice with slices beside it; episodes begin anywhere above it."""
        self.surveys = surveys
        survey = surveys.around(self.station, False)
        try:
            start = free_above(self.name, survey, GOAL)
            mdp = grid(survey.causes.shape, survey.blocked, start, GOAL, surveys.task.subtask("grasp").rewards, ACTIONS)
        except NoPath as error:
            raise no_way(self.name, error, survey.names(error.enclosing)) from None
        self.problem = Problem(self.name, self.subtask, from_above(mdp))
        return self.problem

    def pose(self, state: int, goal: ToolPose | None = None) -> ToolPose:
        """Around a slice that `goal` would hold, by default one that stands on the station's first spot."""
        around = goal or spots(self.surveys.task.station(self.station))[0].grasp()
        return near_pose(around, self.problem.mdp.state_cell(state))

    def motion(self, bench: Bench, policy: "Policy") -> Iterator[None]:
        """Open, go above the slice, follow the learned cells down, close, lift, and see that the slice came along."""
        robot, mdp, name = bench.scene.robot, self.problem.mdp, self.slice
        if robot.closed:
            yield from robot.release()
        goal = bench.slice_pose(name)
        if inverse(goal) is None:
            raise SkillFailed(f"{name} is out of reach at ({goal.x:.2f}, {goal.y:.2f}) m")
        tool, approach = robot.tool(), self.surveys.approach(self.station)
        if tool.z < approach.z - 0.01 or hypot(tool.x - approach.x, tool.y - approach.y) > FAR_M:
            yield from over_everything(bench, approach)
        entry = entry_cell(goal, robot.tool())
        path = learned_path(policy, mdp, int(np.ravel_multi_index(entry, mdp.shape)))
        poses = [self.pose(state, goal) for state in path]
        high = max(robot.tool().z, poses[0].z)
        yield from robot.follow([ToolPose(poses[0].x, poses[0].y, high, poses[0].yaw)], slow=_SLOW)
        yield from robot.follow(poses, blend=_BLEND_M, slow=_SLOW)
        yield from robot.grip()
        bench.held = name
        lifted = self.surveys.approach(self.station)
        yield from robot.follow([ToolPose(goal.x, goal.y, lifted.z, goal.yaw)], slow=_SLOW)
        yield from robot.follow([lifted], slow=_SLOW)
        if not bench.holds(name):
            bench.held = None
            raise SkillFailed(f"{name} is not in the gripper after grasping at '{self.station}'")

    def begins_at(self) -> ToolPose:
        """At the station's approach."""
        return self.surveys.approach(self.station)


def _top(x: int, y: int, yaw: int) -> tuple[int, int, int, int]:
    return (x, y, NEAR_SHAPE[2] - 1, yaw)


def free_above(what: str, survey: Survey, goal: tuple[int, ...]) -> tuple[int, ...]:
    """The first free cell of the highest level; BadInput names what blocks them all, or the goal."""
    top = [cell for cell in np.ndindex(*survey.causes.shape) if cell[2] == NEAR_SHAPE[2] - 1]
    free = [cell for cell in top if not survey.blocked[cell]]
    if survey.blocked[goal] or not free:
        names = survey.names([goal] if survey.blocked[goal] else top)
        raise BadInput(f"{what}: no room for gripper and slice; in the way: {', '.join(names)}")
    return free[0]


def from_above(mdp: TabularMDP) -> TabularMDP:
    """The same problem with episodes that begin in any free cell of the highest level."""
    from dataclasses import replace

    levels = np.indices(mdp.shape)[2].ravel()
    starts = np.flatnonzero((levels == NEAR_SHAPE[2] - 1) & ~mdp.terminal)
    return replace(mdp, starts=tuple(int(s) for s in starts))


def entry_cell(goal: ToolPose, tool: ToolPose) -> tuple[int, int, int, int]:
    """The cell of the highest level that is nearest to where the tool is, seen from the slice."""
    c, s = np.cos(goal.yaw), np.sin(goal.yaw)
    dx, dy = tool.x - goal.x, tool.y - goal.y
    along, across = c * dx + s * dy, -s * dx + c * dy
    turn = (tool.yaw - goal.yaw + np.pi / 2) % np.pi - np.pi / 2
    x = int(np.clip(round(along / NEAR_STEP_M[0]) + 2, 0, NEAR_SHAPE[0] - 1))
    y = int(np.clip(round(across / NEAR_STEP_M[1]) + 2, 0, NEAR_SHAPE[1] - 1))
    yaw = int(np.clip(round(turn / NEAR_YAW_STEP) + NEAR_YAWS // 2, 0, NEAR_YAWS - 1))
    return _top(x, y, yaw)
