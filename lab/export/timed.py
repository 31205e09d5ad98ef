"""A run as points in time: joints, tool, gripper, and which machine's input is waited for."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lab.export.commands import thinned
from lab.export.program import Array, Motion, Press, Program
from lab.export.recorder import closed_at

WITHIN_RAD = 1e-4  # of the joints driven, where straight lines between the points are
DIGITS = 6  # of a written number, seconds, metres or radians


@dataclass(frozen=True)
class Point:
    """At t_s [s]: the joints (k,) [rad] and the tool x, y, z [m], yaw [rad] that they hold, the gripper, the job's number.

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
    """Points by time, of an arm's joints by name; between them the joints move in straight lines."""

    joints: tuple[str, ...]
    points: tuple[Point, ...]


def timed(program: Program) -> TimedPoints:
    """The points of a run, as few as keep within WITHIN_RAD; numbers are rounded as they are written."""
    drops = [transfer.drop_s for transfer in program.carried.transfers]
    found: list[Point] = []
    for t_s, joints, waits_for in _rows(program):
        pose = program.arm.forward(joints)
        tool = (_rounded(pose.x), _rounded(pose.y), _rounded(pose.z), _rounded(pose.yaw))
        closed = bool(closed_at(program.carried.actions, np.array([t_s + 1e-9]))[0])
        job = int(np.searchsorted(drops, t_s, side="left")) + 1
        found.append(Point(_rounded(t_s), tuple(map(_rounded, joints)), tool, closed, waits_for, job))
    return TimedPoints(program.arm.joints, tuple(found))


def _rounded(number: float) -> float:
    return round(float(number), DIGITS) + 0.0


def _rows(program: Program) -> Iterator[tuple[float, Array, str]]:
    """Times, joints and what is waited for, in order."""
    waits = [(one.reach_s, one.waits_for) for one in program.carried.transfers if one.waits_for is not None]
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
