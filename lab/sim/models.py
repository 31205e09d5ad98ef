"""The cell's meshes and URDFs, made with trimesh from the parameters below; `write(folder)` regenerates `assets/`."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import pi
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np

from lab.lazy import trimesh
from lab.sim.arms import kinematics as arm
from lab.sim.frames import Rgba, Vector


@dataclass(frozen=True)
class LinkShape:
    """A visible and, unless `ghost`, solid piece of a link: a mesh, or a box or cylinder of `size` [m] at `at` [m]."""

    color: Rgba
    size: tuple[float, ...] = ()
    at: Vector = (0.0, 0.0, 0.0)
    mesh: "trimesh.Trimesh | None" = None
    ghost: bool = False
    hidden: bool = False


@dataclass(frozen=True)
class Link:
    """One link: its parts and mass [kg], and the joint that carries it (None for the root)."""

    name: str
    mass: float
    parts: Sequence[LinkShape]
    joint: "UrdfJoint | None" = None


@dataclass(frozen=True)
class UrdfJoint:
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
class UrdfModel:
    """The description of a URDF: its name and its links, root first."""

    name: str
    links: list[Link] = field(default_factory=list)


def cylinder(radius: float, length: float, at: Vector = (0, 0, 0), along: str = "z") -> "trimesh.Trimesh":
    """A solid cylinder around `at` [m], its axis along x, y or z."""
    mesh: trimesh.Trimesh = trimesh.creation.cylinder(radius=radius, height=length, sections=40)
    if along != "z":
        turn: Vector = (0, 1, 0) if along == "x" else (1, 0, 0)
        mesh.apply_transform(trimesh.transformations.rotation_matrix(pi / 2, turn))  # type: ignore[no-untyped-call]
    mesh.apply_translation(at)
    return mesh


def join(*meshes: "trimesh.Trimesh") -> "trimesh.Trimesh":
    """Meshes as one, overlaps kept."""
    joined = trimesh.util.concatenate(list(meshes))
    assert isinstance(joined, trimesh.Trimesh)
    return joined


def hull(*meshes: "trimesh.Trimesh") -> "trimesh.Trimesh":
    """The convex hull of meshes."""
    hull: trimesh.Trimesh = join(*meshes).convex_hull
    return hull


def box(size: Vector, at: Vector = (0, 0, 0)) -> "trimesh.Trimesh":
    """A solid box of `size` around `at` [m]."""
    mesh: trimesh.Trimesh = trimesh.creation.box(extents=size)
    mesh.apply_translation(at)
    return mesh


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{round(float(v), 6) + 0.0:g}" for v in values)


def _geometry(parent: Xml.Element, part: LinkShape, mesh_file: str) -> None:
    Xml.SubElement(parent, "origin", xyz=_numbers(part.at), rpy="0 0 0")
    shape = Xml.SubElement(parent, "geometry")
    if part.mesh is not None:
        Xml.SubElement(shape, "mesh", filename=mesh_file)
    else:
        Xml.SubElement(shape, "box", size=_numbers(part.size))


def _solid(part: LinkShape) -> "trimesh.Trimesh":
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


def _joint(root: Xml.Element, link: Link, joint: UrdfJoint) -> None:
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


def urdf(model: UrdfModel) -> tuple[str, dict[str, str]]:
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


def obj(mesh: "trimesh.Trimesh") -> str:
    """`mesh` as OBJ text with a normal per face, rounded to micrometres so that every machine writes the same file."""
    lines = [f"v {_numbers(vertex)}" for vertex in mesh.vertices]
    normals = {tuple(np.round(normal, 3) + 0.0): None for normal in mesh.face_normals}
    index = {normal: number for number, normal in enumerate(normals, start=1)}
    lines += [f"vn {_numbers(normal)}" for normal in normals]
    for face, normal in zip(mesh.faces, mesh.face_normals, strict=True):
        at = index[tuple(np.round(normal, 3) + 0.0)]
        lines.append("f " + " ".join(f"{corner + 1}//{at}" for corner in face))
    return "\n".join(lines) + "\n"


# ---- The models of the cell -------------------------------------------------------------------------------------------


SLICE = (0.12, 0.015, 0.12)  # [m] width, thickness, height
SLICE_KG = 0.040
TOASTER = (0.20, 0.13, 0.10)  # [m] body, along and across the slot, up
TOASTER_SLOT = (0.132, 0.023)  # [m] length and width of the slot
TOASTER_FLOOR = 0.015  # [m] the slot's bottom above the table
APPLIER_FLOOR = 0.02  # [m] height of the floor of the butter applier
APPLIER_LIP = 0.012  # [m] height of the lips beside the slice above that floor
NOZZLE_OUT = -0.115  # [m] the nozzle's plane beside the slice, along its thickness
FINGER = (0.075, 0.012, 0.030)  # [m] length, thickness, width
FINGER_OPEN = 0.022  # [m] each finger's pad from the middle when open
MARKER_OUT, MARKER_UP = 0.13, 0.165  # [m] the gripper's marker beside the tool's axis and above the tips
MARKER_RADIUS = 0.017
MARKER_THICK = 0.001  # thin, because a visible side would shift the middle of the outline that the camera sees

WHITE, GRAPHITE, BLUE = (0.93, 0.93, 0.95, 1.0), (0.22, 0.23, 0.26, 1.0), (0.16, 0.30, 0.55, 1.0)
STEEL, RUBBER = (0.72, 0.73, 0.76, 1.0), (0.12, 0.12, 0.12, 1.0)
CRUST, CRUMB = (0.62, 0.42, 0.22, 1.0), (0.93, 0.83, 0.64, 1.0)
MARKER_MAGENTA, MARKER_CYAN, MARKER_GREEN = (0.95, 0.0, 0.95, 1.0), (0.0, 0.85, 0.85, 1.0), (0.0, 0.80, 0.0, 1.0)

FURNACE_FLOOR, FURNACE_ROOF = 0.12, 0.36  # [m] height of the hearth and of the roof


def _turning(number: int, parent: str, at: Vector, axis: Vector) -> UrdfJoint:
    limits = (float(arm.LOWER[number]), float(arm.UPPER[number]))
    return UrdfJoint(arm.JOINTS[number], "revolute", parent, at, axis, limits, float(arm.SPEED[number]))


def robot() -> UrdfModel:
    """The six-axis arm with its two-finger gripper (an approximate model of the UP6 class, see kinematics)."""
    fingers = (_finger(name, side) for name, side in (("finger_left", 1.0), ("finger_right", -1.0)))
    return UrdfModel("robot", [*_shoulder(), *_forearm(), _tool(), *fingers])


def _shoulder() -> list[Link]:
    """Base, turret and upper arm."""
    shoulder, elbow = (arm.SHOULDER_OUT, 0.0, 0.20), (0.0, 0.0, arm.UPPER_ARM)
    base = join(
        hull(cylinder(0.19, 0.02, (0, 0, 0.01)), cylinder(0.15, 0.02, (0, 0, 0.06))),
        cylinder(0.13, 0.19, (0, 0, 0.155)),
    )
    turret = join(
        cylinder(0.145, 0.06, (0, 0, 0.03)),
        hull(cylinder(0.12, 0.05, (0, 0, 0.06)), cylinder(0.10, 0.18, shoulder, "y")),
    )
    upper = join(
        hull(cylinder(0.085, 0.11, (0, 0, 0), "y"), cylinder(0.065, 0.10, elbow, "y")),
        cylinder(0.055, 0.17, elbow, "y"),
    )
    return [
        Link("base", 40.0, [LinkShape(GRAPHITE, mesh=base)]),
        Link("turret", 30.0, [LinkShape(BLUE, mesh=turret)], _turning(0, "base", (0, 0, 0.25), (0, 0, 1))),
        Link("upper_arm", 18.0, [LinkShape(WHITE, mesh=upper)], _turning(1, "turret", shoulder, (0, 1, 0))),
    ]


def _forearm() -> list[Link]:
    """Forearm, roll and wrist."""
    elbow, root, half = (0.0, 0.0, arm.UPPER_ARM), 0.20, arm.FOREARM
    fore = hull(cylinder(0.085, 0.12, (0, 0, 0.06), "y"), cylinder(0.07, 0.14, (0.10, 0, arm.ELBOW_UP), "x"))
    roll = hull(cylinder(0.062, 0.02, (0.0, 0, 0), "x"), cylinder(0.045, 0.02, (half - root - 0.04, 0, 0), "x"))
    wrist = join(cylinder(0.047, 0.085, (0, 0, 0), "y"), cylinder(0.034, 0.075, (0.0375, 0, 0), "x"))
    return [
        Link("forearm", 12.0, [LinkShape(BLUE, mesh=fore)], _turning(2, "upper_arm", elbow, (0, 1, 0))),
        Link("roll", 5.0, [LinkShape(WHITE, mesh=roll)], _turning(3, "forearm", (root, 0, arm.ELBOW_UP), (1, 0, 0))),
        Link("wrist", 2.0, [LinkShape(GRAPHITE, mesh=wrist)], _turning(4, "roll", (half - root, 0, 0), (0, 1, 0))),
    ]


def _tool() -> Link:
    """The palm, with the marker that the overhead camera sees on an outrigger."""
    palm = join(
        cylinder(0.032, 0.02, (0.01, 0, 0), "x"),
        box((0.05, 0.10, 0.05), (0.045, 0, 0)),
        box((0.026, 0.085, 0.034), (0.083, 0, 0)),
    )
    marker_x = arm.TOOL - MARKER_UP
    marker = cylinder(MARKER_RADIUS, MARKER_THICK, (marker_x, 0, MARKER_OUT), "x")
    bar = (0.008, 0.018, MARKER_OUT - MARKER_RADIUS)
    parts = [
        LinkShape(GRAPHITE, mesh=palm),
        LinkShape(STEEL, bar, (marker_x + 0.006, 0, bar[2] / 2), ghost=True),
        LinkShape(MARKER_MAGENTA, mesh=marker, ghost=True),
    ]
    return Link("tool", 1.2, parts, _turning(5, "wrist", (arm.FLANGE, 0, 0), (1, 0, 0)))


def _finger(name: str, side: float) -> Link:
    """One finger that slides outwards on its side, with rubber inside."""
    pad = LinkShape(STEEL, FINGER, (FINGER[0] / 2, side * FINGER[1] / 2, 0))
    rubber = LinkShape(RUBBER, (0.03, 0.0016, 0.028), (FINGER[0] - 0.016, side * 0.0008, 0), ghost=True)
    root, open_m = (arm.TOOL - FINGER[0], 0, 0), FINGER_OPEN + 0.008
    return Link(
        name, 0.08, [pad, rubber], UrdfJoint(name, "prismatic", "tool", root, (0, side, 0), (0.0, open_m), 0.2, 200.0)
    )


def toaster() -> UrdfModel:
    """A toaster with a real slot between floor, walls and ends, which are separate boxes because physics would fill a mesh."""
    (length, width, height), (slot_length, slot_width) = TOASTER, TOASTER_SLOT
    wall, end, up = (width - slot_width) / 2, (length - slot_length) / 2, height - TOASTER_FLOOR
    parts = [LinkShape(STEEL, (length, width, TOASTER_FLOOR), (0, 0, TOASTER_FLOOR / 2))]
    for side in (1.0, -1.0):
        parts.append(LinkShape(STEEL, (length, wall, up), (0, side * (slot_width + wall) / 2, TOASTER_FLOOR + up / 2)))
        parts.append(
            LinkShape(STEEL, (end, slot_width, up), (side * (slot_length + end) / 2, 0, TOASTER_FLOOR + up / 2))
        )
    parts.append(LinkShape(GRAPHITE, (length + 0.006, width + 0.006, 0.012), (0, 0, 0.006), ghost=True))
    parts.append(LinkShape(GRAPHITE, (0.014, 0.030, 0.010), (length / 2 + 0.007, 0.02, 0.066), ghost=True))
    return UrdfModel("toaster", [Link("toaster", 2.0, parts)])


def furnace() -> UrdfModel:
    """A furnace that is open towards its negative x axis: hearth, back, two sides and a roof; parts stand over its origin."""
    length, width, wall, middle = 0.16, 0.26, 0.02, 0.01
    up = FURNACE_ROOF - FURNACE_FLOOR
    walls = [((wall, width), (middle + (length - wall) / 2, 0.0))]
    walls += [((length - wall, wall), (middle - wall / 2, side * (width - wall) / 2)) for side in (1.0, -1.0)]
    parts = [LinkShape(GRAPHITE, (length, width, FURNACE_FLOOR), (middle, 0, FURNACE_FLOOR / 2))]
    parts += [LinkShape(STEEL, (*size, up), (*at, FURNACE_FLOOR + up / 2)) for size, at in walls]
    parts.append(LinkShape(STEEL, (length, width, wall), (middle, 0, FURNACE_ROOF + wall / 2)))
    return UrdfModel("furnace", [Link("furnace", 20.0, parts)])


def applier() -> UrdfModel:
    """The butter applier: a groove with a low back rest that a slice stands in, and a head that slides across and up."""
    groove, lip = SLICE[1] + 0.005, 0.012
    span = SLICE[0] + 0.06
    parts = [
        LinkShape(STEEL, (span, 0.34, APPLIER_FLOOR), (0, -0.07, APPLIER_FLOOR / 2)),
        LinkShape(STEEL, (SLICE[0], lip, 0.05), (0, (groove + lip) / 2, APPLIER_FLOOR + 0.025)),
        LinkShape(STEEL, (SLICE[0], lip, APPLIER_LIP), (0, -(groove + lip) / 2, APPLIER_FLOOR + APPLIER_LIP / 2)),
        LinkShape(GRAPHITE, (span, 0.03, 0.02), (0, NOZZLE_OUT - 0.06, APPLIER_FLOOR + 0.01), ghost=True),
    ]
    slide_x = UrdfJoint(
        "head_x", "prismatic", "applier", (0, NOZZLE_OUT - 0.06, APPLIER_FLOOR), (1, 0, 0), (-0.06, 0.06), 0.5
    )
    slide_z = UrdfJoint("head_z", "prismatic", "column", (0, 0.03, 0), (0, 0, 1), (0.0, 0.14), 0.5)
    column = [LinkShape(WHITE, (0.03, 0.022, 0.16), (0, 0, 0.08))]
    head = [
        LinkShape(BLUE, (0.04, 0.03, 0.034), (0, 0, 0)),
        LinkShape(STEEL, (0.012, 0.018, 0.012), (0, 0.024, 0), ghost=True),
    ]
    return UrdfModel(
        "applier", [Link("applier", 3.0, parts), Link("column", 0.4, column, slide_x), Link("head", 0.2, head, slide_z)]
    )


def bread() -> UrdfModel:
    """A slice of bread that stands: solid as a box, seen as a loaf's profile with a crust."""
    width, thick, height = SLICE

    def profile(shrink: float, depth: float) -> "trimesh.Trimesh":
        w, top, bottom = width / 2 - shrink, height / 2 - shrink, -height / 2 + shrink
        side, round_ = top - 0.034, 0.030
        cap = [(w - round_ + round_ * np.cos(t), top - round_ + round_ * np.sin(t)) for t in np.linspace(0, pi / 2, 8)]
        outline = [(w * 0.97, bottom), (w * 0.97, side), *cap]
        outline += [(-x, z) for x, z in outline]
        return hull(trimesh.Trimesh([(x, y, z) for x, z in outline for y in (-depth / 2, depth / 2)]))

    seen = [
        LinkShape(CRUST, mesh=profile(0.0, thick), ghost=True),
        LinkShape(CRUMB, mesh=profile(0.007, thick + 0.0008), ghost=True),
    ]
    return UrdfModel("slice", [Link("slice", SLICE_KG, [LinkShape(CRUST, SLICE, hidden=True), *seen])])


MODELS = {"robot": robot, "toaster": toaster, "applier": applier, "furnace": furnace, "slice": bread}


def write(folder: Path) -> list[Path]:
    """Write every model's URDF and meshes into `folder`; returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for make in MODELS.values():
        model = make()
        text, meshes = urdf(model)
        for name, content in {f"{model.name}.urdf": text, **meshes}.items():
            (folder / name).write_text(content, encoding="utf-8")
            written.append(folder / name)
    return written
