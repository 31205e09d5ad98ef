"""What a real camera and a real room do to a picture: a bent lens, uneven and coloured light, blur, noise, hidden markers."""

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.typing import NDArray

from lab.vision.lens import Lens
from lab.vision.opencv import cv2
from lab.vision.picture_files import Image, check_picture

Array = NDArray[np.float64]

CORNER_SHIFT = (0.02, 0.05)  # of the way from the middle to a corner: how far the lens draws it in
MIDDLE_OFF = 0.01  # of the picture's width: how far the lens sits off the sensor's middle, at the most
LEAST_LIGHT = 0.45  # in the darkest corner, against the brightest
CAST = 0.12  # how much warmer or colder the light is, red against blue, at the most
LAMP = 0.35  # how much brighter a lamp makes the table beneath it, at the most
BLUR = (0.5, 1.1)  # pixels, standard deviation
NOISE = (2.0, 6.0)  # of 255, standard deviation of the sensor's noise, at mid grey
HIDDEN = 0.40  # of a marker, at the most
COVERS = ((40, 40, 45), (225, 225, 220), (205, 160, 135), (120, 85, 50))  # a cable, paper, a finger, tape


def drawn_lens(rng: np.random.Generator, straight: Lens) -> Lens:
    """A lens like `straight` as one is bought: barrel distortion, a little out of the middle and out of true."""
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
    """The picture (H, W, 3) in a room's uneven light, through a lens that is not quite sharp, with a sensor's noise.

    strength: 0 leaves it as it is, 1 draws from all that the constants above allow.
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
    """How much light each pixel gets (H, W, 3): a slope from a window, a lamp, dark corners, and a colour."""
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
    """A copy with each disc (x, y, radius) [pixels] partly covered by something's straight edge, and how much of each."""
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
    """How far from the middle of a disc of radius 1 a straight edge lies that cuts `share` of it off."""
    edges = np.linspace(-1, 1, 2001)
    cut = (np.arccos(edges) - edges * np.sqrt(1 - edges**2)) / pi  # falls from 1 to 0
    return float(np.interp(-share, -cut, edges))
