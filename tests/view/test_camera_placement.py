"""Where a camera stands: all of it is in the picture, and no nearer camera would do."""

from collections.abc import Callable
from math import radians, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.mdp import FloatArray
from lab.sim.frames import Viewpoint
from lab.view.scene_data import camera_for

InPicture = Callable[[Viewpoint, FloatArray], bool]  # the fixture of tests/conftest.py
coordinate = st.floats(-3.0, 3.0)
points = st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=1, max_size=12)


@given(seen=points, azimuth=st.floats(-3.0, 3.0), elevation=st.floats(0.1, 1.4))
def test_a_camera_has_all_points_in_its_picture_and_looks_from_where_it_is_told(
    in_picture: InPicture, seen: list[tuple[float, float, float]], azimuth: float, elevation: float
) -> None:
    cloud = np.array(seen) + np.array([[0.0, 0.0, 0.0], [0.1, 0.1, 0.1]])[:, None]
    camera = camera_for(cloud.reshape(-1, 3), azimuth, elevation)
    assert in_picture(camera, cloud.reshape(-1, 3))
    x, y, z = np.subtract(camera.eye, camera.target)
    assert np.arctan2(y, x) == pytest.approx(azimuth)
    assert np.arctan2(z, np.hypot(x, y)) == pytest.approx(elevation)


def test_a_nearer_camera_would_not_do() -> None:
    """The unit square from straight in front fills the picture but for the margin: 0.5 / tan(19 degrees) away, and 6 %."""
    square = np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [-0.5, 0.0, 1.0], [0.5, 0.0, 1.0]])
    camera = camera_for(square, radians(-90.0), 0.0)
    assert camera.target == pytest.approx((0.0, 0.0, 0.5))
    assert camera.eye == pytest.approx((0.0, -1.06 * 0.5 / tan(radians(19.0)), 0.5))
