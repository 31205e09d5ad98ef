"""A desk as the class's server sees it: the process with the lesson, and what its page shows.

The server is one of the pages of the desk's process: it only watches, and knows all parts of the document.
"""

import asyncio
import json
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from multiprocessing import get_all_start_methods, get_context
from multiprocessing.connection import Connection
from typing import Any, Literal

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, WebSocketException

from lab.classroom.desk_process import FINISH, DeskOrder, sit
from lab.seat.page.page_state import PARTS, PageContent
from lab.seat.page.teaching_page import TITLE

Json = dict[str, Any]
State = Literal["idle", "opening", "open", "over", "failed", "stopped", "lost"]
KEPT = ("lesson", "place", "robot", "question", "curve", "standing", "notices", "members", "work", "receipt", "ended")
AGAIN_S = 0.5  # after which a lost connection to the desk is made again
MOST_MESSAGE = 1 << 24  # bytes of the desk's messages
PRELOADED = ["lab.classroom.desk_process", "lab.skills.prepared_scene", "lab.learning.kernels"]


def processes() -> Any:
    """The way in which desks are started: copies of one process that has loaded the lab, where the system has that."""
    if "forkserver" not in get_all_start_methods():
        return get_context("spawn")
    context = get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    return context


def nothing_shown() -> Json:
    """The parts of a page's document before a lesson has begun."""
    empty = PageContent(TITLE)
    return {part: PARTS[part](empty, 0.0) for part in KEPT}


class Desk:
    """The process of one lesson, and its state; all methods are called in the server's event loop.

    on_news: called when the shown document or the state has changed. state: "idle" for a desk that has no process by intent.
    parts: the newest parts of the page's document, of a team that of the one who is first. questions: the pending questions by
    the names of those who teach together, "" for one pupil alone. people: these names, once the process has begun.
    result: the lesson's document, once it is over. text: why it failed.
    """

    def __init__(self, order: DeskOrder) -> None:
        self.order = order
        self.on_news: Callable[[], None] = lambda: None
        self.state: State = "opening"
        self.parts: Json = {}
        self.result: Mapping[str, Any] | None = None
        self.text = ""
        self.ready = asyncio.Event()  # the page answers, or never will
        self.questions: dict[str, Json] = {}
        self.people: tuple[str, ...] = ()
        self._addresses: dict[str, str] = {}
        self._loop = asyncio.get_running_loop()
        self._pipe: Connection | None = None
        self._process: Any = None
        self._watching: list[asyncio.Task[None]] = []
        self._turn, self._closed = asyncio.Lock(), False
        self._silent = asyncio.Event()  # the process has ended, and all that it said has been heard

    async def open(self, context: Any) -> None:
        """Start the process, unless the desk was closed meanwhile."""
        async with self._turn:
            if not self._closed:
                await asyncio.to_thread(self._start, context)

    def _start(self, context: Any) -> None:
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=sit, args=[self.order, other], daemon=True)
        self._process.start()
        other.close()
        threading.Thread(target=self._listen, args=[self._pipe], daemon=True).start()

    @property
    def is_closed(self) -> bool:
        """Whether the class has closed the desk, whose process then ends within seconds."""
        return self._closed

    @property
    def is_there(self) -> bool:
        """Whether the page of the process answers."""
        return bool(self._addresses)

    def finish(self) -> None:
        """Finish a run by hand: its document is made of what was done."""
        if self._pipe is not None:
            with suppress(OSError):
                self._pipe.send(FINISH)

    async def close(self) -> None:
        """End the process: the lesson is interrupted, and its journal holds every answer. Safe to call again."""
        self._closed = True
        async with self._turn:
            for watching in self._watching:
                watching.cancel()
            await asyncio.gather(*self._watching, return_exceptions=True)
            pipe, self._pipe = self._pipe, None
            if pipe is not None:
                with suppress(OSError):
                    pipe.send("close")
            if self._process is not None:
                await asyncio.to_thread(self._process.join)
                await self._silent.wait()
        self.ready.set()

    async def page(self, watches: bool = False, name: str = "") -> ClientConnection:
        """A further page of the process; watches: it never gets the seat by itself. Raises OSError if the process has ended.

        name: of one of those who teach together; whoever is not among them watches the page of the one who is first.
        """
        await self.ready.wait()
        if not self._addresses:
            raise OSError("the desk's process has ended")
        address = self._addresses.get(name)
        if address is None or watches:
            address = f"{address or next(iter(self._addresses.values()))}&watch"
        try:
            return await connect(address, max_size=MOST_MESSAGE, compression=None, proxy=None)
        except (WebSocketException, EOFError) as error:  # killed while it answered
            raise OSError(str(error)) from None

    # ---- what the process says

    def _listen(self, pipe: Connection) -> None:
        """Pass on what comes through the pipe; in a thread of its own."""
        with pipe, suppress(RuntimeError):  # the event loop has ended
            try:
                while True:
                    self._loop.call_soon_threadsafe(self._hear, pipe.recv())
            except (EOFError, OSError):
                self._loop.call_soon_threadsafe(self._ended)

    def _hear(self, said: tuple[Any, ...]) -> None:
        match said:
            case ("pages", dict(pages)):
                self._addresses = {
                    name: f"ws://127.0.0.1:{port}/frames?token={token}" for name, (port, token) in pages.items()
                }
                self.state, self.people = "open", tuple(self._addresses)
                self.ready.set()
                self._watching = [asyncio.create_task(self._watch(name)) for name in self._addresses]
            case ("over", document):
                self.state, self.result = "over", document
            case ("failed" | "stopped" as how, str(text)):
                self.state, self.text = how, text
        self.on_news()

    def _ended(self) -> None:
        """The process has ended; if nobody asked it to, it was killed."""
        if self.state in ("opening", "open"):
            self.state, self.text = "lost", "its process has ended"
        self._addresses = {}
        self.questions.clear()
        self.ready.set()
        self._silent.set()
        self.on_news()

    async def _watch(self, name: str) -> None:
        """Take over the parts of a page's document as they change, also after a connection that was lost under load.

        Of all pages but the first, only the question is taken over.
        """
        kept = KEPT if name == next(iter(self._addresses)) else ("question",)
        while self._addresses:
            with suppress(OSError, ConnectionClosed):
                async with await self.page(watches=True, name=name) as page:
                    async for message in page:
                        parts = json.loads(message).get("seat", {})
                        if new := {part: parts[part] for part in kept if part in parts}:
                            self._take(name, new, kept is KEPT)
            await asyncio.sleep(AGAIN_S)

    def _take(self, name: str, new: Json, is_first: bool) -> None:
        """Take over new parts of somebody's page."""
        if "question" in new:
            self.questions.pop(name, None)
            if new["question"] is not None:
                self.questions[name] = new["question"]
        if is_first:
            self.parts |= new
        self.on_news()
