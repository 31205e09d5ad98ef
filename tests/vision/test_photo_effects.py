"""What a room and a sensor do to a picture: from the seed alone, within bounds, and nothing at strength 0."""

import cv2
import numpy as np
import pytest

from lab.vision import Image
from lab.vision.calibration import pinhole
from lab.vision.lens import CORNER_SHIFT, HIDDEN, drawn_lens, hide, spoiled


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
