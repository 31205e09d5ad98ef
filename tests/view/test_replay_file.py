"""A replay's page read back."""

import base64
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from lab.errors import BadInput
from lab.sequencing.cell.schedule import Schedule
from lab.sim.frames import Body, Frame, Pose, Recording, Shape
from lab.view.meshcat import replay_html
from lab.view.replay_file import read_replay
from lab.view.scene_data import Story

HALF = 0.5**0.5
RED = (1.0, 0.0, 0.0, 1.0)


def at(x: float, turned: bool = False) -> Pose:
    return (x, 0.0, 0.5, 0.0, 0.0, HALF if turned else 0.0, HALF if turned else 1.0)


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """A cube of a mesh that goes and turns, a ball that is hidden and becomes red, a label."""
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "cube.stl")
    cube = Body("cube", (Shape("mesh", (0.1, 0.2, 0.3), mesh=tmp_path / "cube.stl", position=(0.0, 0.0, 1.0)),))
    ball = Body("ball", (Shape("sphere", (0.1,)), Shape("cylinder", (0.1, 0.3)), Shape("label", (0.1,), text="x")))
    frames = [
        Frame(2.0, {"cube": at(0.0), "ball": at(9.0)}, visible={"ball": False}),
        Frame(3.0, {"cube": at(1.0)}, visible={"ball": True}),
        Frame(4.0, {"cube": at(3.0, turned=True)}, colors={"ball": RED}),
    ]
    story = Story(Schedule((), (), (), 0.0, ()), captions=((1.0, "later"), (0.0, "first")), begins_s=(0.0,))
    return replay_html(Recording((cube, ball), frames), tmp_path / "replay.html", title="a < b", story=story)


def test_what_was_recorded_is_read_back(page: Path) -> None:
    replay = read_replay(page)
    assert (replay.title, replay.duration_s) == ("a < b", 2.0)
    assert (replay.captions, replay.begins_s) == (((0.0, "first"), (1.0, "later")), (0.0,))
    assert [len(body) for body in replay.bodies] == [1, 2]
    cube = replay.bodies[0][0]
    assert np.allclose(np.ptp(cube.positions, axis=0), (0.1, 0.2, 0.3), atol=1e-6)
    assert np.allclose(cube.positions.mean(axis=0), (0.0, 0.0, 1.0), atol=1e-6)
    moments = replay.at([0.0, 0.5, 1.0, 2.0, 99.0])
    assert np.allclose(moments.places[:, 0, 0], (0.0, 0.5, 1.0, 3.0, 3.0), atol=3e-4)
    assert np.allclose(moments.places[:, 1, 0], 9.0)
    assert np.allclose(moments.turns[-1, 0] @ (1, 0, 0), (0, 1, 0), atol=1e-3)
    assert np.allclose(moments.turns[0, 0], np.eye(3), atol=1e-3)
    assert moments.shown.T.tolist() == [[True] * 5, [False, False, True, True, True]]
    assert np.isnan(moments.rgba[2, 1]).all()
    assert tuple(moments.rgba[3, 1]) == RED


def packed(values: Any, kind: str = "<f4") -> str:
    return base64.b64encode(np.asarray(values, dtype=kind).tobytes()).decode()


def _mesh(data: Any) -> Any:
    return next(spec for spec in data["scene"]["geometries"] if spec["kind"] == "mesh")


@pytest.mark.parametrize(
    "spoil",
    [
        lambda data: _mesh(data).update(faces=packed([0, 1, 10**6], "<u4")),
        lambda data: _mesh(data).update(positions=packed([np.nan] * 72)),
        lambda data: _mesh(data).update(normals=packed([0.0, 0.0, 1.0])),
        lambda data: _mesh(data).update(positions="not base64"),
        lambda data: data["scene"]["bodies"][0]["motion"]["position"].update(times=packed([0.0, 0.0, 0.0])),
        lambda data: data["scene"]["bodies"][0]["shapes"][0].update(geometry=-1),
        lambda data: data["scene"]["bodies"][0]["shapes"][0].update(geometry=99),
        lambda data: data["scene"]["bodies"][0]["shapes"][0].update(pose=[0.0] * 7),
        lambda data: data["scene"]["bodies"][0]["shapes"][0].update(scale=[0.0, 1.0, 1.0]),
        lambda data: data["scene"]["bodies"][0]["motion"]["quaternion"].update(values=packed([0.0] * 12)),
        lambda data: data["scene"]["bodies"][0]["motion"].update(start=[0.0] * 7),
        lambda data: data["scene"]["camera"].update(eye=[10**400, 0, 0]),
        lambda data: data["scene"]["camera"].update(eye=[1e300, 0, 0]),
        lambda data: data["scene"]["bodies"][0].update(shapes=7),
        lambda data: data["scene"].update(bodies=[]),
        lambda data: data.update(duration_s="long"),
        lambda data: data.update(duration_s=-1.0),
        lambda data: data.pop("scene"),
        lambda data: data["scene"]["geometries"][1].update(size=[1e9] * 5),
    ],
)
def test_a_page_that_was_changed_is_refused_in_one_line(page: Path, spoil: Callable[[Any], Any]) -> None:
    text = page.read_text(encoding="utf-8")
    found = re.search(r'(?<=type="application/json">).*?(?=</script>)', text, re.DOTALL)
    assert found is not None
    data = json.loads(found[0])
    spoil(data)
    page.write_text(text.replace(found[0], json.dumps(data)), encoding="utf-8")
    with pytest.raises(BadInput, match=r"replay\.html' is no replay that the lab wrote: .") as refused:
        read_replay(page)
    assert len(str(refused.value)) < 300 + len(str(page))
    assert "\n" not in str(refused.value)


def test_a_file_that_is_no_page_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.html").write_text("<title>x</title>")
    for name in ("other.html", "missing.html"):
        with pytest.raises(BadInput, match=name):
            read_replay(tmp_path / name)
