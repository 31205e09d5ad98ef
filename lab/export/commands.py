"""A program as a controller's commands: straight lines with rounded corners, outputs, inputs, timers; one job a transfer.

`jobs_of` makes the jobs; the rest of the file reduces a motion's poses to as few lines as keep to its path.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, pi, radians

import numpy as np
import scipy

from lab.export.program import Action, Array, Motion, Press, Program, ProgramTransfer
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import GRIP_STEPS
from lab.sim.arms.tool_path import COUNTED, bending, roundings, timed, way_of
from lab.sim.world import TIME_STEP

WITHIN_M = 2e-4  # largest deviation of the lines and arcs from a path; turns are converted to lengths with YAW_ARM
PASSED_M = 0.0005  # rounding of a pose on a curve or a straight line, so that it is passed without a stop
HELD_M = 7e-4  # a pose is dropped if the path without it deviates by no more than this
_TURN_M = 0.001 / radians(1.0)  # [m/rad]: a turn of 1 degree counts as a deviation of 1 mm
_ALIKE = 1.5  # largest ratio of speeds at which two motions on one line become one
_BRIEF_M = 0.005  # lines shorter than this are ignored for speed, and a path may become shorter by this much
_SAMPLED_M_S = 0.12  # speed at which a path is sampled, which gives a point every half millimetre
STILL_M = 1e-5  # a motion no longer than this is dropped
MOST_TURN = pi / 2  # [rad] largest turn on one line, because a controller turns in the shorter direction
GRIP_S = GRIP_STEPS * TIME_STEP  # time that fingers need to close or open
START_PERCENT = 10.0  # of the joints' speed, for the move to a job's start, as in the thesis


@dataclass(frozen=True)
class JointMove:
    """A move of all joints (k,) [rad] together, with a share of their speed [%]."""

    joints: tuple[float, ...]
    percent: float = START_PERCENT


@dataclass(frozen=True, eq=False)
class Path:
    """Straight lines through tool poses x, y, z [m], yaw [rad] (n, 4) in the world, to a stop at the last.

    roundings (n,) [m]: the distance before and after each pose in which an arc replaces the corner; 0: the tool stops there.
    speeds (n,) [m/s]: of each line, along a length in which turns of the tool are converted with YAW_ARM.
    """

    points: Array
    roundings: Array
    speeds: Array


@dataclass(frozen=True)
class GripperOutput:
    """Sets the gripper's output."""

    closed: bool


@dataclass(frozen=True)
class Pause:
    """Waits for a time [s]."""

    seconds: float


@dataclass(frozen=True)
class Await:
    """Waits until a machine's input, counted from 1, reports that it is done; `station`: the machine's name, if known."""

    machine: int
    station: str = ""


@dataclass(frozen=True)
class Start:
    """Tells a machine, counted from 1, to begin, and waits until it no longer reports that it is done."""

    machine: int
    station: str = ""


@dataclass(frozen=True)
class Reset:
    """Tells a machine, counted from 1, that its part was taken out, and waits until it no longer reports that it is done."""

    machine: int
    station: str = ""


@dataclass(frozen=True)
class Check:
    """Continues only if the gripper's input reports that it holds something."""


@dataclass(frozen=True)
class Payload:
    """Sets the mass that the gripper carries from now on [kg], 0 for nothing."""

    mass_kg: float


Command = JointMove | Path | GripperOutput | Pause | Await | Start | Reset | Check | Payload


@dataclass(frozen=True)
class TransferJob:
    """The commands of one transfer, in order; ways: the uninterrupted motions that each `Path` stands for."""

    words: str
    commands: tuple[Command, ...]
    ways: tuple[tuple[Motion, ...], ...] = ()


def jobs_of(program: Program) -> list[TransferJob]:
    """The jobs of a program, one for each transfer; actions after the last transfer, as of a failed run, are one more job."""
    jobs, left, transfers = [], list(program.carried.actions), program.carried.transfers
    for number, transfer in enumerate(transfers):
        own = [action for action in left if action.at_s < transfer.drop_s]
        left = left[len(own) :]
        more = _more_of_batch(program, transfer, transfers[number + 1 :])
        jobs.append(_job(program, own, transfer, frozenset(more)))
    if left:
        jobs.append(_job(program, left, None))
    return jobs


def _more_of_batch(program: Program, transfer: ProgramTransfer, following: Sequence[ProgramTransfer]) -> set[str]:
    """The batch machines whose next transfer continues this one: it, too, loads the machine, or it, too, unloads it."""
    continued = set()
    for name in program.carried.batches:
        own = next((later for later in following if name in (later.origin, later.target)), None)
        if own is not None and name in (transfer.origin, transfer.target):
            continued |= {name} if (own.target == name) == (transfer.target == name) else set()
    return continued


