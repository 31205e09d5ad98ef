"""Pages that ask for their news by GET requests, where a proxy such as Colab's passes neither websockets nor POST requests.

A page opens itself and then asks again and again; a request for news is answered when there is some, or after HOLD_S.
"""

import asyncio
import time
from collections.abc import Callable, Coroutine, Sequence
from secrets import token_urlsafe
from typing import Any

from starlette.datastructures import QueryParams
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route

HOLD_S = 8.0  # longest time until a request for news is answered
GONE_S = 20.0  # a page that has asked nothing for so long has left
MOST_UNREAD = 64  # messages of one page that wait; more are refused


class PolledSocket:
    """Stands for the websocket of a page that polls; what is sent waits until the page has fetched it."""

    def __init__(self, query_params: QueryParams) -> None:
        self.query_params = query_params
        self._said: asyncio.Queue[str | None] = asyncio.Queue()  # None: the page has left
        self._offered: dict[str, Any] | None = None
        self._there, self._taken = asyncio.Event(), asyncio.Event()
        self._fetching = 0
        self._seen_s = time.monotonic()

    # ---- as a websocket

    async def send_text(self, data: str) -> None:
        """Offer a message; returns when the page has fetched it."""
        await self._offer({"news": data})

    async def close(self, code: int = 1000, reason: str | None = None) -> None:
        """Close the page; returns when it has heard so."""
        await self._offer({"ended": [code, reason or ""]})
        self.leave()

    async def _offer(self, answer: dict[str, Any]) -> None:
        self._offered = answer
        self._taken.clear()
        self._there.set()
        await self._taken.wait()

    async def receive(self) -> dict[str, Any]:
        """The next message of the page, as a websocket gives it; a disconnection when the page has left."""
        while True:
            try:
                message = await asyncio.wait_for(self._said.get(), GONE_S)
            except TimeoutError:
                if self._fetching or time.monotonic() - self._seen_s <= GONE_S:
                    continue
                message = None
            if message is None:
                return {"type": "websocket.disconnect"}
            return {"type": "websocket.receive", "text": message}

    # ---- as the page asks

    async def fetch(self) -> dict[str, Any]:
        """The answer to a request for news: "news" (a message), "ended" (code and reason), or nothing after HOLD_S."""
        self._fetching += 1
        try:
            await asyncio.wait_for(self._there.wait(), HOLD_S)
        except TimeoutError:
            return {}
        finally:
            self._fetching -= 1
            self._seen_s = time.monotonic()
        answer, self._offered = self._offered, None
        self._there.clear()
        self._taken.set()
        return answer or {}

    def hear(self, message: str) -> bool:
        """Take a message of the page; returns whether there was room for it."""
        self._seen_s = time.monotonic()
        if self._said.qsize() >= MOST_UNREAD:
            return False
        self._said.put_nowait(message)
        return True

    def leave(self) -> None:
        """The page has left."""
        self._said.put_nowait(None)


class PolledPages:
    """The pages that poll, each under a key of its own.

    serve: serves an open page until it has left; full: says why no further page is served, "" if it is.
    """

    def __init__(self, serve: Callable[[PolledSocket], Coroutine[Any, Any, None]], full: Callable[[], str]) -> None:
        self._serve, self._full = serve, full
        self._pages: dict[str, tuple[PolledSocket, asyncio.Task[None]]] = {}

    def routes(self) -> Sequence[Route]:
        """The addresses at which a page opens itself, fetches its news, says something and leaves."""
        answers = {"open": self._open, "news": self._news, "say": self._say, "leave": self._leave}
        return [Route(f"/{name}", answer) for name, answer in answers.items()]

    async def _open(self, request: Request) -> Response:
        """A new page; it takes the place of the one whose key it names, as after a broken connection."""
        if (before := self._pages.get(request.query_params.get("instead", ""))) is not None:
            before[0].leave()
            await asyncio.wait([before[1]], timeout=HOLD_S)  # so that its seat is free
        if why := self._full():
            return PlainTextResponse(why, 503)
        key, socket = token_urlsafe(16), PolledSocket(request.query_params)
        task = asyncio.create_task(self._serve(socket))
        self._pages[key] = socket, task
        task.add_done_callback(lambda _: self._pages.pop(key))
        return JSONResponse({"page": key})

    async def _news(self, request: Request) -> Response:
        socket = self._of(request)
        return _gone() if socket is None else JSONResponse(await socket.fetch())

    async def _say(self, request: Request) -> Response:
        socket = self._of(request)
        if socket is None:
            return _gone()
        if not socket.hear(request.query_params.get("say", "")):
            return PlainTextResponse("This page says too much at once.\n", 429)
        return Response(status_code=204)

    async def _leave(self, request: Request) -> Response:
        if (socket := self._of(request)) is not None:
            socket.leave()
        return Response(status_code=204)

    def _of(self, request: Request) -> PolledSocket | None:
        page = self._pages.get(request.query_params.get("page", ""))
        return None if page is None else page[0]


def _gone() -> Response:
    return PlainTextResponse("This page was closed: open it again.\n", 410)
