"""What grasp and place share: a grid of tool poses around one part, from any start above it down to where the fingers act."""

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import NoPath, TabularMDP, grid
from lab.sim.arms.kinematics import ToolPose
from lab.sim.scene.blocked_cells import OUT_OF_REACH, Survey, in_the_way
from lab.skills.skill import Bench, Skill, learned_path, no_path_error
from lab.skills.surveys import NEAR_SHAPE, NEAR_STEP_M, NEAR_YAW_STEP, NEAR_YAWS, SurveyName, Surveys, near_pose
from lab.tasks.task import Task
from lab.toolbox.policy import Policy

SLOW = 0.6
SIDEWAYS = {
    "left": "lower",
    "right": "higher",
    "down": "in",
    "up": "out",
}  # move names at a station entered from the side
_BLEND_M = 0.008


class AroundPart(Skill):
    """A skill at one station whose states are tool poses relative to the part: x, y, z, and yaw where the tool may turn."""

    near: ClassVar[bool] = True
    looks_from: ClassVar[tuple[float, float]] = (-60.0, 28.0)
    actions: ClassVar[tuple[str, ...]]
    goal: ClassVar[tuple[int, ...]]  # the cell where the fingers close or open

    def __init__(self, task: Task, kind: str, station: str) -> None:
        super().__init__(f"{self.subtask}{task.called(kind)} at {station}", kind)
        self.station = station

    @property
    def needs(self) -> tuple[SurveyName, ...]:
        """The survey of the poses around the part."""
        return (("around", self.station, self.kind, self.carries),)

    def setup(self, surveys: Surveys) -> Problem:
        """The problem over the poses around a part with neighbours beside it; episodes begin in any free cell above it."""
        self.surveys = surveys
        survey = surveys.around(self.station, self.kind, self.carries)
        self.blocking = survey.causes
        rewards = surveys.task.subtask(self.subtask).rewards
        try:
            start = free_above(self.name, survey, self.goal, self.station)
            actions = (
                self.actions if surveys.into(self.station) is None else tuple(SIDEWAYS.get(a, a) for a in self.actions)
            )
            mdp = grid(survey.causes.shape, survey.blocked, start, self.goal, rewards, actions)
        except NoPath as error:
            raise no_path_error(self.name, error, survey.names(error.enclosing)) from None
        self.problem = Problem(self.name, self.subtask, from_above(mdp))
        return self.problem

    def goal_pose(self) -> ToolPose:
        """The tool pose of the goal cell, for the spot on which the part stands or is to be set down."""
        return self.own_kind.held_at(self.stands_on())

    def pose(self, state: int, goal: ToolPose | None = None) -> ToolPose:
        """The tool pose of a state, relative to `goal`: by default to the part's place according to the task."""
        return near_pose(goal or self.goal_pose(), self.problem.mdp.state_cell(state), self.surveys.into(self.station))

    def begins_at(self) -> ToolPose:
        """The approach pose of the station."""
        return self.surveys.approach(self.station)

    def down(self, bench: Bench, policy: Policy, goal: ToolPose) -> Iterator[None]:
        """Move above the part (or in front of it, at a station entered from the side), then along the learned path to `goal`.

        Path corners are cut where the straight line is free.
        """
        robot, mdp = bench.scene.robot, self.problem.mdp
        entry = entry_cell(goal, robot.tool(), self.surveys.into(self.station) is not None)[: len(mdp.shape)]
        begin = min(mdp.starts, key=lambda state: np.abs(np.subtract(mdp.state_cell(state), entry)).sum())
        path = learned_path(policy, mdp, begin)
        cells = tuple(mdp.state_cell(state) for state in path)
        kept = self.surveys.around_corners(self.station, self.kind, self.carries, cells)
        poses = [self.pose(path[n], goal) for n in kept]
        high = max(robot.tool().z, poses[0].z)
        yield from robot.follow([ToolPose(poses[0].x, poses[0].y, high, poses[0].yaw)], slow=SLOW)
        yield from robot.follow(poses, blend=_BLEND_M, slow=SLOW)


def free_above(what: str, survey: Survey, goal: tuple[int, ...], station: str) -> tuple[int, ...]:
    """The first free cell of the highest level at a station. BadInput names what blocks that whole level, or the goal."""
    top = [cell for cell in np.ndindex(*survey.causes.shape) if cell[2] == NEAR_SHAPE[2] - 1]
    free = [cell for cell in top if not survey.blocked[cell]]
    if survey.blocked[goal] or not free:
        names = survey.names([goal] if survey.blocked[goal] else top)
        why = in_the_way(names, station)
        if names not in ([station], [OUT_OF_REACH]):
            why += ": move that, or say spots that are farther apart"
        less = "" if names == [OUT_OF_REACH] else ", or let the fingers open less (opening_m)"
        raise BadInput(f"{what}: no room for gripper and part; {why}{less}")
    return free[0]


def from_above(mdp: TabularMDP) -> TabularMDP:
    """The same problem, with every free cell of the highest level as a start state."""
    levels = np.indices(mdp.shape)[2].ravel()
    starts = np.flatnonzero((levels == NEAR_SHAPE[2] - 1) & ~mdp.terminal)
    return replace(mdp, starts=tuple(int(s) for s in starts))


def nearest_start(mdp: TabularMDP, cell: tuple[int, ...]) -> int:
    """The start state that is the fewest grid steps from a cell; the cell itself may be blocked."""
    return min(mdp.starts, key=lambda state: np.abs(np.subtract(mdp.state_cell(state), cell)).sum())


def entry_cell(goal: ToolPose, tool: ToolPose, from_the_side: bool = False) -> tuple[int, int, int, int]:
    """The cell (x, y, z, yaw) of the highest level nearest to the tool, in the part's frame; from the side, the middle one."""
    c, s = np.cos(goal.yaw), np.sin(goal.yaw)
    dx, dy = tool.x - goal.x, tool.y - goal.y
    along, across = c * dx + s * dy, -s * dx + c * dy
    turn = (tool.yaw - goal.yaw + np.pi / 2) % np.pi - np.pi / 2
    x = int(np.clip(round(along / NEAR_STEP_M[0]) + 2, 0, NEAR_SHAPE[0] - 1))
    y = int(np.clip(round(across / NEAR_STEP_M[1]) + 2, 0, NEAR_SHAPE[1] - 1))
    if from_the_side:
        x, y = 2, 2
    yaw = int(np.clip(round(turn / NEAR_YAW_STEP) + NEAR_YAWS // 2, 0, NEAR_YAWS - 1))
    return (x, y, NEAR_SHAPE[2] - 1, yaw)
