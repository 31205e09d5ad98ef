"""The live view and the replay's file, without a browser; how it is served: test_server.py."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest

from lab.errors import BadInput, WorkFailed
from lab.sim.frames import IDENTITY, Body, Frame, Recording, Shape
from lab.view.meshcat import LiveView, replay_html, viewer_script

BODIES = tuple(Body(name, (Shape("box", (0.1, 0.1, 0.1)),)) for name in ("table", "slice 1"))


@pytest.fixture
def view() -> Iterator[LiveView]:
    with LiveView() as running:
        running.show(BODIES)
        yield running


def test_the_hint_forwards_the_port_in_one_line(view: LiveView) -> None:
    assert re.fullmatch(rf"ssh -L {view.port}:127\.0\.0\.1:{view.port} \S+@\S+", view.hint)


def test_each_view_has_an_address_of_its_own(view: LiveView) -> None:
    with LiveView() as other:
        tokens = [
            re.fullmatch(rf"http://127\.0\.0\.1:{one.port}/\?token=([\w-]{{20,}})", one.url) for one in (view, other)
        ]
        assert all(tokens)
        assert tokens[0] is not None
        assert tokens[1] is not None
        assert tokens[0][1] != tokens[1][1]


def test_unknown_bodies_are_named(view: LiveView) -> None:
    with pytest.raises(BadInput, match="did you mean 'slice 1'"):
        view.update(Frame(0, {"slice 2": IDENTITY}))


def test_outside_its_context_there_is_no_page() -> None:
    view = LiveView()
    with pytest.raises(WorkFailed, match="not running"):
        view.show(BODIES)


def test_after_its_end_nothing_is_shown() -> None:
    view = LiveView().__enter__()
    view.show(BODIES)
    view.close()
    view.close()
    view.update(Frame(10.0, {"table": IDENTITY}))


# ---- the replay -------------------------------------------------------------------------------------------------


def moving(count: int) -> Recording:
    frames = [Frame(2 + t / 10, {"slice 1": (t * t / 1000, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)}) for t in range(count)]
    return Recording(BODIES, frames)


def data_of(path: Path) -> dict[str, Any]:
    text = re.search(r'<script id="lab-data" type="application/json">(.*?)</script>', path.read_text("utf-8"), re.S)
    assert text is not None
    data = json.loads(text[1])
    assert isinstance(data, dict)
    return data


def test_the_replay_is_one_file_that_names_no_other(tmp_path: Path) -> None:
    path = replay_html(moving(20), tmp_path / "runs" / "replay.html", speed=4)
    text = path.read_text("utf-8")
    own = text.replace(viewer_script().read_text("utf-8"), "")
    assert not re.findall(r"<(?:script|img|link|iframe)[^>]*(?:src|href)=(?!\"data:)", own)
    assert "default-src 'none'" in own
    assert "Three.js Authors" in own
    assert [child.name for child in path.parent.iterdir()] == ["replay.html"]
    data = data_of(path)
    assert (data["speed"], data["start_s"]) == (4, 2)
    assert data["duration_s"] == pytest.approx(1.9)
    still, moved = (body["motion"] for body in data["scene"]["bodies"])
    assert still["position"] is None
    assert moved["position"] is not None
    assert moved["quaternion"] is None


def test_title_and_names_cannot_become_markup(tmp_path: Path) -> None:
    evil = "</script><script>alert(1)<\\/script><!--"
    recording = Recording((Body(evil.replace("/", ""), ()),), [Frame(0, {})])
    path = replay_html(recording, tmp_path / "replay.html", title=f"{evil} & {{{{data}}}}")
    text = path.read_text("utf-8")
    assert "<script>alert" not in text
    assert "&lt;/script&gt;&lt;script&gt;alert(1)" in text
    assert data_of(path)["scene"]["bodies"][0]["name"] == evil.replace("/", "")


def test_even_restless_bodies_cost_few_bytes(tmp_path: Path) -> None:
    """25 bodies that never rest: under 50 bytes a body and frame, so 5000 frames stay under 8 MB with the viewer."""
    rng = np.random.default_rng(0)
    names = [f"body {number}" for number in range(25)]
    frames = []
    for time in range(60):
        turns = rng.normal(size=(25, 4))
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        places = rng.normal(size=(25, 3))
        rows = np.hstack([places, turns]).tolist()
        frames.append(Frame(time / 10, {name: tuple(row) for name, row in zip(names, rows, strict=True)}))
    bodies = tuple(Body(name, (Shape("box", (1, 1, 1)),)) for name in names)
    whole = replay_html(Recording(bodies, frames), tmp_path / "whole.html").stat().st_size
    first = replay_html(Recording(bodies, frames[:1]), tmp_path / "first.html").stat().st_size
    assert first < 1e6
    assert (whole - first) / (25 * 59) < 50


def test_a_failed_write_leaves_the_old_file_and_no_rest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "replay.html"
    path.write_text("old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(BadInput, match=r"replay\.html': No space left on device"):
        replay_html(moving(2), path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_in_the_way_of_the_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "runs").touch()
    with pytest.raises(BadInput, match="cannot write the replay"):
        replay_html(moving(2), tmp_path / "runs" / "replay.html")


@pytest.mark.parametrize("speed", [0, -1, float("nan"), float("inf")])
def test_speeds_that_are_none_are_refused(speed: float, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="replay speed"):
        replay_html(moving(2), tmp_path / "replay.html", speed=speed)
    assert not list(tmp_path.iterdir())


def test_a_replay_can_be_served(tmp_path: Path) -> None:
    path = replay_html(moving(3), tmp_path / "replay.html")
    with LiveView(replay=path) as view, urlopen(view.url) as answer:
        assert answer.read() == path.read_bytes()


@pytest.mark.parametrize("content", [None, b"", b"<html></html>", b"\xff\xfe"])
def test_what_is_no_replay_is_not_served(content: bytes | None, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / "replay.html").write_bytes(content)
    with pytest.raises(BadInput, match=r"replay\.html"), LiveView(replay=tmp_path / "replay.html"):
        pass


def test_a_recording_of_nothing_is_a_still_picture(tmp_path: Path) -> None:
    data = data_of(replay_html(Recording(BODIES), tmp_path / "replay.html"))
    assert data["duration_s"] == 0
    assert data["scene"]["bodies"][0]["motion"]["start"] == list(IDENTITY)
