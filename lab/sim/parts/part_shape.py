"""The shape of a part for physics and gripper: hull, standing pose, inertia and looks, from a record of a task file.

Physics knows a part as a box, a cylinder or a convex hull: hollows of a mesh are visible and count for its mass, but
not for contacts. A mesh that is a box becomes a box, which touches a flat side with four corners at once, unlike a hull.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from io import BytesIO
from math import cos, pi, sin
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, counted
from lab.files import assets_folder, is_file, within
from lab.lazy import scipy, trimesh
from lab.sim import urdf_reader
from lab.sim.frames import Quaternion, Shape, ShapeKind, Vector
from lab.sim.mesh_file import is_binary, readable, text_corners
from lab.tasks.part_fields import PartFields

MOST_TEXT = 40_000  # triangles of an STL in text, which PyBullet cannot read and gets one by one
MOST_HULL = 256  # vertices: more make physics slower, not rounder
LARGEST_M, SMALLEST_M = 2.0, 0.002  # of a part's longest edge: beyond them its unit is not the metre
MARGIN_M = 0.001  # around a hull that is not thin: with less, contacts are less reliable
ROUND = 64  # sides of a cylinder's hull
BOX_SHARE = 0.999  # a mesh that fills this share of its smallest bounding box counts as that box

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PartShape:
    """A part in its own frame: origin at the centre of mass, z up as it stands, at yaw 0.

    solid: what physics makes of it, with size [m] (box x, y, z; cylinder diameter, height; mesh ()), in its principal axes,
    which `turn`, a quaternion xyzw, takes to the part's. hull (n, 3): the corners of its convex hull, in the part's axes [m].
    inertia_m2 (3,): moments of inertia about the principal axes, for 1 kg. looks: what is seen, in the part's axes.
    """

    name: str
    solid: ShapeKind
    size: tuple[float, ...]
    turn: Quaternion
    hull: Array
    inertia_m2: Vector
    looks: tuple[Shape, ...]

    @cached_property
    def low(self) -> Array:
        """The lower corner (3,) of its bounds [m]."""
        return np.asarray(self.hull.min(axis=0))

    @cached_property
    def high(self) -> Array:
        """The upper corner (3,) of its bounds [m]."""
        return np.asarray(self.hull.max(axis=0))

    @cached_property
    def inner(self) -> tuple[Array, float]:
        """The hull shrunk by the engine's margin: corners (n, 3) [m], in principal axes, and the margin [m].

        Flat sides are then in contact where they really are; edges are rounded by the margin.
        """
        corners = self.hull @ urdf_reader.rotation(self.turn)
        hull = scipy.spatial.ConvexHull(corners)
        sides = np.unique(hull.equations.round(9), axis=0)  # (k, 4): normals, and offsets [m]
        middle = corners.mean(axis=0)
        margin = min(MARGIN_M, float(np.min(-sides[:, :3] @ middle - sides[:, 3])) / 2)
        sides[:, 3] += margin
        return np.asarray(scipy.spatial.HalfspaceIntersection(sides, middle).intersections), margin

    @property
    def foot_m(self) -> float:
        """The height of the origin above the foot [m]."""
        return -float(self.low[2])

    @property
    def height_m(self) -> float:
        """The height from foot to top [m]."""
        return float(self.high[2] - self.low[2])


def shape_of(part: PartFields, folder: Path) -> PartShape:
    """The shape that a record describes; its files lie in `folder`, the task file's, or in the lab's assets.

    Raises BadInput for a file that is missing, too large or no mesh, that has holes or is in another unit.
    """
    tilt, (r, g, b) = _tilt(*part.stands), part.color
    size: tuple[float, ...] = part.size_m or ()
    solid: ShapeKind = part.shape
    if part.shape == "mesh":
        path = _found(part, "file", part.file or "", folder)
        mesh = _mesh(part, path)
        middle, tensor = np.array(mesh.center_mass), np.array(mesh.moment_inertia) / float(mesh.mass)
        moments, axes = np.linalg.eigh(tensor)
        hull = _few(np.array(mesh.convex_hull.vertices) - middle)
        around = mesh.bounding_box_oriented.primitive
        if mesh.volume >= BOX_SHARE * float(np.prod(around.extents)):
            edges = np.argsort(-np.array(around.extents))  # the least moment first, as above
            solid, axes = "box", np.array(around.transform)[:3, edges]
            size = tuple(float(edge) for edge in around.extents[edges])
            moments = _box(size)[1]
        axes = axes * np.sign(np.linalg.det(axes))  # a rotation, not a reflection
        seen = Shape("mesh", (part.scale,) * 3, path, (r, g, b, 1.0))
    else:
        middle, axes = np.zeros(3), np.eye(3)
        hull, moments = _box(size) if part.shape == "box" else _cylinder(size)
        seen = Shape(part.shape, size if part.shape == "box" else (size[0] / 2, size[1]), None, (r, g, b, 1.0))
    looks = (seen,) if part.look is None else _look(part, folder)
    x, y, z = (float(f"{moment:.12g}") for moment in moments)  # without rounding noise
    return PartShape(
        part.name,
        solid,
        size,
        _quaternion(tilt @ axes),
        hull @ tilt.T,
        (x, y, z),
        tuple(_placed(look, tilt, middle) for look in looks),
    )


def visual_arrays(looks: Sequence[Shape]) -> dict[str, Any]:
    """The arguments of PyBullet's createVisualShapeArray except kinds and places; unused entries are blank."""
    return {
        "halfExtents": [[edge / 2 for edge in look.size] if look.kind == "box" else [0.0] * 3 for look in looks],
        "radii": [look.size[0] if look.kind in ("cylinder", "sphere") else 0.0 for look in looks],
        "lengths": [look.size[1] if look.kind == "cylinder" else 0.0 for look in looks],
        "fileNames": [str(look.mesh or "") for look in looks],
        "meshScales": [list(look.size or (1, 1, 1)) if look.kind == "mesh" else [1, 1, 1] for look in looks],
        "rgbaColors": [list(look.rgba) for look in looks],
    }


