"""The lens: what it bends it straightens again, and points go where OpenCV's model says."""

import cv2
import numpy as np
import pytest

from lab.errors import BadInput
from lab.vision import Image, Lens
from lab.vision.calibration import pinhole
from lab.vision.lens import CORNER_SHIFT, HIDDEN, drawn_lens, hide, spoiled

BARREL = Lens((200, 160), (300.0, 300.0), (102.0, 78.0), (-0.4, 0.1, 0.002, -0.001, 0.0))


def test_a_point_on_the_axis_falls_on_the_middle_and_one_beside_it_is_drawn_in() -> None:
    """k1 = -0.4 at 0.2 focal lengths: 0.2 (1 - 0.4 x 0.04) = 0.1968 of them, 59.04 pixels instead of 60."""
    lens = Lens((200, 160), (300.0, 300.0), (100.0, 80.0), (-0.4, 0.0, 0.0, 0.0, 0.0))
    pixels = lens.projected([(0, 0, 1), (0.2, 0, 1)], np.eye(3), np.zeros(3))
    assert pixels == pytest.approx(np.array([(100.0, 80.0), (159.04, 80.0)]))
    assert lens.straight_points(pixels) == pytest.approx(np.array([(100.0, 80.0), (160.0, 80.0)]), abs=1e-4)


def test_a_bent_picture_comes_straight_again() -> None:
    y, x = np.mgrid[:320, :400].astype(float)
    scene = np.repeat((128 + 100 * np.sin(x / 15) * np.cos(y / 12))[..., None], 3, axis=2).astype(np.uint8)
    wide = np.array([[300.0, 0, 200], [0, 300.0, 160], [0, 0, 1]])
    bent = BARREL.bent(scene, wide)
    assert bent.shape == (160, 200, 3)
    straight = BARREL.straightened(bent)
    there = scene[82:242, 98:298]  # the middle (102, 78) of the lens is (200, 160) of the scene
    inner = (slice(15, -15), slice(15, -15))
    assert np.abs(straight[inner].astype(int) - there[inner]).max() < 12
    assert np.abs(bent[inner].astype(int) - there[inner]).max() > 24


def test_for_pictures_of_half_the_size_everything_is_half() -> None:
    half = BARREL.scaled((100, 80))
    assert (half.focal, half.distortion) == ((150.0, 150.0), BARREL.distortion)
    whole, less = (one.projected([(0.1, 0.05, 1)], np.eye(3), np.zeros(3))[0] for one in (BARREL, half))
    assert (less + 0.5) * 2 == pytest.approx(whole + 0.5)


def test_what_is_no_lens_is_refused_and_so_is_another_cameras_picture() -> None:
    with pytest.raises(BadInput, match="wanted finite numbers"):
        Lens((10, 10), (0.0, 1.0), (5, 5))
    with pytest.raises(BadInput, match=r"9 x 9 pixels: the camera was calibrated with 200 x 160"):
        BARREL.straightened(np.zeros((9, 9, 3), np.uint8))


# ---- photo effects ----------------------------------------------------------------------------------------------------


def grey(side: int = 200) -> Image:
    return np.full((side, side, 3), 150, np.uint8)


def test_the_same_seed_spoils_alike_and_another_one_otherwise() -> None:
    one, same, other = (spoiled(grey(), np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert (one == same).all()
    assert (one != other).any()
    assert (spoiled(grey(), np.random.default_rng(1), 0.0) == grey()).all()


def test_light_is_uneven_and_noise_is_there() -> None:
    image = spoiled(grey(), np.random.default_rng(4)).astype(float)
    assert 1.0 < image[:20, :20].std(axis=(0, 1)).max() < 12.0
    blocks = image.reshape(10, 20, 10, 20, 3).mean(axis=(1, 3, 4))
    assert blocks.max() - blocks.min() > 10


def test_a_drawn_lens_draws_corners_in_by_some_percent() -> None:
    straight = pinhole((640, 640), 0.4)
    for seed in range(20):
        lens = drawn_lens(np.random.default_rng(seed), straight)
        across = np.hypot(320, 320) / straight.focal[0] / np.sqrt(2)
        seen = lens.projected([(across, across, 1.0)], np.eye(3), np.zeros(3))[0] - lens.middle
        share = 1 - np.linalg.norm(seen) / (across * np.sqrt(2) * lens.focal[0])
        assert CORNER_SHIFT[0] - 0.012 < share < CORNER_SHIFT[1] + 0.012


@pytest.mark.parametrize("seed", range(6))
def test_a_marker_is_hidden_as_far_as_is_said(seed: int) -> None:
    image = grey()
    cv2.circle(image, (100, 100), 30, (255, 0, 255), -1)
    covered, (share,) = hide(image, [(100.0, 100.0, 30.0)], np.random.default_rng(seed))
    count = [int((one == (255, 0, 255)).all(axis=2).sum()) for one in (image, covered)]
    assert 0 <= share <= HIDDEN
    assert 1 - count[1] / count[0] == pytest.approx(share, abs=0.05)  # the edge is smoothed
