"""The arms that ship, and how any arm is made from its URDF: it is checked, gets the camera's marker, and is measured."""

from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from math import pi
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.files import assets_folder, is_file, pybullet_data_folder, within
from lab.sim import models
from lab.sim.arms import kinematics
from lab.sim.arms.arm import Arm, Kinematics
from lab.sim.arms.chain import Chain
from lab.sim.arms.convex_pieces import lighten
from lab.sim.arms.fingers import fingers_of, is_jaw
from lab.sim.arms.foreign_urdf import Urdf, parent, settled, written
from lab.sim.arms.level_tool import LevelTool
from lab.sim.arms.numeric_kinematics import ON_AXIS_M, NumericKinematics
from lab.sim.arms.one_jaw import jaw_of
from lab.sim.urdf_reader import floats
from lab.tasks.robot_fields import RobotSettings

Array = NDArray[np.float64]

ALONG_X = np.eye(3)  # a tool link's axes are the tool's own: x out of the gripper
ALONG_Z = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # the tool's axes (columns) where z points out
FARTHEST_TURN = (
    pi - 0.15
)  # [rad] limit of the first joint: beyond it, neighbouring poses behind the arm would differ by a whole turn
PACKAGE = "package://"  # begins the name of a URDF in an installed Python package
OWN_NEAREST_M = 0.25  # [m] `nearest_m` of a URDF whose task file does not set it


@dataclass(frozen=True)
class ArmModel:
    """An arm that ships: the folder of its URDF, its tool, and the data that a URDF does not hold.

    axes (3, 3): the tool's axes in its link; tip_m: the finger tips along x [m], with the margin that physics gives meshes;
    nearest_m: see `Arm`; flange: where the lab's own gripper is mounted, as a link and how far out [m], of an arm that has
    none; opening_m: see `RobotSettings`; closed_form: of the lab's own arm.
    """

    urdf: str
    tool_link: str
    fingers: tuple[str, ...]
    tip_m: float
    nearest_m: float
    axes: Array
    flange: tuple[str, float] | None = None
    opening_m: float | None = None
    closed_form: bool = False


_OWN_GRIPPER = ("finger_left", "finger_right")
ARMS: dict[str, ArmModel] = {
    "up6": ArmModel(
        "robot.urdf", "tool", _OWN_GRIPPER, kinematics.TOOL, 0.36, ALONG_X, None, 2 * models.FINGER_OPEN, True
    ),
    "panda": ArmModel("franka_panda/panda.urdf", "panda_hand", ("panda_finger_joint1",), 0.1135, 0.30, ALONG_Z),
    "iiwa": ArmModel(
        "kuka_iiwa/model.urdf", "tool", _OWN_GRIPPER, kinematics.TOOL, 0.42, ALONG_X, ("lbr_iiwa_link_7", 0.045)
    ),
    "xarm6": ArmModel(
        "xarm/xarm6_with_gripper.urdf", "xarm_gripper_base_link", ("drive_joint",), 0.1765, 0.25, ALONG_Z
    ),
}


def arm_of(settings: RobotSettings, folder: Path = Path()) -> Arm:
    """The arm of a task's [robot]; folder: the task file's, for URDF files. Raises BadInput for an unsuitable one."""
    changed = 0
    path = Path()
    if settings.is_file:
        path = _urdf_file(settings.model, folder)
        changed = path.stat().st_mtime_ns
    mount = (settings.opening_m, settings.base_up_m, settings.nearest_m)
    tool = settings.tool_link or "", settings.fingers or (), settings.tip_m
    motors = settings.joint_speed_rad_s, settings.joint_torque_nm
    return _made(settings.model, path, changed, tool, mount, motors, settings.tool == "level")


