"""The overhead camera: which way is up, and which pixel a point falls on."""

from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray

from lab.sim.arms.kinematics import ToolPose
from lab.sim.camera import AHEAD_M, PIXELS, UP_M, Camera, TableCamera, hand_camera, seen_corners
from lab.sim.models import MARKER_GREEN, MARKER_RADIUS
from lab.sim.parts.part_shape import shape_of
from lab.sim.world import World
from lab.tasks.part_fields import PartFields
from lab.tasks.task_file import load
from lab.vision import Image, Lens
from lab.vision.calibration import Calibration

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


@pytest.mark.parametrize("window", [(0, 0, 40), (53, 97, 60), (260, 200, 60)])
def test_a_window_shows_what_the_whole_picture_shows_there(world: World, window: tuple[int, int, int]) -> None:
    """Its edges and colours to the pixel; where surfaces are shaded, rounding may differ by a step or two."""
    camera = Camera((0.2, -1.0, 1.5), (0.6, 0.1, 0.0), (0.0, 0.0, 1.0), 0.5, 320, 260)
    world.box("table", (3, 3, 0.02), (0, 0, -0.01), (0.86, 0.85, 0.83, 1))
    for x in np.linspace(0.2, 1.0, 9):
        world.disc(f"marker {x:g}", MARKER_RADIUS, 0.004, (float(x), 0.1, -0.002), MARKER_GREEN)
    left, top, side = window
    part = camera.picture(world, window)
    assert part.shape == (side, side, 3)
    whole = camera.picture(world)[top : top + side, left : left + side]
    assert np.abs(part.astype(int) - whole).max() <= 8
    assert (part != whole).any(axis=2).mean() < 0.01


def test_a_window_is_moved_into_the_picture() -> None:
    camera = Camera.overhead((0.0, 0.0, 1.0), 0.5, 64)
    assert camera.in_picture((10, 20, 30)) == (10, 20, 30)
    assert camera.in_picture((-3, 60, 30)) == (0, 34, 30)
    assert camera.in_picture((5, 5, 100)) == (0, 0, 64)


def test_a_room_s_camera_cuts_the_window_out_of_its_picture(world: World) -> None:
    camera = TableCamera(**vars(Camera.overhead((0.0, 0.0, 1.0), 0.5, 64)), strength=1.0)
    world.box("cube", (0.1, 0.1, 0.1), (0.05, 0.02, 0.05), (0.7, 0.5, 0.3, 1))
    assert np.array_equal(camera.picture(world, (10, 20, 30)), camera.picture(world)[20:50, 10:40])


def calibration_of(camera: Camera, lens: Lens) -> Calibration:
    turn, shift = camera.turn_and_shift()
    return Calibration(lens, tuple(tuple(row) for row in turn.tolist()), tuple(shift.tolist()), 0.0, 0, "by hand")


def test_turn_and_shift_are_those_of_the_projection() -> None:
    camera = Camera((0.3, 0.1, 1.5), (0.5, 0.0, 0.0), (0.2, 1.0, 0.0), 0.6, 200, 160)
    points = np.array([(0.5, 0.1, 0.0), (0.3, -0.2, 0.2)])
    way = np.column_stack([points, np.ones(2)]) @ camera.pixel_from_world().T
    assert camera.lens().projected(points, *camera.turn_and_shift()) == pytest.approx(way[:, :2] / way[:, 2:])


def test_a_calibrated_camera_sees_straight_through_a_bent_lens() -> None:
    hung = Camera((0.02, -0.01, 2.0), (0.03, 0.0, 0.0), (0.02, 1.0, 0.0), 0.4, 240, 240)
    straight = hung.lens()
    bent = Lens(straight.size, straight.focal, (123.0, 117.0), (-0.8, 0.0, 0.0, 0.0, 0.0))
    camera = TableCamera.calibrated(calibration_of(hung, bent), None, 0.0)
    at = (0.25, 0.2, 0.05)
    with World() as world:
        world.box("table", (3, 3, 0.02), (0, 0, -0.01), (0.8, 0.8, 0.8, 1))
        world.disc("marker", 0.03, 0.002, at, (1, 0, 1, 1))
        raw, picture = camera.picture_through(bent, world), camera.picture(world)
        again, small = camera.picture(world), TableCamera.calibrated(calibration_of(hung, bent), 120, 0.0)
    x, y, w = camera.pixel_from_world() @ (*at, 1.0)

    def middle(image: Image) -> NDArray[np.float64]:
        down, right = np.nonzero((image[..., 0] > 120) & (image[..., 1] < 60))
        return np.array([right.mean(), down.mean()])

    assert middle(picture) == pytest.approx((x / w, y / w), abs=0.7)
    assert np.linalg.norm(middle(raw) - (x / w, y / w)) > 1.5
    assert (picture == again).all()
    u, v, w = small.pixel_from_world() @ (*at, 1.0)
    assert ((u / w + 0.5) * 2, (v / w + 0.5) * 2) == pytest.approx(middle(picture) + 0.5, abs=0.8)


# ---- hand camera ------------------------------------------------------------------------------------------------------


def test_it_hangs_ahead_of_the_tool_and_looks_down() -> None:
    camera = hand_camera(ToolPose(0.5, 0.2, 0.3, pi / 2))
    assert camera.eye == pytest.approx((0.5, 0.2 + AHEAD_M, 0.3 + UP_M))
    x, y, w = camera.pixel_from_world() @ (0.5, 0.2 + AHEAD_M, 0.0, 1.0)
    assert (x / w, y / w) == pytest.approx((PIXELS / 2, PIXELS / 2 - 1))
    x, y, w = camera.pixel_from_world() @ (0.5, 0.3 + AHEAD_M, 0.0, 1.0)  # along the tool's x: to the right
    assert x / w > PIXELS / 2 + 50
    assert y / w == pytest.approx(PIXELS / 2 - 1)


def test_of_a_box_its_eight_corners_are_seen_from_its_foot() -> None:
    task = load("breakfast")
    cup, slice_ = task.part("cup"), task.part("slice")
    corners = seen_corners(shape_of(cup, task.folder))
    assert corners.min(axis=0) == pytest.approx((-0.017, -0.017, 0.0), abs=1e-6)
    assert corners.max(axis=0) == pytest.approx((0.017, 0.017, 0.07), abs=1e-6)
    plain = PartFields(name="plain", shape="box", size_m=(0.1, 0.02, 0.06), mass_kg=0.1)
    assert {tuple(np.round(one, 6)) for one in seen_corners(shape_of(plain, task.folder))} == {
        (x, y, z) for x in (-0.05, 0.05) for y in (-0.01, 0.01) for z in (0.0, 0.06)
    }
    loaf = seen_corners(shape_of(slice_, task.folder))  # its look, not the box that physics feels
    assert len(loaf) > 8
    assert loaf[loaf[:, 2] > 0.119][:, 0].max() < 0.04  # round at the top
