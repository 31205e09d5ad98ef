"""A run as timed points: joints, tool, gripper, and the machine whose input the robot waits for."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lab.export.commands import thinned
from lab.export.program import Array, Motion, Press, Program
from lab.export.recorder import closed_at

WITHIN_RAD = 1e-4  # largest deviation of the joints when interpolated linearly between the points
DIGITS = 6  # decimals of a written number: seconds, metres or radians


@dataclass(frozen=True)
class Point:
    """The state at t_s [s]: joints (k,) [rad], their tool pose x, y, z [m], yaw [rad], the gripper, the number of the job.

    waits_for: the machine whose input the robot waits for from now on; "": none.
    """

    t_s: float
    joints: tuple[float, ...]
    tool: tuple[float, float, float, float]
    closed: bool
    waits_for: str
    job: int


@dataclass(frozen=True)
class TimedPoints:
    """Points by time, and the names of the arm's joints; between the points the joints are interpolated linearly."""

    joints: tuple[str, ...]
    points: tuple[Point, ...]


def timed(program: Program) -> TimedPoints:
    """The points of a run, as few as stay within WITHIN_RAD of its joints; numbers are rounded to DIGITS decimals."""
    drops = [transfer.drop_s for transfer in program.carried.transfers]
    points: list[Point] = []
    for t_s, joints, waits_for in _rows(program):
        pose = program.arm.forward(joints)
        tool = (_rounded(pose.x), _rounded(pose.y), _rounded(pose.z), _rounded(pose.yaw))
        closed = bool(closed_at(program.carried.actions, np.array([t_s + 1e-9]))[0])
        job = int(np.searchsorted(drops, t_s, side="left")) + 1
        points.append(Point(_rounded(t_s), tuple(map(_rounded, joints)), tool, closed, waits_for, job))
    return TimedPoints(program.arm.joints, tuple(points))


def _rounded(number: float) -> float:
    return round(float(number), DIGITS) + 0.0


def _rows(program: Program) -> Iterator[tuple[float, Array, str]]:
    """Times, joints and the machine waited for, of each action in order."""
    waits = [
        (transfer.reach_s, transfer.waits_for)
        for transfer in program.carried.transfers
        if transfer.waits_for is not None
    ]
    joints = program.joints[0] if len(program.joints) else None
    for action in program.carried.actions:
        while waits and joints is not None and waits[0][0] <= action.at_s + 1e-9:
            reach_s, station = waits.pop(0)
            yield reach_s, joints, station
        if isinstance(action, Motion):
            at_s, rows = program.at_s[action.first : action.last], program.joints[action.first : action.last]
            for row in thinned(at_s, rows, WITHIN_RAD):
                yield float(at_s[row]), rows[row], ""
            joints = rows[-1]
        elif isinstance(action, Press) and joints is not None:
            yield action.at_s, joints, ""
