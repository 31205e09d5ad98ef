"""An arm made from a URDF file of one's own, and what is said of one that cannot be."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sim.arms.arm_models import ARMS, arm_named, arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME, RobotArm
from lab.sim.world import World
from lab.tasks.robot_fields import MODELS, RobotSettings

SOLID = '<inertial><mass value="1"/><inertia ixx=".01" ixy="0" ixz="0" iyy=".01" iyz="0" izz=".01"/></inertial>'


def link(name: str, size: str = "0.04 0.04 0.04", at: str = "0 0 0", more: str = "") -> str:
    solid = f'<collision><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></collision>'
    return f'<link name="{name}">{SOLID}{more}{solid}{solid.replace("collision", "visual")}</link>'


def joint(name: str, parent: str, child: str, xyz: str, axis: str, low: float, high: float, more: str = "") -> str:
    kind = "prismatic" if name in ("left", "right") else "revolute"
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="{axis}"/><limit lower="{low}" upper="{high}" velocity="2" effort="100"/>{more}</joint>'
    )


MESH = '<visual><geometry><mesh filename="package://mine/part.stl" scale="0.001 0.001 0.001"/></geometry></visual>'
PICTURE = '<visual><geometry><mesh filename="fine.dae"/></geometry></visual>'
FRAME = '<link name="tool0"/><joint name="flange" type="fixed"><parent link="l5"/><child link="tool0"/></joint>'
OWN = f"""<robot name="own"><material name="red"><color rgba="1 0 0 1"/></material>
{link("foot", more=MESH + PICTURE)}{link("l1")}{link("l2")}{link("l3")}{link("l4")}{link("l5")}{FRAME}
{link("finger_a", "0.02 0.01 0.06", "0 0.005 0.03")}{link("finger_b", "0.02 0.01 0.06", "0 -0.005 0.03")}
{joint("j1", "foot", "l1", "0 0 0.3", "0 0 1", -2.9, 2.9)}{joint("j2", "l1", "l2", "0 0 0.1", "0 1 0", -2, 2)}
{joint("j3", "l2", "l3", "0 0 0.4", "0 1 0", -0.1, 2.6)}{joint("j4", "l3", "l4", "0 0 0.4", "0 1 0", -2, 2)}
{joint("j5", "l4", "l5", "0 0 0.1", "0 0 1", -3.1, 3.1)}
{joint("left", "tool0", "finger_a", "0 0 0.03", "0 1 0", 0, 0.03)}
{joint("right", "tool0", "finger_b", "0 0 0.03", "0 -1 0", 0, 0.03)}</robot>"""
SETTINGS: dict[str, Any] = {
    "model": "own.urdf", "tool_link": "tool0", "fingers": ("left", "right"), "tip_m": 0.09, "start": "plate",
}  # fmt: skip


def stl(folder: Path) -> None:
    """A tetrahedron of 10 mm, binary, in millimetres."""
    corners = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]], "<f4")
    faces = [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]
    body = b"".join(np.zeros(3, "<f4").tobytes() + corners[list(face)].tobytes() + b"\0\0" for face in faces)
    (folder / "part.stl").write_bytes(b"\0" * 80 + struct.pack("<I", 4) + body)


def written(folder: Path, text: str = OWN) -> Path:
    stl(folder)
    (folder / "own.urdf").write_text(text)
    return folder


def test_every_arm_that_a_task_may_name_is_there() -> None:
    assert tuple(ARMS) == MODELS


def test_an_arm_of_ones_own_holds_its_tool_where_it_should(tmp_path: Path) -> None:
    arm = arm_of(RobotSettings(**SETTINGS, base_up_m=0.1, opening_m=0.05), written(tmp_path))
    assert arm.joints == ("j1", "j2", "j3", "j4", "j5")
    assert (arm.gripper.opening_m, arm.gripper.thick_m, arm.gripper.width_m) == pytest.approx((0.05, 0.01, 0.02))
    assert arm.fingers.links == (("finger_b",), ("finger_a",)) or arm.fingers.links == (("finger_a",), ("finger_b",))
    pose = ToolPose(0.45, -0.2, 0.3, 0.4)
    with World() as world:
        robot = RobotArm(world, arm, 0.5, 2.0, 25.0)
        assert robot.stand(pose)
        tool = robot.tool()
        assert (tool.x, tool.y, tool.z, tool.yaw) == pytest.approx((0.45, -0.2, 0.3, 0.4), abs=1e-4)
        marker, _ = world.pose(
            NAME, "marker of the tool"
        )  # as on the lab's own arm: above the tips, on the tool's axis
        assert marker == pytest.approx([0.45, -0.2, 0.3 + 0.165], abs=1e-4)
        seen = {body.name: [shape.kind for shape in body.shapes] for body in world.bodies()}
        assert seen["robot"] == ["mesh", "box"]  # the picture that nobody here can read is left out
        for _ in robot.grip():
            world.step()
        assert world.joints(NAME, ("left", "right")) == pytest.approx([0.0, 0.0], abs=2e-3)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("part.stl", "missing.stl", "mesh 'mine/missing.stl' is missing"),
        ("package://mine/part.stl", "../part.stl", "mesh '../part.stl' lies outside"),
        ('<link name="l2">' + SOLID, '<link name="l2">', "link 'l2' has no mass or no inertia"),
        ('mass value="1"', 'mass value="-1"', "is -1 kg"),
        ('name="j2" type="revolute"', 'name="j2" type="continuous"', "joint 'j2' is continuous"),
        (
            'lower="-0.1" upper="2.6" velocity="2"',
            'lower="-0.1" upper="2.6"',
            "velocity limit of joint 'j3' is 'None'",
        ),
        ('lower="-2" upper="2"', 'lower="2" upper="-2"', "lower limit 2 above upper limit -2"),
        ('<parent link="l3"/>', '<parent link="l33"/>', "unknown link 'l33' (parent of joint 'j4'): did you mean 'l3'"),
        ('<parent link="l3"/>', '<parent link="l5"/>', "link 'l4' hangs on itself"),
        ('<child link="l5"/>', '<child link="l4"/>', "link 'l4' is carried by two joints"),
        ('<link name="l4">', '<link name="l3">', "link 'l3' stands twice"),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>', "an axis of length 0"),
        ("</robot>", "", "not a readable URDF"),
    ],
)
def test_a_urdf_that_cannot_be_is_refused_in_one_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in OWN
    folder = written(tmp_path, OWN.replace(old, new, 1) if "mass value" not in old else OWN.replace(old, new))
    with pytest.raises(BadInput) as caught:
        arm_of(RobotSettings(**SETTINGS), folder)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"tool_link": "tool1"}, "unknown link 'tool1' (robot.tool_link): did you mean 'tool0'"),
        ({"fingers": ("lift", "right")}, "unknown joint 'lift' (robot.fingers): did you mean 'left'"),
        ({"fingers": ("left", "j2")}, "do not open and close two fingers"),
        (
            {"fingers": ("left",)},
            "the finger joint left opens and closes no jaw: no part of the hand comes within 0.02 m",
        ),
        ({"fingers": ("j2",)}, "the finger joint j2 opens and closes no jaw: it does not hang on the hand of 'tool0'"),
        ({"opening_m": 0.5}, "robot.opening_m 0.5: the gripper opens 0.060 m at the most"),
        ({"model": "other.urdf"}, "robot.model 'other.urdf': no such file beside the task file"),
        ({"model": "../own.urdf"}, "robot.model '../own.urdf': the URDF lies outside the task file's folder"),
        ({"model": "package://no_such_arm/own.urdf"}, "no Python package 'no_such_arm' is installed beside the lab"),
        ({"model": "package://../own.urdf"}, "no Python package '..' is installed beside the lab"),
        ({"tool_link": "l4"}, "its last joint 'j4' does not turn the tool about the tool's own axis"),
    ],
)
def test_words_that_do_not_fit_the_urdf_are_refused(tmp_path: Path, settings: dict[str, Any], said: str) -> None:
    with pytest.raises(BadInput) as caught:
        arm_of(RobotSettings(**(SETTINGS | settings)), written(tmp_path))
    assert said in str(caught.value)


def test_an_arm_is_read_from_an_installed_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """None of the package's code runs, and nothing outside its folder is read."""
    written(tmp_path)
    package = tmp_path / "arm_of_mine"
    (package / "urdf").mkdir(parents=True)
    (package / "__init__.py").write_text("raise SystemExit")
    written(package / "urdf")
    monkeypatch.syspath_prepend(str(tmp_path))
    arm = arm_of(RobotSettings(**SETTINGS | {"model": "package://arm_of_mine/urdf/own.urdf"}))
    assert arm.joints == ("j1", "j2", "j3", "j4", "j5")
    for name, said in [("../own.urdf", "lies outside the package's folder"), ("own.urdf", "no such file in ")]:
        with pytest.raises(BadInput, match=said):
            arm_of(RobotSettings(**SETTINGS | {"model": f"package://arm_of_mine/{name}"}))


