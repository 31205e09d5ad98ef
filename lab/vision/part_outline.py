"""The pose of a part of known shape, found in a picture by shape-based matching.

The outline that the part's corners would show is compared with the picture's edges on a grid of positions and yaws, then
on ever finer grids around the best. The score uses the gradient's direction across the outline, not its strength, so light
and colour may vary.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.lazy import cv2
from lab.vision.markers import calmed
from lab.vision.picture_files import Image, check_picture

Array = NDArray[np.float64]

OUTLINE_POINTS = 72
COARSE_PX, FINE_PX = 2.0, 1.2  # standard deviations of the smoothing in the coarse and the fine search
COARSE_M, COARSE_RAD = 0.004, 0.05  # steps of position and yaw in the coarse search
FINEST = 7  # how often these steps are halved
KEPT = 5  # candidates of the coarse search that are refined
FAINT = 2.5  # gradient, of 255 per pixel, that counts half
SEEN = 0.56  # least mean share of the outline that must be an edge of the picture
LIKE_RAD = 0.11  # largest angle between the RGB vectors of the colour inside the outline and of the part


@dataclass(frozen=True, eq=False)
class PartSeen:
    """A part's seen foot (x, y) [m] and yaw [rad]; `share`: the share of its outline (n, 2) [pixels] that is an edge, 0 to 1."""

    x: float
    y: float
    yaw: float
    share: float
    outline: Array


@dataclass(frozen=True, eq=False)
class Outlined:
    """The part to find: corners (n, 3) [m] of its hull relative to its foot, the foot's height [m], and whether it is round.

    A round part shows no yaw. `pixel_from_world` (3, 4): the camera's projection. colours (c, 3): RGB of the part's surfaces.
    """

    corners: Array
    foot_m: float
    round: bool
    pixel_from_world: Array
    colours: Array

    def outlines(self, poses: Array) -> Array:
        """The outlines (k, OUTLINE_POINTS, 4) of the part at `poses` (k, 3) x, y [m], yaw: pixel and unit normal each."""
        c, s = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
        x = poses[:, :1] + c * self.corners[:, 0] - s * self.corners[:, 1]
        y = poses[:, 1:2] + s * self.corners[:, 0] + c * self.corners[:, 1]
        z = np.broadcast_to(self.corners[:, 2] + self.foot_m, x.shape)
        homogeneous = np.stack([x, y, z, np.ones_like(x)], axis=-1) @ self.pixel_from_world.T
        pixels = (homogeneous[..., :2] / homogeneous[..., 2:]).astype(np.float32)
        return np.stack([_evenly(cv2.convexHull(points)[:, 0].astype(np.float64)) for points in pixels])


def find_part(image: Image, part: Outlined, near: ArrayLike, reach_m: float, reach_rad: float) -> PartSeen | None:
    """The part in an undistorted picture (H, W, 3), within reach of the pose `near` (x, y [m], yaw [rad]); None: not seen."""
    check_picture(image)
    at = np.asarray(near, dtype=np.float64)
    coarse = _edges(image, COARSE_PX)
    yaws = np.zeros(1) if part.round else _steps(reach_rad, COARSE_RAD)
    ways = np.stack(np.meshgrid(_steps(reach_m, COARSE_M), _steps(reach_m, COARSE_M), yaws), axis=-1).reshape(-1, 3)
    shares = _shares(coarse, part.outlines(at + ways))
    best = at + ways[np.argsort(-shares)[:KEPT]]
    fine = _edges(image, FINE_PX)
    for edges, last in ((coarse, 2), (fine, FINEST)):
        best = np.array([_finer(edges, part, pose, last) for pose in best])
    shares = _shares(fine, part.outlines(best))
    pose, share = best[int(np.argmax(shares))], float(shares.max())
    outline = part.outlines(pose[None])[0, :, :2]
    if share < SEEN or np.abs(pose[:2] - at[:2]).max() > 1.2 * reach_m or not _coloured(image, outline, part.colours):
        return None
    return PartSeen(float(pose[0]), float(pose[1]), float(pose[2]), share, outline)


def _coloured(image: Image, outline: Array, colours: Array) -> bool:
    """Whether most pixels inside an outline have one of the colours, at any brightness."""
    within = np.zeros(image.shape[:2], np.uint8)
    cv2.fillPoly(within, [np.rint(outline).astype(np.int32)], 1)
    pixels = calmed(image)[within > 0].astype(np.float64) + 1.0
    ways = pixels / np.linalg.norm(pixels, axis=1)[:, None]
    wanted = (colours + 1e-3) / np.linalg.norm(colours + 1e-3, axis=1)[:, None]
    return bool(len(pixels)) and float(np.median((ways @ wanted.T).max(axis=1))) > np.cos(LIKE_RAD)


def _steps(reach: float, step: float) -> Array:
    count = int(np.ceil(reach / step))
    return np.asarray(np.arange(-count, count + 1) * step, dtype=np.float64)


def _finer(edges: Array, part: Outlined, pose: Array, last: int) -> Array:
    """The pose at which the outline fits best, searched with steps that are halved up to the level `last`."""
    turns = (0.0,) if part.round else (-1.0, 0.0, 1.0)
    ways = np.stack(np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], turns), axis=-1).reshape(-1, 3)
    for level in range(1, last):
        step = np.array([COARSE_M, COARSE_M, COARSE_RAD]) / 2**level
        for _ in range(4):
            tried = pose + ways * step
            best = tried[int(np.argmax(_shares(edges, part.outlines(tried))))]
            if np.array_equal(best, pose):
                break
            pose = best
    return pose


def _edges(image: Image, smooth_px: float) -> Array:
    """The gradient (H, W, 2) of the channel where it is strongest, with a length from 0 (none) to 1 (strong)."""
    soft = cv2.GaussianBlur(calmed(image), (0, 0), smooth_px).astype(np.float64)
    dy, dx = np.gradient(soft, axis=(0, 1))
    strong = np.hypot(dx, dy) * smooth_px
    channel = strong.argmax(axis=2)[..., None]
    dx, dy, strong = (np.take_along_axis(gradient, channel, axis=2)[..., 0] for gradient in (dx, dy, strong))
    scale = smooth_px / (strong + FAINT)
    return np.asarray(np.stack([dx * scale, dy * scale], axis=-1), dtype=np.float64)


def _shares(edges: Array, outlines: Array) -> Array:
    """The share (k,) of each outline (k, n, 4) that lies along an edge, 0 to 1; outside the picture there are no edges."""
    x, y = outlines[..., 0].astype(np.float32), outlines[..., 1].astype(np.float32)
    there: Any = cv2.remap(edges.astype(np.float32), x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    across = np.abs((there * outlines[..., 2:]).sum(axis=-1))
    return np.asarray(across.mean(axis=1), dtype=np.float64)


def _evenly(polygon: Array) -> Array:
    """OUTLINE_POINTS points (n, 4) spaced evenly along a closed polygon (m, 2): pixel and unit normal of each."""
    ends = np.roll(polygon, -1, axis=0)
    sides = ends - polygon
    lengths = np.maximum(np.linalg.norm(sides, axis=1), 1e-9)
    way = np.concatenate([[0.0], np.cumsum(lengths)])
    at = (np.arange(OUTLINE_POINTS) + 0.5) / OUTLINE_POINTS * way[-1]
    side = np.minimum(np.searchsorted(way, at, side="right") - 1, len(sides) - 1)
    along = sides[side] / lengths[side][:, None]
    points = polygon[side] + along * (at - way[side])[:, None]
    return np.column_stack([points, -along[:, 1], along[:, 0]])