def _tilt(roll: float, pitch: float) -> Array:
    """The turn (3, 3) by roll about x, then by pitch about the old y, as in a URDF."""
    (c, s), (d, t) = (cos(roll), sin(roll)), (cos(pitch), sin(pitch))
    about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return np.asarray(np.array([[d, 0, t], [0, 1, 0], [-t, 0, d]]) @ about_x)


def _quaternion(turn: Array) -> Quaternion:
    """Of a turn (3, 3), as xyzw; exactly (0, 0, 0, 1) for none, for which scipy is not loaded."""
    if np.array_equal(turn, np.eye(3)):
        return (0.0, 0.0, 0.0, 1.0)
    rotation = scipy.spatial.transform.Rotation.from_matrix(turn)
    x, y, z, w = (float(value) + 0.0 for value in rotation.as_quat(canonical=True))
    return x, y, z, w


def _placed(look: Shape, tilt: Array, middle: Array) -> Shape:
    """A visible shape without a turn of its own, moved from the axes of size, file or URDF to the part's."""
    x, y, z = (float(value) + 0.0 for value in tilt @ (np.array(look.position) - middle))
    return replace(look, position=(x, y, z), quaternion=_quaternion(tilt))


def _box(size: tuple[float, ...]) -> tuple[Array, Array]:
    """Corners (8, 3) [m], and moments of inertia (3,) for 1 kg [m2]."""
    x, y, z = size
    corners = np.array([(i, j, k) for i in (-x, x) for j in (-y, y) for k in (-z, z)]) / 2
    return corners, np.array([y * y + z * z, x * x + z * z, x * x + y * y]) / 12


def _cylinder(size: tuple[float, ...]) -> tuple[Array, Array]:
    """Corners (2 ROUND, 3) [m], and moments of inertia (3,) for 1 kg [m2]."""
    diameter, height = size
    turns = np.arange(ROUND) * 2 * pi / ROUND
    ring = diameter / 2 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    corners = np.concatenate([np.column_stack([ring, np.full(ROUND, z)]) for z in (-height / 2, height / 2)])
    across = diameter**2 / 16 + height**2 / 12
    return corners, np.array([across, across, diameter**2 / 8])