def _job(
    program: Program, actions: Sequence[Action], transfer: ProgramTransfer | None, more: Collection[str] = frozenset()
) -> TransferJob:
    machines = program.carried.machines
    commands: list[Command] = []
    ways: list[tuple[Motion, ...]] = []
    together: list[Motion] = []  # motions since the last command
    wait, taken = None if transfer is None else transfer.waits_for, False

    def lead() -> None:
        nonlocal taken
        way = tuple(m for m in together if _length(program.tools(m.first, m.last)) > STILL_M)
        together.clear()
        if not way:
            return
        if not ways:
            commands.append(JointMove(tuple(map(float, program.joints[way[0].first]))))
        ways.append(way)
        commands.append(_path(program, way))
        if taken and transfer is not None and transfer.waits_for is not None and transfer.waits_for not in more:
            commands.append(Reset(machines.index(transfer.waits_for) + 1, transfer.waits_for))
            taken = False

    for action in actions:
        if wait is not None and transfer is not None and action.at_s >= transfer.reach_s - TIME_STEP / 2:
            lead()
            commands.append(Await(machines.index(wait) + 1, wait))
            wait, taken = None, False
        if isinstance(action, Motion):
            together.append(action)
            continue
        lead()
        if isinstance(action, Press):
            commands += [GripperOutput(action.closed), Pause(GRIP_S)]
            if transfer is not None:
                commands += [Check(), Payload(transfer.mass_kg)] if action.closed else [Payload(0.0)]
                taken = action.closed and wait is None
        else:
            commands.append(Pause(action.seconds))
    lead()
    if (
        transfer is not None
        and transfer.carries == "part"
        and transfer.target in machines
        and transfer.target not in more
    ):
        commands.append(Start(machines.index(transfer.target) + 1, transfer.target))
    return TransferJob("not finished" if transfer is None else transfer.words, tuple(commands), tuple(ways))


def _path(program: Program, way: Sequence[Motion]) -> Path:
    """The path of consecutive motions, as few lines with rounded corners."""
    points: list[Array] = []
    rounded, speeds = list[float](), list[float]()
    for motion in way:
        rows = program.tools(motion.first, motion.last)
        if points:
            rows[:, 3] += 2 * pi * np.round((points[-1][3] - rows[0, 3]) / (2 * pi))
        corners, cuts = _corners(motion, rows)
        new = corners if not points else corners[1:]
        points += list(new)
        rounded += cuts[-len(new) :].tolist()
        speeds += [_speed(rows if motion.complete else rows[:-1])] * len(new)
    corners, cuts = np.array(points), np.array(rounded)
    far = np.diff(way_of(corners))
    kept = _needed(corners, cuts, speeds)
    fast = [_pace(far[a:b], speeds[a + 1 : b + 1]) for a, b in pairwise(kept)]
    return _turning(corners[kept], cuts[kept], np.array(fast))


def _corners(motion: Motion, rows: Array) -> tuple[Array, Array]:
    """The poses (n, 4) at which a motion bends, ends included, and their roundings (n,) [m]; `rows`: its poses when driven."""
    poses = np.array(motion.poses)
    poses[:, 3] += pi * np.round((rows[-1, 3] - poses[-1, 3]) / pi)  # a gripper is symmetric under half a turn
    corners = np.vstack([rows[:1], poses])
    corners = corners[bending(corners * COUNTED)]
    cuts = roundings(corners * COUNTED, np.full(len(corners), motion.blend_m))
    if motion.complete and _apart(rows, _shape(corners, cuts)) <= WITHIN_M:
        return corners, cuts
    points = straightened(rows)
    return points, np.array([0.0, *[PASSED_M] * (len(points) - 2), 0.0])


def _apart(rows: Array, shape: Array) -> float:
    """The largest deviation [m] of poses (n, 4) from a path (m, 4), turns included by _TURN_M."""
    lines = np.vstack([shape[:-1] + share * np.diff(shape, axis=0) for share in (0.0, 0.25, 0.5, 0.75)] + [shape[-1:]])
    gaps = rows - lines[scipy.spatial.cKDTree(lines * COUNTED).query(rows * COUNTED)[1]]
    return float(max(np.linalg.norm(gaps[:, :3], axis=1).max(), _TURN_M * np.abs(gaps[:, 3]).max()))


