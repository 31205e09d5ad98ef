"""The overhead camera: which way is up, and which pixel a point falls on."""

import numpy as np
import pytest

from lab.sim.camera import Camera
from lab.sim.models import MARKER_GREEN, MARKER_RADIUS
from lab.sim.world import World

RNG = np.random.default_rng(3)
SPOTS = [tuple(map(float, spot)) for spot in RNG.uniform([0.42, -0.36, 0.01], [1.18, 0.36, 0.5], (8, 3))]


def middle_of_green(picture: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]) -> tuple[float, float]:
    """The centroid (x, y) [pixels] of what is more green than anything else."""
    wide = picture.astype(int)
    rows, columns = np.nonzero(wide[..., 1] - np.maximum(wide[..., 0], wide[..., 2]) > 10)
    assert len(rows) > 50
    return float(columns.mean()), float(rows.mean())


def projected(camera: Camera, point: tuple[float, ...]) -> tuple[float, float]:
    x, y, w = camera.pixel_from_world() @ (*point, 1.0)
    return x / w, y / w


@pytest.mark.parametrize("spot", SPOTS)
def test_a_rendered_marker_is_where_the_matrix_says(world: World, spot: tuple[float, float, float]) -> None:
    camera = Camera.overhead((0.8, 0.0, 2.4), 0.40, 640)
    world.box("table", (3, 3, 0.02), (0, 0, -0.01), (0.86, 0.85, 0.83, 1))
    world.disc("marker", MARKER_RADIUS, 0.004, (spot[0], spot[1], spot[2] - 0.002), MARKER_GREEN)
    seen = middle_of_green(camera.picture(world))
    assert np.hypot(*np.subtract(seen, projected(camera, spot))) < 0.3


def test_a_wide_picture_and_a_slanted_camera_agree_too(world: World) -> None:
    camera = Camera((0.2, -1.0, 1.5), (0.6, 0.1, 0.0), (0.0, 0.0, 1.0), 0.5, 480, 320)
    world.disc("marker", MARKER_RADIUS, 0.004, (0.65, 0.15, -0.002), MARKER_GREEN)
    picture = camera.picture(world)
    assert picture.shape == (320, 480, 3)
    assert np.hypot(*np.subtract(middle_of_green(picture), projected(camera, (0.65, 0.15, 0.0)))) < 0.5


def test_right_is_x_and_up_is_y() -> None:
    camera = Camera.overhead((0.8, 0.0, 2.4), 0.40, 640)
    x, y = projected(camera, (0.8, 0.0, 0.0))
    assert (x, y) == pytest.approx((320, 319))  # TinyRenderer draws one row too high
    assert projected(camera, (0.9, 0.0, 0.0))[0] > x
    assert projected(camera, (0.8, 0.1, 0.0))[1] < y


def test_the_same_world_gives_the_same_picture(world: World) -> None:
    camera = Camera.overhead((0.0, 0.0, 1.0), 0.5, 64)
    world.box("cube", (0.1, 0.1, 0.1), (0.05, 0.02, 0.05), (0.7, 0.5, 0.3, 1))
    first = camera.picture(world)
    assert first.dtype == np.uint8
    assert first.shape == (64, 64, 3)
    assert np.array_equal(first, camera.picture(world))
