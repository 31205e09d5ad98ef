"""What an arm reaches at one height of its tool, found by asking its inverse kinematics."""

from collections.abc import Callable
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from lab.sim.arms.kinematics import ToolPose
from lab.sim.scene.ground_plan import Ring

Inverse = Callable[[ToolPose], NDArray[np.float64] | None]

MOST_M = 2.5  # no arm of a table's size reaches farther
STEP_M, STEP_RAD = 0.04, pi / 18
HALVINGS = 8  # of a step: the ring's edges are right within 0.2 mm and 0.04 degrees


def ring_of(inverse: Inverse, height_m: float, nearest_m: float = 0.0) -> Ring | None:
    """The ring around the arm's axis that a vertical tool reaches at a height; None where it reaches nothing.

    `nearest_m`: nearer to its axis the tool never goes. It is looked for straight ahead, and the way the arm can turn in the
    ring's middle; of several rings the widest counts.
    """

    def ahead(far: float) -> bool:
        return far >= nearest_m and inverse(ToolPose(far, 0.0, height_m)) is not None

    steps = [far for far in np.arange(0.0, MOST_M, STEP_M).tolist() if ahead(far)]
    runs = np.split(np.array(steps), np.flatnonzero(np.diff(steps) > 1.5 * STEP_M) + 1)
    widest = max(runs, key=len)
    if not len(widest):
        return None
    first, last = float(widest[0]), float(widest[-1])
    nearest, farthest = _edge(ahead, first, first - STEP_M), _edge(ahead, last, last + STEP_M)
    middle = (first + last) / 2

    def turned(angle: float) -> bool:
        return inverse(ToolPose(middle * cos(angle), middle * sin(angle), height_m, angle)) is not None

    right, left = (_turn(lambda angle, way=way: turned(way * angle)) for way in (-1, 1))  # type: ignore[misc]
    return Ring(nearest, farthest, right, left)


def _turn(turned: Callable[[float], bool]) -> float:
    for angle in np.arange(STEP_RAD, pi + STEP_RAD / 2, STEP_RAD).tolist():
        if not turned(angle):
            return _edge(turned, angle - STEP_RAD, angle)
    return pi


def _edge(holds: Callable[[float], bool], inside: float, outside: float) -> float:
    """Where `holds` ends between a value for which it is true and one for which it is not, on the true side."""
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside
