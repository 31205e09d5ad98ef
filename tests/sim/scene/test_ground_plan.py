"""Rectangles on the table."""

from math import pi

import numpy as np
import pytest

from lab.sim.scene.ground_plan import Block, PlannedObstacle


def test_the_corners_of_a_turned_rectangle_by_hand() -> None:
    assert Block(1.0, 2.0, 0.4, 0.2).corners() == pytest.approx(
        np.array([(0.8, 1.9), (1.2, 1.9), (1.2, 2.1), (0.8, 2.1)])
    )
    turned = Block(1.0, 2.0, 0.4, 0.2, pi / 2).corners()  # its length runs along y now
    assert turned == pytest.approx(np.array([(1.1, 1.8), (1.1, 2.2), (0.9, 2.2), (0.9, 1.8)]))


def test_an_obstacle_without_an_area_stays() -> None:
    """A square of 1 m turned by half a right angle is as wide and as high as its diagonal."""
    turned = Block(0.0, 0.0, 1.0, 1.0, pi / 4)
    assert not PlannedObstacle("wall", turned, Block(0.0, 0.0, 2**0.5, 2**0.5)).moves
    assert PlannedObstacle("wall", turned, Block(0.0, 0.0, 2**0.5, 1.6)).moves
