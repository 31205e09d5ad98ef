"""Makes an arm's foreign URDF complete: one tree, limits, masses, colours, and meshes by their full paths.

Errors that physics could not handle are refused in one line; missing values are filled in.
"""

import hashlib
import os
from collections.abc import Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory, gettempdir
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, unknown
from lab.files import is_file, write_whole
from lab.operating_system import is_gone, is_own_folder
from lab.sim import mesh_file
from lab.sim.urdf_reader import check_inertial, check_joint, check_mesh, check_numbers, finite, floats, read

MOVING = ("revolute", "prismatic")
_FRAME_KG, _FRAME_KGM2 = 1e-3, 1e-7  # of a link that is only a frame: physics requires a positive mass of every link
_NOTHING_KG = 1e-6  # a mass below it stands for none
_ROOT_KG, _ROOT_KGM2 = 1.0, 0.01  # of a foot without an inertial: its mass has no effect, because it is bolted down
MOST_LINKS = 200
MOST_SEEN_BYTES = 500_000  # of the meshes of one link
_GREY = "0.8 0.8 0.8 1"
_QUARTER_RAD = 1e-5  # an angle this close to a quarter turn was rounded when it was written
_PACKAGE = "package://"

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Urdf:
    """A URDF's tree: its origin, its XML, its joints by the link that they carry, and its root link."""

    path: Path
    root: Xml.Element
    carrying: dict[str, Xml.Element]
    foot: str

    @property
    def links(self) -> dict[str, Xml.Element]:
        """Its links by name."""
        return {link.get("name", ""): link for link in self.root.findall("link")}

    @property
    def joints(self) -> dict[str, Xml.Element]:
        """Its joints by name."""
        return {joint.get("name", ""): joint for joint in self.root.findall("joint")}

    def link(self, name: str, what: str) -> Xml.Element:
        """A link; BadInput lists the known ones, `what` says where the name came from."""
        if name not in self.links:
            raise BadInput(f"{self.path}: {unknown('link', name, self.links, what)}")
        return self.links[name]

    def joint(self, name: str, what: str) -> Xml.Element:
        """A joint that moves; BadInput lists the known ones, `what` says where the name came from."""
        moving = {name: joint for name, joint in self.joints.items() if joint.get("type") in MOVING}
        if name not in moving:
            raise BadInput(f"{self.path}: {unknown('joint', name, moving, what)}")
        return moving[name]

    def down_to(self, link: str) -> list[Xml.Element]:
        """The joints from the foot to a link, in order."""
        way = []
        while link != self.foot:
            way.append(self.carrying[link])
            link = parent(self.carrying[link])
        return way[::-1]

    def below(self, link: str) -> list[str]:
        """A link and all that it carries."""
        carried = [name for name, joint in self.carrying.items() if parent(joint) == link]
        return [link, *(name for child_link in carried for name in self.below(child_link))]


def child(joint: Xml.Element) -> str:
    """The link that a joint carries."""
    return _end(joint, "child")


def parent(joint: Xml.Element) -> str:
    """The link that a joint hangs on."""
    return _end(joint, "parent")


