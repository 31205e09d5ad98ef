"""A program as a controller takes it: straight lines with rounded corners, outputs, inputs, timers, one job a transfer."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, pi

import numpy as np

from lab.export.program import Action, Array, Motion, Press, Program, Transfer
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import GRIP_STEPS
from lab.sim.arms.tool_path import COUNTED, bending, roundings, timed, way_of
from lab.sim.world import TIME_STEP

WITHIN_M = 3e-4  # a way is written as lines and arcs that deviate so little from it; a turn counts as YAW_ARM
PASSED_M = 0.0005  # the rounding of a pose that lies on a curve or straight on: it is passed without a stop
_ALIKE = 1.5  # times as fast: motions that are one line stay two where their speeds differ more
_SAMPLED_M_S = 0.12  # at which a path of lines and arcs has a point every half millimetre
STILL_M = 1e-5  # a motion that leads no farther than this is left out
MOST_TURN = pi / 2  # [rad] of one piece: a controller turns the shorter way round
GRIP_S = GRIP_STEPS * TIME_STEP  # what fingers need to close or open
START_PERCENT = 10.0  # of the joints' speed, to where a job begins: the thesis's


@dataclass(frozen=True)
class Joint:
    """All joints (k,) [rad] at once, with a share of their speed [%]."""

    joints: tuple[float, ...]
    percent: float = START_PERCENT


@dataclass(frozen=True, eq=False)
class Path:
    """Straight lines through tool poses x, y, z [m], yaw [rad] (n, 4) in the world, to a stop at the last.

    roundings (n,) [m]: from where before each pose to where behind it an arc stands for the corner; 0: the tool stops there.
    speeds (n,) [m/s]: of each line, of the way in which a turn of the tool counts as YAW_ARM.
    """

    points: Array
    roundings: Array
    speeds: Array


@dataclass(frozen=True)
class Grip:
    """The gripper's output."""

    closed: bool


@dataclass(frozen=True)
class Pause:
    """A timer."""

    seconds: float


@dataclass(frozen=True)
class Await:
    """Waits until a machine's input, counted from 1, says that it is done; `station`: the machine, where that is known."""

    machine: int
    station: str = ""


@dataclass(frozen=True)
class Start:
    """Tells a machine, counted from 1, to begin, until it says no longer that it is done."""

    machine: int
    station: str = ""


@dataclass(frozen=True)
class Reset:
    """Tells a machine, counted from 1, that its part was taken out, until it says no longer that it is done."""

    machine: int
    station: str = ""


@dataclass(frozen=True)
class Check:
    """Goes on only where the gripper's input says that it holds something."""


@dataclass(frozen=True)
class Payload:
    """What the gripper carries from now on [kg], 0 for nothing."""

    mass_kg: float


Command = Joint | Path | Grip | Pause | Await | Start | Reset | Check | Payload


@dataclass(frozen=True)
class Job:
    """One transfer's commands, in order; ways: the motions that each `Path` stands for."""

    words: str
    commands: tuple[Command, ...]
    ways: tuple[tuple[Motion, ...], ...] = ()


def jobs_of(program: Program) -> list[Job]:
    """One job a transfer; what the robot did after the last one, where a run failed, is a job of its own."""
    jobs, left, transfers = [], list(program.carried.actions), program.carried.transfers
    for number, transfer in enumerate(transfers):
        own = [action for action in left if action.at_s < transfer.drop_s]
        left = left[len(own) :]
        more = _more_of_batch(program, transfer, transfers[number + 1 :])
        jobs.append(_job(program, own, transfer, frozenset(more)))
    if left:
        jobs.append(_job(program, left, None))
    return jobs


def moving(program: Program) -> list[tuple[Motion, ...]]:
    """The motions that lead anywhere, one after the other without a pause: each is a `Path` of its jobs, in order."""
    return [way for job in jobs_of(program) for way in job.ways]


def _more_of_batch(program: Program, transfer: Transfer, following: Sequence[Transfer]) -> set[str]:
    """The machines with batches for which another transfer does the same: it brings another part, or takes another one out."""
    found = set()
    for name in program.carried.batches:
        own = next((one for one in following if name in (one.origin, one.target)), None)
        if own is not None and name in (transfer.origin, transfer.target):
            found |= {name} if (own.target == name) == (transfer.target == name) else set()
    return found


def _job(
    program: Program, actions: Sequence[Action], transfer: Transfer | None, more: Collection[str] = frozenset()
) -> Job:
    machines = program.carried.machines
    found: list[Command] = []
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
            found.append(Joint(tuple(map(float, program.joints[way[0].first]))))
        ways.append(way)
        found.append(_path(program, way))
        if taken and transfer is not None and transfer.waits_for is not None and transfer.waits_for not in more:
            found.append(Reset(machines.index(transfer.waits_for) + 1, transfer.waits_for))
            taken = False

    for action in actions:
        if wait is not None and transfer is not None and action.at_s >= transfer.reach_s - TIME_STEP / 2:
            lead()
            found.append(Await(machines.index(wait) + 1, wait))
            wait, taken = None, False
        if isinstance(action, Motion):
            together.append(action)
            continue
        lead()
        if isinstance(action, Press):
            found += [Grip(action.closed), Pause(GRIP_S)]
            if transfer is not None:
                found += [Check(), Payload(transfer.mass_kg)] if action.closed else [Payload(0.0)]
                taken = action.closed and wait is None
        else:
            found.append(Pause(action.seconds))
    lead()
    if (
        transfer is not None
        and transfer.carries == "part"
        and transfer.target in machines
        and transfer.target not in more
    ):
        found.append(Start(machines.index(transfer.target) + 1, transfer.target))
    return Job("not finished" if transfer is None else transfer.words, tuple(found), tuple(ways))