def _few(hull: Array) -> Array:
    """The corners (n, 3) of a hull that lie farthest in many directions, at most about MOST_HULL."""
    if len(hull) <= MOST_HULL:
        return hull
    count = 2 * MOST_HULL
    z = 1 - (2 * np.arange(count) + 1) / count
    turns = np.arange(count) * pi * (3 - 5**0.5)  # Fibonacci's lattice on a sphere
    out = np.sqrt(1 - z * z)
    ways = np.stack([out * np.cos(turns), out * np.sin(turns), z], axis=1)
    return np.asarray(hull[np.unique(np.argmax(ways @ hull.T, axis=1))])


# ---- Files of meshes and looks --------------------------------------------------------------------------------------


def _found(part: PartFields, field: str, name: str, folder: Path) -> Path:
    """The file of a field, beside the task file or in the assets; BadInput for a path or link that leads out of both."""
    where = f"part '{part.name}': {field} = '{name}'"
    for place in (folder, assets_folder()):
        if not is_file(place / name):
            continue
        path = within(place, name)
        if path is None:
            raise BadInput(f"{where}: it lies outside the folder '{place}'")
        return path
    raise BadInput(f"{where}: no such file, neither in '{folder}' nor in the lab's assets")


def _look(part: PartFields, folder: Path) -> tuple[Shape, ...]:
    path = _found(part, "look", part.look or "", folder)
    urdf_reader.validate(path)
    links = urdf_reader.looks(path)
    if len(links) != 1 or not links[""]:
        words = f"{counted(len(links), 'link')}, {counted(len(next(iter(links.values()))), 'visual')}"
        raise BadInput(
            f"part '{part.name}': look = '{part.look}': it has {words}: wanted one link with boxes or meshes to see"
        )
    return links[""]


def _mesh(part: PartFields, path: Path) -> "trimesh.Trimesh":
    """The mesh in metres, closed, its faces outwards; or its hull, where the part asks for that."""
    where = f"part '{part.name}': file = '{part.file}'"
    try:
        kind = path.suffix.lower().removeprefix(".")
        raw: dict[str, Any] = {"process": False, "skip_materials": True}  # unchanged, and without other files
        data = readable(path)
        mesh: Any = trimesh.load(BytesIO(data), kind, force="mesh", **raw)
        points: Array = np.asarray(mesh.vertices, dtype=float)
    except Exception as error:  # a mesh reader may raise anything for a foreign file
        raise BadInput(f"{where}: it cannot be read as {kind.upper()}: {type(error).__name__}: {error}") from None
    if points.shape[1:] != (3,):
        raise BadInput(f"{where}: its vertices are not three numbers each")
    if not isinstance(mesh, trimesh.Trimesh) or len(points) < 4 or len(mesh.faces) < 4:
        raise BadInput(f"{where}: a mesh of {len(points)} vertices: wanted a solid, 4 or more and faces between them")
    if kind == "stl" and not is_binary(data) and len(mesh.faces) > MOST_TEXT:
        raise BadInput(
            f"{where}: an STL in text of {len(mesh.faces)} triangles: up to {MOST_TEXT} are read: save it as binary"
        )
    if not np.isfinite(points).all():
        raise BadInput(f"{where}: vertex {int(np.argmin(np.isfinite(points).all(axis=1)))} is not finite")
    faces = np.asarray(mesh.faces)
    if faces.min() < 0 or faces.max() >= len(points):
        raise BadInput(f"{where}: a face of vertex {max(int(faces.max()), -int(faces.min()))}, it has {len(points)}")
    mesh.apply_scale(part.scale)  # type: ignore[no-untyped-call]
    _check_size(part, where, float(max(mesh.extents)))
    mesh.merge_vertices(merge_tex=True, merge_norm=True)  # seams of a texture are no holes
    try:
        hull = mesh.convex_hull
    except Exception:  # Qhull's own kind of error
        raise BadInput(f"{where}: it is flat: wanted a solid") from None
    if part.hull:
        return cast("trimesh.Trimesh", hull)
    _check_closed(where, mesh)
    if not mesh.is_winding_consistent or mesh.volume <= 0:
        trimesh.repair.fix_normals(mesh, multibody=True)  # type: ignore[no-untyped-call]
    if not 0 < mesh.volume <= hull.volume * 1.001:
        raise BadInput(
            f"{where}: it encloses {mesh.volume * 1e6:.3g} cm3, its hull {hull.volume * 1e6:.3g} cm3: parts of it overlap or are "
            "inside out; mend it, or set hull = true, which takes its convex hull"
        )
    return mesh


