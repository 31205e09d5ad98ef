"""Rectangles on the table."""

from math import atan2, cos, hypot, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ELBOW_UP, FLANGE, FOREARM, SHOULDER_OUT, SHOULDER_UP, TOOL, UPPER_ARM, ToolPose
from lab.sim.scene.ground_plan import Block, PlannedObstacle, ring_of
from lab.tasks.robot_fields import RobotSettings


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


# ---- reach ------------------------------------------------------------------------------------------------------------


UP6 = arm_of(RobotSettings(start="rack"))


def crane(nearest: float, farthest: float, right: float, left: float) -> NDArray[np.float64]:
    """The inverse kinematics of an arm that reaches just this ring, up to 0.5 m high."""

    def inverse(pose: ToolPose) -> NDArray[np.float64] | None:
        far, turn = hypot(pose.x, pose.y), atan2(pose.y, pose.x)
        within = nearest <= far <= farthest and -right <= turn <= left and pose.z <= 0.5
        return np.zeros(3) if within else None

    return inverse  # type: ignore[return-value]


@given(st.floats(0.05, 0.5), st.floats(0.2, 1.5), st.floats(0.0, 3.1), st.floats(0.0, 3.1))
def test_the_ring_is_found_within_a_millimetre_and_a_tenth_of_a_degree(
    nearest: float, width: float, right: float, left: float
) -> None:
    ring = ring_of(crane(nearest, nearest + width, right, left), 0.3)  # type: ignore[arg-type]
    assert ring is not None
    assert (ring.nearest_m, ring.farthest_m) == pytest.approx((nearest, nearest + width), abs=1e-3)
    assert (ring.right_rad, ring.left_rad) == pytest.approx((right, left), abs=radians(0.1))


def test_an_arm_that_turns_all_round_and_a_height_that_it_does_not_reach() -> None:
    ring = ring_of(crane(0.3, 0.9, pi, pi), 0.3, nearest_m=0.4)  # type: ignore[arg-type]
    assert ring is not None
    assert (ring.right_rad, ring.left_rad) == (pi, pi)
    assert ring.nearest_m == pytest.approx(0.4, abs=1e-3)
    assert ring_of(crane(0.3, 0.9, pi, pi), 0.6) is None  # type: ignore[arg-type]


def test_the_arm_of_the_lab_by_its_lengths() -> None:
    """Stretched out, upper arm and forearm are one side of a triangle whose other sides are its height and its distance."""
    height = 0.2
    up = SHOULDER_UP - height - FLANGE - TOOL
    stretched = UPPER_ARM + hypot(FOREARM, ELBOW_UP)
    ring = ring_of(UP6.inverse, height)
    assert ring is not None
    assert ring.farthest_m == pytest.approx(SHOULDER_OUT + (stretched**2 - up**2) ** 0.5, abs=1e-3)
    assert ring.left_rad == pytest.approx(radians(170), abs=1e-3)
    for turn in (-ring.right_rad, 1.0, ring.left_rad):
        for far in (ring.nearest_m, ring.farthest_m):
            assert UP6.inverse(ToolPose(far * cos(turn), far * sin(turn), height, turn)) is not None
