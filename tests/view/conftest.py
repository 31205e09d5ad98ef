"""What the tests of pages stand on: a page without a browser, and a way to wait for what a browser's page does."""

import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import pytest
from websockets.sync.client import ClientConnection, connect

from lab.view.meshcat import LiveView

if TYPE_CHECKING:
    from playwright.sync_api import Page

WAIT_S = 20.0


@dataclass
class Watcher:
    """A page as the server sees it: what it was told last of each part of the panel, and what it was refused."""

    socket: ClientConnection
    seat: dict[str, Any] = field(default_factory=dict)
    refusals: list[str] = field(default_factory=list)

    def hear(self) -> dict[str, Any]:
        """The next message."""
        message = json.loads(self.socket.recv(timeout=WAIT_S))
        assert isinstance(message, dict)
        self.seat |= message.get("seat", {})
        self.refusals += [message["refusal"]] if "refusal" in message else []
        return message

    def hear_until(self, fits: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """Listen until what is known of the panel fits."""
        while not fits(self.seat):
            self.hear()
        return self.seat

    def say(self, message: Any) -> None:
        """Send something, as JSON unless it is text or bytes."""
        self.socket.send(message if isinstance(message, str | bytes) else json.dumps(message))

    def refused(self, message: Any) -> str:
        """Send something, and hear why it is ignored."""
        before = len(self.refusals)
        self.say(message)
        while len(self.refusals) == before:
            self.hear()
        return self.refusals[-1]


Opens = Callable[..., AbstractContextManager[Watcher]]


@pytest.fixture
def opens() -> Opens:
    """Open a view's page without a browser: `with opens(view) as page`; headers as keywords."""

    @contextmanager
    def watch(view: LiveView, **headers: str) -> Iterator[Watcher]:
        address = view.url.replace("http", "ws").replace("/?", "/frames?")
        with connect(address, additional_headers=headers, max_size=None, open_timeout=WAIT_S) as socket:
            yield Watcher(socket)

    return watch


Until = Callable[["Page", str], None]


@pytest.fixture
def until() -> Until:
    """Wait until an expression is true in a browser's page; its rules forbid the way that Playwright has for this."""

    def wait(page: "Page", expression: str) -> None:
        look = f"() => ({expression}) ? yes() : performance.now() > end ? no(new Error('never came')) : setTimeout(look, 10)"
        page.evaluate(
            f"() => new Promise((yes, no) => {{ const end = performance.now() + {1000 * WAIT_S}; const look = {look}; look(); }})"
        )

    return wait
