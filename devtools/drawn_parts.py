"""Random kinds of parts: boxes, cylinders and meshes of usual sizes and materials, with their mesh files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

KG_M3 = (500.0, 1200.0, 2700.0, 7800.0)  # wood, plastic, aluminium, steel
MASS_KG, FRICTION = (0.004, 2.0), (0.3, 1.1)
AREA = (0.004, 0.004, 0.06)  # the largest offsets of a part from its spot: x, y [m], yaw [rad]
NARROW_M = (0.012, 0.05)  # the width of a part between the fingers
SPARE_M = 0.014  # the part of the fingers' opening that no part fills
GRIP_SHARE = (0.35, 0.7)  # the height of a grip as a share of the part's
FLAT_TOPS = ("box", "cylinder", "block", "disc", "nut")  # other parts can stand on these
ORIGIN_M = 0.05  # the largest offset of a mesh file's origin from the middle of its part
SIDES = 48  # of a round mesh
LYING = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # a turn by -90 degrees about x

Table = dict[str, Any]  # of a task file
Rng = np.random.Generator
Mesh = Any  # a trimesh.Trimesh, as trimesh's functions have no types


@dataclass(frozen=True)
class DrawnPart:
    """A kind of part: its table in the task file, what it looks like, and its extents x, y, z as it stands [m]."""

    table: Table
    form: str
    extents_m: tuple[float, float, float]

    @property
    def name(self) -> str:
        """The kind's name."""
        return str(self.table["name"])

    @property
    def stacks(self) -> bool:
        """Whether another part can stand on it."""
        return self.form in FLAT_TOPS


def drawn_part(rng: Rng, number: int, opening_m: float, folder: Path) -> DrawnPart:
    """A kind of part narrow enough for fingers that open `opening_m`; its mesh file is written to `folder`."""
    form = str(rng.choice([*SOLIDS, *MESHES] if rng.random() < 0.6 else [*SOLIDS]))
    narrow = float(rng.uniform(NARROW_M[0], min(NARROW_M[1], opening_m - SPARE_M)))
    mesh = (SOLIDS | MESHES)[form](rng, narrow)
    x, y, z = (float(edge) for edge in mesh.extents)
    table: Table = {"name": f"{form}-{number}"}
    if form == "box":
        table |= {"shape": "box", "size_m": [round(edge, 4) for edge in (x, y, z)]}
    elif form == "cylinder":
        table |= {"shape": "cylinder", "size_m": [round(edge, 4) for edge in (x, z)]}
    else:
        table |= {"shape": "mesh"} | mesh_fields(mesh, table["name"], rng, folder)
    kg = float(np.clip(mesh.volume * rng.choice(KG_M3), *MASS_KG))
    table |= {"mass_kg": float(f"{kg:.3g}"), "friction": round(float(rng.uniform(*FRICTION)), 2)}
    if rng.random() < 0.5:
        table["area"] = [round(float(most * rng.random()), 4) for most in AREA]
    if rng.random() < 0.15 and z > 0.025:
        table["grip"] = {"yaw": 0.0, "up_m": round(float(z * rng.uniform(*GRIP_SHARE)), 4)}
    return DrawnPart(table, form, (x, y, z))


def mesh_fields(mesh: Mesh, name: str, rng: Rng, folder: Path) -> Table:
    """The fields of a mesh file, which is written as STL or OBJ, in metres or millimetres, upright or lying."""
    fields: Table = {}
    mesh = mesh.copy()
    if rng.random() < 0.2:  # the mesh lies on its side, and the task file stands it up
        mesh.apply_transform(LYING)
        fields["stands"] = [round(np.pi / 2, 6), 0.0]
    mesh.apply_translation(rng.uniform(-ORIGIN_M, ORIGIN_M, 3))
    if rng.random() < 0.6:
        mesh.apply_scale(1000.0)
        fields["scale"] = 0.001
    ending = str(rng.choice(["stl", "obj"]))
    mesh.export(folder / f"{name}.{ending}")
    return {"file": f"{name}.{ending}", **fields}


# ---- meshes, from a generator and the width between the fingers [m] ---------------------------------------------------


def box(rng: Rng, narrow: float) -> Mesh:
    """A box, narrow along y."""
    return trimesh.creation.box((rng.uniform(max(0.02, narrow), 0.1), narrow, rng.uniform(0.02, 0.1)))


def cylinder(rng: Rng, narrow: float) -> Mesh:
    """An upright cylinder, not too slender to stand."""
    return trimesh.creation.cylinder(narrow / 2, rng.uniform(0.015, min(0.1, 4 * narrow)), sections=SIDES)


def nut(rng: Rng, narrow: float) -> Mesh:
    """A hexagonal nut, flat."""
    across = narrow / np.sqrt(3)  # from its middle to a corner
    return trimesh.creation.annulus(0.5 * across, across, rng.uniform(0.012, 0.03), sections=6)


def bottle(rng: Rng, narrow: float) -> Mesh:
    """A bottle: a body, a shoulder, a neck."""
    high, wide, neck = rng.uniform(0.05, min(0.12, 4 * narrow)), narrow / 2, rng.uniform(0.25, 0.5) * narrow / 2
    outline = [(0.0, 0.0), (wide, 0.0), (wide, 0.6 * high), (neck, 0.75 * high), (neck, high), (0.0, high)]
    return trimesh.creation.revolve(np.array(outline), sections=SIDES)


def bracket(rng: Rng, narrow: float) -> Mesh:
    """An L, with a foot along x."""
    long, high, thick = rng.uniform(0.03, 0.07), rng.uniform(0.03, 0.07), rng.uniform(0.006, 0.015)
    corners = [(thick, thick), (thick, high), (0.0, high), (0.0, 0.0), (long, 0.0), (long, thick)]
    return extruded(corners, narrow)


def wedge(rng: Rng, narrow: float) -> Mesh:
    """A block with a sloping front."""
    long, high = rng.uniform(0.04, 0.08), rng.uniform(0.025, 0.06)
    return extruded([(0.0, 0.0), (long, 0.0), (rng.uniform(0.3, 0.8) * long, high), (0.0, high)], narrow)


def plate(rng: Rng, narrow: float) -> Mesh:
    """A thin plate that stands on its edge."""
    return trimesh.creation.box((rng.uniform(0.03, 0.09), rng.uniform(0.0015, 0.005), rng.uniform(0.025, 0.06)))


def extruded(corners: Sequence[tuple[float, float]], wide: float) -> Mesh:
    """A prism of width `wide` along y over a counterclockwise outline (x, z) that is star-shaped around its first corner."""
    count = len(corners)
    points = [(x, side, z) for side in (-wide / 2, wide / 2) for x, z in corners]
    fan = [(0, n, n + 1) for n in range(1, count - 1)]
    faces = [*fan, *((count + a, count + c, count + b) for a, b, c in fan)]
    for n in range(count):
        here, there = n, (n + 1) % count
        faces += [(here, count + here, there), (there, count + here, count + there)]
    mesh = trimesh.Trimesh(points, faces)
    mesh.fix_normals()
    return mesh


SOLIDS = {"box": box, "cylinder": cylinder}
MESHES = {
    "block": box,
    "disc": cylinder,
    "nut": nut,
    "bottle": bottle,
    "bracket": bracket,
    "wedge": wedge,
    "plate": plate,
}
