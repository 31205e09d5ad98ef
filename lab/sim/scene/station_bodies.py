"""The bodies of stations: a slab, a box, or a URDF or mesh file, which is put into the world and measured."""

from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.files import beside_or_asset
from lab.lazy import trimesh
from lab.sim import urdf_reader
from lab.sim.frames import Rgba, Vector
from lab.sim.mesh_file import readable
from lab.sim.world import World
from lab.tasks.task_fields import Station

RGBA: dict[str, Rgba] = {
    "storage": (0.97, 0.97, 0.98, 1.0),
    "buffer": (0.55, 0.57, 0.6, 1.0),
    "machine": (0.72, 0.73, 0.76, 1.0),
}
FRICTION = {"storage": 0.8, "buffer": 0.8, "machine": 0.5}
MESHES = (".obj", ".stl")
SMALLEST_M, LARGEST_M = 0.01, 3.0  # of a body's longest edge: beyond them its unit is not the metre
HEAD_JOINTS, HEAD_LINK = ("head_x", "head_z"), "head"  # the joints of a machine's own head, across and up, and its link
Array = NDArray[np.float64]


def build(world: World, station: Station, slab: tuple[Vector, Vector], folder: Path) -> None:
    """Put a station's body into the world; `slab`: size and centre [m] of one that is a slab or a box. Raises BadInput."""
    at, yaw = stands_at(station, slab)
    rgba = RGBA[station.kind] if station.color is None else (*station.color, 1.0)
    if station.stands_on in ("slab", "box"):
        world.box(station.name, slab[0], at, rgba, yaw=yaw)
    else:
        path = _file(station, folder)
        if path.suffix.lower() in MESHES:
            world.mesh(station.name, path, at, rgba, yaw=yaw)
        else:
            world.load(station.name, path, at, yaw)
    world.friction(station.name, FRICTION[station.kind])


def stands_at(station: Station, slab: tuple[Vector, Vector]) -> tuple[Vector, float]:
    """The position [m] and yaw [rad] of a station's body; `slab` as for `build`."""
    x, y, yaw = station.pose
    return (slab[1] if station.stands_on in ("slab", "box") else (x, y, 0.0)), yaw


def check(station: Station, folder: Path) -> None:
    """Raises BadInput for a body file that cannot be read or is in another unit, or that lacks the head that it needs."""
    is_file = station.stands_on not in ("slab", "box")
    if is_file:
        low, high = bounds(station, folder)
        longest = max(b - a for a, b in zip(low, high, strict=True))
        if not SMALLEST_M <= longest <= LARGEST_M:
            raise BadInput(
                f"station '{station.name}': body = '{station.stands_on}': it is {longest:.3g} m long: allowed are "
                f"{SMALLEST_M} to {LARGEST_M} m; its unit must be the metre"
            )
    if station.process is None:
        return
    root = urdf_reader.read(_file(station, folder)) if station.stands_on.lower().endswith(".urdf") else None
    names = (
        {}
        if root is None
        else {kind: [element.get("name") for element in root.iter(kind)] for kind in ("joint", "link")}
    )
    lacking = [f"joint '{name}'" for name in HEAD_JOINTS if name not in names.get("joint", [])]
    lacking += [f"link '{HEAD_LINK}'"] if HEAD_LINK not in names.get("link", []) else []
    if lacking:
        raise BadInput(
            f"station '{station.name}': process = '{station.process}' is carried out by a head, and its body "
            f"{station.stands_on} has no {', no '.join(lacking)}: wanted a URDF with them, such as applier.urdf"
        )


def bounds(station: Station, folder: Path) -> tuple[Vector, Vector]:
    """The lowest and highest corner [m] of a body from a file, in its own axes. Raises BadInput."""
    path = _file(station, folder)
    try:
        return _bounds(path)
    except BadInput as error:
        said = str(error).removeprefix(f"{path}: ")
        raise BadInput(f"station '{station.name}': body = '{station.stands_on}': {said}") from None


@cache
def _bounds(path: Path) -> tuple[Vector, Vector]:
    low, high = _mesh_bounds(path) if path.suffix.lower() in MESHES else urdf_reader.bounds(path)
    return tuple(map(float, low)), tuple(map(float, high))  # type: ignore[return-value]


def _mesh_bounds(path: Path) -> tuple[Array, Array]:
    kind = path.suffix.lower().removeprefix(".")
    try:
        mesh: Any = trimesh.load(
            BytesIO(readable(path)), kind, force="mesh", skip_materials=True
        )  # opens no other file
        points = np.asarray(mesh.vertices, dtype=float)
        faces = len(mesh.faces)
    except Exception as error:  # a mesh reader may raise anything for a foreign file
        raise BadInput(f"it cannot be read as {kind.upper()}: {type(error).__name__}: {error}") from None
    if faces < 1 or len(points) < 3 or points.shape[1:] != (3,) or not np.isfinite(points).all():
        raise BadInput(
            f"a mesh of {len(points)} vertices and {faces} faces: wanted finite ones, and faces between them"
        )
    return points.min(axis=0), points.max(axis=0)


def _file(station: Station, folder: Path) -> Path:
    path = beside_or_asset(station.stands_on, folder, f"station '{station.name}': body =")
    if path.suffix.lower() not in (".urdf", *MESHES):
        raise BadInput(
            f"station '{station.name}': body = '{station.stands_on}': wanted 'slab', 'box', or a .urdf, .obj or .stl file"
        )
    if station.floor_m is None:
        raise BadInput(
            f"station '{station.name}': floor_m is missing: how high parts stand in or on '{station.stands_on}'"
        )
    return path
