"""Round coloured markers in a picture, partly hidden ones among them, and the grid that they define (thesis ch. 8.3, step 3).

Markers are classified by hue and saturation, never by brightness: a renderer shades flat discs like balls, and a room
has shadows.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import hypot, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.lazy import cv2
from lab.vision.grid_view import Cell, GridView, Marker, View, plain_view
from lab.vision.picture_files import Image, check_picture

Array = NDArray[np.float64]

WHOLE = 0.95  # share of the expected area above which a spot counts as a whole disc
LARGER = 1.6  # multiple of the expected area above which a spot is no disc
LEAST_ARC = 0.42  # share of the circle that must be visible
ON_ARC_PX = 0.9  # largest distance from the circle of outline points that belong to its rim
OUT_PX = 1.6  # an outline that extends farther beyond the circle belongs to another object
OUTSIDE = 0.04  # share of the outline for which that is tolerated
SAMPLES = 28  # points of the outline; every pair of them gives candidate circles
NOISY = 1.5  # standard deviation, of 255, above which a picture is smoothed
SMOOTH_PX = 1.0
RIM_IN_PX = 0.1  # by which the outline lies inside the rim


def calmed(image: Image) -> Image:
    """The picture (H, W, 3), smoothed if it is noisy; a clean rendered picture is returned unchanged."""
    second = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], dtype=np.float64)
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    rough: Any = np.abs(
        cv2.filter2D(grey, cv2.CV_64F, second)
    )  # noise estimate, J. Immerkaer, 1996; the median ignores edges
    noise = float(np.median(rough)) / 0.6745 / 6.0
    if noise <= NOISY:
        return image
    return np.asarray(cv2.GaussianBlur(image, (0, 0), SMOOTH_PX), dtype=np.uint8)


def hidden_part(outline: NDArray[np.int32], area: float, view: View, kind: str) -> bool:
    """Whether a spot with this outline (n, 2) and area [pixels] is smaller than a whole marker of known size."""
    if view.radius_m <= 0.0:
        return False
    return bool(area < WHOLE * np.pi * _rim(outline, view, kind) ** 2)


def behind_cover(outline: NDArray[np.int32], view: View, kind: str) -> tuple[float, float] | None:
    """The centre [pixels] of a partly hidden marker, from the outline (n, 2) of its visible part; None: no marker fits.

    Every pair of outline points gives two circles of the known radius; the circle with most outline points on its rim wins.
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
    """The radius of a whole marker's outline [pixels]; the outline passes through the centres of its outermost pixels."""
    return max(view.radius_px(outline.mean(axis=0), kind) - RIM_IN_PX, 1.0)


def _circles(points: Array, radius: float) -> Array:
    """The centres (n, 2) of the circles with this radius through each pair of points that are far enough apart."""
    one, other = (np.array(side) for side in zip(*combinations(points, 2), strict=True))
    way = other - one
    length = np.linalg.norm(way, axis=1)
    far = (length > 0.6 * radius) & (length < 1.98 * radius)
    one, way, length = one[far], way[far], length[far][:, None]
    across = np.column_stack([-way[:, 1], way[:, 0]]) / length
    up = np.sqrt(radius**2 - length**2 / 4)
    return np.concatenate([one + way / 2 + up * across, one + way / 2 - up * across])


def _refined(points: Array, centre: Array, radius: float) -> Array:
    """The centre that fits the points near the circle best, by least squares (Gauss-Newton)."""
    for _ in range(8):
        out = points - centre
        far = np.linalg.norm(out, axis=1)
        near = np.abs(far - radius) < ON_ARC_PX
        if near.sum() < 5:
            return centre
        ways = out[near] / far[near][:, None]
        centre = centre + np.linalg.lstsq(ways, far[near] - radius, rcond=None)[0]
    return centre


# ---- markers and the grid that they define ------------------------------------------------------------------------------


SATURATION = 100  # of 255; wood, bread, steel and skin stay below it or have another hue
CHROMA = 12  # of 255, largest minus smallest channel: on black, sensor noise has every hue and full saturation
MIN_PIXELS = 8.0  # a smaller spot is noise
RIM = 1.0  # pixels: outline points this close to the spot's hull belong to its edge, others to a highlight
MAX_CELLS = 2.0  # cell areas: a larger spot is no marker
ROUNDNESS = 0.72  # least share of its enclosing circle that a spot fills: a disc near 1, a square 0.64
MAX_MARKERS = 10_000  # in a picture, enough for 100 x 100 cells; fitting ellipses to more would take too long


