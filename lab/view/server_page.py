"""One open page: the news for it from scene and panel, sent as fast as it can take them; and limits on connections."""

import asyncio
import json
import socket
from collections import Counter
from collections.abc import Mapping, MutableMapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from errno import EMFILE, ENFILE, ENOBUFS, ENOMEM
from itertools import count
from pathlib import Path
from typing import Any, Protocol

from starlette.websockets import WebSocketDisconnect
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from lab.operating_system import most_descriptors

MOST = 128  # connections, and at most a quarter of the file descriptors
IDLE_S = 10.0  # time within which a request must arrive
MOST_LOOKS = 3  # IDLE_S within which a request must have been read and answered
BACKLOG = 16  # connections accepted at once
SLICE = 1 << 12  # bytes of a websocket that are taken in at once
MOST_WAITING = 256  # messages of a page that nobody has asked for yet
MOST_OTHERS, OTHERS_S = 200, 10.0  # pings, pongs and fragments of a page in so many seconds
MOST_UNREAD = 1 << 22  # bytes of unread answers to a page's pings
_NUMBERS = count()


def most_connections() -> int:
    """The largest number of connections."""
    descriptors = most_descriptors()
    return MOST if descriptors is None else max(4, min(MOST, descriptors // 4))


class Listener(socket.socket):
    """A listening socket that ends the oldest of the connections that have not begun to speak HTTP when there are too many.

    Such are, over TLS, those that shake no hands. On Windows, where event loops accept in another way, all are left alone.
    """

    def __init__(self) -> None:
        super().__init__(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)  # named, asyncio sends at once
        self.knocking: dict[Any, socket.socket] = {}  # by the other end's address, the oldest first

    def accept(self) -> tuple[socket.socket, Any]:
        """A new connection and its address. Raises OSError."""
        connection, address = super().accept()
        self.knocking[address] = connection
        if len(self.knocking) > most_connections():
            many = Counter(host for host, _ in self.knocking)
            first = max(
                self.knocking, key=lambda address: many[address[0]]
            )  # of several the first one, which is the oldest
            with suppress(OSError):
                self.knocking.pop(first).shutdown(socket.SHUT_RDWR)
        return connection, address


class LimitedConnection(H11Protocol):
    """A connection that has used only HTTP so far, with limits on number, idle time and the time of a request.

    knocking: those of a `Listener`.
    """

    _asked_before: object = None
    _looks = 0
    _cut = False

    def __init__(self, *uvicorn: Any, knocking: dict[Any, Any] | None = None, **more: Any) -> None:
        super().__init__(*uvicorn, **more)
        self._knocking = {} if knocking is None else knocking

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """If there are too many, close the oldest request of an address that has most of them."""
        super().connection_made(transport)
        self._knocking.pop(transport.get_extra_info("peername"), None)
        self._number = next(_NUMBERS)
        self._look = self.loop.call_later(IDLE_S, self._still_there)
        there = [connection for connection in self.connections if not getattr(connection, "_cut", False)]
        if len(there) > most_connections():
            requests = [connection for connection in there if isinstance(connection, LimitedConnection)]
            many = Counter(connection.address for connection in requests)
            min(requests, key=lambda one: (-many[one.address], one._number)).cut()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the closed connection."""
        self._look.cancel()
        super().connection_lost(exc)

    @property
    def address(self) -> str:
        """The other end's."""
        return self.client[0] if self.client else ""

    @property
    def waits(self) -> bool:
        """Whether the connection is idle: no request of it is being answered."""
        return self.cycle is None or self.cycle.response_complete

    def cut(self) -> None:
        """Close the connection immediately."""
        self._cut = True
        self.transport.abort()

    def _still_there(self) -> None:
        """Close the connection if it has sent no request since the last check, or if a request takes MOST_LOOKS of them.

        Pages have switched to a websocket by then.
        """
        if self not in self.connections:
            return
        self._looks = self._looks + 1 if self.cycle is self._asked_before else 0
        if self._looks >= (1 if self.waits else MOST_LOOKS):
            self.cut()
            return
        self._asked_before = self.cycle
        self._look = self.loop.call_later(IDLE_S, self._still_there)


class LimitedSocket(WebSocketsSansIOProtocol):
    """A page's websocket; one that browsers would not use like that is cut off.

    Such are messages that pile up, pings and fragments without end, and answers that nobody reads. What comes is taken in
    small parts, so that other pages wait for none of it.
    """

    def __init__(self, *uvicorn: Any, **more: Any) -> None:
        super().__init__(*uvicorn, **more)
        self._others, self._since_s = 0, 0.0  # frames that brought no message, and since when they are counted

    def data_received(self, data: bytes) -> None:
        """Take in what was received, until the connection is cut."""
        for begin in range(0, len(data), SLICE):
            if self.transport.is_closing():
                return
            super().data_received(data[begin : begin + SLICE])

    def send_receive_event_to_app(self) -> None:
        """Keep a message until it is asked for."""
        super().send_receive_event_to_app()
        if self.queue.qsize() > MOST_WAITING:
            self.transport.abort()

    def handle_cont(self, event: Any) -> None:
        """A further fragment of a message."""
        self._count()
        super().handle_cont(event)

    def handle_pong(self, event: Any) -> None:
        """An answer to a ping."""
        self._count()
        super().handle_pong(event)

    def handle_ping(self) -> None:
        """Answered while somebody reads the answers."""
        self._count()
        super().handle_ping()
        if self.transport.get_write_buffer_size() > MOST_UNREAD:
            self.transport.abort()

    def keepalive_timeout(self) -> None:
        """The browser is not there any more: what it has not read is dropped."""
        super().keepalive_timeout()
        self.transport.abort()

    async def send(self, message: Any) -> None:
        """Send, or close; a browser that does not take the end is cut off. Raises OSError once the connection is closing."""
        if message["type"] == "websocket.send" and self.transport.is_closing():
            raise ClientDisconnected  # asyncio would warn, on the terminal, of writing to it
        await super().send(message)
        if message["type"] == "websocket.close":
            self.loop.call_later(self.close_timeout, self.transport.abort)

    def _count(self) -> None:
        now_s = self.loop.time()
        if now_s > self._since_s + OTHERS_S:
            self._others, self._since_s = 0, now_s
        self._others += 1
        if self._others > MOST_OTHERS:
            self.transport.abort()


def quiet_when_full(loop: asyncio.AbstractEventLoop, told: dict[str, Any]) -> None:
    """asyncio's words about descriptors that are used up go nowhere: it looks again in a second, and a lesson goes on."""
    error = told.get("exception")
    if not (isinstance(error, OSError) and error.errno in (EMFILE, ENFILE, ENOBUFS, ENOMEM)):
        loop.default_exception_handler(told)


# ---- pages and their queues -------------------------------------------------------------------------------------------


PAUSE_S = 1 / 60  # between two messages to a page
ENDED = "the run has ended"


@dataclass
class News:
    """What a page has to be told: a whole new scene, or None, and after it what is where, in which colour, visible."""

    scene: Mapping[str, Any] | None = None
    time_s: float | None = None
    poses: dict[str, tuple[float, ...]] = field(default_factory=dict)
    colors: dict[str, tuple[float, ...]] = field(default_factory=dict)
    visible: dict[str, bool] = field(default_factory=dict)

    def merge(self, later: "News") -> None:
        """Take over what `later` says; its scene, if it has one, ends what was known."""
        if later.scene is not None:
            self.scene = later.scene
            self.poses, self.colors, self.visible = {}, {}, {}
        self.time_s = self.time_s if later.time_s is None else later.time_s
        self.poses.update(later.poses)
        self.colors.update(later.colors)
        self.visible.update(later.visible)

    def text(self) -> str:
        """The JSON members "scene", when there is one, and "frame" of a message of `page.js`."""
        frame = {"time_s": self.time_s, "poses": self.poses, "colors": self.colors, "visible": self.visible}
        scene = "" if self.scene is None else f'"scene": {json.dumps(self.scene)}, '
        return f'{scene}"frame": {json.dumps(frame)}'


class ScenePanel(Protocol):
    """The content of a page beside the scene, and the receiver of its messages; called only in the server's thread.

    files: HTML that is inserted into the page, style sheets, and scripts in the order in which they run.
    """

    files: Sequence[Path]

    def joined(self, page: int, watches: bool = False) -> None:
        """A browser has opened a page; each page has its own number. watches: it asked for no more than to look."""

    def left(self, page: int) -> None:
        """A browser has left."""

    def said(self, page: int, message: str | bytes) -> None:
        """A page has sent a message, which may be anything."""

    def stirred(self) -> bool:
        """Whether there is news since the last call."""

    def news(self, page: int) -> str:
        """The JSON members that this page has not received yet; "" for none."""


class PageSocket(Protocol):
    """What is used of the connection of one page: a websocket, or what stands for one."""

    async def send_text(self, data: str) -> None:
        """Send a message."""

    async def close(self, code: int = 1000, reason: str | None = None) -> None:
        """Close the connection."""

    async def receive(self) -> MutableMapping[str, Any]:
        """The next message of the page, or its disconnection."""


class PageQueue:
    """The pending news of one page, and the task that sends them; `last`: the connection is closed after them."""

    def __init__(self, number: int, socket: PageSocket, panel: ScenePanel | None) -> None:
        self.number, self.socket, self._panel = number, socket, panel
        self.wake, self.last = asyncio.Event(), False
        self.sending: asyncio.Task[None]
        self._waiting: News | None = None

    def offer(self, news: News) -> None:
        """Send `news` as soon as the page can take them, merged with those that are pending."""
        self._waiting = self._waiting or News()
        self._waiting.merge(news)
        self.wake.set()

    async def send(self) -> None:
        """Send pending news until the page has left or received the last ones."""
        try:
            while True:
                self.wake.clear()
                if text := self._text():
                    await self.socket.send_text(text)
                    await asyncio.sleep(PAUSE_S)
                elif self.last:
                    break
                else:
                    await self.wake.wait()
            await self.socket.close(1001, ENDED)
        except (WebSocketDisconnect, RuntimeError):  # it has left
            return

    def _text(self) -> str:
        """The message to send now, "" for none."""
        members = [] if self._waiting is None else [self._waiting.text()]
        self._waiting = None
        if self._panel is not None and (news := self._panel.news(self.number)):
            members.append(news)
        return f"{{{', '.join(members)}}}" if members else ""