def test_motors_are_as_fast_and_strong_as_the_task_says(tmp_path: Path) -> None:
    arm = arm_of(RobotSettings(**SETTINGS, joint_speed_rad_s=1.5, joint_torque_nm=60.0), written(tmp_path))
    assert arm.speed == pytest.approx([1.5] * 5)  # the URDF's own limit is 2
    with World() as world:
        robot = RobotArm(world, arm, 0.5, 2.0, 25.0)
        pose = ToolPose(0.45, 0.0, 0.3)
        robot.stand(pose)
        for _ in robot.rest(60):
            world.step()
        assert robot.tool().z == pytest.approx(0.3, abs=1e-3)  # 7 links of 1 kg; below: what holds them takes more
    weak = arm_of(RobotSettings(**SETTINGS, joint_torque_nm=3.0), tmp_path)
    with World() as world:
        robot = RobotArm(world, weak, 0.5, 2.0, 25.0)
        robot.stand(pose)
        for _ in robot.rest(60):
            world.step()
        assert robot.tool().z < 0.25


def test_a_changed_file_is_another_arm(tmp_path: Path) -> None:
    first = arm_of(RobotSettings(**SETTINGS), written(tmp_path))
    assert arm_of(RobotSettings(**SETTINGS), tmp_path) is first
    (tmp_path / "own.urdf").write_text(OWN.replace('upper="0.03"', 'upper="0.02"'))
    assert arm_of(RobotSettings(**SETTINGS), tmp_path).gripper.opening_m == pytest.approx(0.04)


def test_the_grippers_of_the_arms_that_ship() -> None:
    wide = {name: arm_named(name).gripper.opening_m for name in ARMS}
    assert wide == pytest.approx({"up6": 0.044, "panda": 0.08, "iiwa": 0.06, "xarm6": 0.089}, abs=1e-3)
