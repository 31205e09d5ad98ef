"""Path shortcutting: of the corners of a learned path, those that are left where the tool may go straight past the others.

The policy still says which way round; only where straight lines between its corners are free does the tool leave its cells.
Source: S. Berchtold and B. Glavina, 1994 (shortcuts between the corners of a path).
"""

from collections.abc import Callable, Sequence
from math import ceil

import numpy as np

from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.tool_path import COUNTED, bending, way_of

Free = Callable[[Sequence[ToolPose]], bool]  # whether the tool can be at all of these poses


def corners(path: Sequence[ToolPose], step_m: float, free: Free) -> tuple[int, ...]:
    """Which poses of a path are left, both ends included: those of the fewest free lines, and of as few of the shortest.

    Lines are asked about at poses at most `step_m` apart, a turn counted as way; those of the path itself are free.
    """
    points = np.array([[p.x, p.y, p.z, p.yaw] for p in path])
    rows = bending(points * COUNTED)
    best: list[tuple[int, float, tuple[int, ...]]] = [(0, 0.0, (rows[0],))]  # lines, way [m] and poses, to each corner
    for at, row in enumerate(rows[1:], 1):
        ways = []
        for before, (lines, way, kept) in enumerate(best):
            long = float(way_of(points[[rows[before], row]])[-1])
            if before == at - 1 or free(_between(points[rows[before]], points[row], step_m, long)):
                ways.append((lines + 1, way + long, (*kept, row)))
        best.append(min(ways))
    return best[-1][2]


def _between(one: np.ndarray, other: np.ndarray, step_m: float, long: float) -> list[ToolPose]:
    """The poses on a line, both ends included."""
    shares = np.linspace(0.0, 1.0, ceil(long / step_m) + 1)
    return [ToolPose(*map(float, one + share * (other - one))) for share in shares]
