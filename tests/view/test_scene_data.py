"""Bodies as the page's JSON."""

import base64
from pathlib import Path

import numpy as np
import pytest
import trimesh

from lab.errors import BadInput
from lab.sim.frames import Body, Shape, Viewpoint
from lab.view.scene_data import describe, read_mesh


@pytest.fixture(params=["part.stl", "part.obj"])
def cube(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / str(request.param)
    trimesh.creation.box((1, 1, 1)).export(path)
    return path


def test_every_kind_of_shape_is_described(cube: Path) -> None:
    shapes = (
        Shape("box", (1, 2, 3), position=(0.5, 0, 0)),
        Shape("cylinder", (0.1, 2), rgba=(1, 0, 0, 0.5)),
        Shape("sphere", (0.1,)),
        Shape("mesh", (2, 2, 2), mesh=cube),
    )
    scene = describe([Body("a", shapes)], Viewpoint(eye=(1, 2, 3), target=(0, 0, 1)))
    assert scene["camera"] == {"eye": [1, 2, 3], "target": [0, 0, 1]}
    assert [geometry["kind"] for geometry in scene["geometries"]] == ["box", "cylinder", "sphere", "mesh"]
    assert scene["geometries"][1]["size"] == [0.1, 2]
    assert [shape["geometry"] for shape in scene["bodies"][0]["shapes"]] == [0, 1, 2, 3]
    assert [shape["scale"] for shape in scene["bodies"][0]["shapes"]] == [[1, 1, 1]] * 3 + [[2, 2, 2]]
    assert scene["bodies"][0]["shapes"][0]["pose"] == [0.5, 0, 0, 0, 0, 0, 1]
    assert scene["bodies"][0]["shapes"][1]["rgba"] == [1, 0, 0, 0.5]


def test_labels_of_one_text_share_it_and_others_do_not() -> None:
    texts = [Shape("label", (0.1,), text=text) for text in ("x", "y", "x")]
    scene = describe([Body("axes", tuple(texts))], Viewpoint())
    assert scene["geometries"] == [{"kind": "label", "size": [0.1], "text": text} for text in ("x", "y")]
    assert [shape["geometry"] for shape in scene["bodies"][0]["shapes"]] == [0, 1, 0]


def test_bodies_share_geometry(cube: Path) -> None:
    shapes = (Shape("mesh", mesh=cube), Shape("box", (1, 1, 1)))
    scene = describe([Body(name, shapes) for name in "abc"], Viewpoint())
    assert len(scene["geometries"]) == 2


def test_a_cube_keeps_its_edges_sharp(cube: Path) -> None:
    mesh = read_mesh(cube, 0)
    normals = np.frombuffer(base64.b64decode(mesh["normals"]), "<f4").reshape(-1, 3)
    faces = np.frombuffer(base64.b64decode(mesh["faces"]), "<u4").reshape(-1, 3)
    assert normals.shape == (24, 3)  # each corner once for each of its three sides
    assert faces.shape == (12, 3)
    assert np.sort(np.abs(normals), axis=1) == pytest.approx(np.tile([0, 0, 1], (24, 1)), abs=1e-6)


def test_a_changed_file_is_read_again(cube: Path) -> None:
    before = describe([Body("a", (Shape("mesh", mesh=cube),))], Viewpoint())["geometries"]
    trimesh.creation.box((9, 9, 9)).export(cube)
    after = describe([Body("a", (Shape("mesh", mesh=cube),))], Viewpoint())["geometries"]
    assert before != after


@pytest.mark.parametrize(
    "name", ["missing.stl", "garbage.stl", "garbage.obj", "empty.obj", "strange.xyz1", "folder.stl"]
)
def test_an_unreadable_mesh_is_named(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    if name.startswith("garbage"):
        path.write_bytes(b"v 1 nan\x00\xff what")
    elif name.startswith("folder"):
        path.mkdir()
    elif not name.startswith("missing"):
        path.touch()
    with pytest.raises(BadInput, match=name):
        describe([Body("a", (Shape("mesh", mesh=path),))], Viewpoint())


def test_a_comment_in_latin_1_is_no_fault(tmp_path: Path) -> None:
    text = trimesh.creation.box((1, 1, 1)).export(file_type="obj")
    (tmp_path / "part.obj").write_bytes("# Prüfteil\n".encode("latin-1") + text.encode())
    assert read_mesh(tmp_path / "part.obj", 0)["kind"] == "mesh"


def test_two_bodies_of_one_name_are_refused() -> None:
    with pytest.raises(BadInput, match="used twice"):
        describe([Body("a", ()), Body("a", ())], Viewpoint())
