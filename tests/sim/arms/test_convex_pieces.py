"""Slices of a mesh, and meshes with fewer corners, on shapes whose numbers are plain."""

from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from lab.lazy import scipy
from lab.sim import mesh_file
from lab.sim.arms.convex_pieces import SLICE_M, lighten, pieces_of, slices_of, thinned
from lab.sim.arms.foreign_urdf import settled

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
CUBE = CORNERS[scipy.spatial.ConvexHull(CORNERS).simplices]  # triangles (12, 3, 3)
UP = np.array([0.0, 0.0, 1.0])


def column(x: float, y: float, wide: float, high: float, foot: float = 0.0) -> np.ndarray:
    return np.asarray(CUBE * [wide, wide, high - foot] + [x, y, foot])


def volume(points: np.ndarray) -> float:
    return float(scipy.spatial.ConvexHull(points).volume)


def test_slices_of_a_column_are_flat_boxes() -> None:
    slices = slices_of(column(0.0, 0.0, 0.01, 4 * SLICE_M), UP)
    assert len(slices) == 4
    assert np.allclose([volume(points) for points in slices], 0.01**2 * SLICE_M)


@given(st.floats(0.01, 0.05), st.floats(0.01, 0.05), st.floats(-0.05, 0.05))
def test_slices_fill_a_convex_body(wide: float, high: float, foot: float) -> None:
    slices = [
        points for points in slices_of(column(0.0, 0.0, wide, foot + high, foot), UP) if np.ptp(points[:, 2]) > 1e-9
    ]
    assert np.isclose(sum(map(volume, slices)), wide**2 * high)


def test_thinned_meshes_have_fewer_triangles_and_the_same_size() -> None:
    """A grid of 50 x 50 squares of 1 mm; corners within cubes of 5 mm become one."""
    n = 50
    at = np.stack(np.meshgrid(np.arange(n + 1), np.arange(n + 1), [0.0], indexing="ij"), axis=-1).reshape(-1, 3) * 1e-3
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    corners, faces = thinned(at[np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])], 5e-3)
    assert len(corners) == 11**2
    assert len(faces) == 2 * 10 * 10
    assert np.ptp(corners, axis=0)[:2].tolist() >= [0.047, 0.047]


def stl(path: Path, triangles: np.ndarray) -> None:
    rows = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    rows["corners"] = triangles
    path.write_bytes(b"\0" * 80 + np.uint32(len(triangles)).tobytes() + rows.tobytes())


def test_the_space_between_two_jaws_of_one_mesh_stays_free(tmp_path: Path) -> None:
    """A U of two columns on a plate: its hull is 30 mm wide all the way up, its slices above the plate are cut apart."""
    legs = [column(0.0, 0.0, 0.006, 0.048, 0.012), column(0.024, 0.0, 0.006, 0.048, 0.012)]
    stl(tmp_path / "u.stl", np.concatenate([column(0.0, 0.0, 0.006, 0.012) * [5, 1, 1], legs[0]]))
    (tmp_path / "u.urdf").write_text(
        '<robot name="u"><link name="foot"><inertial><mass value="1"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
        '<collision><geometry><mesh filename="u.stl"/></geometry></collision></link></robot>'
    )
    urdf = settled(tmp_path / "u.urdf", tmp_path)
    pieces = pieces_of(urdf, ["foot"], UP)["foot"]
    high = [points for points, _ in pieces if points[:, 2].min() > 0.0125]
    assert high
    assert max(points[:, 0].max() for points in high) < 0.0065
    files = [Path(mesh.get("filename", "")) for mesh in urdf.root.iter("mesh")]
    assert len(files) == len(pieces) == 8
    solid, files_m3 = 0.03 * 0.006 * 0.012 + 0.006**2 * 0.036, sum(volume(mesh_file.vertices(file)) for file in files)
    assert solid < files_m3 < solid + 0.03 * 0.006 * SLICE_M  # the slice on the plate begins as wide as it


def test_a_heavy_mesh_collides_as_its_hull_and_is_seen_thinned(tmp_path: Path) -> None:
    many = np.repeat(column(0.0, 0.0, 0.05, 0.05), 400, axis=0)  # 4,800 triangles, 240 kB
    stl(tmp_path / "heavy.stl", many)
    mesh = '<geometry><mesh filename="heavy.stl" scale="2 2 2"/></geometry>'
    (tmp_path / "arm.urdf").write_text(
        '<robot name="arm"><link name="foot"><inertial><mass value="1"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
        f'<visual><origin xyz="0 0 1"/>{mesh}</visual><collision><origin xyz="0 0 1"/>{mesh}</collision></link></robot>'
    )
    urdf = settled(tmp_path / "arm.urdf", tmp_path)
    lighten(urdf)
    for piece in ("visual", "collision"):
        seen = urdf.links["foot"].find(f"{piece}/geometry/mesh")
        assert seen is not None
        points = mesh_file.vertices(Path(seen.get("filename", "")))
        assert len(points) == 8
        assert np.allclose(points.min(axis=0), [0, 0, 1], atol=1e-3)
        assert np.allclose(points.max(axis=0), [0.1, 0.1, 1.1], atol=1e-3)
