"""What stands at a station: a slab, a box, or a URDF or mesh file, put into the world and measured."""

from functools import cache
from pathlib import Path

import numpy as np

from lab.errors import BadInput
from lab.files import beside_or_asset
from lab.sim import urdf_reader
from lab.sim.frames import Rgba, Vector
from lab.sim.world import World
from lab.tasks.task_fields import Station

RGBA: dict[str, Rgba] = {
    "storage": (0.97, 0.97, 0.98, 1.0),
    "buffer": (0.55, 0.57, 0.6, 1.0),
    "machine": (0.72, 0.73, 0.76, 1.0),
}
FRICTION = {"storage": 0.8, "buffer": 0.8, "machine": 0.5}
MESHES = (".obj", ".stl")


def build(world: World, station: Station, slab: tuple[Vector, Vector], folder: Path) -> None:
    """Put a station's body into the world; `slab`: size and centre [m] of one that is a slab or a box. Raises BadInput."""
    x, y, yaw = station.pose
    rgba = RGBA[station.kind] if station.color is None else (*station.color, 1.0)
    if station.stands_on in ("slab", "box"):
        size, middle = slab
        world.box(station.name, size, middle, rgba, yaw=yaw)
    else:
        path = _file(station, folder)
        if path.suffix.lower() in MESHES:
            world.mesh(station.name, path, (x, y, 0.0), rgba, yaw=yaw)
        else:
            world.load(station.name, path, (x, y, 0.0), yaw)
    world.friction(station.name, FRICTION[station.kind])


def bounds(station: Station, folder: Path) -> tuple[Vector, Vector]:
    """The lowest and highest corner [m] of a body from a file, in its own axes."""
    return _bounds(_file(station, folder))


@cache
def _bounds(path: Path) -> tuple[Vector, Vector]:
    if path.suffix.lower() in MESHES:
        import trimesh

        mesh = trimesh.load(path, force="mesh")
        low, high = np.asarray(mesh.bounds, dtype=float)
    else:
        low, high = urdf_reader.bounds(path)
    return tuple(map(float, low)), tuple(map(float, high))  # type: ignore[return-value]


def _file(station: Station, folder: Path) -> Path:
    path = beside_or_asset(station.stands_on, folder, f"station '{station.name}': body")
    if path.suffix.lower() not in (".urdf", *MESHES):
        raise BadInput(
            f"station '{station.name}': body '{station.stands_on}': wanted 'slab', 'box', or a .urdf, .obj or .stl file"
        )
    if station.floor_m is None:
        raise BadInput(
            f"station '{station.name}': floor_m is missing: how high parts stand in or on '{station.stands_on}'"
        )
    return path
