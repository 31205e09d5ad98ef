"""The camera in the hand: where it looks, and what is to be seen of a part."""

from math import pi

import numpy as np
import pytest

from lab.sim.arms.kinematics import ToolPose
from lab.sim.camera import AHEAD_M, PIXELS, UP_M, hand_camera, seen_corners
from lab.sim.parts.part_shape import shape_of
from lab.tasks.part_fields import PartFields
from lab.tasks.task_file import load


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
