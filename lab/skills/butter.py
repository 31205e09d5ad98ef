"""Butter: the applier's head covers the slice, cell by cell of 3 x 3, by the shortest learned path."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from lab.learning.problem import Problem
from lab.mdp import coverage
from lab.sim import models
from lab.sim.frames import Body, Shape
from lab.sim.kinematics import ToolPose
from lab.sim.world import TIME_STEP, Array
from lab.skills.skill import Bench, Skill, SkillFailed, learned_path
from lab.skills.surveys import Surveys
from lab.tasks.task_file import Task

if TYPE_CHECKING:
    from lab.toolbox.policy import Policy

SHAPE = (3, 3)  # rows from the top, columns along the slice's width
CELL_M = models.SLICE[0] / 3
JOINTS = ("head_x", "head_z")
REST = (0.0, 0.0)  # where the head waits, low, out of the gripper's way
HEAD_BEHIND_M = 0.03  # the head's frame behind the nozzle's plane
BUTTER = (1.0, 0.87, 0.25, 1.0)
_RAY_M = 0.2


class Butter(Skill):
    """Butter the slice that stands in the applier; `covered` are the cells that the nozzle's ray has met, in order."""

    subtask: ClassVar[str] = "butter"
    help: ClassVar[str] = "the applier's head covers a slice with butter, cell by cell"
    near: ClassVar[bool] = True
    moves_arm: ClassVar[bool] = False
    looks_from: ClassVar[tuple[float, float]] = (-42.0, 28.0)  # the head stands before the slice

    def __init__(self, station: str) -> None:
        super().__init__(f"butter at {station}")
        self.station = station
        self.covered: list[tuple[int, int]] = []

    @classmethod
    def at_machine(cls, task: Task, station: str) -> "Butter | None":
        """In a machine with this process."""
        return cls(station) if task.station(station).process == cls.subtask else None

    def setup(self, surveys: Surveys) -> Problem:
        """Which cell the head is at and which are covered: the shortest complete coverage."""
        self.surveys = surveys
        mdp = coverage(SHAPE, surveys.task.subtask("butter").rewards)
        self.problem = Problem(self.name, self.subtask, mdp)
        return self.problem

    def head(self, state: int) -> tuple[float, float]:
        """The head's joints in a state [m]: across from the slice's middle, and up from the applier's floor."""
        row, column = self.problem.mdp.state_cell(state)
        return ((column - 1) * CELL_M, (SHAPE[0] - 1 - row + 0.5) * CELL_M)

    def pose(self, state: int) -> ToolPose:
        """Where the applier's head is; the arm has no part in this sub-task."""
        x, y, yaw = self.surveys.task.station(self.station).pose
        across, up = self.head(state)
        return ToolPose(x, y, models.APPLIER_FLOOR, yaw).local(across, models.NOZZLE_OUT - HEAD_BEHIND_M, up)

    def show(self, bench: Bench, state: int) -> bool:
        """Put the head over the state's cell at once, without physics."""
        bench.scene.world.set_joints(self.station, JOINTS, self.head(state))
        return True

    @classmethod
    def on_slice(cls, number: int) -> tuple[Body, ...]:
        """Nine patches of butter on the side of its negative y axis."""
        return tuple(_patch(number, row, column) for row, column in np.ndindex(*SHAPE))

    def shown(self) -> list[str]:
        """The patches that were covered in this motion."""
        return [patch_name(int(self.slice.rpartition(" ")[2]), *cell) for cell in self.covered]

    def shown_in(self, state: int, number: int) -> dict[str, bool]:
        """Where butter is in `state`."""
        covered = np.ndenumerate(self.problem.mdp.covered(state))
        return {patch_name(number, row, column): bool(on) for (row, column), on in covered}

    def motion(self, bench: Bench, policy: "Policy") -> Iterator[None]:
        """Move the head along the learned cells, stay on each, note where the nozzle's ray meets the slice, and go to rest."""
        mdp = self.problem.mdp
        station = self.surveys.task.station(self.station)
        self.covered = []
        for state in learned_path(policy, mdp, mdp.start):
            yield from self._slide(bench, self.head(state), station.head_speed_m_s)
            for _ in range(round(station.dwell_s / TIME_STEP)):
                yield
            met = self._met(bench)
            if met is not None and met not in self.covered:
                self.covered.append(met)
        yield from self._slide(bench, REST, station.head_speed_m_s)  # so that every slice takes the same time
        missed = sorted(set(np.ndindex(*SHAPE)) - set(self.covered))
        if missed:
            raise SkillFailed(f"the butter missed {len(missed)} of 9 cells of {self.slice}: {missed}")

    def _slide(self, bench: Bench, target: tuple[float, float], speed: float) -> Iterator[None]:
        world = bench.scene.world
        here = world.joints(self.station, JOINTS)
        way = np.array(target) - here
        steps = max(1, int(np.ceil(np.linalg.norm(way) / speed / TIME_STEP)))
        for step in range(1, steps + 1):
            world.drive(self.station, JOINTS, here + way * step / steps, way / steps / TIME_STEP, force=300.0)
            yield
        world.drive(self.station, JOINTS, target, force=300.0)

    def _met(self, bench: Bench) -> tuple[int, int] | None:
        """The cell of the slice that the nozzle's ray meets, in the slice's own frame."""
        world = bench.scene.world
        nozzle, _ = world.pose(self.station, "head")
        yaw = self.surveys.task.station(self.station).pose[2]
        ahead = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
        hit = world.ray(nozzle + 0.035 * ahead, nozzle + _RAY_M * ahead)
        if hit is None or hit[0] != self.slice:
            return None
        centre, turn = world.pose(self.slice)
        local = _unrotated(hit[1] - centre, turn)
        row = int((models.SLICE[2] / 2 - local[2]) // CELL_M)
        column = int((local[0] + models.SLICE[0] / 2) // CELL_M)
        return (row, column) if 0 <= row < SHAPE[0] and 0 <= column < SHAPE[1] else None


def patch_name(number: int, row: int, column: int) -> str:
    """What the butter in a cell of slice `number` is called."""
    return f"butter {number} {row}{column}"


def _patch(number: int, row: int, column: int) -> Body:
    at = ((column - 1) * CELL_M * 0.9, -models.SLICE[1] / 2 - 0.0016, (1 - row) * CELL_M * 0.9)
    return Body(
        patch_name(number, row, column), (Shape("box", (CELL_M * 0.82, 0.0024, CELL_M * 0.82), None, BUTTER, at),)
    )


def _unrotated(vector: Array, turn: Array) -> Array:
    """`vector` (3,) in the frame that the quaternion `turn` (4,) xyzw describes."""
    axis, w = -turn[:3], turn[3]
    twice = 2.0 * np.cross(axis, vector)
    return np.asarray(vector + w * twice + np.cross(axis, twice))
