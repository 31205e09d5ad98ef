"""Reads and checks URDFs before PyBullet does, which silently loads negative masses, NaN inertias and broken meshes."""

from collections.abc import Sequence
from math import cos, sin
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, counted, unknown
from lab.files import is_file, read_limited, within
from lab.sim import mesh_file
from lab.sim.frames import Quaternion, Shape

MAX_BYTES = 5_000_000  # of a URDF


def read(path: Path) -> Xml.Element:
    """The root of a URDF; BadInput when it cannot be read, declares entities, or has no links."""
    try:
        text = read_limited(path, MAX_BYTES).decode("utf-8")
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            raise BadInput(f"{path}: a URDF must not declare a document type or entities")
        root = Xml.fromstring(text)
    except OSError as error:
        raise BadInput(f"{path}: not a readable URDF: {error.strerror or error}") from None
    except (UnicodeDecodeError, Xml.ParseError) as error:
        raise BadInput(f"{path}: not a readable URDF: {error}") from None
    links = root.findall("link")
    if root.tag != "robot" or not links:
        raise BadInput(
            f"{path}: not a URDF: the root is <{root.tag}> with {len(links)} links, wanted <robot> with at least one"
        )
    return root


def validate(path: Path, meshes: Path | None = None) -> None:
    """BadInput unless `path` is a URDF whose masses and inertias are finite and positive and whose meshes exist and are finite.

    Inertia tensors must be positive definite [kg m2]; mesh files must lie in the folder `meshes`, by default the URDF's own.
    """
    root = read(path)
    links = [link.get("name", "") for link in root.findall("link")]
    check_numbers(path, root)
    for link in root.findall("link"):
        check_inertial(path, link)
    for joint in root.findall("joint"):
        check_joint(path, joint, links)
    for mesh in root.iter("mesh"):
        check_mesh(path, mesh.get("filename", ""), meshes or path.parent)


def looks(path: Path) -> dict[str, tuple[Shape, ...]]:
    """The visuals of each link of a valid URDF, with their colours; the root link is ''."""
    root = Xml.parse(path).getroot()
    children = {child.get("link") for child in root.iterfind("joint/child")}
    looks_of = {}
    for link in root.iter("link"):
        name = link.get("name", "")
        shapes = (_shape(path, visual) for visual in link.iter("visual"))
        looks_of[name if name in children else ""] = tuple(shape for shape in shapes if shape is not None)
    return looks_of


def _shape(path: Path, visual: Xml.Element) -> Shape | None:
    x, y, z = floats(visual.find("origin"), "xyz", "0 0 0")
    r, g, b, alpha = floats(visual.find("material/color"), "rgba", "0.8 0.8 0.8 1")
    rgba, at, turn = (r, g, b, alpha), (x, y, z), _quaternion(*floats(visual.find("origin"), "rpy", "0 0 0"))
    box, cylinder, sphere, mesh = (visual.find(f"geometry/{kind}") for kind in ("box", "cylinder", "sphere", "mesh"))
    if box is not None:
        return Shape("box", floats(box, "size", ""), None, rgba, at, turn)
    if cylinder is not None:
        return Shape("cylinder", floats(cylinder, "radius", "") + floats(cylinder, "length", ""), None, rgba, at, turn)
    if sphere is not None:
        return Shape("sphere", floats(sphere, "radius", ""), None, rgba, at, turn)
    if mesh is None:
        return None
    return Shape("mesh", floats(mesh, "scale", ""), path.parent / mesh.get("filename", ""), rgba, at, turn)


def meshes(path: Path) -> list[str]:
    """The mesh files that a URDF names, as written there."""
    return [mesh.get("filename", "") for mesh in read(path).iter("mesh")]


