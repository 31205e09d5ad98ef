"""Simulated cameras, overhead and in the hand: their pictures of the world, and the pixel of each point of the world."""

from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from math import atan, cos, pi, radians, sin, tan

import numpy as np
from numpy.typing import NDArray

from lab.lazy import scipy
from lab.sim.arms.kinematics import ToolPose
from lab.sim.frames import Shape
from lab.sim.mesh_file import vertices
from lab.sim.parts.part_shape import PartShape
from lab.sim.urdf_reader import rotation
from lab.sim.world import World
from lab.vision import Image, Lens
from lab.vision.calibration import Calibration
from lab.vision.grid_view import Window
from lab.vision.lens import spoiled

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera at `eye` looking at `target` [m] with `up` towards the picture's upper edge; square pixels."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float]
    field_of_view_rad: float
    width: int
    height: int

    @classmethod
    def overhead(cls, position: tuple[float, float, float], field_of_view_rad: float, pixels: int) -> "Camera":
        """A camera that looks straight down from `position` [m]: the picture's right is the world's x, its top the world's y."""
        return cls(position, (position[0], position[1], 0.0), (0.0, 1.0, 0.0), field_of_view_rad, pixels, pixels)

    def view_matrix(self) -> Array:
        """World to camera, (4, 4), OpenGL's convention: the camera looks along its -z."""
        eye, target, up = (np.array(v, dtype=float) for v in (self.eye, self.target, self.up))
        back = (eye - target) / np.linalg.norm(eye - target)
        right = np.cross(up, back)
        right /= np.linalg.norm(right)
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack([right, np.cross(back, right), back])
        matrix[:3, 3] = -matrix[:3, :3] @ eye
        return matrix

    def projection_matrix(self) -> Array:
        """Camera to clip space, (4, 4), OpenGL's convention."""
        scale, near, far = 1.0 / tan(self.field_of_view_rad / 2.0), 0.05, 8.0  # [m]
        matrix = np.zeros((4, 4))
        matrix[0, 0], matrix[1, 1] = scale * self.height / self.width, scale
        matrix[2, 2], matrix[2, 3] = (far + near) / (near - far), 2.0 * far * near / (near - far)
        matrix[3, 2] = -1.0
        return matrix

    def pixel_from_world(self) -> Array:
        """(3, 4): homogeneous pixel (x, y, w) of a homogeneous world point [m]; TinyRenderer's offset of one row included."""
        clip = self.projection_matrix() @ self.view_matrix()
        x, y, w = clip[0], clip[1], clip[3]
        return np.stack([(x + w) / 2.0 * self.width, (w - y) / 2.0 * self.height - w, w])

    def picture(self, world: World, window: Window | None = None) -> Image:
        """What the camera sees: (height, width, 3) uint8 RGB, or (side, side, 3) of a window within it alone."""
        view, projection = self.view_matrix(), self.projection_matrix()
        if window is None:
            return world.render(view, projection, self.width, self.height)
        left, top, side = window
        across, down = self.width / side, self.height / side
        magnified = np.diag([across, down, 1.0, 1.0])  # the window's middle gets clip coordinates 0, its edges 1
        magnified[:2, 3] = across - 1.0 - 2.0 * left / side, 1.0 - down + 2.0 * top / side
        return world.render(view, magnified @ projection, side, side)

    def in_picture(self, window: Window) -> Window:
        """The window, moved and shrunk so that it lies within the picture."""
        left, top, side = window
        side = min(side, self.width, self.height)
        return min(max(left, 0), self.width - side), min(max(top, 0), self.height - side), side

    # ---- as a lens in front of a sensor ----------------------------------------------------------------------------

    def lens(self) -> Lens:
        """The lens by focal length and principal point [pixels], without distortion."""
        focal = self.height / 2.0 / tan(self.field_of_view_rad / 2.0)
        return Lens((self.width, self.height), (focal, focal), (self.width / 2.0, self.height / 2.0 - 1.0))

    def turn_and_shift(self) -> tuple[Array, Array]:
        """(3, 3) and (3,) [m]: from world points to the camera's, x to the right, y down, z ahead, as OpenCV has them."""
        ahead = np.diag([1.0, -1.0, -1.0]) @ self.view_matrix()[:3]
        return ahead[:, :3], ahead[:, 3]

    def picture_through(self, lens: Lens, world: World) -> Image:
        """What the camera sees through a lens with distortion: a wider picture is taken and bent."""
        width, height = lens.size
        corners = lens.straight_points(
            [(0, 0), (width, 0), (0, height), (width, height), (width / 2, 0), (0, height / 2)]
        )
        most = max(float(np.abs(corners - lens.middle).max()) / lens.focal[1], 0.01) * 1.02  # tangent of half its angle
        side = 2 * int(np.ceil(most * lens.focal[1]))
        wide = Camera(self.eye, self.target, self.up, 2.0 * atan(side / 2.0 / lens.focal[1]), side, side)
        return lens.bent(wide.picture(world), wide.lens().matrix)


