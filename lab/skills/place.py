"""Place: set a slice down on a plate, a buffer or in a machine's groove, and let go."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from lab.learning.problem import Problem
from lab.mdp import NoPath, grid
from lab.sim.kinematics import ToolPose
from lab.sim.scene import Spot, is_toaster, spots
from lab.skills.grasp import entry_cell, free_above, from_above
from lab.skills.skill import Bench, Skill, SkillFailed, learned_path, no_way
from lab.skills.surveys import RELEASE_ABOVE, Surveys, near_pose
from lab.tasks.task_file import Task

if TYPE_CHECKING:
    from lab.toolbox.policy import Policy

ACTIONS = ("left", "right", "backward", "forward", "down", "up")  # of the spot's axes
GOAL = (2, 2, 0)
NEAR_M = 0.012  # a slice this near to its spot stands on it
_SLOW = 0.6
_BLEND_M = 0.008


class Place(Skill):
    """Set a slice down at one station: the table holds the tool's position relative to the spot (x, y, z)."""

    subtask: ClassVar[str] = "place"
    help: ClassVar[str] = "a slice is set down at a station and let go"
    near: ClassVar[bool] = True
    looks_from: ClassVar[tuple[float, float]] = (-60.0, 28.0)
    carries = True

    def __init__(self, station: str) -> None:
        super().__init__(f"place at {station}")
        self.station = station

    @classmethod
    def on_carry(cls, task: Task, origin: str, target: str) -> "Place | None":
        """At the end, where the camera's grid does not lead."""
        return None if is_toaster(task.station(target)) else cls(target)

    def setup(self, surveys: Surveys) -> Problem:
        """The positions above a spot with slices beside it; episodes begin anywhere above it."""
        self.surveys = surveys
        survey = surveys.around(self.station, True)
        try:
            start = free_above(self.name, survey, GOAL)
            mdp = grid(survey.causes.shape, survey.blocked, start, GOAL, surveys.task.subtask("place").rewards, ACTIONS)
        except NoPath as error:
            raise no_way(self.name, error, survey.names(error.enclosing)) from None
        self.problem = Problem(self.name, self.subtask, from_above(mdp))
        return self.problem

    def pose(self, state: int, goal: ToolPose | None = None) -> ToolPose:
        """Around where the tool lets go, `goal`, by default that of a slice held in its middle."""
        around = goal or self._spot().grasp().shifted(dz=RELEASE_ABOVE)
        return near_pose(around, self.problem.mdp.state_cell(state))

    def _spot(self) -> Spot:
        return self.spot or spots(self.surveys.task.station(self.station))[0]

    def motion(self, bench: Bench, policy: "Policy") -> Iterator[None]:
        """Go above the spot, follow the learned cells down, let go, rise, and see that the slice stands."""
        robot, mdp, name = bench.scene.robot, self.problem.mdp, bench.held
        spot = self._spot()
        if name is None:
            raise SkillFailed(f"nothing in the gripper to place at '{self.station}'")
        goal = release_pose(bench, name, spot)
        entry = entry_cell(goal, robot.tool())[:3]
        path = learned_path(policy, mdp, int(np.ravel_multi_index(entry, mdp.shape)))
        poses = [self.pose(state, goal) for state in path]
        high = max(robot.tool().z, poses[0].z)
        yield from robot.follow([ToolPose(poses[0].x, poses[0].y, high, goal.yaw)], slow=_SLOW)
        yield from robot.follow(poses, blend=_BLEND_M, slow=_SLOW)
        yield from let_go(bench, goal, self.surveys.approach(self.station))
        if not bench.stands(name, spot.grasp(), NEAR_M):
            raise SkillFailed(f"{name} does not stand on '{self.station}'")

    def begins_at(self) -> ToolPose:
        """At the station's approach."""
        return self.surveys.approach(self.station)


def release_pose(bench: Bench, name: str, spot: Spot) -> ToolPose:
    """Where the tool lets go so that the slice, as it hangs in the fingers, stands on the spot."""
    tool, hangs, wanted = bench.scene.robot.tool(), bench.slice_pose(name), spot.grasp()
    c, s = np.cos(tool.yaw), np.sin(tool.yaw)
    along = c * (hangs.x - tool.x) + s * (hangs.y - tool.y)
    return wanted.local(-along, 0.0, tool.z - hangs.z + RELEASE_ABOVE)


def let_go(bench: Bench, at: ToolPose, approach: ToolPose) -> Iterator[None]:
    """Open the fingers, rise straight up, and come to the station's approach."""
    robot = bench.scene.robot
    yield from robot.release()
    bench.held = None
    yield from robot.follow([ToolPose(at.x, at.y, approach.z, at.yaw)], slow=_SLOW)
    yield from robot.follow([approach], slow=_SLOW)
