"""What all skills share: one life, from what a task needs of them to what they show, and the bench they work at."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from math import atan2, hypot
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, WorkFailed
from lab.learning.problem import Problem
from lab.mdp import NoPath, TabularMDP, greedy_path
from lab.sim import models
from lab.sim.frames import Body
from lab.sim.kinematics import ToolPose
from lab.sim.scene import GRASP_DEPTH, Scene, Spot, spots
from lab.tasks.task_file import Task
from lab.vision import GridView

if TYPE_CHECKING:
    from lab.skills.surveys import Surveys
    from lab.toolbox.policy import Policy

LOST_M = 0.03  # [m] a slice farther than this from where the fingers hold it is not held
UPRIGHT = 0.97  # cosine of the largest tilt of a slice that stands
FINGERS_OFF_M = 0.0005  # [m] of a finger off a slice that is put between them
TRIED_WITH = "slice 1"
SETTLE_STEPS = 60  # physics steps until a new scene is at rest
STAND_STEPS = 15  # physics steps until what was put somewhere at once is at rest


class Status(Enum):
    """Where a skill is in its life."""

    IDLE = "idle"
    RUNNING = "running"
    SUCCESS = "success"
    FAILURE = "failure"


class SkillFailed(Exception):
    """A skill noticed that it did not do what it is for; the text says why."""


@dataclass
class Bench:
    """The cell in which skills are carried out, and the slice that the robot holds."""

    scene: Scene
    held: str | None = None

    def slice_pose(self, name: str) -> ToolPose:
        """The tool pose that would hold the slice where it is now, its yaw within a quarter turn of the world's x axis."""
        position, turn = self.scene.world.pose(name)
        yaw = 2.0 * atan2(float(turn[2]), float(turn[3]))
        half = (yaw + np.pi / 2) % np.pi - np.pi / 2
        z = float(position[2]) + models.SLICE[2] / 2 - GRASP_DEPTH
        return ToolPose(float(position[0]), float(position[1]), z, float(half))

    def hold(self, name: str, pose: ToolPose) -> None:
        """Stand a new slice between the fingers of the tool that is at `pose`, and grip it."""
        scene = self.scene
        scene.robot.open_at_once(models.SLICE[1] / 2 + FINGERS_OFF_M)
        scene.add_slice(name, Spot(pose.x, pose.y, pose.z + GRASP_DEPTH - models.SLICE[2], pose.yaw))
        for _ in scene.robot.grip():
            scene.world.step()
        self.held = name

    def upright(self, name: str) -> float:
        """Cosine of a slice's tilt: 1 when it stands."""
        x, y, _, _ = self.scene.world.pose(name)[1]
        return float(1.0 - 2.0 * (x * x + y * y))

    def holds(self, name: str) -> bool:
        """Whether both fingers touch the slice and it is where they hold it."""
        tool, at = self.scene.robot.tool(), self.slice_pose(name)
        return self.scene.robot.touches(name) and hypot(tool.x - at.x, tool.y - at.y, tool.z - at.z) < LOST_M

    def stands(self, name: str, foot: ToolPose, within: float) -> bool:
        """Whether the slice stands upright within `within` [m] of where `foot` as a grasp pose would hold it."""
        at = self.slice_pose(name)
        near = hypot(at.x - foot.x, at.y - foot.y) < within and abs(at.z - foot.z) < 0.006
        return near and self.upright(name) > UPRIGHT


@dataclass(frozen=True, eq=False)
class Photo:
    """The picture (H, W, 3) that a problem was read from, RGB uint8, and the grid that was seen in it."""

    picture: NDArray[np.uint8]
    seen: GridView


