"""The live page's server: who gets in, what a page is told, and that no page can hold up the run. No browser here."""

import json
import re
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from lab.errors import BadInput
from lab.sim.frames import IDENTITY, Body, Frame, Shape
from lab.view.meshcat import LiveView, viewer_script
from lab.view.server import File, Server
from lab.view.server_page import News

if TYPE_CHECKING:
    Opens = Callable[..., AbstractContextManager[Any]]

BODIES = tuple(Body(name, (Shape("box", (0.1, 0.1, 0.1)),)) for name in ("table", "slice 1"))
AHEAD = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def view() -> Iterator[LiveView]:
    with LiveView() as running:
        running.show(BODIES)
        yield running


def refused(url: str, **headers: str) -> tuple[int, str]:
    """Status and text of an answer that is no page."""
    with pytest.raises(HTTPError) as error:
        urlopen(Request(url, headers=headers))
    with error.value as answer:
        return answer.code, answer.read().decode()


# ---- who gets in


def test_the_page_and_what_it_loads_are_served(view: LiveView) -> None:
    with urlopen(view.url) as answer:
        page = answer.read().decode()
    assert 'id="meshcat-pane"' in page
    assert "{{" not in page
    loaded = re.findall(r'(?:src|href)="([^":]+)"', page)
    assert [name.partition("?")[0] for name in loaded] == ["page.css", "main.min.js", "page.js"]
    for name in loaded:
        with urlopen(f"http://127.0.0.1:{view.port}/{name}") as answer:
            assert len(answer.read()) > 500
    with urlopen(view.url.replace("/?", "/main.min.js?")) as answer:
        assert answer.read() == viewer_script().read_bytes()


def test_every_page_comes_with_strict_rules(view: LiveView) -> None:
    with urlopen(view.url) as answer:
        rules = dict(rule.split(" ", 1) for rule in answer.headers["Content-Security-Policy"].split("; "))
        assert answer.headers["Referrer-Policy"] == "no-referrer"  # the token stays here
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["Cache-Control"] == "no-store"
    assert rules["default-src"] == "'none'"
    assert rules["script-src"] == "'self'"
    assert rules["frame-ancestors"] == "'none'"


def test_nobody_gets_in_without_the_token(view: LiveView) -> None:
    own = view.url.partition("token=")[2]
    for token in ("", "?token=", "?token=wrong", f"?Token={own}", f"?token={own}x", f"?token={own[:-1]}", "?token=%FF"):
        for path in ("", "main.min.js", "page.js", "frames", "nothing"):
            status, text = refused(f"http://127.0.0.1:{view.port}/{path}{token}")
            assert (status, path, token) == (403, path, token)
            assert text == "This page needs the token of its address: open the whole link that the lab printed.\n"


def test_no_websocket_without_the_token(view: LiveView) -> None:
    with pytest.raises(InvalidStatus, match="403") as error, connect(f"ws://127.0.0.1:{view.port}/frames?token=wrong"):
        pass
    assert b"needs the token" in error.value.response.body


def test_an_unknown_page_is_said(view: LiveView) -> None:
    assert refused(view.url.replace("/?", "/nothing?")) == (404, "There is no such page.\n")


def test_another_name_for_this_computer_gets_nothing(view: LiveView, opens: "Opens") -> None:
    assert refused(view.url, Host="elsewhere.example")[0] == 400
    for origin in ("http://elsewhere.example", f"https://127.0.0.1:{view.port}", "http://127.0.0.1:1", "null"):
        with pytest.raises(InvalidStatus, match="403"), opens(view, Origin=origin):
            pass
    with opens(view, Origin=f"http://127.0.0.1:{view.port}") as page:
        assert "scene" in page.hear()


def test_a_forwarded_port_gets_in(view: LiveView) -> None:
    """Through ssh -L 9000:127.0.0.1:PORT the browser says localhost:9000."""
    with urlopen(Request(view.url, headers={"Host": "localhost:9000"})) as answer:
        assert answer.status == 200


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


@pytest.mark.parametrize("port", [-1, 65536, 10**9])
def test_ports_that_do_not_exist_are_refused(port: int) -> None:
    with pytest.raises(BadInput, match=f"port {port}"), LiveView(port):
        pass


def test_a_taken_port_is_refused(view: LiveView) -> None:
    taken = f"port {view.port} for the live view: Address already in use"
    with pytest.raises(BadInput, match=taken), LiveView(view.port):
        pass


def test_a_port_is_free_again_at_once(view: LiveView) -> None:
    port = view.port
    view.close()
    with LiveView(port) as again:
        assert again.port == port


# ---- what a page is told


def test_a_page_gets_the_scene_and_then_what_moved(view: LiveView, opens: "Opens") -> None:
    with opens(view) as page:
        assert [body["name"] for body in page.hear()["scene"]["bodies"]] == ["table", "slice 1"]
        assert view.wait_for_page(5)
        view.update(Frame(0.0, {"table": IDENTITY, "slice 1": IDENTITY}))
        second = page.hear()
        assert "scene" not in second
        assert second["frame"]["poses"] == {"table": list(IDENTITY), "slice 1": list(IDENTITY)}
        view.update(Frame(0.1, {"table": IDENTITY, "slice 1": AHEAD}, {"table": (1, 0, 0, 1)}, {"table": False}))
        assert page.hear()["frame"] == {
            "time_s": 0.1,
            "poses": {"slice 1": list(AHEAD)},
            "colors": {"table": [1, 0, 0, 1]},
            "visible": {"table": False},
        }


