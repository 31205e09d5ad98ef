"""What models are made of, and how they become URDF and OBJ text: parts, links, joints, trimesh primitives."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import pi
from typing import TYPE_CHECKING
from xml.etree import ElementTree as Xml

import numpy as np

from lab.sim.frames import Rgba, Vector

if TYPE_CHECKING:
    from trimesh import Trimesh


@dataclass(frozen=True)
class Part:
    """A visible and, unless `ghost`, solid piece of a link: a mesh, or a box or cylinder of `size` [m] at `at` [m]."""

    color: Rgba
    size: tuple[float, ...] = ()
    at: Vector = (0.0, 0.0, 0.0)
    mesh: "Trimesh | None" = None
    ghost: bool = False
    hidden: bool = False


@dataclass(frozen=True)
class Link:
    """One link: its parts and mass [kg], and the joint that carries it (None for the root)."""

    name: str
    mass: float
    parts: Sequence[Part]
    joint: "Joint | None" = None


@dataclass(frozen=True)
class Joint:
    """A joint at `at` [m] on `parent`, turning about or sliding along `axis` within [lower, upper] [rad or m]."""

    name: str
    kind: str
    parent: str
    at: Vector
    axis: Vector = (0.0, 0.0, 1.0)
    limits: tuple[float, float] = (0.0, 0.0)
    speed: float = 1.0
    effort: float = 1000.0


@dataclass
class Model:
    """A URDF to be: its name and links, root first."""

    name: str
    links: list[Link] = field(default_factory=list)


def cylinder(radius: float, length: float, at: Vector = (0, 0, 0), along: str = "z") -> "Trimesh":
    """A solid cylinder around `at` [m], its axis along x, y or z."""
    import trimesh

    mesh: Trimesh = trimesh.creation.cylinder(radius=radius, height=length, sections=40)
    if along != "z":
        turn: Vector = (0, 1, 0) if along == "x" else (1, 0, 0)
        mesh.apply_transform(trimesh.transformations.rotation_matrix(pi / 2, turn))  # type: ignore[no-untyped-call]
    mesh.apply_translation(at)
    return mesh


def join(*meshes: "Trimesh") -> "Trimesh":
    """Meshes as one, overlaps kept."""
    import trimesh

    joined = trimesh.util.concatenate(list(meshes))
    assert isinstance(joined, trimesh.Trimesh)
    return joined


def hull(*meshes: "Trimesh") -> "Trimesh":
    """The convex hull of meshes."""
    hull: Trimesh = join(*meshes).convex_hull
    return hull


def box(size: Vector, at: Vector = (0, 0, 0)) -> "Trimesh":
    """A solid box of `size` around `at` [m]."""
    import trimesh

    mesh: Trimesh = trimesh.creation.box(extents=size)
    mesh.apply_translation(at)
    return mesh


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{round(float(v), 6) + 0.0:g}" for v in values)


def _geometry(parent: Xml.Element, part: Part, mesh_file: str) -> None:
    Xml.SubElement(parent, "origin", xyz=_numbers(part.at), rpy="0 0 0")
    shape = Xml.SubElement(parent, "geometry")
    if part.mesh is not None:
        Xml.SubElement(shape, "mesh", filename=mesh_file)
    else:
        Xml.SubElement(shape, "box", size=_numbers(part.size))


def _solid(part: Part) -> "Trimesh":
    size = part.size
    return part.mesh if part.mesh is not None else box((size[0], size[1], size[2]), part.at)


def _inertial(element: Xml.Element, link: Link) -> None:
    """Mass and inertia of the link's solid parts taken as one homogeneous body."""
    body = join(*[_solid(part) for part in link.parts if not part.ghost])
    tensor = body.moment_inertia / body.volume * link.mass
    inertial = Xml.SubElement(element, "inertial")
    Xml.SubElement(inertial, "origin", xyz=_numbers(body.center_mass), rpy="0 0 0")
    Xml.SubElement(inertial, "mass", value=_numbers([link.mass]))
    names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    Xml.SubElement(
        inertial, "inertia", {name: f"{round(float(tensor[at]), 9) + 0.0:.9g}" for name, at in names.items()}
    )


def _joint(root: Xml.Element, link: Link, joint: Joint) -> None:
    element = Xml.SubElement(root, "joint", name=joint.name, type=joint.kind)
    Xml.SubElement(element, "parent", link=joint.parent)
    Xml.SubElement(element, "child", link=link.name)
    Xml.SubElement(element, "origin", xyz=_numbers(joint.at), rpy="0 0 0")
    Xml.SubElement(element, "axis", xyz=_numbers(joint.axis))
    low, high = joint.limits
    Xml.SubElement(
        element,
        "limit",
        lower=_numbers([low]),
        upper=_numbers([high]),
        effort=_numbers([joint.effort]),
        velocity=_numbers([joint.speed]),
    )


def urdf(model: Model) -> tuple[str, dict[str, str]]:
    """The URDF text of `model`, and the OBJ text of each mesh it names by file name."""
    root = Xml.Element("robot", name=model.name)
    meshes: dict[str, str] = {}
    for link in model.links:
        element = Xml.SubElement(root, "link", name=link.name)
        _inertial(element, link)
        for number, part in enumerate(link.parts):
            mesh_file = f"{model.name}_{link.name}_{number}.obj"
            if part.mesh is not None:
                meshes[mesh_file] = obj(part.mesh)
            if not part.hidden:
                visual = Xml.SubElement(element, "visual")
                _geometry(visual, part, mesh_file)
                material = Xml.SubElement(visual, "material", name=f"{link.name}_{number}")
                Xml.SubElement(material, "color", rgba=_numbers(part.color))
            if not part.ghost:
                _geometry(Xml.SubElement(element, "collision"), part, mesh_file)
        if link.joint is not None:
            _joint(root, link, link.joint)
    Xml.indent(root)
    return '<?xml version="1.0"?>\n' + Xml.tostring(root, encoding="unicode") + "\n", meshes


def obj(mesh: "Trimesh") -> str:
    """`mesh` as OBJ text with a normal per face, rounded to micrometres so that every machine writes the same file."""
    lines = [f"v {_numbers(vertex)}" for vertex in mesh.vertices]
    normals = {tuple(np.round(normal, 3) + 0.0): None for normal in mesh.face_normals}
    index = {normal: number for number, normal in enumerate(normals, start=1)}
    lines += [f"vn {_numbers(normal)}" for normal in normals]
    for face, normal in zip(mesh.faces, mesh.face_normals, strict=True):
        at = index[tuple(np.round(normal, 3) + 0.0)]
        lines.append("f " + " ".join(f"{corner + 1}//{at}" for corner in face))
    return "\n".join(lines) + "\n"