@dataclass(frozen=True)
class TableCamera(Camera):
    """A camera in a real room: a calibrated lens; uneven light, blur and noise of some `strength`.

    Its pictures are undistorted.
    """

    calibration: Calibration | None = None
    strength: float = 0.0

    @classmethod
    def calibrated(cls, calibration: Calibration, pixels: int | None, strength: float) -> "TableCamera":
        """The camera that a calibration found, with pictures of `pixels` a side if given."""
        width, height = calibration.lens.size
        if pixels is not None:
            width, height = pixels, round(height * pixels / width)
            calibration = replace(calibration, lens=calibration.lens.scaled((width, height)))
        eye, turn = calibration.eye_m, np.array(calibration.turn)
        x, y, z = (float(value) for value in np.array(eye) + turn[2])
        up = (float(-turn[1][0]), float(-turn[1][1]), float(-turn[1][2]))
        angle = 2.0 * atan(height / 2.0 / calibration.lens.focal[1])
        return cls(eye, (x, y, z), up, angle, width, height, calibration, strength)

    def pixel_from_world(self) -> Array:
        """(3, 4): homogeneous pixel of the straightened picture."""
        return super().pixel_from_world() if self.calibration is None else self.calibration.pixel_from_world

    def picture(self, world: World, window: Window | None = None) -> Image:
        """What the camera saw in this physics step, straightened: (height, width, 3) uint8 RGB; of it the window, if given."""
        rng = np.random.default_rng([world.steps])
        if self.calibration is None:
            picture = spoiled(super().picture(world), rng, self.strength)
        else:
            lens = self.calibration.lens
            picture = lens.straightened(spoiled(self.picture_through(lens, world), rng, self.strength))
        if window is None:
            return picture
        left, top, side = window
        return picture[top : top + side, left : left + side]


# ---- The camera in the hand -------------------------------------------------------------------------------------------


AHEAD_M = 0.085  # along the tool's x axis
UP_M = 0.1137  # above the finger tips; not a round number: TinyRenderer takes minutes if a corner lies in the camera's plane
ANGLE_RAD = radians(75.0)
PIXELS = 480
_ROUND = 48  # sides of a cylinder's hull


def hand_camera(tool: ToolPose) -> Camera:
    """The camera when the tool is at a pose: its picture's right is the tool's x axis, its top the tool's y axis."""
    at = tool.local(AHEAD_M, 0.0, UP_M)
    up = (-sin(tool.yaw), cos(tool.yaw), 0.0)
    return Camera((at.x, at.y, at.z), (at.x, at.y, 0.0), up, ANGLE_RAD, PIXELS, PIXELS)


@cache
def seen_corners(shape: PartShape) -> Array:
    """The corners (n, 3) of the hull of a part's visible shapes, relative to the middle of its foot [m]."""
    points = np.concatenate([_points(look) for look in shape.looks])
    corners: Array = points[scipy.spatial.ConvexHull(points).vertices] + (0.0, 0.0, shape.foot_m)
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
