"""The recorder of a robot's motions, gripper outputs and rests during a run, for a later export."""

from collections.abc import Callable, Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from lab.export.program import Action, ArmRest, Array, Motion, Press, Program, ProgramDocument, ProgramTransfer
from lab.sequencing.cell.schedule import Move
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME, RobotArm, Trajectory
from lab.sim.world import TIME_STEP
from lab.tasks.task import Task

SEEN_EVERY = 2  # physics steps between two records of the tool: 120 a simulated second


class MotionRecorder:
    """A `MotionListener` that records the joint targets of each physics step of a motion, and the tool's real poses."""

    def __init__(self, robot: RobotArm) -> None:
        """Start recording: times begin at 0 now, and the robot reports to this listener from now on."""
        self._robot, self._zero = robot, robot.world.steps
        self._actions: list[Action] = []
        self._rows: list[Array] = []  # joints (n, k) and times (n,) [steps] of each motion
        self._times: list[Array] = []
        self._seen: list[tuple[int, Array]] = []  # time [steps], and the tool link's pose (7,)
        self._open: tuple[Sequence[ToolPose], float, Trajectory, Array, int, int] | None = None
        self._driven = 0
        robot.listener = self

    @property
    def _steps(self) -> int:
        return self._robot.world.steps - self._zero

    def began(self, poses: Sequence[ToolPose], blend: float, way: Trajectory, before: Array) -> None:
        """A motion begins; one that was under way is recorded as aborted."""
        self._close(complete=False)
        self._open = poses, blend, way, before, self._steps, len(self._seen)
        self._driven = 0

    def drives(self, row: int) -> None:
        """A row of the trajectory becomes the target; every SEEN_EVERY rows, record the pose that the row before led to."""
        assert self._open is not None
        rows = len(self._open[2].positions)
        self._driven = min(row + 1, rows)
        if row % SEEN_EVERY == 0 or row == rows:
            self._see()

    def ended(self) -> None:
        """The motion is complete: record it."""
        self._see()
        self._close(complete=True)

    def pressed(self, closed: bool) -> None:
        """Record a gripper output."""
        self._close(complete=False)
        self._actions.append(Press(at_s=self._steps * TIME_STEP, closed=closed))

    def rested(self, steps: int) -> None:
        """Record a rest."""
        self._close(complete=False)
        self._actions.append(ArmRest(at_s=self._steps * TIME_STEP, seconds=steps * TIME_STEP))

    def _see(self) -> None:
        position, turn = self._robot.world.pose(NAME, self._robot.arm.tool_link)
        self._seen.append((self._steps, np.concatenate([position, turn])))

    def _close(self, *, complete: bool) -> None:
        """Record the motion that is under way, up to the row that was driven."""
        if self._open is None:
            return
        poses, blend, way, before, begun, seen = self._open
        self._open = None
        self._driven = min(self._driven, self._steps - begun)  # a target set in the step of a stop was not driven
        if not self._driven:
            return
        first = sum(map(len, self._rows))
        rows, times = [before, *way.positions[: self._driven]], [*range(begun, begun + self._driven + 1)]
        if not complete:  # it ends where the arm came to a stop
            self._see()
            rows.append(self._robot.world.joints(NAME, self._robot.arm.joints))
            times.append(self._steps)
        self._rows.append(np.array(rows))
        self._times.append(np.array(times, float))
        self._actions.append(
            Motion(
                at_s=begun * TIME_STEP,
                poses=tuple((p.x, p.y, p.z, p.yaw) for p in poses),
                blend_m=blend,
                first=first,
                last=first + len(rows),
                seen_first=seen,
                seen_last=len(self._seen),
                complete=complete,
            )
        )

    def program(self, task: Task, seed: int, moves: Sequence[Move], name: Callable[[int], str]) -> Program:
        """The program recorded so far; `moves`: the transfers that were made; `name`: gives a part's name."""
        self._close(complete=False)
        arm = self._robot.arm
        machines = tuple(station.name for station in task.stations if station.kind == "machine")
        carried = ProgramDocument(
            task=task.name,
            seed=seed,
            robot=task.robot,
            folder=str(task.folder) if task.robot.is_file else "",
            machines=machines,
            batches=tuple(station.name for station in task.stations if station.batch),
            transfers=tuple(_transfer(move, name(move.part), machines, task) for move in moves),
            actions=tuple(self._actions),
        )
        joints = np.concatenate([np.empty((0, len(arm.joints))), *self._rows])
        at_s = np.concatenate([np.empty(0), *self._times]) * TIME_STEP
        seen_at_s = np.array([steps for steps, _ in self._seen], float) * TIME_STEP
        links = np.array([pose for _, pose in self._seen]).reshape(-1, 7)
        return Program(carried, at_s, joints, closed_at(carried.actions, at_s), seen_at_s, tips(links, arm.tip))


def tips(links: Array, tip: Array) -> Array:
    """The finger tips' poses (n, 7), x, y, z [m] and quaternion xyzw, for poses (n, 7) of the link in which `tip` (4, 4) is."""
    if not len(links):
        return links
    rotation = scipy.spatial.transform.Rotation
    turns = rotation.from_quat(links[:, 3:])
    return np.hstack([links[:, :3] + turns.apply(tip[:3, 3]), (turns * rotation.from_matrix(tip[:3, :3])).as_quat()])


def closed_at(actions: Sequence[Action], at_s: Array) -> NDArray[np.bool_]:
    """Whether the gripper was closed (n,) at times `at_s` (n,) [s]; it is open at first."""
    presses = [action for action in actions if isinstance(action, Press)]
    states = np.array([False, *(press.closed for press in presses)])
    return np.asarray(states[np.searchsorted([press.at_s for press in presses], at_s, side="right")])


def _mass_kg(task: Task, part: str, *, on_pallet: bool) -> float:
    """The mass [kg] of a part, named by kind and number, and of its pallet; 0 for a part that the task does not contain."""
    masses = {kind.name: kind.mass_kg for kind in task.parts}
    own = next((kind for kind in task.parts if kind.name == part.rpartition(" ")[0]), None)
    if own is None:
        return 0.0
    return own.mass_kg + (masses.get(own.pallet or "", 0.0) if on_pallet else 0.0)


def _transfer(move: Move, part: str, machines: Sequence[str], task: Task) -> ProgramTransfer:
    waits = move.origin in machines and move.carries == "part"
    return ProgramTransfer(
        part=part,
        carries=move.carries,
        start=move.start,
        origin=move.origin,
        target=move.target,
        leave_s=move.leave_s,
        reach_s=move.reach_s,
        drop_s=move.drop_s,
        waits_for=move.origin if waits else None,
        mass_kg=_mass_kg(task, part, on_pallet=move.carries != "part"),
    )
