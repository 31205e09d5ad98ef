"""What one page has to be told: what is where in the scene, and what the panel has that is new; sent as it can take it."""

import asyncio
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from errno import EMFILE, ENFILE, ENOBUFS, ENOMEM
from itertools import count
from pathlib import Path
from typing import Any, Protocol

from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from lab.operating_system import most_descriptors

MOST = 128  # connections; a quarter of the descriptors at the most
IDLE_S = 10.0  # for a request to come
BACKLOG = 16  # connections that are accepted in one go
MOST_UNREAD = 1 << 22  # bytes of answers to pings that wait for a page
_NUMBERS = count()


def most_connections() -> int:
    """How many connections there may be."""
    descriptors = most_descriptors()
    return MOST if descriptors is None else max(4, min(MOST, descriptors // 4))


class LimitedConnection(H11Protocol):
    """A connection on which nothing but HTTP was spoken so far."""

    _asked_before: object = None
    _cut = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Makes room for itself."""
        super().connection_made(transport)
        self._number = next(_NUMBERS)
        self._look = self.loop.call_later(IDLE_S, self._still_there)
        there = [one for one in self.connections if not getattr(one, "_cut", False)]
        if len(there) > most_connections():
            waiting = [one for one in there if isinstance(one, LimitedConnection) and one.waits]
            min(waiting, key=lambda one: one._number, default=self).cut()

    def connection_lost(self, exc: Exception | None) -> None:
        """It is over."""
        self._look.cancel()
        super().connection_lost(exc)

    @property
    def waits(self) -> bool:
        """Whether nothing that it asked for is being answered."""
        return self.cycle is None or self.cycle.response_complete

    def cut(self) -> None:
        """End it at once."""
        self._cut = True
        self.transport.abort()

    def _still_there(self) -> None:
        """Ends it where it has not asked for anything since the last look; a page has another protocol by then."""
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


# ---- server page ------------------------------------------------------------------------------------------------------


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


class Panel(Protocol):
    """What pages show and say beside the scene; all of it is called in the server's thread.

    files: what a page loads for it: HTML that is put into the page, style sheets, and scripts in the order they are run.
    """

    files: Sequence[Path]

    def joined(self, page: int) -> None:
        """A browser has opened the page; each one has a number of its own."""

    def left(self, page: int) -> None:
        """A browser has left."""

    def said(self, page: int, message: str | bytes) -> None:
        """What a page sends, whatever that is."""

    def stirred(self) -> bool:
        """Whether there is something new since this was asked last."""

    def news(self, page: int) -> str:
        """The JSON members that this page does not know yet; "" when it knows all."""


class Page:
    """What waits for one page, and the task that sends it; `last`: then the connection is closed."""

    def __init__(self, number: int, socket: WebSocket, panel: Panel | None) -> None:
        self.number, self.socket, self._panel = number, socket, panel
        self.wake, self.last = asyncio.Event(), False
        self.sending: asyncio.Task[None]
        self._waiting: News | None = None

    def offer(self, news: News) -> None:
        """Send `news` as soon as the page can take it, together with what waits already."""
        self._waiting = self._waiting or News()
        self._waiting.merge(news)
        self.wake.set()

    async def send(self) -> None:
        """Send what waits whenever there is something, until the page has left, or was sent the last."""
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
