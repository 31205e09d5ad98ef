"""A part's pose from its outline: painted at known poses, with neighbours, on light ground; gone, or another colour."""

from itertools import product

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.vision import Image
from lab.vision.part_outline import Outlined, find_part

SIDE, FOCAL, HIGH = 320, 320.0, 0.42
CAMERA = np.array([[FOCAL, 0, -SIDE / 2, SIDE / 2 * HIGH], [0, -FOCAL, -SIDE / 2, SIDE / 2 * HIGH], [0, 0, -1.0, HIGH]])
BROWN = np.array([[0.62, 0.42, 0.22]])
BOX = np.array(list(product((-0.06, 0.06), (-0.0075, 0.0075), (0.0, 0.12))))
PART = Outlined(BOX, 0.012, False, CAMERA, BROWN)


def painted(
    *poses: tuple[float, float, float], rgb: tuple[int, int, int] = (158, 107, 56), noise: float = 4.0
) -> Image:
    image = np.full((SIDE, SIDE, 3), 215, np.uint8)
    for pose in poses:
        outline = PART.outlines(np.array([pose]))[0, :, :2]
        cv2.fillPoly(image, [np.rint(outline * 16).astype(np.int32)], rgb, cv2.LINE_AA, 4)
    grain = np.random.default_rng(0).normal(0, noise, image.shape)
    return np.clip(image + grain, 0, 255).astype(np.uint8)


@settings(max_examples=15)
@given(st.floats(-0.025, 0.025), st.floats(-0.02, 0.02), st.floats(-0.18, 0.18))
def test_a_part_is_found_within_two_millimetres_and_two_degrees(x: float, y: float, yaw: float) -> None:
    seen = find_part(painted((x, y, yaw), (0.0, y + 0.06, 0.0)), PART, (0.0, 0.0, 0.0), 0.03, 0.2)
    assert seen is not None
    assert np.hypot(seen.x - x, seen.y - y) < 0.002
    assert abs(seen.yaw - yaw) < np.radians(2)


def test_where_nothing_stands_nothing_is_seen() -> None:
    assert find_part(painted(), PART, (0.0, 0.0, 0.0), 0.03, 0.2) is None


def test_a_thing_of_another_colour_is_not_the_part() -> None:
    assert find_part(painted((0.0, 0.0, 0.0), rgb=(90, 95, 110)), PART, (0.0, 0.0, 0.0), 0.03, 0.2) is None


@pytest.mark.parametrize("light", [0.5, 1.1])
def test_light_does_not_matter(light: float) -> None:
    image = (painted((0.01, -0.01, 0.1)) * light).clip(0, 255).astype(np.uint8)
    seen = find_part(image, PART, (0.0, 0.0, 0.0), 0.03, 0.2)
    assert seen is not None
    assert (seen.x, seen.y, seen.yaw) == pytest.approx((0.01, -0.01, 0.1), abs=0.002)
