"""Cover: treat a surface cell by cell along the shortest learned path, as with butter, glue or paint, or by vacuuming."""

from collections.abc import Iterator, Sequence
from typing import ClassVar

import numpy as np

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import coverage
from lab.sim import models
from lab.sim.arms.kinematics import ToolPose
from lab.sim.frames import Body, Shape
from lab.sim.parts.kinds import Kind
from lab.sim.scene.scene import Scene
from lab.sim.scene.station_bodies import HEAD_JOINTS, HEAD_LINK
from lab.sim.world import TIME_STEP, Array, World
from lab.skills.sight import SkillFailed
from lab.skills.skill import Bench, Skill, learned_path
from lab.skills.state_words import plain
from lab.skills.surveys import Surveys
from lab.tasks.task import Task
from lab.tasks.task_fields import Process, Stage
from lab.toolbox.policy import Policy

REST = (0.0, 0.0)  # joints of a machine's head while it waits, low and clear of the gripper
HEAD_BEHIND_M = 0.03  # distance of the head's frame behind the nozzle's plane
PATCH_M = 0.0024  # thickness of the patches drawn on the part
OVER_M = 0.004  # [m] a tool this near to the middle of a cell covers it
_RAY_M = 0.2


class Cover(Skill):
    """Cover a surface, by a machine's head on a part or by the robot at a station; `covered`: the cells covered, in order."""

    subtask: ClassVar[str] = "cover"
    help: ClassVar[str] = "a surface is covered cell by cell, as with butter or by vacuuming"
    doing: ClassVar[str] = "covers {part}"

    def __init__(self, task: Task, name: str, station: str, kind: str) -> None:
        super().__init__(f"{name} at {station}", kind)
        self.process: Process = task.processes[name]
        self.shape = self.process.grid
        self.station = station
        self.covered: list[tuple[int, int]] = []

    @classmethod
    def at_machine(cls, task: Task, station: str) -> "CoverPart | None":
        """The skill of the machine's head, where the machine has a process; None elsewhere."""
        process, kinds = task.station(station).process, task.kinds_at(station)
        return CoverPart(task, process, station, kinds[0].name) if process is not None and kinds else None

    @classmethod
    def at_service(cls, task: Task, stage: Stage) -> "CoverPlace | None":
        """The skill of the robot's hand, where a stage names a service; None elsewhere."""
        return None if stage.service is None else CoverPlace(task, stage.service, stage.station, "")

    def setup(self, surveys: Surveys) -> Problem:
        """The problem of shortest complete coverage; a state is the tool's cell and the set of covered cells."""
        self.surveys = surveys
        mdp = coverage(self.shape, surveys.task.subtask(self.subtask).rewards)
        self.problem = Problem(self.name, self.subtask, mdp)
        return self.problem

    def in_words(self, state: int) -> str:
        """The tool's cell and the number of covered cells, as a sentence."""
        mdp, (rows, columns) = self.problem.mdp, self.shape
        row, column = mdp.state_cell(state)
        what = f"{plain(self.kind)} in {plain(self.station)}" if self.kind else plain(self.station)
        return (
            f"The tool is over row {row + 1} from the top, column {column + 1} from the left, of {rows} x {columns} cells of "
            f"{what}; {int(mdp.covered(state).sum())} of {rows * columns} cells are covered, and all are to be."
        )

    def moves_in_words(self) -> tuple[str, ...]:
        """One cell for each action."""
        return ("1 cell",) * self.problem.mdp.n_actions

    def _complete(self) -> None:
        """Raise SkillFailed when a cell was missed."""
        missed = sorted(set(np.ndindex(*self.shape)) - set(self.covered))
        if missed:
            cells = f"{len(missed)} of {self.shape[0] * self.shape[1]} cells"
            raise SkillFailed(f"'{self.name}' missed {cells} of {self.part or self.station}: {missed}")


