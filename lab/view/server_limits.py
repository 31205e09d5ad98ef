"""What a connection may take from the live page's server before it has shown the token: little, and not for long.

Any local user can open connections. So there are at most as many as the process can spare descriptors for, the oldest one
that has not asked for anything makes room for a new one, and none waits for ever. Pages that are open are not touched.
"""

import asyncio
from errno import EMFILE, ENFILE, ENOBUFS, ENOMEM
from itertools import count
from typing import Any

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