@dataclass(frozen=True)
class Hue:
    """A marker's colour: OpenCV `hue` (0..179) within `tolerance`, its name, and its RGB (0..255) for drawing."""

    hue: int
    colour: str
    rgb: tuple[int, int, int]
    tolerance: int = 12


MARKERS = {
    "gripper": Hue(150, "magenta", (255, 0, 255)),
    "obstacle": Hue(60, "green", (0, 255, 0)),
    "toaster": Hue(90, "cyan", (0, 255, 255)),
}


def find_markers(image: Image, view: View) -> tuple[tuple[Marker, ...], int]:
    """All markers in a picture (H, W, 3), sorted by kind, then cell; and the number of spots rejected as not round.

    Cells may lie outside the grid. Raises BadInput for a picture of another shape or dtype, or with too many spots.
    """
    check_picture(image)
    image = calmed(image)
    hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
    colourful = image.max(axis=2) - image.min(axis=2) >= CHROMA
    markers, ignored = [], 0
    for kind, hue in MARKERS.items():
        low, high = (hue.hue - hue.tolerance, SATURATION, 0), (hue.hue + hue.tolerance, 255, 255)
        mask = cv2.inRange(hsv, np.array(low), np.array(high)) * colourful
        for outline in cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]:
            hull = cv2.convexHull(outline)  # a highlight may bite into the outline
            area, radius = cv2.contourArea(hull), cv2.minEnclosingCircle(hull)[1]
            if area < MIN_PIXELS:
                continue
            round_enough = cv2.contourArea(outline) >= ROUNDNESS * pi * radius**2
            if hidden_part(outline.reshape(-1, 2), area, view, kind):
                cover = behind_cover(outline.reshape(-1, 2), view, kind)
            elif area <= MAX_CELLS * view.cell_pixels and round_enough:
                rim = [p for p in outline if abs(cv2.pointPolygonTest(hull, tuple(map(float, p[0])), True)) < RIM]
                x, y = cv2.fitEllipse(np.array(rim))[0]
                cover = (float(x), float(y))
            else:
                cover = None
            if cover is None:
                ignored += 1
                continue
            place = view.place(cover, kind)
            markers.append(Marker(kind, cover, place, view.cell(place)))
            if len(markers) > MAX_MARKERS:
                raise BadInput(f"picture: more than {MAX_MARKERS} round coloured spots: no picture of a grid")
    return tuple(sorted(markers, key=lambda m: (m.kind, m.cell, m.pixel))), ignored


def see(
    image: Image,
    view: View | None = None,
    *,
    shape: Cell = (12, 12),
    goal_near_m: Sequence[float] | None = None,
    where: str = "picture",
) -> GridView:
    """The grid that a picture (H, W, 3) shows; without a view the picture itself is a grid of `shape`.

    goal_near_m: approximate position (x, y) [m] of the goal's machine, for a cell with several machines: the nearest of
    their markers is the goal, and markers outside the view's grid are ignored.

    Raises BadInput, naming `where`: no markers, not exactly one gripper or one toaster, a marker outside the grid, the
    start or the goal on an obstacle, a picture of another shape or dtype. Thesis ch. 8.3, fig. 8.2.
    """
    check_picture(image, where)
    view = view or plain_view(image.shape[:2], shape)
    markers, ignored = find_markers(image, view)
    if goal_near_m is not None:
        markers = _of_this_grid(markers, view, goal_near_m)
    if not markers:
        wanted = ", ".join(f"{name} ({hue.colour})" for name, hue in MARKERS.items())
        raise BadInput(f"{where}: no round coloured marker found: wanted {wanted}{_passed_over(ignored)}")
    gripper, toaster = (_single(markers, ignored, kind, where) for kind in ("gripper", "toaster"))
    for marker in markers:
        if not view.holds(marker.cell):
            raise BadInput(f"{where}: {_outside(marker, view)}")
    obstacles = {m.cell for m in markers if m.kind == "obstacle"}
    for name, marker in (("start", gripper), ("goal", toaster)):
        if marker.cell in obstacles:
            raise BadInput(
                f"{where}: the {name} {marker.cell} ({marker.kind} marker) is on a cell that an obstacle covers"
            )
    return GridView(view.shape, gripper.cell, toaster.cell, tuple(sorted(obstacles)), markers, view)