_UNITS_M = {"mm": 0.001, "cm": 0.01, "inches": 0.0254, "m": 1.0}  # units that a mesh may have


def _check_size(part: PartFields, where: str, longest: float) -> None:
    if SMALLEST_M <= longest <= LARGEST_M:
        return
    fits = {
        unit: metres for unit, metres in _UNITS_M.items() if SMALLEST_M <= longest / part.scale * metres <= LARGEST_M
    }
    sizes = [
        f"{metres:g} ({unit}) would make it {longest / part.scale * metres:.3g} m" for unit, metres in fits.items()
    ]
    may = f"; scale = {', '.join(sizes)}" if sizes else ""
    raise BadInput(
        f"{where}, scale = {part.scale:g}: it is {longest:.3g} m long: allowed are {SMALLEST_M} to {LARGEST_M} m{may}"
    )


def _check_closed(where: str, mesh: "trimesh.Trimesh") -> None:
    """Raises BadInput for a mesh with holes, which has neither mass nor inertia."""
    if mesh.is_watertight:
        return
    shared = np.unique(mesh.edges_sorted, axis=0, return_counts=True)[1]
    alone, many = int((shared == 1).sum()), int((shared > 2).sum())
    faults = [f"{counted(alone, 'open edge')} (a hole)"] if alone else []
    faults += [f"{counted(many, 'edge')} of more than two faces"] if many else []
    raise BadInput(
        f"{where}: its surface is not closed: {' and '.join(faults) or 'faces are missing'}; close it, "
        "or set hull = true, which takes its convex hull"
    )


# ---- A part's shapes in PyBullet --------------------------------------------------------------------------------------


Call = Callable[..., Any]


def solid_of(engine: Any, call: Call, shape: PartShape) -> int:
    """PyBullet's number of a part's collision shape; engine: the module; call: calls its function by name."""
    if shape.solid == "box":
        return int(call("createCollisionShape", engine.GEOM_BOX, halfExtents=[s / 2 for s in shape.size]))
    if shape.solid == "cylinder":
        diameter, height = shape.size
        return int(call("createCollisionShape", engine.GEOM_CYLINDER, radius=diameter / 2, height=height))
    return int(call("createCollisionShape", engine.GEOM_MESH, vertices=shape.inner[0].tolist()))


def seen_of(engine: Any, call: Call, looks: Sequence[Shape], turn: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> int:
    """PyBullet's number of a visual shape, whose axes are turned by `turn` (quaternion xyzw) against those of the body.

    Of meshes in text, which PyBullet cannot read, only the first is used.
    """
    back = engine.invertTransform([0, 0, 0], list(turn))[1]
    places = [engine.multiplyTransforms([0, 0, 0], back, look.position, look.quaternion) for look in looks]
    if (corners := text_corners(looks[0].mesh)) is not None:
        look = looks[0]
        place = dict(zip(("visualFramePosition", "visualFrameOrientation"), places[0], strict=True))
        corners, faces = corners * (look.size or (1.0, 1.0, 1.0)), list(range(len(corners)))
        place |= {"vertices": corners.tolist(), "indices": faces, "rgbaColor": look.rgba}
        return int(call("createVisualShape", engine.GEOM_MESH, **place))
    arrays = visual_arrays(looks)
    kinds = [getattr(engine, f"GEOM_{look.kind.upper()}") for look in looks]
    at, turns = (
        [list(values) for values in ways] for ways in zip(*places, strict=True)
    )  # PyBullet crashes over tuples
    arrays |= {"shapeTypes": kinds, "visualFramePositions": at, "visualFrameOrientations": turns}
    return int(call("createVisualShapeArray", **arrays))