def bounds(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The lowest and the highest corner (3,) [m] of the solids in the root link of a valid URDF, in its frame."""
    validate(path)
    root = Xml.parse(path).getroot()
    children = {child.get("link") for child in root.iterfind("joint/child")}
    solids = (
        solid for link in root.iter("link") if link.get("name") not in children for solid in link.iter("collision")
    )
    corners = [corner for solid in solids for corner in _corners(path, solid)]
    if not corners:
        raise BadInput(f"{path}: its root link has nothing solid (no <collision>)")
    return np.min(corners, axis=0), np.max(corners, axis=0)


def _corners(path: Path, solid: Xml.Element) -> NDArray[np.float64]:
    """Points (n, 3) that bound a solid, in its link's frame [m]."""
    shape = _shape(path, solid)
    if shape is None:
        return np.zeros((0, 3))
    if shape.kind == "mesh" and shape.mesh is not None:
        points = mesh_file.vertices(shape.mesh) * (shape.size or (1.0, 1.0, 1.0))
    else:
        half = {
            "box": shape.size,
            "cylinder": (2 * shape.size[0],) * 2 + shape.size[1:],
            "sphere": (2 * shape.size[0],) * 3,
        }
        signs = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
        points = signs * np.array(half[shape.kind]) / 2
    return np.asarray(points @ rotation(shape.quaternion).T + np.array(shape.position))


def floats(element: Xml.Element | None, name: str, default: str) -> tuple[float, ...]:
    """The numbers of an attribute."""
    text = default if element is None else element.get(name, default)
    return tuple(float(word) for word in text.split())


def _quaternion(roll: float, pitch: float, yaw: float) -> Quaternion:
    """A URDF's rpy [rad], about fixed x, then y, then z, as xyzw."""
    (cr, cp, cy), (sr, sp, sy) = ([f(angle / 2) for angle in (roll, pitch, yaw)] for f in (cos, sin))
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def placed(origin: Xml.Element | None) -> NDArray[np.float64]:
    """The frame (4, 4) of an <origin> [m] in its parent's frame; the identity without an <origin>."""
    frame = np.eye(4)
    frame[:3, :3] = rotation(_quaternion(*floats(origin, "rpy", "0 0 0")))
    frame[:3, 3] = floats(origin, "xyz", "0 0 0")
    return frame


def rotation(quaternion: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """The axes (3, 3), as columns, of a quaternion xyzw of length 1."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def finite(path: Path, what: str, text: str | None) -> float:
    """A number of a URDF; BadInput if the text is not a finite number."""
    try:
        value = float(text or "")
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise BadInput(f"{path}: {what} is '{text}', wanted a finite number")
    return value


_NUMBERS = {"xyz": 3, "rpy": 3, "size": 3, "scale": 3, "rgba": 4, "radius": 1, "length": 1}


def check_numbers(path: Path, root: Xml.Element) -> None:
    """Raises BadInput unless every place, size, axis and colour in a URDF has its count of finite numbers."""
    for element in root.iter():
        for name, count in _NUMBERS.items():
            text = element.get(name)
            if text is None:
                continue
            what = f"{name} of a <{element.tag}>"
            numbers = [finite(path, what, word) for word in text.split()]
            if len(numbers) != count:
                raise BadInput(f"{path}: {what} is '{text}', wanted {counted(count, 'number')}")
            if name in ("size", "radius", "length", "scale") and min(numbers) <= 0:
                raise BadInput(f"{path}: {what} is '{text}', wanted above 0")


def check_inertial(path: Path, link: Xml.Element) -> None:
    """Raises BadInput unless a link has a possible mass and inertia."""
    name = link.get("name", "")
    mass, inertia = link.find("inertial/mass"), link.find("inertial/inertia")
    if mass is None or inertia is None:
        raise BadInput(f"{path}: link '{name}' has no mass or no inertia")
    if finite(path, f"mass of link '{name}'", mass.get("value")) <= 0:
        raise BadInput(f"{path}: mass of link '{name}' is {mass.get('value')} kg, wanted more than 0")
    xx, xy, xz, yy, yz, zz = (
        finite(path, f"{key} of link '{name}'", inertia.get(key)) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    if np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))[0] <= 0:
        raise BadInput(
            f"{path}: inertia of link '{name}' is not positive definite (ixx {xx:g}, iyy {yy:g}, izz {zz:g})"
        )


def check_joint(path: Path, joint: Xml.Element, links: list[str]) -> None:
    """Raises BadInput unless a joint joins known links and its lower limit is below its upper limit."""
    name = joint.get("name", "")
    for end in ("parent", "child"):
        element = joint.find(end)
        link = element.get("link", "") if element is not None else ""
        if link not in links:
            raise BadInput(f"{path}: {unknown('link', link, links, f'{end} of joint {name!r}')}")
    limit = joint.find("limit")
    if limit is not None:
        low, high = (finite(path, f"{key} limit of joint '{name}'", limit.get(key)) for key in ("lower", "upper"))
        if low > high:
            raise BadInput(f"{path}: joint '{name}' has lower limit {low:g} above upper limit {high:g}")


def check_mesh(path: Path, name: str, folder: Path) -> None:
    """BadInput unless the mesh that the URDF at `path` names is an OBJ or STL file in `folder` with finite vertices."""
    file = within(folder, name, path.parent)
    if file is None:
        raise BadInput(f"{path}: mesh '{name}' lies outside the URDF's folder")
    if not is_file(file):
        raise BadInput(f"{path}: mesh '{name}' is missing")
    kind = "an STL" if file.suffix.lower() == ".stl" else "an OBJ"
    try:
        vertices = mesh_file.vertices(file)
    except (OSError, ValueError) as error:
        raise BadInput(f"{path}: mesh '{name}' is not {kind} file: {error}") from None
    if len(vertices) < 4 or vertices.shape[1] < 3 or not np.isfinite(vertices).all():
        raise BadInput(
            f"{path}: mesh '{name}' has {len(vertices)} vertices or one that is not three finite numbers; wanted 4 or more"
        )