def test_a_late_page_gets_everything_at_once(view: LiveView, opens: "Opens") -> None:
    view.update(Frame(0.0, {"table": AHEAD}, visible={"slice 1": False}))
    view.update(Frame(0.5, {"slice 1": AHEAD}))
    with opens(view) as page:
        frame = page.hear()["frame"]
    assert frame["poses"] == {"table": list(AHEAD), "slice 1": list(AHEAD)}
    assert frame["visible"] == {"slice 1": False}
    assert frame["time_s"] == 0.5


def test_what_a_page_says_is_dropped(view: LiveView, opens: "Opens") -> None:
    with opens(view) as page:
        page.hear()
        for message in ('{"type": "img", "data": "x,y"}', "no json", b"\x00\xff"):
            page.say(message)
        view.update(Frame(1.0, {"table": AHEAD}))
        assert page.hear()["frame"]["poses"] == {"table": list(AHEAD)}


def test_a_page_that_says_too_much_is_cut_off(view: LiveView, opens: "Opens") -> None:
    with opens(view) as page, opens(view) as other:
        page.hear()
        page.say("x" * (1 << 17))
        with pytest.raises(ConnectionClosed) as cut:
            page.hear()
        assert cut.value.rcvd is not None
        assert cut.value.rcvd.code == 1009
        other.hear()
        view.update(Frame(1.0, {"table": AHEAD}))
        assert other.hear()["frame"]["time_s"] == 1.0


def test_a_page_that_reads_slowly_skips_frames_and_ends_with_the_last(view: LiveView, opens: "Opens") -> None:
    with opens(view) as page:
        page.hear()
        for number in range(1, 1001):
            view.update(Frame(number / 10, {"slice 1": (float(number), 0, 0, 0, 0, 0, 1)}))
        heard = 1
        while (frame := page.hear()["frame"])["time_s"] < 100:
            heard += 1
        assert frame["poses"]["slice 1"][0] == 1000
        assert heard < 500


def test_too_many_pages_are_refused(view: LiveView, opens: "Opens", monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lab.view.server.MAX_PAGES", 1)
    with opens(view) as first:
        first.hear()
        with pytest.raises(InvalidStatus, match="503"), opens(view):
            pass


def test_without_pages_nothing_waits(view: LiveView) -> None:
    assert not view.wait_for_page(0)


def test_a_new_scene_ends_the_old_one() -> None:
    known = News({"bodies": ["old"]}, 1.0, {"a": AHEAD}, {"a": (1, 1, 1, 1)}, {"a": False})
    known.merge(News({"bodies": ["new"]}))
    assert (known.scene, known.poses, known.colors, known.visible) == ({"bodies": ["new"]}, {}, {}, {})
    assert json.loads(f"{{{known.text()}}}")["frame"]["time_s"] == 1.0


# ---- the end


def test_the_last_frame_arrives_before_the_end(opens: "Opens") -> None:
    view = LiveView().__enter__()
    view.show(BODIES)
    with opens(view) as page:
        page.hear()
        view.update(Frame(9.0, {"table": AHEAD}))
        view.close()
        assert page.hear()["frame"]["time_s"] == 9.0
        with pytest.raises(ConnectionClosed) as ended:
            page.hear()
        assert ended.value.rcvd is not None
        assert (ended.value.rcvd.code, ended.value.rcvd.reason) == (1001, "the run has ended")


def test_leaving_does_not_wait_for_a_page_that_hangs() -> None:
    with LiveView() as view, socket.create_connection(("127.0.0.1", view.port)) as mute:
        asked = view.url.partition("?")[2]
        request = f"GET /frames?{asked} HTTP/1.1\r\nHost: 127.0.0.1:{view.port}\r\nUpgrade: websocket\r\n"
        request += f"Connection: Upgrade\r\nSec-WebSocket-Key: {'A' * 22}==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        mute.sendall(request.encode())
        assert view.wait_for_page(5)
        view.show([Body(f"body {number}", BODIES[0].shapes * 20) for number in range(2000)])  # more than a socket holds
        running = next(thread for thread in threading.enumerate() if thread.name == "live view")
        view.close()
        assert not running.is_alive()


def test_half_a_request_does_not_hold_up_the_end() -> None:
    with LiveView() as view, socket.create_connection(("127.0.0.1", view.port)) as half:
        half.sendall(b"GET / HT")
        with urlopen(view.url) as answer:  # so that the server has seen the other one
            answer.read()
        running = next(thread for thread in threading.enumerate() if thread.name == "live view")
        view.close()
        assert not running.is_alive()


def test_no_thread_and_no_socket_is_left(view: LiveView, opens: "Opens") -> None:
    port = view.port
    assert "live view" in {one.name for one in threading.enumerate()}
    with opens(view) as page:
        page.hear()
        view.close()
        with pytest.raises(ConnectionClosed):
            page.hear()
    assert not {one.name for one in threading.enumerate()} & {"live view", "AnyIO worker thread"}
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), timeout=5)


def test_a_server_that_never_started_gives_its_port_back() -> None:
    server = Server(0, {"": File(b"", "text/html")}, "token")
    server.stop()
    again = Server(server.port, {"": File(b"", "text/html")}, "token")
    again.stop()
