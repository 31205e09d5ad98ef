"""What strangers without the token can take from the page's server: little, and not for long; open pages are not touched."""

import asyncio
import os
import resource
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast
from urllib.request import urlopen

import pytest
from uvicorn import Server as Uvicorn
from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.server import ServerState

from lab.sim.frames import Body, Frame, Shape
from lab.view import server_page
from lab.view.meshcat import LiveView
from lab.view.server import config_of, listening
from lab.view.server_page import LimitedSocket

if TYPE_CHECKING:
    Opens = Callable[..., AbstractContextManager[Any]]


@pytest.fixture
def view() -> Iterator[LiveView]:
    with LiveView() as running:
        running.show((Body("table", (Shape("box", (0.1, 0.1, 0.1)),)),))
        yield running


def bare(view: LiveView) -> socket.socket:
    """A connection that says nothing."""
    return socket.create_connection(("127.0.0.1", view.port), timeout=30.0)


def is_cut(one: socket.socket) -> bool:
    """Wait until the server has ended it."""
    try:
        return one.recv(1) == b""
    except ConnectionResetError:
        return True


def test_the_oldest_stranger_makes_room_and_a_page_stays(
    view: LiveView, opens: "Opens", monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four connections are allowed, one is a page: of ten that say nothing the first seven have to go."""
    monkeypatch.setattr(server_page, "MOST", 4)
    with ExitStack() as stack:
        page = stack.enter_context(opens(view))
        page.hear()
        strangers = [stack.enter_context(bare(view)) for _ in range(10)]
        assert all(is_cut(one) for one in strangers[:7])
        with urlopen(view.url) as answer:  # whoever has the token comes in all the same
            assert answer.status == 200
        view.update(Frame(2.0, {}))
        while page.hear()["frame"]["time_s"] != 2.0:
            pass


def test_who_asks_for_nothing_does_not_wait_for_ever(
    view: LiveView, opens: "Opens", monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither with nothing said, nor with half a request; a page may be silent as long as it likes."""
    monkeypatch.setattr(server_page, "IDLE_S", 0.2)
    with opens(view) as page, bare(view) as silent, bare(view) as half:
        half.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")
        page.hear()
        assert is_cut(silent)
        assert is_cut(half)
        view.update(Frame(2.0, {}))
        while page.hear()["frame"]["time_s"] != 2.0:
            pass


def test_without_descriptors_the_server_waits_and_says_nothing(
    view: LiveView, capfd: pytest.CaptureFixture[str]
) -> None:
    """All are taken; a stranger knocks; as soon as one is free again it is let in."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    knocking = socket.socket()
    knocking.settimeout(30.0)
    resource.setrlimit(resource.RLIMIT_NOFILE, (len(os.listdir("/proc/self/fd")) + 20, before[1]))
    taken = []
    try:
        while True:
            try:
                taken.append(os.open(os.devnull, os.O_RDONLY))
            except OSError:
                break
        knocking.connect(("127.0.0.1", view.port))
        time.sleep(0.3)
    finally:
        for one in taken:
            os.close(one)
        resource.setrlimit(resource.RLIMIT_NOFILE, before)
    knocking.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    assert knocking.recv(12) == b"HTTP/1.1 403"
    knocking.close()
    assert capfd.readouterr().err == ""


def test_pings_whose_answers_nobody_reads_end_the_connection(view: LiveView, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_page, "MOST_UNREAD", 1 << 16)
    path = view.url.partition(str(view.port))[2].replace("/?", "/frames?")
    ask = f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{view.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    with bare(view) as page:
        page.sendall(f"{ask}Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        assert page.recv(12) == b"HTTP/1.1 101"
        pings = (b"\x89\xfd\0\0\0\0" + bytes(125)) * 1000  # masked with zeros
        with pytest.raises((ConnectionResetError, BrokenPipeError)):
            page.sendall(pings * 1000)  # 131 MB


@pytest.mark.parametrize(
    "frames",
    [
        b"\x89\x80\0\0\0\0" * 300,  # pings
        b"\x8a\x80\0\0\0\0" * 300,  # pongs
        b"\x01\x80\0\0\0\0" + b"\x00\x80\0\0\0\0" * 300,  # fragments of one message
        b"\x81\x80\0\0\0\0" * 1000,  # messages faster than they are read
    ],
)
def test_a_page_that_sends_what_no_browser_does_is_cut(view: LiveView, frames: bytes) -> None:
    path = view.url.partition(str(view.port))[2].replace("/?", "/frames?")
    ask = f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{view.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    with bare(view) as page:
        page.sendall(f"{ask}Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        assert page.recv(12) == b"HTTP/1.1 101"
        page.sendall(frames)
        while not is_cut(page):
            pass


def test_a_request_that_is_never_answered_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_page, "IDLE_S", 0.05)

    async def never(scope: Any, receive: Any, send: Any) -> None:
        await asyncio.Event().wait()

    async def asked() -> bytes:
        with listening(0) as listener:
            server = Uvicorn(config_of(never, listener))
            serving = asyncio.create_task(server.serve(sockets=[listener]))
            reader, writer = await asyncio.open_connection(*listener.getsockname())
            writer.write(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            try:
                return await reader.read()
            except ConnectionResetError:
                return b""
            finally:
                writer.close()
                for task in server.server_state.tasks:
                    task.cancel()
                server.should_exit = True
                await serving

    assert asyncio.run(asyncio.wait_for(asked(), 30.0)) == b""


def test_the_oldest_of_those_who_shake_no_hands_makes_room(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four may knock at a time: of six the first two are ended."""
    monkeypatch.setattr(server_page, "MOST", 4)
    with ExitStack() as stack:
        listener = stack.enter_context(listening(0))
        listener.setblocking(True)
        strangers = [
            stack.enter_context(socket.create_connection(listener.getsockname(), timeout=30.0)) for _ in range(6)
        ]
        held = [stack.enter_context(listener.accept()[0]) for _ in strangers]
        assert [is_cut(one) for one in strangers[:2]] == [True, True]
        assert [*listener.knocking] == [one.getsockname() for one in strangers[2:]]
        assert [one.getpeername() for one in held[2:]] == [*listener.knocking]


def test_nothing_is_written_to_a_connection_that_is_closing() -> None:
    async def nobody(scope: Any, receive: Any, send: Any) -> None:
        raise AssertionError

    async def closing() -> None:
        with listening(0) as listener:
            config = config_of(nobody, listener)
            config.load()
            page = LimitedSocket(config=config, server_state=ServerState(), app_state={})
            page.transport = cast(Any, SimpleNamespace(is_closing=lambda: True))  # which can write nothing
            with pytest.raises(ClientDisconnected):
                await page.send({"type": "websocket.send", "text": "x"})

    asyncio.run(closing())