def _urdf_file(name: str, folder: Path) -> Path:
    """The file of a URDF beside the task file, or in an installed Python package; BadInput if there is none."""
    where, file, place = "task file's", name, "beside the task file"
    if name.startswith(PACKAGE):
        package, _, file = name.removeprefix(PACKAGE).partition("/")
        try:
            spec = find_spec(package) if package.isidentifier() else None  # none of its code runs
        except (ImportError, AttributeError, ValueError):
            spec = None
        folders = list(spec.submodule_search_locations or []) if spec else []
        if not folders:
            raise BadInput(f"robot.model '{name}': no Python package '{package}' is installed beside the lab")
        where, folder, place = "package's", Path(folders[0]), f"in '{folders[0]}'"
    path = within(folder, file)
    if path is None:
        raise BadInput(f"robot.model '{name}': the URDF lies outside the {where} folder")
    if not is_file(path):
        raise BadInput(f"robot.model '{name}': no such file {place}")
    return path


def arm_named(name: str, tool: Literal["hanging", "level"] = "hanging") -> Arm:
    """The arm that ships under a name, with its default settings."""
    return arm_of(RobotSettings(model=name, tool=tool, start="anywhere"))


@lru_cache(maxsize=16)
def _made(
    name: str,
    path: Path,
    changed_ns: int,
    tool: tuple[str, tuple[str, ...], float | None],
    mount: tuple[float | None, float, float | None],
    motors: tuple[float | None, float | None],
    level: bool,
) -> Arm:
    if name in ARMS:
        model = ARMS[name]
        folder = assets_folder() if model.closed_form else pybullet_data_folder()
        path = folder / model.urdf
    else:
        link, fingers, tip_m = tool
        model, folder = ArmModel("", link, fingers, tip_m or 0.0, OWN_NEAREST_M, ALONG_Z), path.parent
    opening_m, base_up_m, nearest_m = mount
    urdf = settled(path, folder)
    tip = np.eye(4)
    tip[:3, :3], tip[:3, 3] = model.axes, model.axes[:, 0] * model.tip_m
    if model.flange is not None:
        urdf = _with_own_gripper(urdf, *model.flange)
    urdf.link(model.tool_link, "robot.tool_link")
    opening_m = opening_m or model.opening_m
    if is_jaw(urdf, model.fingers):
        fingers_found, tip = jaw_of(urdf, model.fingers[0], model.tool_link, tip, opening_m)
    else:
        fingers_found = fingers_of(urdf, model.fingers, model.tool_link, tip, opening_m)
    if model.flange is None and not model.closed_form:
        urdf = _with_marker(urdf, model.tool_link, tip)
    if name not in ARMS:
        lighten(urdf)
        _centre(urdf, Chain.of(urdf, model.tool_link))
    chain = Chain.of(urdf, model.tool_link, tip)
    _still(urdf, (*chain.names, *fingers_found.joints))
    how: Kinematics = kinematics.ClosedForm() if model.closed_form else NumericKinematics(chain, name)
    lower, upper = chain.lower.copy(), chain.upper.copy()
    ahead = how.home[0]
    lower[0], upper[0] = max(lower[0], ahead - FARTHEST_TURN), min(upper[0], ahead + FARTHEST_TURN)
    file = path if model.closed_form else written(urdf.root, path.stem)
    speed_rad_s, torque_nm = motors
    speed = chain.speed if speed_rad_s is None else np.minimum(chain.speed, speed_rad_s)
    return Arm(
        name,
        file,
        chain.names,
        lower,
        upper,
        speed,
        fingers_found,
        model.tool_link,
        tip,
        nearest_m or model.nearest_m,
        base_up_m,
        how,
        LevelTool.of(chain, how.home) if level else None,
        torque_nm,
    )


def _still(urdf: Urdf, moving: tuple[str, ...]) -> None:
    """Fixes at zero the joints that move neither the tool nor its fingers."""
    for name, joint in urdf.joints.items():
        if name not in moving:
            joint.set("type", "fixed")


def _centre(urdf: Urdf, chain: Chain) -> None:
    """Moves the foot's frame into the axis of the first joint, if that turns about the vertical beside it."""
    _, _, origins, directions = chain.along(np.zeros((1, len(chain.names))))
    aside = origins[0, :1, :2].ravel()
    if not aside.size or np.linalg.norm(aside) <= ON_AXIS_M or abs(directions[0, 0, 2]) < 0.999:
        return
    pieces = [piece for piece in urdf.links[urdf.foot] if piece.tag in ("inertial", "visual", "collision")]
    for piece in [*pieces, *(joint for joint in urdf.joints.values() if parent(joint) == urdf.foot)]:
        origin = piece.find("origin")
        if origin is None:
            origin = Xml.SubElement(piece, "origin", xyz="0 0 0")
        x, y, z = floats(origin, "xyz", "0 0 0")
        origin.set("xyz", f"{x - aside[0]:.12g} {y - aside[1]:.12g} {z:.12g}")


