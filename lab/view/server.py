"""The live page's server: HTTP and a websocket for each page on 127.0.0.1, in a thread of its own.

A page gets what changed since it was last sent something, at most 60 times a second: a slow page skips frames, it
neither holds up the run nor lets messages pile up. What a page sends is dropped.
"""

import asyncio
import json
import socket
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.iostream import StreamClosedError
from tornado.web import Application, RequestHandler, StaticFileHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from lab.errors import BadInput, WorkFailed

ADDRESS = "127.0.0.1"
HOSTS = r"(127\.0\.0\.1|localhost)"  # also through a forwarded port; no other name may lead here
FLUSH_S, STOP_S = 0.5, 3.0
PAUSE_S = 1 / 60


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
        """The JSON message of `page.js`."""
        frame = {"time_s": self.time_s, "poses": self.poses, "colors": self.colors, "visible": self.visible}
        return json.dumps({"frame": frame} if self.scene is None else {"scene": self.scene, "frame": frame})


class Server:
    """Serves `page` at / and the viewer's script beside it; `send` may be called from any thread.

    Raises BadInput for a port that it cannot have.
    """

    def __init__(self, port: int, page: str, script: Path) -> None:
        self._socket = _listen(port)
        self.port: int = self._socket.getsockname()[1]
        self.connected = threading.Event()
        self.pages: set[Page] = set()
        self._page, self._script = page, script
        self._known = News()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="live view", daemon=True)
        self._ready = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stopped: asyncio.Event

    def start(self) -> None:
        """Begin to serve; raises WorkFailed when the thread does not come up."""
        self._thread.start()
        if not self._ready.wait(STOP_S):
            raise WorkFailed(f"live view: the server on port {self.port} did not start within {STOP_S} s")

    def send(self, news: News) -> None:
        """Have every page told, now or when it connects; returns at once."""
        self._call(self._publish, news)

    def stop(self) -> None:
        """Give pages half a second to take the last frame, then close all; at most about 3 s, whatever pages do."""
        if self._loop is None:
            self._socket.close()
            return
        self._call(self._stopped.set)
        self._thread.join(STOP_S)

    def _call(self, function: Any, *arguments: Any) -> None:
        if self._loop is not None and not self._loop.is_closed():
            try:
                self._loop.call_soon_threadsafe(function, *arguments)
            except RuntimeError:  # closed between the question and the call: nobody is left to be told
                return

    def _publish(self, news: News) -> None:
        self._known.merge(news)
        for page in self.pages:
            page.offer(news)

    def welcome(self, page: "Page") -> None:
        """Tell a page that has just connected all that is known."""
        self.pages.add(page)
        self.connected.set()
        page.offer(self._known)

    def farewell(self, page: "Page") -> None:
        """Forget a page that has left."""
        self.pages.discard(page)
        if not self.pages:
            self.connected.clear()

    async def _serve(self) -> None:
        self._loop, self._stopped = asyncio.get_running_loop(), asyncio.Event()
        application = Application(log_function=lambda handler: None, websocket_max_message_size=1024)
        application.add_handlers(
            HOSTS,
            [
                (r"/", Front, {"page": self._page}),
                (r"/frames", Page, {"server": self}),
                (rf"/({self._script.name})", StaticFileHandler, {"path": str(self._script.parent)}),
            ],
        )
        server = HTTPServer(application)
        server.add_sockets([self._socket])
        self._ready.set()
        await self._stopped.wait()
        server.stop()
        if sending := [page.sending for page in self.pages if page.sending]:
            await asyncio.wait(sending, timeout=FLUSH_S)
        for page in list(self.pages):
            page.close(1001, "the run has ended")
        try:
            await asyncio.wait_for(server.close_all_connections(), FLUSH_S)
        except TimeoutError:
            return  # a page that does not answer; the loop's end cuts it off


def _listen(port: int) -> socket.socket:
    own = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        own.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        own.setblocking(False)
        own.bind((ADDRESS, port))
        own.listen(16)
    except (OSError, OverflowError) as reason:
        own.close()
        text = getattr(reason, "strerror", None) or "no such port"
        allowed = "choose a free one within 1024..65535, or 0 for any"
        raise BadInput(f"port {port} for the live view: {text}: {allowed}") from None
    return own


class Front(RequestHandler):
    """The page itself."""

    def initialize(self, page: str) -> None:
        """Keep the text to serve."""
        self._text = page

    def get(self) -> None:
        """Answer with the page."""
        self.set_header("Cache-Control", "no-store")
        self.finish(self._text)


class Page(WebSocketHandler):
    """One open page. What it sends is dropped; tornado refuses connections that another site's page opens."""

    def initialize(self, server: Server) -> None:
        """Nothing waits yet."""
        self._server = server
        self._waiting: News | None = None
        self.sending: asyncio.Task[None] | None = None

    def open(self, *_: str, **__: str) -> None:
        """A browser has the page."""
        self.set_nodelay(True)
        self._server.welcome(self)

    def on_message(self, message: str | bytes) -> None:
        """Drop it: a page only watches."""

    def on_close(self) -> None:
        """The browser has left."""
        self._server.farewell(self)

    def offer(self, news: News) -> None:
        """Send `news`, or keep it with what waits already while a message is under way."""
        self._waiting = self._waiting or News()
        self._waiting.merge(news)
        if self.sending is None or self.sending.done():
            self.sending = asyncio.create_task(self._send())

    async def _send(self) -> None:
        while self._waiting is not None:
            news, self._waiting = self._waiting, None
            try:
                await self.write_message(news.text())
            except (WebSocketClosedError, StreamClosedError):
                return
            await asyncio.sleep(PAUSE_S)
