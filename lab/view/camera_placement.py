"""Placement of a camera so that its picture contains a whole scene."""

from itertools import product
from math import cos, radians, sin, tan

import numpy as np
from numpy.typing import ArrayLike

from lab.mdp import FloatArray
from lab.sim.frames import Vector, Viewpoint

_HALF_VIEW = radians(19.0)  # half of the page's field of view, from bottom to top
_WIDE = 1.2  # least aspect ratio, width to height, at which the whole scene is visible
_MARGIN = 1.06


def camera_for(points: ArrayLike, azimuth: float, elevation: float, wide: float = _WIDE) -> Viewpoint:
    """The nearest camera in a given direction whose picture contains all `points` (n, 3) [m].

    `azimuth` [rad] from the x axis, counter-clockwise as seen from above; `elevation` [rad] above the horizon. wide: the
    least aspect ratio of the picture, width to height.
    """
    seen = np.asarray(points, dtype=np.float64)
    target = (seen.min(axis=0) + seen.max(axis=0)) / 2
    back = np.array([cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation)])
    right = np.array([-sin(azimuth), cos(azimuth), 0.0])
    off = seen - target
    aside = np.maximum(abs(off @ np.cross(back, right)), abs(off @ right) / wide)
    eye = target + back * float((_MARGIN * aside / tan(_HALF_VIEW) + off @ back).max())
    return Viewpoint(vector(eye), vector(target))


def corners(low: ArrayLike, high: ArrayLike) -> FloatArray:
    """The eight corners (8, 3) of a box [m]."""
    return np.array(list(product(*np.stack([np.asarray(low), np.asarray(high)], axis=1))), dtype=np.float64)


def vector(values: FloatArray) -> Vector:
    """The three values as a tuple of plain floats."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)
