"""The live page's server: HTTP and a websocket for each page on 127.0.0.1, in a thread of its own.

A page receives the changes since its last message, at most 60 times a second: a slow page skips frames, and neither
delays the run nor lets messages pile up. Messages from a page go to the panel, if there is one.
"""

import asyncio
import secrets
import threading
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any
from urllib.parse import urlsplit

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket
from uvicorn import Config
from uvicorn import Server as Uvicorn

from lab.errors import BadInput, WorkFailed
from lab.operating_system import keep_port
from lab.view.framing import Framing
from lab.view.polled_pages import PolledPages, PolledSocket
from lab.view.server_page import (
    BACKLOG,
    PAUSE_S,
    LimitedConnection,
    LimitedSocket,
    Listener,
    News,
    PageQueue,
    ScenePanel,
    quiet_when_full,
)

ADDRESS = "127.0.0.1"
HOSTS = ("127.0.0.1", "localhost")  # also through a forwarded port; requests to other host names are rejected
FLUSH_S, GRACE_S, STOP_S = 0.5, 1, 3.0
POLL_S = 0.2  # interval at which the panel is asked for news
READ_S = 0.005  # least interval between two messages from a page, against flooding
MAX_PAGES = 32
PART = 1 << 16  # bytes of a file that are sent at once
MAX_MESSAGE = 1 << 16  # bytes; a longer one ends the connection
NO_TOKEN = "This page needs the token of its address: open the whole link that the lab printed.\n"
HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


@dataclass(frozen=True)
class File:
    """A served file: its bytes, its media type, and its content security policy."""

    content: bytes
    kind: str
    policy: str = "default-src 'none'"


class Server:
    """Serves `files` ("" is the page) to requests with the token; `send` and `wake` may be called from any thread.

    framing: the pages that may show this one in a frame; None: none. Raises BadInput for a port that is taken or not allowed.
    """

    def __init__(
        self,
        port: int,
        files: Mapping[str, File],
        token: str,
        panel: ScenePanel | None = None,
        framing: Framing | None = None,
    ) -> None:
        self._socket = listening(port)
        self.port: int = self._socket.getsockname()[1]
        self.connected = threading.Event()
        self._files, self._token, self._panel, self._framing = files, token, panel, framing
        self._pages: set[PageQueue] = set()
        self._opened = 0
        self._known = News()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="live view", daemon=True)
        self._ready = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stopped: asyncio.Event

    def start(self) -> None:
        """Begin to serve; raises WorkFailed when the thread does not start in time."""
        self._thread.start()
        if not self._ready.wait(STOP_S):
            raise WorkFailed(f"live view: the server on port {self.port} did not start within {STOP_S} s")

    def send(self, news: News) -> None:
        """Send news to every page, now or when it connects; returns at once."""
        self._call(self._publish, news)

    def wake(self) -> None:
        """Send the panel's news to every page immediately."""
        self._call(self._wake)

    def stop(self) -> None:
        """Close all pages after half a second for their last frame; takes at most about 3 s, whatever pages do."""
        if self._loop is None:
            self._socket.close()
            return
        self._call(self._stopped.set)
        self._thread.join(STOP_S)

    def _call(self, function: Any, *arguments: Any) -> None:
        if self._loop is not None and not self._loop.is_closed():
            try:
                self._loop.call_soon_threadsafe(function, *arguments)
            except RuntimeError:  # closed between the check and the call: no page is left
                return

    def _publish(self, news: News) -> None:
        self._known.merge(news)
        for page in self._pages:
            page.offer(news)

    def _wake(self) -> None:
        for page in self._pages:
            page.wake.set()

    async def _serve(self) -> None:
        self._loop, self._stopped = asyncio.get_running_loop(), asyncio.Event()
        self._loop.set_exception_handler(quiet_when_full)
        server = Uvicorn(config_of(self._application(), self._socket))
        serving = asyncio.create_task(server.serve(sockets=[self._socket]))
        polling = asyncio.create_task(self._poll())
        self._ready.set()
        await self._stopped.wait()
        polling.cancel()
        for page in self._pages:
            page.last = True
            page.wake.set()
        if self._pages:
            await asyncio.wait([page.sending for page in self._pages], timeout=FLUSH_S)
        server.should_exit = True
        await serving
        for connection in list(server.server_state.connections):  # cut off a connection that does not answer
            connection.transport.abort()
        await asyncio.sleep(0)

    def _application(self) -> Starlette:
        framing = self._framing or Framing(())
        guards = [
            Middleware(TrustedHostMiddleware, allowed_hosts=[*HOSTS, *framing.hosts], www_redirect=False),
            Middleware(_Guard, self._token, framing.origin),
        ]
        polled = PolledPages(self._serve_page, self._full).routes() if framing.polls else ()
        routes = [*polled, Route("/{name}", self._file), Route("/", self._file), WebSocketRoute("/frames", self._page)]
        return Starlette(routes=routes, middleware=guards)

    async def _file(self, request: Request) -> Response:
        file = self._files.get(request.path_params.get("name", ""))
        if file is None:
            return PlainTextResponse("There is no such page.\n", 404)
        return answer_of(
            replace(file, policy=file.policy if self._framing is None else self._framing.policy(file.policy))
        )

    async def _poll(self) -> None:
        """Poll the panel for news that nobody announced with `wake`."""
        while True:
            await asyncio.sleep(POLL_S)
            if self._pages and self._panel is not None and self._panel.stirred():
                self._wake()

    def _full(self) -> str:
        """Why no further page is served; "" if it is."""
        return f"{MAX_PAGES} pages are open: close one.\n" if len(self._pages) >= MAX_PAGES else ""

    async def _page(self, socket: WebSocket) -> None:
        if why := self._full():
            await socket.send_denial_response(PlainTextResponse(why, 503))
            return
        await socket.accept()
        await self._serve_page(socket)

    async def _serve_page(self, socket: WebSocket | PolledSocket) -> None:
        """Serve one open page, from its first message to its last."""
        self._opened += 1
        page = PageQueue(self._opened, socket, self._panel)
        page.offer(self._known)
        if self._panel is not None:
            self._panel.joined(page.number, "watch" in socket.query_params)
        self._pages.add(page)
        page.sending = asyncio.create_task(page.send())
        self.connected.set()
        self._wake()  # the other pages show that one more is open
        try:
            await self._hear(page)
        finally:
            page.sending.cancel()
            self._pages.discard(page)
            if not self._pages:
                self.connected.clear()
            if self._panel is not None:
                self._panel.left(page.number)
                self._wake()

    async def _hear(self, page: "PageQueue") -> None:
        while True:
            heard = await page.socket.receive()
            if heard["type"] == "websocket.disconnect":
                return
            if self._panel is not None:
                self._panel.said(page.number, heard.get("text") or heard.get("bytes") or "")
                asyncio.get_running_loop().call_later(PAUSE_S, self._wake)  # the run's messages to it come first
            await asyncio.sleep(READ_S)


