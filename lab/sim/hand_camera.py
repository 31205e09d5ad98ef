"""The camera in the hand: beside the tool, looking straight down at what is to be taken up or was set down."""

from functools import cache
from itertools import product
from math import cos, pi, radians, sin

import numpy as np
from numpy.typing import NDArray

from lab.sim.arms.kinematics import ToolPose
from lab.sim.camera import Camera
from lab.sim.frames import Shape
from lab.sim.mesh_file import vertices
from lab.sim.parts.part_shape import PartShape
from lab.sim.urdf_reader import rotation

AHEAD_M = 0.085  # along the tool's x axis
UP_M = (
    0.1137  # above the finger tips; odd, for TinyRenderer takes minutes where a corner lies in the camera's very plane
)
ANGLE_RAD = radians(75.0)
PIXELS = 480
_ROUND = 48  # sides of a cylinder's hull

Array = NDArray[np.float64]


def hand_camera(tool: ToolPose) -> Camera:
    """The camera when the tool is at a pose: its picture's right is the tool's x axis, its top the tool's y axis."""
    at = tool.local(AHEAD_M, 0.0, UP_M)
    up = (-sin(tool.yaw), cos(tool.yaw), 0.0)
    return Camera((at.x, at.y, at.z), (at.x, at.y, 0.0), up, ANGLE_RAD, PIXELS, PIXELS)


@cache
def seen_corners(shape: PartShape) -> Array:
    """Corners (n, 3) [m], from the middle of the part's foot, of the hull of what is seen of it."""
    from scipy.spatial import ConvexHull

    points = np.concatenate([_points(look) for look in shape.looks])
    corners: Array = points[ConvexHull(points).vertices] + (0.0, 0.0, shape.foot_m)
    return corners


def _points(look: Shape) -> Array:
    """Points (n, 3) [m] that span one visible piece, in the part's axes."""
    if look.kind == "mesh" and look.mesh is not None:
        own = vertices(look.mesh) * (look.size or (1.0, 1.0, 1.0))
    elif look.kind == "box":
        own = np.array(list(product(*((-edge / 2, edge / 2) for edge in look.size))))
    else:
        radius, height = (look.size[0], look.size[-1] if look.kind == "cylinder" else 2 * look.size[0])
        turns = np.arange(_ROUND) * 2 * pi / _ROUND
        ring = radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        own = np.concatenate([np.column_stack([ring, np.full(_ROUND, z)]) for z in (-height / 2, height / 2)])
    return np.asarray(own @ rotation(look.quaternion).T + look.position)