class CoverPart(Cover):
    """A machine's head covers one side of the part that stands in it: the side that faces the part's negative y axis."""

    near: ClassVar[bool] = True
    moves_arm: ClassVar[bool] = False
    looks_from: ClassVar[tuple[float, float]] = (-42.0, 28.0)  # the head stands before the part

    def setup(self, surveys: Surveys) -> Problem:
        """The problem of shortest complete coverage. BadInput names cells out of the head's reach, and what blocks them."""
        problem = super().setup(surveys)
        for part in surveys.task.kinds_at(self.station):
            missed = self._missed(surveys.kinds[part.name])
            if missed:
                (row, column), before = min(missed.items())
                raise BadInput(
                    f"{self.name}: the head misses {len(missed)} of {self.shape[0] * self.shape[1]} cells of {part.name}, as row "
                    f"{row + 1} from the top, column {column + 1}: before it is {before}; another grid of the process, another "
                    "floor_m or body may do"
                )
        return problem

    def _missed(self, kind: Kind) -> dict[tuple[int, ...], str]:
        """By cell of a part on its spot that the head's ray does not hit: the name of what it hits instead."""
        task, places, missed = self.surveys.task, self.surveys.places, dict[tuple[int, ...], str]()
        with World() as world:
            scene = Scene(world, task, (), self.surveys.layout)
            scene.add(kind.name, kind.name, places.spots(task.station(self.station), kind.name)[0])
            for cell in np.ndindex(*self.shape):
                world.set_joints(self.station, HEAD_JOINTS, self.head_at(cell, kind))
                hit = self._ray(world)
                if hit is None or hit[0] != kind.name:
                    missed[cell] = "nothing" if hit is None else f"'{hit[0]}'"
                elif self._cell_of(world, kind.name, kind, hit[1]) != cell:
                    missed[cell] = "another cell"
        return missed

    def cell_m(self, kind: Kind | None = None) -> tuple[float, float]:
        """Height and width of a cell on the part's side [m]."""
        low, high = (kind or self.own_kind).shape.low, (kind or self.own_kind).shape.high
        return float(high[2] - low[2]) / self.shape[0], float(high[0] - low[0]) / self.shape[1]

    def head(self, state: int, kind: Kind | None = None) -> tuple[float, float]:
        """The head's joints in a state [m]: sideways from the part's middle, and height above the machine's floor."""
        return self.head_at(self.problem.mdp.state_cell(state), kind)

    def head_at(self, cell: Sequence[int], kind: Kind | None = None) -> tuple[float, float]:
        """The head's joints [m] in front of a cell, given by its row from the top and its column."""
        (row, column), (high, wide) = cell, self.cell_m(kind)
        return ((column - (self.shape[1] - 1) / 2) * wide, (self.shape[0] - 1 - row + 0.5) * high)

    def pose(self, state: int) -> ToolPose:
        """The pose of the machine's head; the arm does not move in this skill."""
        x, y, yaw = self.surveys.task.station(self.station).pose
        across, up = self.head(state)
        floor = self.surveys.places.floor(self.surveys.task.station(self.station))
        return ToolPose(x, y, floor, yaw).local(across, models.NOZZLE_OUT - HEAD_BEHIND_M, up)

    def show(self, bench: Bench, state: int) -> bool:
        """Put the head over the state's cell at once, without physics."""
        bench.scene.world.set_joints(self.station, HEAD_JOINTS, self.head(state))
        return True

    def on_part(self, name: str, kind: Kind) -> tuple[Body, ...]:
        """A patch for each cell of the covered side of the part."""
        high, wide = self.cell_m(kind)
        low, top = kind.shape.low, kind.shape.high
        patches = []
        for row, column in np.ndindex(*self.shape):
            middle = (float(low[0] + top[0]) / 2, float(low[1]) - 2 * PATCH_M / 3, float(low[2] + top[2]) / 2)
            across, up = (column - (self.shape[1] - 1) / 2) * wide * 0.9, ((self.shape[0] - 1) / 2 - row) * high * 0.9
            at = (middle[0] + across, middle[1], middle[2] + up)
            shape = Shape("box", (wide * 0.82, PATCH_M, high * 0.82), None, (*self.process.color, 1.0), at)
            patches.append(Body(self._patch(name, row, column), (shape,)))
        return tuple(patches)

    def _patch(self, name: str, row: int, column: int) -> str:
        """The body name of a covered cell of a part."""
        return f"{self.name.partition(' at ')[0]} on {name} {row}{column}"

    def shown(self) -> list[str]:
        """The names of the patches that this motion has covered."""
        return [self._patch(self.part, *cell) for cell in self.covered]

    def shown_in(self, state: int, name: str) -> dict[str, bool]:
        """By patch name: whether its cell is covered in `state`."""
        covered = np.ndenumerate(self.problem.mdp.covered(state))
        return {self._patch(name, row, column): bool(on) for (row, column), on in covered}

    def motion(self, bench: Bench, policy: Policy) -> Iterator[None]:
        """Move the head along the learned path, dwell on each cell, record where its ray hits the part, and return to rest."""
        mdp, process = self.problem.mdp, self.process
        kind = bench.scene.kind_of.get(
            self.part, self.own_kind
        )  # parts of another kind than the first may come to this machine
        self.covered = []
        for state in learned_path(policy, mdp, mdp.start):
            yield from self._slide(bench, self.head(state, kind), process.speed_m_s)
            for _ in range(round(process.dwell_s / TIME_STEP)):
                yield
            met = self._met(bench, kind)
            if met is not None and met not in self.covered:
                self.covered.append(met)
        yield from self._slide(bench, REST, process.speed_m_s)  # so that the time is the same for every part
        self._complete()

    def _slide(self, bench: Bench, target: tuple[float, float], speed: float) -> Iterator[None]:
        world = bench.scene.world
        here = world.joints(self.station, HEAD_JOINTS)
        way = np.array(target) - here
        steps = max(1, int(np.ceil(np.linalg.norm(way) / speed / TIME_STEP)))
        for step in range(1, steps + 1):
            world.drive(self.station, HEAD_JOINTS, here + way * step / steps, way / steps / TIME_STEP, force=300.0)
            yield
        world.drive(self.station, HEAD_JOINTS, target, force=300.0)

    def _met(self, bench: Bench, kind: Kind) -> tuple[int, int] | None:
        """The cell of the part that the nozzle's ray hits; None when it hits none."""
        hit = self._ray(bench.scene.world)
        return (
            self._cell_of(bench.scene.world, self.part, kind, hit[1])
            if hit is not None and hit[0] == self.part
            else None
        )

    def _ray(self, world: World) -> tuple[str, Array] | None:
        """The name of the body that the nozzle's ray hits, and the point; None when it hits nothing."""
        nozzle, _ = world.pose(self.station, HEAD_LINK)
        yaw = self.surveys.task.station(self.station).pose[2]
        ahead = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
        return world.ray(nozzle + 0.035 * ahead, nozzle + _RAY_M * ahead)

    def _cell_of(self, world: World, part: str, kind: Kind, at: Array) -> tuple[int, int] | None:
        """The cell of a part in which a point lies, in the part's own frame."""
        centre, turn = world.pose(part)
        local, (high, wide) = _unrotated(at - centre, turn), self.cell_m(kind)
        row = int((kind.shape.high[2] - local[2]) // high)
        column = int((local[0] - kind.shape.low[0]) // wide)
        return (row, column) if 0 <= row < self.shape[0] and 0 <= column < self.shape[1] else None


class CoverPlace(Cover):
    """The robot's empty tool covers a surface at a station before it takes the part out, as when it vacuums a mill."""

    def pose(self, state: int) -> ToolPose:
        """The tool pose over the middle of the state's cell."""
        return self.over(self.problem.mdp.state_cell(state))

    def over(self, cell: tuple[int, ...]) -> ToolPose:
        """The tool pose over the middle of a cell."""
        (row, column), process = cell, self.process
        assert process.area_m is not None
        x, y, yaw = self.surveys.task.station(self.station).pose
        dx, dy, high = process.off_m
        across = (column - (self.shape[1] - 1) / 2) * process.area_m[0] / self.shape[1]
        along = ((self.shape[0] - 1) / 2 - row) * process.area_m[1] / self.shape[0]
        return ToolPose(x, y, high, yaw).local(dx + across, dy + along)

    def setup(self, surveys: Surveys) -> Problem:
        """The problem of shortest complete coverage. BadInput when the tool cannot reach a cell of the area."""
        problem = super().setup(surveys)
        area_m, off_m, name = self.process.area_m, self.process.off_m, self.name.partition(" at ")[0]
        where = f"processes.{name}.area_m = {list(area_m or ())}, off_m = {list(off_m)} at '{self.station}'"
        surveys.check_free(where, [self.over(cell) for cell in np.ndindex(*self.shape)])
        return problem

    def begins_at(self) -> ToolPose:
        """The approach pose of the station."""
        return self.surveys.approach(self.station)

    def motion(self, bench: Bench, policy: Policy) -> Iterator[None]:
        """Move down to the first cell, along the learned path with a dwell on each cell, and back up to the approach."""
        robot, mdp, process = bench.scene.robot, self.problem.mdp, self.process
        approach = self.surveys.approach(self.station)
        slow = min(1.0, process.speed_m_s / robot.speed)
        self.covered = []
        path = learned_path(policy, mdp, mdp.start)
        first = self.pose(path[0])
        yield from robot.follow([ToolPose(first.x, first.y, approach.z, first.yaw)])
        for state in path:
            yield from robot.follow([self.pose(state)], slow=slow)
            yield from robot.rest(round(process.dwell_s / TIME_STEP))
            cell = self._under(robot.tool())
            if cell is not None and cell not in self.covered:
                self.covered.append(cell)
        last = self.pose(path[-1])
        yield from robot.follow([ToolPose(last.x, last.y, approach.z, last.yaw), approach])
        self._complete()

    def _under(self, tool: ToolPose) -> tuple[int, int] | None:
        """The cell below the finger tips; None outside the area."""
        for cell in np.ndindex(*self.shape):
            over = self.over(cell)
            if abs(tool.x - over.x) < OVER_M and abs(tool.y - over.y) < OVER_M and abs(tool.z - over.z) < OVER_M:
                return (int(cell[0]), int(cell[1]))
        return None


def _unrotated(vector: Array, turn: Array) -> Array:
    """`vector` (3,) in the frame that the quaternion `turn` (4,) xyzw describes."""
    axis, w = -turn[:3], turn[3]
    twice = 2.0 * np.cross(axis, vector)
    return np.asarray(vector + w * twice + np.cross(axis, twice))
