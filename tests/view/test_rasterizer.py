"""Pictures drawn without a display: what is nearer hides, glass lets through, a lamp casts shadows."""

import numpy as np
import pytest

from lab.sim.frames import IDENTITY, Body, Frame, Shape, Viewpoint
from lab.view.rasterizer import BACKGROUND, Floats, Mesh, Rasterizer, Still
from lab.view.scene_data import corners_of

RED, GREEN = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0)
FRONT = Viewpoint(eye=(4.0, 0.0, 1.0), target=(0.0, 0.0, 0.0))
SIZE = (60, 40)


def box(size: tuple[float, float, float], rgba: tuple[float, float, float, float]) -> tuple[Mesh, ...]:
    return (Mesh(*corners_of(Shape("box", size)), rgba),)


def drawn(*placed: tuple[tuple[Mesh, ...], tuple[float, float, float]], hidden: int = -1) -> Floats:
    """A picture of bodies at places, without the one of number `hidden`, 0..1."""
    rasterizer = Rasterizer([body for body, _ in placed], FRONT, *SIZE)
    count = len(placed)
    shown = np.arange(count) != hidden
    turns, own = np.tile(np.eye(3), (count, 1, 1)), np.full((count, 4), np.nan)
    return rasterizer.picture(np.array([at for _, at in placed]), turns, shown, own) / 255.0


def main_colour(pixel: Floats) -> int:
    """Which of red, green, blue a pixel is; -1 for what is of no colour."""
    return int(np.argmax(pixel)) if np.ptp(pixel) > 0.1 else -1


MIDDLE = (SIZE[1] // 2, SIZE[0] // 2)


@pytest.mark.parametrize("order", [1, -1])
def test_what_is_nearer_hides_what_is_behind_it_whichever_is_named_first(order: int) -> None:
    near, far = (box((0.2, 0.5, 0.5), RED), (1.0, 0.0, 0.0)), (box((0.2, 1.0, 1.0), GREEN), (-1.0, 0.0, 0.0))
    picture = drawn(*(near, far)[::order])
    assert main_colour(picture[MIDDLE]) == 0
    assert 1 in {main_colour(pixel) for pixel in picture.reshape(-1, 3)}
    assert np.allclose(picture[0, 0], BACKGROUND, atol=0.01)
    assert main_colour(drawn(near, far, hidden=0)[MIDDLE]) == 1


def test_glass_lets_what_is_behind_it_through() -> None:
    far = (box((0.2, 1.0, 1.0), GREEN), (-1.0, 0.0, 0.0))
    red, green, _ = drawn((box((0.2, 0.5, 0.5), (1.0, 0.0, 0.0, 0.5)), (1.0, 0.0, 0.0)), far)[MIDDLE]
    assert min(red, green) > 0.2


def test_a_ground_that_reaches_behind_the_camera_is_drawn() -> None:
    picture = drawn((box((50.0, 50.0, 0.1), GREEN), (0.0, 0.0, -0.5)))
    assert main_colour(picture[-1, SIZE[0] // 2]) == 1


def test_what_is_under_something_is_darker() -> None:
    ground = (box((4.0, 4.0, 0.1), (0.8, 0.8, 0.8, 1.0)), (0.0, 0.0, -0.5))
    without, under = drawn(ground), drawn(ground, (box((0.6, 0.6, 0.1), RED), (0.6, -0.4, 0.6)))
    darker = (under.max(axis=2) < without.max(axis=2) - 0.1) & (np.ptp(under, axis=2) < 0.1)
    assert 3 < darker.sum() < 400


@pytest.mark.parametrize("x", [-1, 0, 1])
@pytest.mark.parametrize("y", [-1, 0, 1])
def test_points_to_look_at_fill_the_picture(x: int, y: int) -> None:
    points = corners_of(Shape("box", (0.2, 0.2, 0.2)))[0] + np.array([0.0, x, y])
    body = (Mesh(points, *corners_of(Shape("box", (0.2, 0.2, 0.2)))[1:], RED),)
    rasterizer = Rasterizer([body], FRONT, *SIZE, around=points)
    picture = rasterizer.picture(np.zeros((1, 3)), np.eye(3)[None], np.array([True]), np.full((1, 4), np.nan)) / 255.0
    red = np.argwhere(np.ptp(picture, axis=2) > 0.1)
    assert np.ptp(red[:, 0]) > 0.8 * SIZE[1] or np.ptp(red[:, 1]) > 0.8 * SIZE[0]
    assert red.min() > 0


# ---- still ------------------------------------------------------------------------------------------------------------


def test_it_keeps_what_was_shown_last() -> None:
    one, other = (Body(name, (Shape("sphere", (0.1,)),)) for name in ("one", "other"))
    still = Still()
    still.show([one])
    still.update(Frame(0.0, {"one": IDENTITY}))
    still.show([other])
    still.update(Frame(1.0, {"other": IDENTITY}))
    still.recording.check()
    assert still.recording.bodies == (other,)
    assert [frame.time_s for frame in still.recording.frames] == [1.0]
