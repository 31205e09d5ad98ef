"""Where a camera stands so that all of a scene is in its picture."""

from itertools import product
from math import cos, radians, sin, tan

import numpy as np
from numpy.typing import ArrayLike

from lab.mdp import FloatArray
from lab.sim.frames import Vector, Viewpoint

_HALF_VIEW = radians(19.0)  # half of the page's field of view, from bottom to top
_WIDE = 1.2  # the narrowest picture, width to height, in which all is to be seen
_MARGIN = 1.06


def camera_for(points: ArrayLike, azimuth: float, elevation: float, wide: float = _WIDE) -> Viewpoint:
    """The nearest camera on one side of the `points` (n, 3) [m] that has them all in its picture.

    `azimuth` [rad] from the x axis, counter-clockwise as seen from above; `elevation` [rad] above the horizon. wide: the
    picture's width to its height, at least.
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
    """Three plain numbers."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)
