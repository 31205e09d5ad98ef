"""A camera's lens: focal length, principal point and distortion, which it removes from pictures and adds to them.

The second half makes rendered pictures look like photographs: a real lens, uneven light, blur, noise, covered markers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput
from lab.lazy import cv2
from lab.vision.picture_files import Image, check_picture

Array = NDArray[np.float64]

TERMS = ("k1", "k2", "p1", "p2", "k3")


@dataclass(frozen=True)
class Lens:
    """Focal lengths and principal point (`middle`) [pixels] for pictures of `size`, and Brown's distortion k1 k2 p1 p2 k3.

    Pixels are (x, y) from the centre of the top left pixel. The terms are those of OpenCV; with all 0 it is a pinhole.
    Raises BadInput for numbers that are not finite, and for sizes or focal lengths that are not above 0.
    """

    size: tuple[int, int]
    focal: tuple[float, float]
    middle: tuple[float, float]
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        values = [*self.focal, *self.middle, *self.distortion]
        if len(self.distortion) != len(TERMS) or not np.isfinite(values).all() or min(*self.size, *self.focal) <= 0:
            raise BadInput(
                f"lens: size {self.size}, focal {self.focal}, middle {self.middle}, distortion {self.distortion}: "
                f"wanted finite numbers, size and focal lengths above 0, and {len(TERMS)} terms of distortion"
            )

    @property
    def matrix(self) -> Array:
        """The camera matrix (3, 3)."""
        (fx, fy), (cx, cy) = self.focal, self.middle
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def scaled(self, size: tuple[int, int]) -> "Lens":
        """The same lens for pictures of another (width, height) [pixels]."""
        x, y = (new / old for new, old in zip(size, self.size, strict=True))
        middle = ((self.middle[0] + 0.5) * x - 0.5, (self.middle[1] + 0.5) * y - 0.5)
        return Lens(size, (self.focal[0] * x, self.focal[1] * y), middle, self.distortion)

    def projected(self, points: ArrayLike, turn: ArrayLike, shift: ArrayLike) -> Array:
        """The pixels (n, 2) of world points (n, 3) [m]; `turn` (3, 3) and `shift` (3,) take them to the camera's axes."""
        rotation = cv2.Rodrigues(np.asarray(turn, dtype=np.float64))[0]
        world, to = np.asarray(points, dtype=np.float64), np.asarray(shift, dtype=np.float64)
        seen, _ = cv2.projectPoints(world, rotation, to, self.matrix, np.array(self.distortion))
        return np.asarray(seen, dtype=np.float64).reshape(-1, 2)

    def straight_points(self, pixels: ArrayLike) -> Array:
        """The pixels (n, 2) in the undistorted picture of `pixels` (n, 2) in the original."""
        return self._onto(np.asarray(pixels, dtype=np.float64), self.matrix)

    def straightened(self, image: Image) -> Image:
        """The undistorted picture (H, W, 3), as a pinhole with the same matrix would have taken it."""
        self._check(image)
        if not any(self.distortion):
            return image
        return np.asarray(cv2.undistort(image, self.matrix, np.array(self.distortion)), dtype=np.uint8)

    def bent(self, wide: Image, pinhole: Array) -> Image:
        """The distorted picture that this lens takes of the scene in `wide`, the picture of a pinhole with matrix `pinhole`.

        `wide` (H, W, 3) should cover more than this lens sees; outside it, the pixels of its edge are repeated.
        """
        check_picture(wide)
        width, height = self.size
        pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
        there = self._onto(pixels.astype(np.float64), pinhole).reshape(height, width, 2).astype(np.float32)
        bent: Any = cv2.remap(wide, there[..., 0], there[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(bent, dtype=np.uint8)

    def _onto(self, pixels: Array, matrix: Array) -> Array:
        there = cv2.undistortPoints(pixels[:, None], self.matrix, np.array(self.distortion), None, None, matrix)
        return np.asarray(there, dtype=np.float64).reshape(-1, 2)

    def _check(self, image: Image) -> None:
        check_picture(image)
        height, width = image.shape[:2]
        if (width, height) != self.size:
            raise BadInput(
                f"picture: {width} x {height} pixels: the camera was calibrated with {self.size[0]} x {self.size[1]}"
            )


# ---- effects that make a rendered picture look like a photograph --------------------------------------------------------


CORNER_SHIFT = (0.02, 0.05)  # shift of a corner towards the middle by barrel distortion, as a share of their distance
MIDDLE_OFF = 0.01  # largest offset of the principal point, as a share of the picture's width
LEAST_LIGHT = 0.45  # lightness of the darkest corner, relative to the brightest
CAST = 0.12  # largest colour cast, red against blue
LAMP = 0.35  # largest gain of brightness below a lamp
BLUR = (0.5, 1.1)  # standard deviation of the blur [pixels]
NOISE = (2.0, 6.0)  # standard deviation of the sensor's noise at mid grey, of 255
HIDDEN = 0.40  # largest covered share of a marker
COVERS = ((40, 40, 45), (225, 225, 220), (205, 160, 135), (120, 85, 50))  # RGB of a cable, paper, a finger, tape


def drawn_lens(rng: np.random.Generator, straight: Lens) -> Lens:
    """A random real lens in place of `straight`: with barrel distortion, slightly off centre and slightly tilted."""
    width, height = straight.size
    across = float(np.hypot(width, height)) / 2 / straight.focal[0]  # a corner, in focal lengths from the middle
    k1 = -rng.uniform(*CORNER_SHIFT) / across**2
    k2 = rng.uniform(-0.004, 0.004) / across**4
    p1, p2 = rng.uniform(-0.002, 0.002, 2) / across
    off = rng.uniform(-MIDDLE_OFF, MIDDLE_OFF, 2) * width
    focal = straight.focal[0] * rng.uniform(0.97, 1.03)
    middle = (straight.middle[0] + float(off[0]), straight.middle[1] + float(off[1]))
    return Lens(straight.size, (focal, focal), middle, (float(k1), float(k2), float(p1), float(p2), 0.0))


def spoiled(image: Image, rng: np.random.Generator, strength: float = 1.0) -> Image:
    """The picture (H, W, 3) with a room's uneven light, blur and sensor noise.

    strength: 0 leaves the picture unchanged; 1 draws from the full ranges of the constants above.
    """
    check_picture(image)
    if strength <= 0.0:
        return image
    blur = max(1e-3, strength * rng.uniform(*BLUR))
    bright = cv2.GaussianBlur(image, (0, 0), blur).astype(np.float64) * _light(image.shape[:2], rng, strength)
    read, shot = strength * rng.uniform(*NOISE), rng.normal(size=image.shape)
    noise = read * (0.5 + 0.5 * np.sqrt(np.clip(bright, 0, 255) / 128)) * shot
    return np.asarray(np.clip(np.rint(bright + noise), 0, 255), dtype=np.uint8)


def _light(shape: tuple[int, ...], rng: np.random.Generator, strength: float) -> Array:
    """The light factor of each pixel (H, W, 3): a gradient from a window, a lamp, dark corners and a colour cast."""
    rows, columns = shape[:2]
    y, x = np.meshgrid(np.linspace(-1, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
    way, lamp = rng.uniform(0, 2 * pi), rng.uniform(-1, 1, 2)
    slope = rng.uniform(0, 0.35) * (np.cos(way) * x + np.sin(way) * y)
    spot = rng.uniform(0, LAMP) * np.exp(-((x - lamp[0]) ** 2 + (y - lamp[1]) ** 2) / rng.uniform(0.1, 0.6))
    corners = rng.uniform(0, 0.25) * (x**2 + y**2) / 2
    light = 1.0 + slope + spot - corners
    light = np.maximum(light / light.max(), LEAST_LIGHT) * rng.uniform(0.75, 1.1)
    warm = rng.uniform(-CAST, CAST)
    coloured = light[..., None] * np.array([1 + warm / 2, 1.0, 1 - warm / 2])
    return np.asarray(1.0 + strength * (coloured - 1.0))


def hide(
    image: Image, discs: Sequence[tuple[float, float, float]], rng: np.random.Generator
) -> tuple[Image, list[float]]:
    """A copy in which a straight edge covers part of each disc (x, y, radius) [pixels], and the covered shares."""
    canvas, shares = np.array(image), []
    for x, y, radius in discs:
        share, way = rng.uniform(0, HIDDEN), rng.uniform(0, 2 * pi)
        edge = radius * _edge_of(share)
        out, along = np.array([np.cos(way), np.sin(way)]), np.array([-np.sin(way), np.cos(way)])
        wide, half = rng.uniform(1.6, 2.4) * radius, 1.2 * radius
        corners = [(edge, -half), (edge, half), (edge + wide, half), (edge + wide, -half)]
        strip = np.array([(x, y) + a * out + b * along for a, b in corners])
        colour = COVERS[int(rng.integers(len(COVERS)))]
        cv2.fillPoly(canvas, [np.rint(strip * 16).astype(np.int32)], colour, cv2.LINE_AA, 4)
        shares.append(float(share))
    return canvas, shares


def _edge_of(share: float) -> float:
    """The distance from the middle of a unit disc of a straight edge that cuts `share` of its area off."""
    edges = np.linspace(-1, 1, 2001)
    cut = (np.arccos(edges) - edges * np.sqrt(1 - edges**2)) / pi  # falls from 1 to 0
    return float(np.interp(-share, -cut, edges))
