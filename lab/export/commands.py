"""A program as a controller takes it: straight ways, gripper outputs, timers, waits, grouped into one job a transfer."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, pi

import numpy as np

from lab.export.program import Action, Array, Motion, Press, Program, Transfer
from lab.sim.arms.robot import GRIP_STEPS
from lab.sim.arms.tool_path import COUNTED, way_of
from lab.sim.world import TIME_STEP

WITHIN_M = 1e-4  # a way is written as straight pieces that deviate so little from it; a turn counts as YAW_ARM
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
    """Straight pieces through tool poses x, y, z [m], yaw [rad] (n, 4) in the world, to a stop at the last, at a speed [m/s].

    The speed is of the way in which a turn of the tool counts as YAW_ARM.
    """

    points: Array
    speed_m_s: float


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


Command = Joint | Path | Grip | Pause | Await


@dataclass(frozen=True)
class Job:
    """One transfer's commands, in order."""

    words: str
    commands: tuple[Command, ...]


def jobs_of(program: Program) -> list[Job]:
    """One job a transfer; what the robot did after the last one, where a run failed, is a job of its own."""
    jobs, left = [], list(program.carried.actions)
    for transfer in program.carried.transfers:
        own = [action for action in left if action.at_s < transfer.drop_s]
        left = left[len(own) :]
        jobs.append(Job(transfer.words, _commands(program, own, transfer)))
    if left:
        jobs.append(Job("not finished", _commands(program, left, None)))
    return jobs


def moving(program: Program) -> list[Motion]:
    """The motions that lead anywhere: each is a `Path` of its jobs, in order."""
    return [motion for motion in program.motions if _length(program.tools(motion.first, motion.last)) > STILL_M]


def _commands(program: Program, actions: Sequence[Action], transfer: Transfer | None) -> tuple[Command, ...]:
    found: list[Command] = []
    wait = None if transfer is None else transfer.waits_for
    for action in actions:
        if wait is not None and transfer is not None and action.at_s >= transfer.reach_s - TIME_STEP / 2:
            found.append(Await(program.carried.machines.index(wait) + 1, wait))
            wait = None
        if isinstance(action, Motion):
            poses = program.tools(action.first, action.last)
            if _length(poses) > STILL_M:
                if not any(isinstance(command, Path) for command in found):
                    found.append(Joint(tuple(map(float, program.joints[action.first]))))
                driven = poses if action.complete else poses[:-1]
                found.append(Path(straightened(poses)[1:], _speed(driven)))
        elif isinstance(action, Press):
            found += [Grip(action.closed), Pause(GRIP_S)]
        else:
            found.append(Pause(action.seconds))
    return tuple(found)


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
