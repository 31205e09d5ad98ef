"""Fingers as they are measured from a URDF: by hand where they slide, along a linkage, and what their motors must give."""

from math import cos, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.files import assets_folder
from lab.sim.arms.arm_models import ARMS, arm_named
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME, RobotArm
from lab.sim.models import SLICE
from lab.sim.parts.part_shape import shape_of
from lab.sim.world import World
from lab.tasks.part_fields import PartFields

openings = st.floats(0.001, 0.0295)


@given(st.sampled_from(sorted(ARMS)), openings)
def test_an_opening_and_its_joints_undo_each_other(name: str, opening: float) -> None:
    fingers = arm_named(name).fingers
    assert fingers.opening(fingers.at(opening)) == pytest.approx(opening, abs=1e-5)


def test_fingers_that_slide_move_as_far_as_they_open() -> None:
    fingers = arm_named("up6").fingers
    assert fingers.joints == ("finger_left", "finger_right")
    assert fingers.at(0.0125) == pytest.approx([0.0125, 0.0125])
    assert fingers.forces(25.0, 0.01) == pytest.approx([25.0, 25.0])
    assert fingers.ratio("finger_right") == pytest.approx(1.0)


@given(openings)
def test_a_linkage_by_its_drawing(opening: float) -> None:
    """xArm gripper: a crank (35.465, 42.039) mm at 35 mm from the middle carries a finger whose pad is 26 mm inside."""
    fingers = arm_named("xarm6").fingers
    angle = fingers.at(opening)[0]
    assert fingers.at(opening) == pytest.approx([angle] * 6)  # all that mimics goes along
    across = 0.035 + 0.035465 * cos(angle) - 0.042039 * sin(angle) - 0.0260032
    assert across == pytest.approx(opening, abs=2e-5)
    lever = 0.035465 * sin(angle) + 0.042039 * cos(angle)
    assert fingers.forces(25.0, opening) == pytest.approx([25.0 * lever] * 2, rel=5e-3)


@pytest.mark.parametrize("name", sorted(ARMS))
def test_every_gripper_holds_a_slice_that_is_swung_about(name: str) -> None:
    """By friction alone; held still afterwards it creeps by less than 0.5 mm in a second."""
    arm = arm_named(name)
    with World() as world:
        robot = RobotArm(world, arm, 0.5, 2.0, 25.0)
        pose = ToolPose(0.5, 0.2, 0.25, 0.1)
        robot.stand(pose)
        world.box("table", (0.6, 1.0, 0.1), (0.6, 0.0, pose.z - 0.09 - 0.05), (1, 1, 1, 1))
        world.load("slice", assets_folder() / "slice.urdf", (0.5, 0.2, pose.z + 0.03 - SLICE[2] / 2), 0.1, fixed=False)
        world.friction("slice", 0.8, spinning=0.001)
        robot.open_at_once(SLICE[1] / 2 + 0.001)
        assert not robot.touches("slice")
        for _ in robot.grip():
            world.step()
        assert robot.touches("slice")
        for _ in robot.follow([pose.shifted(dz=0.15), ToolPose(0.5, -0.3, 0.35, -0.8)], blend=0.1):
            world.step()
        assert robot.touches("slice")
        before = world.pose("slice")[0]
        assert np.linalg.norm(before - (0.5, -0.3, 0.35 + 0.03 - SLICE[2] / 2)) < 0.005
        for _ in robot.rest(240):
            world.step()
        assert np.linalg.norm(world.pose("slice")[0] - before) < 5e-4
        for _ in robot.release():
            world.step()
        assert not robot.touches("slice")
        assert arm.fingers.opening(world.joints(NAME, arm.fingers.joints)) == pytest.approx(
            arm.fingers.open_m, abs=2e-3
        )


@pytest.mark.parametrize("force_n", [7.0, 25.0, 46.0])
@pytest.mark.parametrize("name", sorted(ARMS))
def test_fingers_that_close_from_wide_open_leave_a_light_box_where_it_stands(
    name: str, force_n: float, tmp_path: Path
) -> None:
    """46 g between pads that come 15 mm each: as fast as its motors can, the xArm's are deep in it, and throw it aside."""
    size, up_m, (x, y) = (0.0387, 0.0324, 0.073), 0.0388, (0.1845, 0.493)
    fields = PartFields.model_validate({"name": "box", "shape": "box", "size_m": size, "mass_kg": 0.0458})
    with World() as world:
        robot = RobotArm(world, arm_named(name), 0.6, 1.5, 25.0, fine=True)
        pose = ToolPose(x, y, 0.25, 0.0)
        assert robot.stand(pose)
        middle = (x, y, pose.z - up_m + size[2] / 2)
        world.box("table", (2.0, 2.0, 0.1), (0.6, 0.0, middle[2] - size[2] / 2 - 0.05), (1, 1, 1, 1))
        world.part("box", shape_of(fields, tmp_path), 0.0458, 0.61, middle, 0.0)
        for _ in robot.grip(force_n):
            world.step()
        assert robot.touches("box")
        assert np.linalg.norm(world.pose("box")[0] - middle) < 4e-4