def _path(program: Program, way: Sequence[Motion]) -> Path:
    """Motions, one after the other, as few lines with rounded corners."""
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
    kept = _needed(np.array(points), rounded, speeds)
    starts = [0, *(row + 1 for row in kept[:-1])]
    slowest = [min(speeds[max(1, first) : row + 1] or speeds[:1]) for first, row in zip(starts, kept, strict=True)]
    return _turning(np.array(points)[kept], np.array(rounded)[kept], np.array(slowest))


def _corners(motion: Motion, rows: Array) -> tuple[Array, Array]:
    """The poses (n, 4) at which a motion bends, its ends included, and their roundings (n,) [m]; `rows`: where it led."""
    poses = np.array(motion.poses)
    poses[:, 3] += pi * np.round((rows[-1, 3] - poses[-1, 3]) / pi)  # a gripper may be half a turn on
    corners = np.vstack([rows[:1], poses])
    corners = corners[bending(corners * COUNTED)]
    cuts = roundings(corners * COUNTED, np.full(len(corners), motion.blend_m))
    if motion.complete:
        rounded = [ToolPose(*corner) for corner in corners.tolist()]
        shape = np.vstack([corners[:1], timed(rounded, _SAMPLED_M_S, 1e3, motion.blend_m)])
        if _apart(rows, shape) <= WITHIN_M:
            return corners, cuts
    points = straightened(rows)
    return points, np.array([0.0, *[PASSED_M] * (len(points) - 2), 0.0])


def _apart(rows: Array, shape: Array) -> float:
    """How far the farthest of poses (n, 4) is off the nearest place of a way (m, 4) [m], a turn counted as way."""
    from scipy.spatial import cKDTree

    lines = np.vstack([shape[:-1] + share * np.diff(shape, axis=0) for share in (0.0, 0.25, 0.5, 0.75)] + [shape[-1:]])
    return float(cKDTree(lines * COUNTED).query(rows * COUNTED)[0].max())


def _needed(points: Array, rounded: Sequence[float], speeds: Sequence[float]) -> list[int]:
    """The rows of points (n, 4) that lines need: those left out lie on a line that is gone about as fast on both sides."""
    kept, spans = [0], [0]
    for row in range(1, len(points)):
        last = row == len(points) - 1
        apart = not last and not 1 / _ALIKE < speeds[row + 1] / speeds[row] < _ALIKE
        if last or rounded[row] > 0.0 or apart:
            spans.append(row)
    for first, last_row in pairwise(spans):
        part = points[first : last_row + 1]
        kept += [first + row for row in thinned(way_of(part), part * COUNTED, WITHIN_M)[1:]]
    return kept


def _turning(points: Array, rounded: Array, speeds: Array) -> Path:
    """The way without its first pose, and with poses between on lines that turn the tool by more than MOST_TURN."""
    rows, cuts, fast = list[Array](), list[float](), list[float]()
    for row in range(1, len(points)):
        start, end = points[row - 1], points[row]
        pieces = max(1, ceil(abs(end[3] - start[3]) / MOST_TURN - 1e-9))
        rows += list(start + (end - start) * (np.arange(1, pieces + 1) / pieces)[:, None])
        cuts += [PASSED_M] * (pieces - 1) + [float(rounded[row])]
        fast += [float(speeds[row])] * pieces
    return Path(np.array(rows), np.array(cuts), np.array(fast))


def step_between(start: Array, end: Array) -> Array:
    """From one tool pose (4,) to another: x, y, z [m], and the shorter way round [rad]."""
    step = np.asarray(end - start)
    step[3] = (step[3] + pi) % (2 * pi) - pi
    return step


def _length(poses: Array) -> float:
    return float(way_of(poses)[-1])


def _speed(poses: Array) -> float:
    """The highest speed [m/s] of tool poses (n, 4), one a physics step."""
    return float(np.diff(way_of(poses)).max()) / TIME_STEP


def straightened(poses: Array) -> Array:
    """Few tool poses (m, 4) whose straight pieces keep within WITHIN_M of the way through `poses` (n, 4), ends included."""
    way = way_of(poses)
    kept = thinned(way, poses * COUNTED, WITHIN_M)
    rows = [poses[:1]]
    for start, end in zip(poses[kept[:-1]], poses[kept[1:]], strict=True):
        pieces = max(1, ceil(abs(end[3] - start[3]) / MOST_TURN - 1e-9))
        rows.append(start + (end - start) * (np.arange(1, pieces + 1) / pieces)[:, None])
    return np.concatenate(rows)


def thinned(along: Array, values: Array, within: float) -> list[int]:
    """The rows to keep so that straight lines over `along` (n,) pass within `within` of all `values` (n, k).

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
