"""Markers of which a part is hidden are found where they are; what is no disc is not."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.vision import MARKERS, Image, View, find_markers
from lab.vision.markers import calmed

SIDE, RADIUS = 200, 14.0
FLAT = View(np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 0, 1.0]]), (0.0, 0.0), 50.0, (4, 4), radius_m=RADIUS)


def disc(x: float, y: float) -> Image:
    image = np.full((SIDE, SIDE, 3), 180, np.uint8)
    cv2.circle(image, (round(x * 16), round(y * 16)), round(RADIUS * 16), MARKERS["obstacle"].rgb, -1, cv2.LINE_AA, 4)
    return image


def cut(image: Image, x: float, y: float, way: float, edge: float) -> Image:
    """Covers what lies farther than `edge` from (x, y) towards `way`."""
    down, right = np.mgrid[:SIDE, :SIDE]
    image = image.copy()
    image[(right - x) * np.cos(way) + (down - y) * np.sin(way) > edge] = (60, 60, 60)
    return image


@given(st.floats(60, 140), st.floats(60, 140), st.floats(0, 6.28), st.floats(0.2 * RADIUS, 1.1 * RADIUS))
def test_a_marker_cut_by_an_edge_is_found_where_it_is(x: float, y: float, way: float, edge: float) -> None:
    markers, ignored = find_markers(cut(disc(x, y), x, y, way, edge), FLAT)
    assert (len(markers), ignored) == (1, 0)
    assert np.hypot(markers[0].pixel[0] - x, markers[0].pixel[1] - y) < 0.125 * RADIUS


def test_without_a_known_size_a_cut_marker_is_passed_over() -> None:
    plain = View(FLAT.pixel_from_world, (0.0, 0.0), 50.0, (4, 4))
    assert find_markers(cut(disc(100, 100), 100, 100, 0.5, 2.0), plain) == ((), 1)


def test_a_sliver_and_a_square_are_no_markers() -> None:
    assert find_markers(cut(disc(100, 100), 100, 100, 0.5, -8.0), FLAT) == ((), 1)
    square = np.full((SIDE, SIDE, 3), 180, np.uint8)
    square[90:110, 90:110] = MARKERS["obstacle"].rgb
    assert find_markers(square, FLAT) == ((), 1)


@pytest.mark.parametrize(("noise", "same"), [(0.0, True), (6.0, False)])
def test_only_noisy_pictures_are_smoothed(noise: float, same: bool) -> None:
    image = np.clip(disc(80, 90) + np.random.default_rng(0).normal(0, noise, (SIDE, SIDE, 3)), 0, 255).astype(np.uint8)
    assert (calmed(image) == image).all() == same