def _end(joint: Xml.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def settled(path: Path, folder: Path) -> Urdf:
    """The URDF at `path`, whose meshes lie in `folder`, completed for physics and viewer; BadInput names the error."""
    root = read(path)
    for element in [one for one in root if one.tag not in ("link", "joint", "material")]:
        root.remove(element)  # transmissions, and elements for other simulators
    check_numbers(path, root)
    links, joints = ([one.get("name", "") for one in root.findall(kind)] for kind in ("link", "joint"))
    if len(links) > MOST_LINKS:
        raise BadInput(f"{path}: {len(links)} links: arms have up to {MOST_LINKS}")
    for kind, names in (("link", links), ("joint", joints)):
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise BadInput(f"{path}: {kind} '{twice[0]}' stands twice in it")
    for joint in root.findall("joint"):
        check_joint(path, joint, links)
        _check_limits(path, joint)
        _straighten(joint)
    carrying, foot = _tree(path, root, links)
    for link in root.findall("link"):
        name = link.get("name", "")
        _fill_inertial(path, link, name == foot, carrying.get(name))
        _find_meshes(path, link, folder)
    _paint(root)
    return Urdf(path, root, carrying, foot)


def _check_limits(path: Path, joint: Xml.Element) -> None:
    name, kind, limit = joint.get("name", ""), joint.get("type", ""), joint.find("limit")
    if kind == "fixed":
        return
    if kind not in MOVING:
        raise BadInput(f"{path}: joint '{name}' is {kind or 'of no type'}: wanted revolute or prismatic, with limits")
    if limit is None or joint.find("axis") is None:
        raise BadInput(f"{path}: joint '{name}' has no limits or no axis")
    if finite(path, f"velocity limit of joint '{name}'", limit.get("velocity")) <= 0:
        raise BadInput(f"{path}: joint '{name}' has the velocity limit {limit.get('velocity')}, wanted above 0")
    if np.linalg.norm(floats(joint.find("axis"), "xyz", "0 0 0")) < 1e-6:
        raise BadInput(f"{path}: joint '{name}' has an axis of length 0")


def _straighten(joint: Xml.Element) -> None:
    """Rounds a joint's angles to exact quarter turns: with 1.5708, nearly aligned wrist axes would make the wrist spin."""
    origin = joint.find("origin")
    if origin is not None:
        turns = np.array(floats(origin, "rpy", "0 0 0"))
        quarters = np.round(turns / (np.pi / 2)) * (np.pi / 2)
        turns = np.where(abs(turns - quarters) < _QUARTER_RAD, quarters, turns)
        origin.set("rpy", " ".join(map(repr, turns.tolist())))


def _tree(path: Path, root: Xml.Element, links: Sequence[str]) -> tuple[dict[str, Xml.Element], str]:
    joints = root.findall("joint")
    carrying: dict[str, Xml.Element] = {}
    for joint in joints:
        if child(joint) in carrying:
            raise BadInput(f"{path}: link '{child(joint)}' is carried by two joints: a tree is wanted")
        carrying[child(joint)] = joint
    feet = [link for link in links if link not in carrying]
    if len(feet) != 1:
        raise BadInput(f"{path}: {len(feet)} links are carried by no joint, wanted one: {', '.join(feet)}")
    reached = Urdf(path, root, carrying, feet[0]).below(feet[0])
    apart = [link for link in links if link not in reached]
    if apart:
        raise BadInput(f"{path}: link '{apart[0]}' hangs on itself: its joints lead round in a circle")
    return carrying, feet[0]


def _fill_inertial(path: Path, link: Xml.Element, is_foot: bool, joint: Xml.Element | None) -> None:
    """Gives frames and a massless foot a small mass, and replaces an impossible inertia by a close possible one."""
    name, mass = link.get("name", ""), link.find("inertial/mass")
    weightless = mass is None or abs(finite(path, f"mass of link '{name}'", mass.get("value"))) < _NOTHING_KG
    is_frame = link.find("collision") is None and joint is not None and joint.get("type") == "fixed"
    if weightless and (is_frame or is_foot):
        old = link.find("inertial")
        if old is not None:
            link.remove(old)
        kg, kgm2 = (_ROOT_KG, _ROOT_KGM2) if is_foot else (_FRAME_KG, _FRAME_KGM2)
        inertial = Xml.SubElement(link, "inertial")
        Xml.SubElement(inertial, "mass", value=f"{kg:g}")
        _set_inertia(Xml.SubElement(inertial, "inertia"), np.eye(3) * kgm2)
        return
    check_inertial(path, link)
    inertia = link.find("inertial/inertia")
    assert inertia is not None
    xx, xy, xz, yy, yz, zz = (float(inertia.get(key, "")) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    moments, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if moments[2] > moments[0] + moments[1]:  # PyBullet would ignore such an inertia
        moments[0] = moments[2] - moments[1] + 1e-3 * moments[2]
        moments[1] = max(moments[1], moments[0])
        _set_inertia(inertia, axes @ np.diag(moments) @ axes.T)


def _set_inertia(element: Xml.Element, tensor: Array) -> None:
    names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    element.attrib.update({name: f"{float(tensor[at]):.9g}" for name, at in names.items()})


def _find_meshes(path: Path, link: Xml.Element, folder: Path) -> None:
    """Replaces mesh names by full paths; visuals of unsupported formats are left out."""
    for piece in [one for one in link if one.tag in ("visual", "collision")]:
        mesh = piece.find("geometry/mesh")
        if mesh is None:
            continue
        name = mesh.get("filename", "")
        if piece.tag == "visual" and Path(name).suffix.lower() not in mesh_file.SUFFIXES:
            link.remove(piece)
            continue
        places = [name]
        if name.startswith(_PACKAGE):
            rest = name.removeprefix(_PACKAGE)
            places = [rest, rest.partition("/")[2]]
        place = next((candidate for candidate in places if is_file(path.parent / candidate)), places[0])
        check_mesh(path, place, folder)
        mesh.set("filename", str((path.parent / place).resolve()))
    _lighten(link)


def _lighten(link: Xml.Element) -> None:
    """Replaces visuals with too many triangles for a browser by the link's collision shapes."""
    solids = [(collision.find("origin"), collision.find("geometry")) for collision in link.findall("collision")]
    if _bytes(link.findall("collision")) > MOST_SEEN_BYTES or _bytes(link.findall("visual")) <= MOST_SEEN_BYTES:
        return
    material = link.find("visual/material")
    for visual in link.findall("visual"):
        link.remove(visual)
    for pieces in solids:
        visual = Xml.SubElement(link, "visual")
        visual.extend(deepcopy(piece) for piece in (*pieces, material) if piece is not None)


def _bytes(pieces: Sequence[Xml.Element]) -> int:
    files = (mesh.get("filename", "") for piece in pieces for mesh in piece.iter("mesh"))
    return sum(Path(file).stat().st_size for file in files)


def _paint(root: Xml.Element) -> None:
    """Gives every visual its own colour."""
    named = {}
    for material in root.iter("material"):
        color = material.find("color")
        if color is not None:
            named[material.get("name", "")] = color.get("rgba", _GREY)
    for material in root.findall("material"):
        root.remove(material)
    for number, visual in enumerate(root.iter("visual")):
        old = visual.find("material")
        rgba = named.get("" if old is None else old.get("name", ""), _GREY)
        if old is not None:
            visual.remove(old)
        Xml.SubElement(Xml.SubElement(visual, "material", name=f"paint {number}"), "color", rgba=rgba)


def mesh_written(corners: Array, faces: NDArray[np.int_]) -> Path:
    """The path of an OBJ file of corners (n, 3) [m] and triangles (m, 3), in the folder of `written`."""
    points = "".join(f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in corners.tolist())
    text = points + "".join(f"f {i + 1} {j + 1} {k + 1}\n" for i, j, k in faces.tolist())
    return _kept(text.encode(), "mesh", ".obj")


def written(root: Xml.Element, name: str) -> Path:
    """The path of the file that a settled URDF is written to, in a folder that is removed when this process ends.

    Different arms have different files, also when their own files have one name.
    """
    Xml.indent(root)
    return _kept(Xml.tostring(root, encoding="unicode").encode(), name, ".urdf")


def _kept(content: bytes, name: str, suffix: str) -> Path:
    """The path of a file with this content."""
    path = Path(_folder().name) / f"{name}-{hashlib.sha256(content).hexdigest()[:20]}{suffix}"
    if not path.exists():
        write_whole(path, content)
    return path


@cache
def _folder() -> TemporaryDirectory[str]:
    """The folder `lab-arms-` with this process's number; folders left by killed processes are removed first."""
    for left in Path(gettempdir()).glob("lab-arms-*-*"):
        with suppress(OSError, ValueError):
            if is_own_folder(left) and is_gone(int(left.name.split("-")[2])):
                rmtree(left, ignore_errors=True)
    return TemporaryDirectory(prefix=f"lab-arms-{os.getpid()}-")
