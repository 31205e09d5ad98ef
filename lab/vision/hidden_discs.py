"""Discs of known size of which something hides a part, found by the arc that is left; and noise taken out of pictures."""

from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.vision.grid_view import View
from lab.vision.opencv import cv2
from lab.vision.picture_files import Image

Array = NDArray[np.float64]

WHOLE = 0.95  # of the area that it should have: a spot with more is taken for a whole disc
LARGER = 1.6  # times the area that it should have: such a spot is no disc
LEAST_ARC = 0.42  # of the circle that must be seen
ON_ARC_PX = 0.9  # from the circle: points of the outline that are its rim
OUT_PX = 1.6  # beyond the circle: an outline that reaches farther is another thing's
OUTSIDE = 0.04  # of the outline that may do so all the same
SAMPLES = 28  # points of the outline of which every two give circles to try
NOISY = 1.5  # of 255, standard deviation: a picture with more noise is smoothed
SMOOTH_PX = 1.0
RIM_IN_PX = 0.1  # the outline runs that much within the rim


def calmed(image: Image) -> Image:
    """The picture (H, W, 3), smoothed where it is noisy; a renderer's clean one as it is."""
    second = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], dtype=np.float64)
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    rough: Any = np.abs(cv2.filter2D(grey, cv2.CV_64F, second))  # Immerkaer 1996; the median leaves edges out
    noise = float(np.median(rough)) / 0.6745 / 6.0
    if noise <= NOISY:
        return image
    return np.asarray(cv2.GaussianBlur(image, (0, 0), SMOOTH_PX), dtype=np.uint8)


def hidden_part(outline: NDArray[np.int32], area: float, view: View, kind: str) -> bool:
    """Whether a spot with this outline (n, 2) and area [pixels] is smaller than a whole marker of known size would be."""
    if view.radius_m <= 0.0:
        return False
    return bool(area < WHOLE * np.pi * _rim(outline, view, kind) ** 2)


def behind_cover(outline: NDArray[np.int32], view: View, kind: str) -> tuple[float, float] | None:
    """The middle [pixels] of the marker of which the spot with this outline (n, 2) is what can be seen; None: of none.

    Every two points of the outline give two circles of the known radius; the one with most of the outline on its rim counts.
    """
    points = outline.astype(np.float64)
    radius = _rim(outline, view, kind)
    if len(points) < 8:
        return None
    some = points[np.linspace(0, len(points) - 1, min(SAMPLES, len(points)), dtype=int)]
    centres = _circles(some, radius)
    if not len(centres):
        return None
    off = np.linalg.norm(points[None] - centres[:, None], axis=2) - radius
    outside = (off > OUT_PX).mean(axis=1)
    votes = np.where(outside <= OUTSIDE, (np.abs(off) < ON_ARC_PX).sum(axis=1), 0)
    best = int(np.argmax(votes))
    if votes[best] < 6:
        return None
    centre = _refined(points, centres[best], radius)
    rim = points[np.abs(np.linalg.norm(points - centre, axis=1) - radius) < ON_ARC_PX]
    turns = np.degrees(np.arctan2(*(rim - centre).T[::-1]))
    if len(np.unique(turns // 10)) < LEAST_ARC * 36:
        return None
    return float(centre[0]), float(centre[1])


def _rim(outline: NDArray[np.int32], view: View, kind: str) -> float:
    """The radius of a whole marker's outline, which runs through the middles of its outermost pixels."""
    return max(view.radius_px(outline.mean(axis=0), kind) - RIM_IN_PX, 1.0)


def _circles(points: Array, radius: float) -> Array:
    """The middles (n, 2) of the circles with this radius through every two of the points that lie well apart."""
    one, other = (np.array(side) for side in zip(*combinations(points, 2), strict=True))
    way = other - one
    length = np.linalg.norm(way, axis=1)
    far = (length > 0.6 * radius) & (length < 1.98 * radius)
    one, way, length = one[far], way[far], length[far][:, None]
    across = np.column_stack([-way[:, 1], way[:, 0]]) / length
    up = np.sqrt(radius**2 - length**2 / 4)
    return np.concatenate([one + way / 2 + up * across, one + way / 2 - up * across])


def _refined(points: Array, centre: Array, radius: float) -> Array:
    """The middle that fits best, by least squares, to the points near the circle (Gauss-Newton)."""
    for _ in range(8):
        out = points - centre
        far = np.linalg.norm(out, axis=1)
        near = np.abs(far - radius) < ON_ARC_PX
        if near.sum() < 5:
            return centre
        ways = out[near] / far[near][:, None]
        centre = centre + np.linalg.lstsq(ways, far[near] - radius, rcond=None)[0]
    return centre