def _shape(points: Array, rounded: Array) -> Array:
    """The tool poses (m, 4), every half millimetre, on lines through poses (n, 4) with roundings [m]."""
    poses, blends = [ToolPose(*pose) for pose in points.tolist()], (2.0 * rounded).tolist()
    return np.vstack([points[:1], timed(poses, _SAMPLED_M_S, 1e3, blends)])


def _needed(points: Array, rounded: Array, speeds: Sequence[float]) -> list[int]:
    """The rows of points (n, 4) that remain after dropping, from the last to the first, those that the path does not need.

    Two lines become one if their speeds are alike (_ALIKE), or one of them is brief (_BRIEF_M), and the path keeps to HELD_M.
    """
    kept, far = [*range(len(points))], np.diff(way_of(points))
    for row in range(len(points) - 2, 0, -1):
        at = kept.index(row)
        before, after = kept[at - 1], kept[at + 1]
        paces = _pace(far[before:row], speeds[before + 1 : row + 1]), _pace(far[row:after], speeds[row + 1 : after + 1])
        brief = min(far[before:row].sum(), far[row:after].sum()) <= _BRIEF_M
        if not brief and max(paces) >= _ALIKE * min(paces):
            continue
        less = [*kept[max(0, at - 2) : at], *kept[at + 1 : at + 3]]
        wanted = _shape(points[less[0] : less[-1] + 1], rounded[less[0] : less[-1] + 1])
        without = _shape(points[less], rounded[less])
        there_and_back = abs(_length(wanted) - _length(without)) > _BRIEF_M
        if not there_and_back and _apart(wanted, without) <= HELD_M and _apart(without, wanted) <= HELD_M:
            kept.remove(row)
    return kept


def _pace(far: Array, speeds: Sequence[float]) -> float:
    """The speed [m/s] on lines (n,) [m] that become one: that of the slowest line that is not brief."""
    return min((speed for line_m, speed in zip(far, speeds, strict=True) if line_m > _BRIEF_M), default=max(speeds))


def _turning(points: Array, rounded: Array, speeds: Array) -> Path:
    """The path without its first pose, with intermediate poses on lines that turn the tool by more than MOST_TURN."""
    rows, cuts, fast = list[Array](), list[float](), list[float]()
    for row in range(1, len(points)):
        start, end = points[row - 1], points[row]
        pieces = max(1, ceil(abs(end[3] - start[3]) / MOST_TURN - 1e-9))
        rows += list(start + (end - start) * (np.arange(1, pieces + 1) / pieces)[:, None])
        cuts += [PASSED_M] * (pieces - 1) + [float(rounded[row])]
        fast += [float(speeds[row - 1])] * pieces
    return Path(np.array(rows), np.array(cuts), np.array(fast))


def step_between(start: Array, end: Array) -> Array:
    """The difference of two tool poses (4,): x, y, z [m], and the turn in the shorter direction [rad]."""
    step = np.asarray(end - start)
    step[3] = (step[3] + pi) % (2 * pi) - pi
    return step


def _length(poses: Array) -> float:
    return float(way_of(poses)[-1])


def _speed(poses: Array) -> float:
    """The highest speed [m/s] between tool poses (n, 4), one per physics step."""
    return float(np.diff(way_of(poses)).max()) / TIME_STEP


def straightened(poses: Array) -> Array:
    """Few tool poses (m, 4), ends included, whose straight lines stay within WITHIN_M of the path through `poses` (n, 4)."""
    way = way_of(poses)
    kept = thinned(way, poses * COUNTED, WITHIN_M)
    rows = [poses[:1]]
    for start, end in zip(poses[kept[:-1]], poses[kept[1:]], strict=True):
        pieces = max(1, ceil(abs(end[3] - start[3]) / MOST_TURN - 1e-9))
        rows.append(start + (end - start) * (np.arange(1, pieces + 1) / pieces)[:, None])
    return np.concatenate(rows)


def thinned(along: Array, values: Array, within: float) -> list[int]:
    """The rows to keep so that straight lines over `along` (n,) stay within `within` of all `values` (n, k).

    Source: D. Douglas and T. Peucker, 1973, with the distance taken at the same `along`.
    """
    kept, spans = {0, len(values) - 1}, [(0, len(values) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        length = along[last] - along[first]
        share = (along[first + 1 : last] - along[first]) / (length or 1.0)
        line = values[first] + share[:, None] * (values[last] - values[first])
        off = np.linalg.norm(values[first + 1 : last] - line, axis=1)
        worst = int(np.argmax(off))
        if off[worst] > within:
            middle = first + 1 + worst
            kept.add(middle)
            spans += [(first, middle), (middle, last)]
    return sorted(kept)