class Skill:
    """One sub-task at one place, with all of its life; a new one is a class of these in a file, and a row in `SKILLS`.

    What a task needs of it (`at_pick` to `at_machine`), the survey of its problem (`setup`), what it is about (`aim`), its
    motion (`start`, `step`, `stop`), what it shows (`show` to `photo`), and how it is tried in physics (`begins_at`).
    """

    subtask: ClassVar[str]
    help: ClassVar[str]  # what is learned, in one line of plain words
    moves_arm: ClassVar[bool] = True  # a machine's process does not
    tried: ClassVar[bool] = False  # whether a lesson ends with a trial in physics
    looks_from: ClassVar[tuple[float, float]] = (-72.0, 36.0)  # [deg] the camera of a lesson, azimuth and elevation
    near: ClassVar[bool] = False  # whether all takes place around its station's first spot; looks_from is then its own

    station = ""  # where it takes place, if it is at one
    carries = False  # whether a slice is in the gripper meanwhile
    surveys: "Surveys"  # once it is set up
    problem: Problem

    def __init__(self, name: str) -> None:
        self.name = name
        self.slice = ""
        self.spot: Spot | None = None
        self.deviations_m: list[float] = []  # how far off a camera has seen the gripper
        self.status = Status.IDLE
        self.reason = ""
        self._motion: Iterator[None] | None = None

    # ---- what a task needs of it: None where it has no part ------------------------------------------------------

    @classmethod
    def at_pick(cls, task: Task, station: str) -> "Skill | None":
        """The skill that takes a slice up from a station."""
        return None

    @classmethod
    def on_carry(cls, task: Task, origin: str, target: str) -> "Skill | None":
        """The skill's part in bringing a slice that is in the gripper from one station to another, and setting it down."""
        return None

    @classmethod
    def on_travel(cls, task: Task, origin: str, target: str) -> "Skill | None":
        """The skill's part in taking the empty gripper from one station to another."""
        return None

    @classmethod
    def at_machine(cls, task: Task, station: str) -> "Skill | None":
        """What a machine does by itself with the slice that stands in it."""
        return None

    # ---- survey and aim ------------------------------------------------------------------------------------------

    def setup(self, surveys: "Surveys") -> Problem:
        """Survey the scene and state the problem to learn. BadInput when it has no solution, naming what is in the way."""
        raise NotImplementedError

    def aim(self, name: str, spot: Spot | None = None) -> Self:
        """The same skill, told which slice it is about, and on which spot to set it down, by default the station's first."""
        self.slice, self.spot = name, spot
        return self

    def pose(self, state: int) -> ToolPose:
        """The tool pose that the motion goes through in a state of the problem; a blocked one may be out of reach."""
        raise NotImplementedError

    # ---- what it shows -------------------------------------------------------------------------------------------

    def show(self, bench: Bench, state: int) -> bool:
        """Put the bench into a state at once, without physics; False, and nothing moves, when the arm cannot reach it."""
        pose = self.pose(state)
        if not bench.scene.robot.stand(pose):
            return False
        if bench.held is not None:
            bench.scene.put_slice(bench.held, pose)
        return True

    @classmethod
    def on_slice(cls, number: int) -> tuple[Body, ...]:
        """What this skill may make to be seen on slice `number`."""
        return ()

    def shown(self) -> list[str]:
        """The names of what is to be seen on its slice now."""
        return []

    def shown_in(self, state: int, number: int) -> dict[str, bool]:
        """What is to be seen on slice `number` in a state of the problem, and what is not, by name."""
        return {}

    def photo(self) -> Photo | None:
        """The picture that its problem was read from, once it is set up; None: it was surveyed without one."""
        return None

    # ---- how it is tried, and its motion ---------------------------------------------------------------------------

    def begins_at(self) -> ToolPose | None:
        """Where the tool is when the skill begins; None: anywhere."""
        return None

    def begin(self, bench: Bench, off: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        """Put all at once to where the set-up skill begins, to try it: the arm, and a slice on its spot or in the gripper.

        off: how far off its spot the slice stands, x, y [m] and yaw [rad].
        """
        scene, pose = bench.scene, self.begins_at()
        self.aim(TRIED_WITH)
        if self.near and not self.carries:
            scene.add_slice(TRIED_WITH, spots(self.surveys.task.station(self.station))[0], off)
        if pose is not None:
            scene.robot.stand(pose)
            if self.carries:
                bench.hold(TRIED_WITH, pose)
            else:
                scene.robot.open_at_once()
        for _ in range(STAND_STEPS):
            scene.world.step()

    def motion(self, bench: Bench, policy: "Policy") -> Iterator[None]:
        """Carry the policy out: each `next` sets what one physics step needs; raises SkillFailed."""
        raise NotImplementedError

    def start(self, bench: Bench, policy: "Policy") -> None:
        """Begin to carry `policy` out from the state the bench is in."""
        self._motion = self.motion(bench, policy)
        self.status, self.reason = Status.RUNNING, ""

    def step(self) -> Status:
        """Set what the next physics step needs; the caller then steps the world."""
        if self.status is not Status.RUNNING or self._motion is None:
            return self.status
        try:
            next(self._motion)
        except StopIteration:
            self.status = Status.SUCCESS
        except (SkillFailed, WorkFailed) as failure:
            self.status, self.reason = Status.FAILURE, str(failure)
        return self.status

    def stop(self) -> None:
        """Break off; the skill can be started again."""
        self._motion, self.status = None, Status.IDLE


def over_everything(bench: Bench, end: ToolPose) -> Iterator[None]:
    """Bring the tool from wherever it is to `end`, over all that stands in the cell: up, across, down."""
    robot, grid = bench.scene.robot, bench.scene.task.workspace
    high = max(end.z, grid.lower_m[2] + (grid.shape[2] - 0.5) * grid.cell_m[2])
    tool = robot.tool()
    for pose in (ToolPose(tool.x, tool.y, high, end.yaw), ToolPose(end.x, end.y, high, end.yaw), end):
        yield from robot.follow([pose])


def learned_path(policy: "Policy", mdp: TabularMDP, start: int) -> list[int]:
    """The states that the policy's greedy actions visit from `start` to the goal; SkillFailed when they do not reach it."""
    if mdp.goal[start]:
        return [start]
    states, _, reached = greedy_path(policy.q, mdp, mdp.n_states, start)
    if not reached:
        raise SkillFailed(f"policy '{policy.name}' does not reach its goal from {mdp.state_label(start)}")
    return states


def no_way(what: str, error: NoPath, names: Sequence[str]) -> BadInput:
    """The error for a goal that no path reaches: says what encloses it."""
    return BadInput(
        f"{what}: no path reaches the goal; the {error.around} is enclosed by: {', '.join(names) or 'the border'}"
    )
