"""One open page: the news for it from scene and panel, sent as fast as it can take them; and limits on connections."""

import asyncio
import json
from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field
from errno import EMFILE, ENFILE, ENOBUFS, ENOMEM
from itertools import count
from pathlib import Path
from typing import Any, Protocol

from starlette.websockets import WebSocketDisconnect
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from lab.operating_system import most_descriptors

MOST = 128  # connections, and at most a quarter of the file descriptors
IDLE_S = 10.0  # time within which a request must arrive
BACKLOG = 16  # connections accepted at once
MOST_UNREAD = 1 << 22  # bytes of unread answers to a page's pings
_NUMBERS = count()


def most_connections() -> int:
    """The largest number of connections."""
    descriptors = most_descriptors()
    return MOST if descriptors is None else max(4, min(MOST, descriptors // 4))


class LimitedConnection(H11Protocol):
    """A connection that has used only HTTP so far, with limits on number and idle time."""

    _asked_before: object = None
    _cut = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Close an idle connection if there are too many."""
        super().connection_made(transport)
        self._number = next(_NUMBERS)
        self._look = self.loop.call_later(IDLE_S, self._still_there)
        there = [connection for connection in self.connections if not getattr(connection, "_cut", False)]
        if len(there) > most_connections():
            waiting = [
                connection for connection in there if isinstance(connection, LimitedConnection) and connection.waits
            ]
            min(waiting, key=lambda connection: connection._number, default=self).cut()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the closed connection."""
        self._look.cancel()
        super().connection_lost(exc)

    @property
    def waits(self) -> bool:
        """Whether the connection is idle: no request of it is being answered."""
        return self.cycle is None or self.cycle.response_complete

    def cut(self) -> None:
        """Close the connection immediately."""
        self._cut = True
        self.transport.abort()

    def _still_there(self) -> None:
        """Close the connection if it has sent no request since the last check; pages have switched to a websocket by then."""
        if self not in self.connections:
            return
        if self.waits and self.cycle is self._asked_before:
            self.cut()
            return
        self._asked_before = self.cycle
        self._look = self.loop.call_later(IDLE_S, self._still_there)


class LimitedSocket(WebSocketsSansIOProtocol):
    """A page's websocket; one that asks for signs of life and does not read them is cut off."""

    def handle_ping(self) -> None:
        """Answered while somebody reads the answers."""
        super().handle_ping()
        if self.transport.get_write_buffer_size() > MOST_UNREAD:
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
