"""Vertices of mesh files, both kinds of STL and OBJ."""

import struct
from pathlib import Path

import numpy as np
import pytest

from lab.sim.mesh_file import readable, triangles, vertices

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]])


def test_the_same_triangle_from_every_kind(tmp_path: Path) -> None:
    obj, text, binary = (tmp_path / name for name in ("a.obj", "b.stl", "c.STL"))
    obj.write_text("vn 0 0 1\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "f 1 2 3\n")
    body = "".join(f"vertex {x} {y} {z}\n" for x, y, z in CORNERS)
    text.write_text(f"solid thing\nfacet normal 0 0 1\nouter loop\n{body}endloop\nendfacet\nendsolid\n")
    data = np.array([[0, 0, 1], *CORNERS], "<f4").tobytes() + b"\0\0"
    binary.write_bytes(b"solid".ljust(80, b"\0") + struct.pack("<I", 1) + data)
    for path in (obj, text, binary):
        assert vertices(path) == pytest.approx(CORNERS)


def test_a_binary_stl_that_is_cut_off_is_no_mesh(tmp_path: Path) -> None:
    path = tmp_path / "cut.stl"
    path.write_bytes(b"\xff" * 80 + struct.pack("<I", 2) + b"\0" * 60)
    with pytest.raises(ValueError, match=r"neither text .* nor a whole binary STL"):
        vertices(path)


def test_a_text_in_latin_1_is_read_and_handed_on_in_utf_8(tmp_path: Path) -> None:
    text = "# Prüfteil\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)
    (tmp_path / "a.obj").write_bytes(text.encode("latin-1"))
    assert vertices(tmp_path / "a.obj") == pytest.approx(CORNERS)
    assert readable(tmp_path / "a.obj").decode("utf-8") == text


def test_triangles_of_a_square_and_of_a_solid(tmp_path: Path) -> None:
    """An OBJ's faces count their corners from 1, or backwards from the last one; a square is two triangles."""
    (tmp_path / "square.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1/1 2 3 4\nf -4 -3 -2\n")
    found = triangles(tmp_path / "square.obj")
    assert found.shape == (3, 3, 3)
    assert found[1].tolist() == [[0, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert found[2].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
    (tmp_path / "less.obj").write_text("v 0 0 0\nf 1 2 3\n")
    with pytest.raises(ValueError, match="a face names a corner that is not there"):
        triangles(tmp_path / "less.obj")