class _Guard:
    """Rejects requests without the token, and websockets that another site's page has opened.

    origin: of a page behind a proxy, "" for none.
    """

    def __init__(self, app: ASGIApp, token: str, origin: str = "") -> None:
        self._app, self._token, self._origin = app, token.encode(), origin

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        asked = HTTPConnection(scope)
        given = asked.query_params.get("token", "").encode()
        if not secrets.compare_digest(given, self._token):
            await PlainTextResponse(NO_TOKEN, 403)(scope, receive, send)
        elif scope["type"] == "websocket" and not _from_here(asked, self._origin):
            await PlainTextResponse("Another site's page may not connect.\n", 403)(scope, receive, send)
        else:
            await self._app(scope, receive, send)


def _from_here(asked: HTTPConnection, proxied: str) -> bool:
    """Whether the websocket was opened by a page of this server, or by a program that is no browser; proxied: see `_Guard`."""
    origin = asked.headers.get("origin")
    if origin is None or (proxied and origin == proxied):
        return True
    return urlsplit(origin)[:2] == ("http", asked.headers.get("host", ""))


def answer_of(file: File) -> Response:
    """The response with a file; a large one in parts, each sent once the one before is on its way."""
    headers = {"Content-Security-Policy": file.policy}
    if len(file.content) <= PART:
        return Response(file.content, headers=headers, media_type=file.kind)

    async def parts() -> AsyncIterator[bytes]:
        for begin in range(0, len(file.content), PART):
            yield file.content[begin : begin + PART]
            await asyncio.sleep(0)  # others have their turn, and a cut connection is noticed

    return StreamingResponse(
        parts(), headers=headers | {"Content-Length": str(len(file.content))}, media_type=file.kind
    )


def config_of(application: Any, listener: Listener, **more: Any) -> Config:
    """The configuration of a server with the lab's limits and headers; more: of uvicorn, such as a certificate."""
    http: Any = partial(LimitedConnection, knocking=listener.knocking)
    return Config(
        application,
        loop="asyncio",
        http=http,
        ws=LimitedSocket,
        backlog=BACKLOG,
        ws_max_size=MAX_MESSAGE,
        ws_per_message_deflate=False,
        lifespan="off",
        log_config=None,
        log_level="critical",
        access_log=False,
        proxy_headers=False,
        server_header=False,
        date_header=False,
        headers=[*HEADERS.items()],
        timeout_graceful_shutdown=GRACE_S,
        **more,
    )


def listening(port: int, address: str = ADDRESS, what: str = "the live view") -> Listener:
    """A socket that listens, by default on this computer alone; port 0 takes a free one.

    what: who wants it, for messages. Raises BadInput for a port that is taken or not allowed, and a wrong address.
    """
    own = Listener()
    try:
        keep_port(own)
        own.setblocking(False)
        own.bind((address, port))
        own.listen(16)
    except (OSError, OverflowError) as reason:
        own.close()
        text = getattr(reason, "strerror", None) or "no such port"
        allowed = "choose a free one within 1024..65535, or 0 for any"
        where = "" if address == ADDRESS else f" of {address}"
        raise BadInput(f"port {port}{where} for {what}: {text}: {allowed}") from None
    return own