def _with_own_gripper(urdf: Urdf, flange: str, out_m: float) -> Urdf:
    """The arm with the lab's own gripper on its flange, `out_m` [m] along the flange's z; the gripper already has its marker."""
    own = settled(assets_folder() / "robot.urdf", assets_folder())
    for link in own.below("tool"):
        urdf.root.append(own.links[link])
        if link != "tool":
            urdf.root.append(own.carrying[link])
    _mount(urdf.root, "mount", flange, "tool", (f"0 0 {out_m:g}", f"0 {-pi / 2:.9f} 0"))
    return _again(urdf)


def _with_marker(urdf: Urdf, tool: str, tip: Array) -> Urdf:
    """The arm with an outrigger for the camera's marker, beside and above the finger tips as on the lab's own arm."""
    link = Xml.SubElement(urdf.root, "link", name="marker of the tool")
    inertial = Xml.SubElement(link, "inertial")
    Xml.SubElement(inertial, "mass", value="0.01")
    Xml.SubElement(inertial, "inertia", ixx="1e-5", ixy="0", ixz="0", iyy="1e-5", iyz="0", izz="1e-5")
    length = models.MARKER_OUT - models.MARKER_RADIUS
    for xyz, kind, size, rgba in (
        (f"0.006 0 {length / 2}", "box", {"size": f"0.008 0.018 {length}"}, models.STEEL),
        (f"0 0 {models.MARKER_OUT}", "cylinder", _disc(), models.MARKER_MAGENTA),
    ):
        visual = Xml.SubElement(link, "visual")
        Xml.SubElement(visual, "origin", xyz=xyz, rpy="0 0 0" if kind == "box" else f"0 {pi / 2:.9f} 0")
        Xml.SubElement(Xml.SubElement(visual, "geometry"), kind, size)
        paint = Xml.SubElement(visual, "material", name=f"marker {kind}")
        Xml.SubElement(paint, "color", rgba=" ".join(map(str, rgba)))
    at = tip[:3, 3] - models.MARKER_UP * tip[:3, 0]
    place = " ".join(f"{number:.9f}" for number in at)
    _mount(urdf.root, "marker of the tool", tool, "marker of the tool", (place, _rpy(tip[:3, :3])))
    return _again(urdf)


def _disc() -> dict[str, str]:
    return {"radius": f"{models.MARKER_RADIUS}", "length": f"{models.MARKER_THICK}"}


def _rpy(axes: Array) -> str:
    """Roll, pitch, yaw [rad] of axes (3, 3), as a URDF has them."""
    pitch = float(np.arctan2(-axes[2, 0], np.hypot(axes[0, 0], axes[1, 0])))
    if abs(abs(pitch) - pi / 2) < 1e-9:
        return f"{np.arctan2(-axes[1, 2], axes[1, 1]):.9f} {pitch:.9f} 0"
    return f"{np.arctan2(axes[2, 1], axes[2, 2]):.9f} {pitch:.9f} {np.arctan2(axes[1, 0], axes[0, 0]):.9f}"


def _mount(root: Xml.Element, name: str, parent: str, child: str, place: tuple[str, str]) -> None:
    joint = Xml.SubElement(root, "joint", name=name, type="fixed")
    Xml.SubElement(joint, "parent", link=parent)
    Xml.SubElement(joint, "child", link=child)
    Xml.SubElement(joint, "origin", xyz=place[0], rpy=place[1])


def _again(urdf: Urdf) -> Urdf:
    """The URDF indexed again after links were added."""
    carrying = {
        child.get("link", ""): joint for joint in urdf.root.findall("joint") for child in joint.findall("child")
    }
    return Urdf(urdf.path, urdf.root, carrying, urdf.foot)