def _of_this_grid(markers: tuple[Marker, ...], view: View, goal_near_m: Sequence[float]) -> tuple[Marker, ...]:
    """The markers that belong to one grid of several."""
    mine = [m for m in markers if m.kind == "gripper" or view.holds(m.cell)]
    goals = [m for m in mine if m.kind == "toaster"]
    goal = min(goals, key=lambda m: hypot(m.world_m[0] - goal_near_m[0], m.world_m[1] - goal_near_m[1]), default=None)
    return tuple(m for m in mine if m.kind != "toaster" or m is goal)


def locate(image: Image, view: View, kind: str) -> Marker:
    """The only marker of `kind` in a picture (H, W, 3), as when the gripper's position is checked.

    Raises BadInput when there is none or more than one, or for a picture of another shape or dtype.
    """
    return _single(*find_markers(image, view), kind, "picture")


def _single(markers: tuple[Marker, ...], ignored: int, kind: str, where: str) -> Marker:
    mine = [m for m in markers if m.kind == kind]
    if len(mine) != 1:
        pixels = ", ".join(f"({m.pixel[0]:.0f}, {m.pixel[1]:.0f})" for m in mine)
        seen = f"{len(mine)} {kind} markers at pixels {pixels}" if mine else f"no {kind} marker"
        wanted = f"wanted exactly one round {MARKERS[kind].colour} spot for the {kind}"
        raise BadInput(f"{where}: {seen}: {wanted}{_passed_over(ignored)}")
    return mine[0]


def _passed_over(ignored: int) -> str:
    return f"; coloured spots passed over as not round or too large: {ignored}" if ignored else ""


def _outside(marker: Marker, view: View) -> str:
    x0, y0 = view.origin_m
    x1, y1 = x0 + view.shape[0] * view.cell_m, y0 + view.shape[1] * view.cell_m
    (u, v), (x, y) = marker.pixel, marker.world_m
    return (
        f"the {marker.kind} marker at pixel ({u:.0f}, {v:.0f}) lies outside the grid: "
        f"x {x:.3f}, y {y:.3f} m is not within x {x0:g} to {x1:g}, y {y0:g} to {y1:g} m"
    )


def draw(image: Image, grid: GridView, outlines: Sequence[Sequence[Sequence[float]]] = ()) -> Image:
    """A copy of the picture (H, W, 3) with the grid's lines, start, goal, obstacles and the markers' centres drawn on it.

    outlines: outlines of parts, each (n, 2) [pixels], drawn in orange.
    """
    check_picture(image)
    view = grid.view
    thin = max(1, round(min(image.shape[:2]) / 400))

    def corners(i: float, j: float, rows: float, columns: float) -> NDArray[np.int32]:
        square = np.array([(i, j), (i + rows, j), (i + rows, j + columns), (i, j + columns)]) * view.cell_m
        points = np.column_stack([square + view.origin_m, np.zeros(4)])
        return np.rint(view.pixel(points)).astype(np.int32)

    filled = np.array(image)
    for i, j in grid.obstacles:
        cv2.fillPoly(filled, [corners(i, j, 1, 1)], (200, 40, 40))
    canvas = np.asarray(cv2.addWeighted(filled, 0.45, image, 0.55, 0.0), dtype=np.uint8)
    rows, columns = grid.shape
    for i in range(rows):
        cv2.polylines(canvas, [corners(i, 0, 1, columns)], True, (255, 255, 255), thin, cv2.LINE_AA)
    for j in range(columns):
        cv2.polylines(canvas, [corners(0, j, rows, 1)], True, (255, 255, 255), thin, cv2.LINE_AA)
    for cell, kind in ((grid.start, "gripper"), (grid.goal, "toaster")):
        cv2.polylines(canvas, [corners(*cell, 1, 1)], True, MARKERS[kind].rgb, 3 * thin, cv2.LINE_AA)
    for outline in outlines:
        cv2.polylines(canvas, [np.rint(outline).astype(np.int32)], True, (255, 120, 0), thin, cv2.LINE_AA)
    for marker in grid.markers:
        at = (round(marker.pixel[0]), round(marker.pixel[1]))
        cv2.drawMarker(canvas, at, (0, 0, 0), cv2.MARKER_CROSS, 10 * thin, thin)
    return canvas
