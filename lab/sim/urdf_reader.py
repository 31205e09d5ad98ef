"""A URDF is checked before PyBullet sees it: PyBullet loads negative masses, NaN inertia and garbage meshes in silence."""

from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np

from lab.errors import BadInput
from lab.sim.frames import Shape

_MAX_BYTES = 20_000_000


def validate(path: Path) -> None:
    """BadInput unless `path` is a URDF whose masses and inertias are finite and positive and whose meshes exist and are finite.

    Inertia tensors must be positive definite [kg m2]; mesh files must lie in the URDF's own folder.
    """
    try:
        text = path.read_text(encoding="utf-8")
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            raise BadInput(f"{path}: a URDF must not declare a document type or entities")
        root = Xml.fromstring(text)
    except (OSError, UnicodeDecodeError, Xml.ParseError) as error:
        raise BadInput(f"{path}: not a readable URDF: {error}") from None
    links = [link.get("name", "") for link in root.iter("link")]
    if root.tag != "robot" or not links:
        raise BadInput(
            f"{path}: not a URDF: the root is <{root.tag}> with {len(links)} links, wanted <robot> with at least one"
        )
    for link in root.iter("link"):
        _check_inertial(path, link)
    for joint in root.iter("joint"):
        _check_joint(path, joint, links)
    for mesh in root.iter("mesh"):
        _check_mesh(path, mesh.get("filename", ""))


def looks(path: Path) -> dict[str, tuple[Shape, ...]]:
    """The visuals of each link of a valid URDF of this lab: boxes and meshes, with their colours; the root link is ''."""
    root = Xml.parse(path).getroot()
    children = {child.get("link") for child in root.iterfind("joint/child")}
    found = {}
    for link in root.iter("link"):
        name = link.get("name", "")
        shapes = (_shape(path, visual) for visual in link.iter("visual"))
        found[name if name in children else ""] = tuple(shape for shape in shapes if shape is not None)
    return found


def _shape(path: Path, visual: Xml.Element) -> Shape | None:
    origin, color = visual.find("origin"), visual.find("material/color")
    x, y, z = _floats(origin, "xyz", "0 0 0")
    r, g, b, alpha = _floats(color, "rgba", "0.8 0.8 0.8 1")
    mesh, box = visual.find("geometry/mesh"), visual.find("geometry/box")
    if mesh is not None:
        return Shape("mesh", (), path.parent / mesh.get("filename", ""), (r, g, b, alpha), (x, y, z))
    return None if box is None else Shape("box", _floats(box, "size", ""), None, (r, g, b, alpha), (x, y, z))


def _floats(element: Xml.Element | None, name: str, default: str) -> tuple[float, ...]:
    text = default if element is None else element.get(name, default)
    return tuple(float(word) for word in text.split())


def _value(path: Path, what: str, text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise BadInput(f"{path}: {what} is '{text}', wanted a finite number")
    return value


def _check_inertial(path: Path, link: Xml.Element) -> None:
    name = link.get("name", "")
    mass, inertia = link.find("inertial/mass"), link.find("inertial/inertia")
    if mass is None or inertia is None:
        raise BadInput(f"{path}: link '{name}' has no mass or no inertia")
    if _value(path, f"mass of link '{name}'", mass.get("value")) <= 0:
        raise BadInput(f"{path}: mass of link '{name}' is {mass.get('value')} kg, wanted more than 0")
    xx, xy, xz, yy, yz, zz = (
        _value(path, f"{key} of link '{name}'", inertia.get(key)) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    if np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))[0] <= 0:
        raise BadInput(
            f"{path}: inertia of link '{name}' is not positive definite (ixx {xx:g}, iyy {yy:g}, izz {zz:g})"
        )


def _check_joint(path: Path, joint: Xml.Element, links: list[str]) -> None:
    name = joint.get("name", "")
    for end in ("parent", "child"):
        element = joint.find(end)
        link = element.get("link", "") if element is not None else ""
        if link not in links:
            raise BadInput(f"{path}: joint '{name}' has the {end} '{link}', known links: {', '.join(links)}")
    limit = joint.find("limit")
    if limit is not None:
        low, high = (_value(path, f"{key} limit of joint '{name}'", limit.get(key)) for key in ("lower", "upper"))
        if low > high:
            raise BadInput(f"{path}: joint '{name}' has lower limit {low:g} above upper limit {high:g}")


def _check_mesh(path: Path, name: str) -> None:
    file = (path.parent / name).resolve()
    if path.parent.resolve() not in file.parents:
        raise BadInput(f"{path}: mesh '{name}' lies outside the URDF's folder")
    if not file.is_file() or not 0 < file.stat().st_size <= _MAX_BYTES:
        raise BadInput(f"{path}: mesh '{name}' is missing, empty or over {_MAX_BYTES // 1_000_000} MB")
    try:
        rows = [line.split()[1:4] for line in file.read_text(encoding="utf-8").splitlines() if line.startswith("v ")]
        vertices = np.array(rows, dtype=float)
    except (UnicodeDecodeError, ValueError) as error:
        raise BadInput(f"{path}: mesh '{name}' is not an OBJ file: {error}") from None
    if len(vertices) < 4 or vertices.shape[1] < 3 or not np.isfinite(vertices).all():
        raise BadInput(
            f"{path}: mesh '{name}' has {len(vertices)} vertices or one that is not three finite numbers; wanted 4 or more"
        )
