"""Bodies as the page's JSON."""

import base64
import json
from collections.abc import Callable
from math import radians, tan
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.mdp import FloatArray
from lab.sequencing.cell.schedule import Activity, Schedule
from lab.sim.frames import Body, Shape, Viewpoint
from lab.view.scene_data import MARKS, Mark, Story, camera_for, describe, read_mesh


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


# ---- story ------------------------------------------------------------------------------------------------------------


CARRY = Activity("robot", "carry", 1, "plate", "toaster", 1.00049, 4.0)
TOASTS = Activity("toaster", "process", 1, "toaster", "toaster", 4.0, 64.0)
SLICE = Activity("slice 1", "process", 1, "toaster", "toaster", 4.0, 64.0)
MEASURED = Schedule((CARRY,), (TOASTS,), (SLICE,), 64.0, (1,))


def test_a_story_has_the_rows_of_robot_and_machines_and_all_else_in_the_order_of_time() -> None:
    late, early = Mark(9.0, "stop", "emergency stop"), Mark(2.0, "fault", "slice 1 was moved")
    story = Story(MEASURED, None, ((5.0, "waits"), (1.0, "carries")), (late, early), (8.0, 1.0))
    said = json.loads(json.dumps(story.to_json()))
    assert [row["resource"] for row in said["measured"]] == ["robot", "toaster"]
    assert said["measured"][0]["start_s"] == 1.0
    assert (said["planned"], said["begins_s"]) == ([], [1.0, 8.0])
    assert said["captions"] == [[1.0, "carries"], [5.0, "waits"]]
    assert [mark["kind"] for mark in said["marks"]] == ["fault", "stop"]


def test_a_bar_is_called_as_its_part_and_has_its_colour_where_the_part_is_worked_on_or_carried() -> None:
    waits = Activity("robot", "wait", 1, "plate", "plate", 0.0, 1.0)
    schedule = Schedule((waits, CARRY), (TOASTS,), (), 64.0, (1,))
    rows = Story(schedule, looks={1: ("slice 1", "#E69F00")}).to_json()["measured"]
    assert [row["name"] for row in rows] == ["slice 1"] * 3
    assert [row.get("color") for row in rows] == [None, "#E69F00", "#E69F00"]
    assert "name" not in Story(schedule).to_json()["measured"][0]


def test_a_mark_is_of_a_known_kind() -> None:
    with pytest.raises(BadInput, match=r"'fualt'.*did you mean 'fault'"):
        Mark(1.0, "fualt", "")  # type: ignore[arg-type]
    assert [Mark(0.0, kind, "").kind for kind in MARKS] == [*MARKS]


# ---- camera placement -------------------------------------------------------------------------------------------------


InPicture = Callable[[Viewpoint, FloatArray], bool]  # the fixture of tests/conftest.py
coordinate = st.floats(-3.0, 3.0)
points = st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=1, max_size=12)


@given(seen=points, azimuth=st.floats(-3.0, 3.0), elevation=st.floats(0.1, 1.4))
def test_a_camera_has_all_points_in_its_picture_and_looks_from_where_it_is_told(
    in_picture: InPicture, seen: list[tuple[float, float, float]], azimuth: float, elevation: float
) -> None:
    cloud = np.array(seen) + np.array([[0.0, 0.0, 0.0], [0.1, 0.1, 0.1]])[:, None]
    camera = camera_for(cloud.reshape(-1, 3), azimuth, elevation)
    assert in_picture(camera, cloud.reshape(-1, 3))
    x, y, z = np.subtract(camera.eye, camera.target)
    assert np.arctan2(y, x) == pytest.approx(azimuth)
    assert np.arctan2(z, np.hypot(x, y)) == pytest.approx(elevation)


def test_a_nearer_camera_would_not_do() -> None:
    """The unit square from straight in front fills the picture but for the margin: 0.5 / tan(19 degrees) away, and 6 %."""
    square = np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [-0.5, 0.0, 1.0], [0.5, 0.0, 1.0]])
    camera = camera_for(square, radians(-90.0), 0.0)
    assert camera.target == pytest.approx((0.0, 0.0, 0.5))
    assert camera.eye == pytest.approx((0.0, -1.06 * 0.5 / tan(radians(19.0)), 0.5))
