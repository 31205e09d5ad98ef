"""What is drawn beside a lesson's scene, and the camera that has all of it in its picture."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from math import cos, radians, sin, tan

import numpy as np
from numpy.typing import ArrayLike

from lab.mdp import FloatArray, TabularMDP
from lab.sim.frames import Body, Camera, Pose, Rgba, Shape, Vector

STEP_S = 0.1  # [s] between two frames: nothing is simulated, the times only count up
TRAIL = 48  # cells of the episode that stay marked
GREEN: Rgba = (0.16, 0.62, 0.30, 0.5)
RED: Rgba = (0.86, 0.16, 0.14, 0.6)
FAINT: Rgba = (0.16, 0.38, 0.78, 0.35)
_HALF_VIEW = radians(19.0)  # half of the page's field of view, from bottom to top
_WIDE = 1.2  # the narrowest picture, width to height, in which all is to be seen
_MARGIN = 1.06

Changes = tuple[dict[str, Pose], dict[str, bool]]  # the poses and the visibility that a frame is to hold


@dataclass
class Marks:
    """Balls at the cells of the episode so far and at a blocked cell that was entered.

    `place` gives the middle of a state [m]; the radii [m] of both kinds of balls. A new episode begins after a terminal
    state, and when the learner is suddenly elsewhere.
    """

    mdp: TabularMDP
    place: Callable[[int], Vector]
    trail_m: float
    collision_m: float
    _last: int | None = None
    _count: int = 0

    def bodies(self) -> tuple[Body, ...]:
        """The balls, in the origin."""
        step = Shape("sphere", (self.trail_m,), None, FAINT)
        collision = Shape("sphere", (self.collision_m,), None, RED)
        return (*(Body(f"trail {number}", (step,)) for number in range(TRAIL)), Body("collision", (collision,)))

    def at(self, state: int) -> Changes:
        """What changes when the learner comes to `state`."""
        last, self._last = self._last, state
        poses: dict[str, Pose] = {}
        visible: dict[str, bool] = {}
        if last is None or self.mdp.terminal[last] or state not in self.mdp.successor[last]:
            visible = {f"trail {number}": False for number in range(TRAIL)}
        elif state != last:
            name = f"trail {self._count % TRAIL}"
            self._count += 1
            poses[name], visible[name] = upright(self.place(last)), True
        visible["collision"] = bool(self.mdp.terminal[state] and not self.mdp.goal[state])
        if visible["collision"]:
            poses["collision"] = upright(self.place(state))
        return poses, visible


def camera_for(points: ArrayLike, azimuth: float, elevation: float) -> Camera:
    """The nearest camera on one side of the `points` (n, 3) [m] that has them all in its picture.

    `azimuth` [rad] from the x axis, counter-clockwise as seen from above; `elevation` [rad] above the horizon.
    """
    seen = np.asarray(points, dtype=np.float64)
    target = (seen.min(axis=0) + seen.max(axis=0)) / 2
    back = np.array([cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation)])
    right = np.array([-sin(azimuth), cos(azimuth), 0.0])
    off = seen - target
    aside = np.maximum(abs(off @ np.cross(back, right)), abs(off @ right) / _WIDE)
    eye = target + back * float((_MARGIN * aside / tan(_HALF_VIEW) + off @ back).max())
    return Camera(vector(eye), vector(target))


def corners(low: ArrayLike, high: ArrayLike) -> FloatArray:
    """The eight corners (8, 3) of a box [m]."""
    return np.array(list(product(*np.stack([np.asarray(low), np.asarray(high)], axis=1))), dtype=np.float64)


def vector(values: FloatArray) -> Vector:
    """Three plain numbers."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def upright(at: Vector) -> Pose:
    """The pose at a place, not turned."""
    return (*at, 0.0, 0.0, 0.0, 1.0)
