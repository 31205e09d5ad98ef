"""The live page's server and the replay's file, without a browser."""

import asyncio
import json
import re
import socket
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

from lab.errors import BadInput, WorkFailed
from lab.view.frames import IDENTITY, Body, Frame, Recording, Shape
from lab.view.meshcat import LiveView, replay_html, viewer_script
from lab.view.server import News

BODIES = tuple(Body(name, (Shape("box", (0.1, 0.1, 0.1)),)) for name in ("table", "slice 1"))
AHEAD = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def view() -> Iterator[LiveView]:
    with LiveView() as running:
        running.show(BODIES)
        yield running


async def hear(connection: WebSocketClientConnection) -> dict[str, Any]:
    text = await asyncio.wait_for(connection.read_message(), 5)
    assert isinstance(text, str)
    message = json.loads(text)
    assert isinstance(message, dict)
    return message


@asynccontextmanager
async def page_of(view: LiveView, **headers: str) -> AsyncIterator[WebSocketClientConnection]:
    connection = await websocket_connect(HTTPRequest(f"{view.url.replace('http', 'ws')}frames", headers=headers))
    yield connection
    ended = connection.close_code is not None  # by the server, and that was read
    connection.close()
    while not ended and await asyncio.wait_for(connection.read_message(), 5) is not None:
        pass


def test_the_page_and_the_viewer_are_served(view: LiveView) -> None:
    with urlopen(view.url) as answer:
        page = answer.read().decode()
    assert 'id="meshcat-pane"' in page
    assert "{{" not in page
    with urlopen(view.url + "main.min.js") as answer:
        assert answer.read() == viewer_script().read_bytes()


def test_it_listens_on_one_loopback_address_only(view: LiveView) -> None:
    """127.0.0.2 is this computer too: a server on every interface would answer there."""
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", view.port), timeout=5)
    listening = [
        row.split()[1]
        for table in (Path("/proc/net/tcp"), Path("/proc/net/tcp6"))
        if table.exists()
        for row in table.read_text().splitlines()[1:]
        if row.split()[3] == "0A" and row.split()[1].endswith(f":{view.port:04X}")
    ]
    assert listening == [f"0100007F:{view.port:04X}"]


def test_another_name_for_this_computer_gets_nothing(view: LiveView) -> None:
    with pytest.raises(HTTPError, match="404") as refused:
        urlopen(Request(view.url, headers={"Host": "elsewhere.example"}))
    refused.value.close()

    async def intrude() -> None:
        async with page_of(view, Origin="http://elsewhere.example"):
            pass

    with pytest.raises(HTTPClientError, match="403"):
        asyncio.run(intrude())


def test_a_page_gets_the_scene_and_then_what_moved(view: LiveView) -> None:
    async def watch() -> None:
        async with page_of(view) as page:
            first = await hear(page)
            assert [body["name"] for body in first["scene"]["bodies"]] == ["table", "slice 1"]
            assert view.wait_for_page(5)
            view.update(Frame(0.0, {"table": IDENTITY, "slice 1": IDENTITY}))
            second = await hear(page)
            assert "scene" not in second
            assert second["frame"]["poses"] == {"table": list(IDENTITY), "slice 1": list(IDENTITY)}
            view.update(Frame(0.1, {"table": IDENTITY, "slice 1": AHEAD}, {"table": (1, 0, 0, 1)}, {"table": False}))
            assert (await hear(page))["frame"] == {
                "time_s": 0.1,
                "poses": {"slice 1": list(AHEAD)},
                "colors": {"table": [1, 0, 0, 1]},
                "visible": {"table": False},
            }

    asyncio.run(watch())


def test_a_late_page_gets_everything_at_once(view: LiveView) -> None:
    view.update(Frame(0.0, {"table": AHEAD}, visible={"slice 1": False}))
    view.update(Frame(0.5, {"slice 1": AHEAD}))

    async def watch() -> dict[str, Any]:
        async with page_of(view) as page:
            return await hear(page)

    message = asyncio.run(watch())
    assert message["frame"]["poses"] == {"table": list(AHEAD), "slice 1": list(AHEAD)}
    assert message["frame"]["visible"] == {"slice 1": False}
    assert message["frame"]["time_s"] == 0.5


