"""Collision meshes as convex pieces: physics takes each mesh as its convex hull, which would fill the space between two jaws."""

from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import NDArray

from lab.lazy import scipy
from lab.sim import mesh_file
from lab.sim.arms.chain import Chain
from lab.sim.arms.fingers import solid_vertices
from lab.sim.arms.foreign_urdf import Urdf, mesh_written
from lab.sim.urdf_reader import floats, placed

SLICE_M = 0.006  # thickness of a slice
ROUND_M = 2e-4  # to which the corners of a piece are rounded
HEAVY_BYTES = 200_000  # of a mesh: beyond it, its hull alone collides, and a thinned one is seen
SEEN_M = 1.5e-3  # to which the corners of a thinned mesh are joined

Array = NDArray[np.float64]
Pieces = list[tuple[Array, NDArray[np.int_]]]  # corners (n, 3) [m] and triangles (m, 3) of each


def pieces_of(urdf: Urdf, links: list[str], along: Array) -> dict[str, Pieces]:
    """The convex pieces of links, in each link's frame; in the URDF they replace the collision meshes.

    Meshes are cut into slices of SLICE_M across the direction `along` (3,) in the foot's frame, with all joints at zero.
    """
    pieces: dict[str, Pieces] = {}
    for name in links:
        link, chain = urdf.links[name], Chain.of(urdf, name)
        axes = chain.ends(np.zeros((1, len(chain.names))))[1][0]
        cut: Pieces = []
        for collision in link.findall("collision"):
            mesh = collision.find("geometry/mesh")
            if mesh is None:
                alone = Xml.Element("link")
                alone.append(collision)
                cut += [
                    piece
                    for corners, faces in _hulls([solid_vertices(alone)])
                    for piece in _hulls(slices_of(corners[faces], axes.T @ along))
                ]
                continue
            slices = _hulls(slices_of(_triangles(collision, mesh), axes.T @ along))
            link.remove(collision)
            for corners, faces in slices:
                _add_mesh(link, mesh_written(corners, faces))
            cut += slices
        if cut:
            pieces[name] = cut
    return pieces


def slices_of(triangles: Array, along: Array) -> list[Array]:
    """The points (n, 3) that bound triangles (m, 3, 3) between planes SLICE_M apart across the unit vector `along` (3,)."""
    heights = triangles @ along
    planes = np.arange(np.floor(heights.min() / SLICE_M), np.ceil(heights.max() / SLICE_M) + 1) * SLICE_M
    first, then = triangles.reshape(-1, 3), np.roll(triangles, -1, axis=1).reshape(-1, 3)
    begin, end = first @ along, then @ along
    on_planes = [_crossings(first, then, begin, end, plane) for plane in planes]
    slices = []
    for low, high, under, over in zip(planes, planes[1:], on_planes, on_planes[1:], strict=False):
        inside = first[(begin >= low) & (begin <= high)]
        slices.append(np.concatenate([inside, under, over]))
    return slices


def _crossings(first: Array, then: Array, begin: Array, end: Array, plane: float) -> Array:
    """The points (n, 3) at which edges from `first` to `then` (m, 3), at heights `begin` to `end` (m,), cross a plane."""
    cross = (begin - plane) * (end - plane) < 0.0
    share = (plane - begin[cross]) / (end[cross] - begin[cross])
    return np.asarray(first[cross] + share[:, None] * (then[cross] - first[cross]))


def lighten(urdf: Urdf) -> None:
    """Replaces heavy collision meshes by their convex hulls, as which physics takes them anyway, and thins heavy visuals out."""
    for link in urdf.links.values():
        for visual in link.findall("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is not None and Path(mesh.get("filename", "")).stat().st_size > HEAVY_BYTES:
                mesh.set("filename", str(mesh_written(*thinned(_triangles(visual, mesh), SEEN_M))))
                mesh.attrib.pop("scale", None)
                visual[:] = [piece for piece in visual if piece.tag != "origin"]
        for collision in link.findall("collision"):
            mesh = collision.find("geometry/mesh")
            if mesh is None or Path(mesh.get("filename", "")).stat().st_size <= HEAVY_BYTES:
                continue
            for corners, faces in _hulls([_triangles(collision, mesh).reshape(-1, 3)], 5 * ROUND_M):
                link.remove(collision)
                _add_mesh(link, mesh_written(corners, faces))


def thinned(triangles: Array, cell_m: float) -> tuple[Array, NDArray[np.int_]]:
    """The corners (n, 3) and triangles (m, 3) of a mesh whose corners (k, 3, 3) [m] are joined within cubes of edge `cell_m`.

    A corner is the mean of those that it replaces. Source: vertex clustering, J. Rossignac and P. Borrel, 1993.
    """
    points = triangles.reshape(-1, 3)
    number, cube = np.unique(_cubes(points, cell_m), return_inverse=True)
    count = np.bincount(cube, minlength=len(number))
    corners = np.stack([np.bincount(cube, points[:, k], len(number)) / count for k in range(3)], axis=1)
    faces = cube.reshape(-1, 3)
    kept = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return corners, np.unique(faces[kept], axis=0)


def _cubes(points: Array, cell_m: float) -> NDArray[np.int_]:
    """The number (n,) of the cube of edge `cell_m` around whose middle each of points (n, 3) is; neighbours need not follow."""
    at = np.round(points / cell_m).astype(int)
    span = np.ptp(at, axis=0) + 1
    return np.asarray((at - at.min(axis=0)) @ np.array([1, span[0], span[0] * span[1]]))


def _triangles(piece: Xml.Element, mesh: Xml.Element) -> Array:
    """The triangles (n, 3, 3) [m] of the mesh of a visual or collision, in its link's frame."""
    frame, scale = placed(piece.find("origin")), np.array(floats(mesh, "scale", "1 1 1"))
    corners = mesh_file.triangles(Path(mesh.get("filename", ""))) * scale
    return np.asarray(corners @ frame[:3, :3].T + frame[:3, 3])


def _hulls(pieces: list[Array], rounded_m: float = ROUND_M) -> Pieces:
    """The convex hulls of points (n, 3) each; those without a volume are left out."""
    hulls: Pieces = []
    for points in pieces:
        first = np.unique(_cubes(points, rounded_m), return_index=True)[1]
        corners = np.round(points[first] / rounded_m) * rounded_m
        if len(corners) < 4 or np.linalg.matrix_rank(corners - corners[0], tol=rounded_m) < 3:
            continue
        hull = scipy.spatial.ConvexHull(corners)
        number = np.full(len(corners), -1)
        number[hull.vertices] = np.arange(len(hull.vertices))
        hulls.append((corners[hull.vertices], number[hull.simplices]))
    return hulls


def _add_mesh(link: Xml.Element, file: Path) -> None:
    geometry = Xml.SubElement(Xml.SubElement(link, "collision"), "geometry")
    Xml.SubElement(geometry, "mesh", filename=str(file))