def test_what_a_page_says_is_dropped(view: LiveView) -> None:
    async def talk() -> None:
        async with page_of(view) as page:
            await hear(page)
            for message in ('{"type": "img", "data": "x,y"}', "no json", b"\x00\xff"):
                await page.write_message(message, binary=isinstance(message, bytes))
            view.update(Frame(1.0, {"table": AHEAD}))
            assert (await hear(page))["frame"]["poses"] == {"table": list(AHEAD)}

    asyncio.run(talk())


def test_a_page_that_reads_slowly_skips_frames_and_ends_with_the_last(view: LiveView) -> None:
    async def watch() -> None:
        async with page_of(view) as page:
            await hear(page)
            for number in range(1, 1001):
                view.update(Frame(number / 10, {"slice 1": (float(number), 0, 0, 0, 0, 0, 1)}))
            frame = (await hear(page))["frame"]
            while frame["time_s"] < 100:
                frame = (await hear(page))["frame"]
            assert frame["poses"]["slice 1"][0] == 1000

    asyncio.run(watch())


def test_the_last_frame_arrives_before_the_end() -> None:
    async def watch() -> None:
        view = LiveView().__enter__()
        view.show(BODIES)
        async with page_of(view) as page:
            await hear(page)
            view.update(Frame(9.0, {"table": AHEAD}))
            await asyncio.to_thread(view.close)
            assert (await hear(page))["frame"]["time_s"] == 9.0
            assert await page.read_message() is None
        view.close()
        view.update(Frame(10.0, {"table": IDENTITY}))

    asyncio.run(watch())


def test_leaving_does_not_wait_for_a_page_that_hangs() -> None:
    with LiveView() as view, socket.create_connection(("127.0.0.1", view.port)) as mute:
        request = (
            f"GET /frames HTTP/1.1\r\nHost: 127.0.0.1:{view.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        )
        mute.sendall(f"{request}Sec-WebSocket-Key: {'A' * 22}==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        assert view.wait_for_page(5)
        view.show([Body(f"body {number}", BODIES[0].shapes * 20) for number in range(2000)])  # more than a socket holds
        running = next(thread for thread in threading.enumerate() if thread.name == "live view")
        view.close()
        assert not running.is_alive()


def test_a_new_scene_ends_the_old_one() -> None:
    known = News({"bodies": ["old"]}, 1.0, {"a": AHEAD}, {"a": (1, 1, 1, 1)}, {"a": False})
    known.merge(News({"bodies": ["new"]}))
    assert (known.scene, known.poses, known.colors, known.visible) == ({"bodies": ["new"]}, {}, {}, {})


def test_without_pages_nothing_waits(view: LiveView) -> None:
    assert not view.wait_for_page(0)


def test_the_hint_forwards_the_port_in_one_line(view: LiveView) -> None:
    assert re.fullmatch(rf"ssh -L {view.port}:127\.0\.0\.1:{view.port} \S+@\S+", view.hint)
    assert view.url == f"http://127.0.0.1:{view.port}/"


def test_unknown_bodies_are_named(view: LiveView) -> None:
    with pytest.raises(BadInput, match="did you mean 'slice 1'"):
        view.update(Frame(0, {"slice 2": IDENTITY}))


@pytest.mark.parametrize("port", [-1, 65536, 10**9])
def test_ports_that_do_not_exist_are_refused(port: int) -> None:
    with pytest.raises(BadInput, match=f"port {port}"), LiveView(port):
        pass


def test_a_taken_port_is_refused(view: LiveView) -> None:
    with (
        pytest.raises(BadInput, match=f"port {view.port} for the live view: Address already in use"),
        LiveView(view.port),
    ):
        pass


def test_outside_its_context_there_is_no_page() -> None:
    view = LiveView()
    with pytest.raises(WorkFailed, match="not running"):
        view.show(BODIES)


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
