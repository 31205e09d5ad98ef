"""The class's server: pupils join with a code and get their desk's page; the teacher's page shows and steers the class.

It passes messages between a pupil's browser and the desk's own page on the loopback, and looks into none of a pupil's.
"""

import asyncio
import datetime
import json
import secrets
import ssl
import threading
import time
from asyncio.sslproto import SSLProtocol
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn import Server as Uvicorn
from websockets.exceptions import ConnectionClosed

from lab.classroom.browser_socket import closer, sender, text_of
from lab.classroom.certificate import fingerprint, made_certificate
from lab.classroom.class_lesson import title_of
from lab.classroom.class_place import Place, files_of
from lab.classroom.class_report import page_now
from lab.classroom.code_picture import code_svg
from lab.classroom.desk import Desk, nothing_shown
from lab.classroom.desk_process import DRAWN_S, LAST_S
from lab.classroom.door import Door, Often
from lab.classroom.room import OVER, RELOAD, REMOVED, PupilPage, Room
from lab.classroom.rooms import obey, room_of
from lab.classroom.roster import Roster
from lab.classroom.step_pages import StepPages
from lab.classroom.study import Study
from lab.classroom.study_room import StudyRoom
from lab.classroom.tile import HAND_OUTS, REPORT
from lab.classroom.turn_record import columns_of
from lab.errors import BadInput, WorkFailed
from lab.files import csv_of
from lab.view.printed_page import POLICY
from lab.view.server import answer_of, config_of, listening
from lab.view.server_page import quiet_when_full

START_S = 10.0
STOP_S = DRAWN_S + LAST_S + 5.0  # the time that desks have for what is over, and a little more
AGAIN_S = 0.5  # after which a page whose desk was killed is told to load again
READ_S = 0.005  # least interval between two messages from a page
TILES_EVERY_S = 0.25
MOST_TEACHERS = 8  # open pages of the teacher
MOST_LOOKERS = 64  # pages that look over a shoulder
TLS_BYTES = 1 << 14  # read at once from a connection; asyncio would keep 256 KB for each, also before hands are shaken
MOST_OPENED, OPENED_S = 20, 10.0  # pages that a pupil may open in so many seconds
FREE, TAKEN = '"free": true', '"free": false'  # in a message about the seat
FRAMED_NOWHERE = f"{POLICY}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"


class ClassServer:
    """Serves a class until `stop`; a context manager. The event loop runs in a thread of its own.

    `join_url` is for pupils, `teacher_url` for the teacher alone. Raises BadInput for a port or address that is taken or not
    allowed, before anything is written; entering writes the roster and raises BadInput if it cannot, and WorkFailed.
    """

    def __init__(self, roster: Roster, place: Place, port: int = 0, study: Study | None = None) -> None:
        self.roster, self._place, self._study = roster, place, study
        self.fingerprint = ""  # of the certificate
        self._secured: dict[str, str] = {}  # uvicorn's names of its files
        if place.certificate is not None and place.key is not None:
            self._secure(place.certificate, place.key)
        self._socket = listening(port, place.address, "the class")
        self.port: int = self._socket.getsockname()[1]
        self._token = secrets.token_urlsafe(16)
        self.room: Room
        self.ended = threading.Event()  # the teacher's page has ended the class
        self._loop: asyncio.AbstractEventLoop
        self._stopped: asyncio.Event
        self._ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="class", daemon=True)
        self._teachers: dict[WebSocket, asyncio.Event] = {}
        self._door = Door(lambda code, name: self.room.join(code, name))
        self._opened: dict[int, Often] = {}  # by pupil
        base = f"{place.hosts[0]}:{self.port}"
        self.join_url = f"{place.scheme}://{base}/?code={roster.code}"
        self.teacher_url = f"{place.scheme}://{base}/teacher/?token={self._token}"
        self._told = {  # to the teacher's page, once
            "code": roster.code,
            "join": self.join_url,
            "picture": code_svg(self.join_url),
            "lessons": [title_of(lesson) for lesson in roster.lessons],
        }
        self._files = files_of(place.hosts, self.port, study is not None)

    def __enter__(self) -> "ClassServer":
        self.roster.port = self.port
        try:
            if self._study is not None:
                self._study.begin()
            self.roster.write()
        except OSError as error:
            raise BadInput(f"folder of the class '{self.roster.folder}': {error.strerror or error}") from None
        if self._place.secured and not self._secured:
            now = datetime.datetime.now(datetime.UTC)
            self._secure(*made_certificate(self.roster.folder, self._place.hosts, now))
        self._thread.start()
        if not self._ready.wait(START_S):
            raise WorkFailed(f"class: the server on port {self.port} did not start within {START_S} s")
        return self

    def _secure(self, certificate: Path, key: Path) -> None:
        self.fingerprint = fingerprint(certificate)
        self._secured = {"ssl_certfile": str(certificate), "ssl_keyfile": str(key)}
        try:
            ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(certificate, key, password="")
        except (OSError, ssl.SSLError) as error:
            raise BadInput(f"certificate '{certificate}' and key '{key}': {error}") from None

    def __exit__(self, *error: object) -> None:
        self.stop()

    def stop(self) -> None:
        """End the class: all lessons are kept, and pages are closed. Safe to call again."""
        if self._thread.is_alive():
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._stopped.set)
            self._thread.join(STOP_S)

    def call(self, function: Callable[[], Any], wait_s: float = START_S) -> Any:
        """The result of a function of the room, called in the server's event loop from another thread.

        Raises TimeoutError if it does not come within `wait_s` [s].
        """

        async def called() -> Any:
            return function()

        return asyncio.run_coroutine_threadsafe(called(), self._loop).result(wait_s)

    async def _serve(self) -> None:
        self._loop, self._stopped = asyncio.get_running_loop(), asyncio.Event()
        self._loop.set_exception_handler(quiet_when_full)
        self.room = room_of(self.roster, self._study)
        self.room.on_news = self._stir
        config = config_of(self._application(), self._socket, **self._secured)
        config.load()
        if config.ssl is not None:
            SSLProtocol.max_size = TLS_BYTES
            config.ssl.minimum_version = ssl.TLSVersion.TLSv1_2
            config.ssl.options |= ssl.OP_NO_RENEGOTIATION
        server = Uvicorn(config)
        serving = asyncio.create_task(server.serve(sockets=[self._socket]))
        self.room.begin()
        self._ready.set()
        await self._stopped.wait()
        await self.room.end()
        server.should_exit = True
        await serving
        for connection in list(server.server_state.connections):
            connection.transport.abort()
        self._socket.close()
        await asyncio.sleep(0)

    # ---- what is served

    def _application(self) -> Starlette:
        guards = [Middleware(TrustedHostMiddleware, allowed_hosts=self._place.hosts, www_redirect=False)]
        routes = [
            Route("/join", self._join, methods=["POST"]),
            *(StepPages(self.room, self._from_here).routes() if isinstance(self.room, StudyRoom) else ()),
            Route("/teacher/class.csv", self._table),
            Route(f"/teacher/{REPORT}", self._report),
            Route(f"/teacher/{HAND_OUTS}", self._report),
            WebSocketRoute("/teacher/frames", self._teach),
            WebSocketRoute("/desk/frames", self._sit),
            Route("/{room}/", self._file),
            Route("/{room}/{name}", self._file),
            Route("/", self._file),
            Route("/{name}", self._file),
        ]
        return Starlette(routes=routes, middleware=guards)

    async def _file(self, request: Request) -> Response:
        """A page or file of the class; none of them holds anything of the class itself."""
        files = self._files.get(request.path_params.get("room", ""), {})
        file = files.get(request.path_params.get("name", ""))
        if file is None:
            return PlainTextResponse("There is no such page.\n", 404)
        return answer_of(file)

    async def _table(self, request: Request) -> Response:
        if not self._is_teacher(request):
            return PlainTextResponse("This page needs the token of the teacher's address.\n", 403)
        return Response(csv_of(self.room.rows(), columns_of(self.roster)), media_type="text/csv")

    async def _report(self, request: Request) -> Response:
        """The report or the hand-outs of the class at this moment."""
        if not self._is_teacher(request):
            return PlainTextResponse("This page needs the token of the teacher's address.\n", 403)
        page = await asyncio.to_thread(page_now, self.roster, request.url.path.rpartition("/")[2])
        return Response(page, headers={"Content-Security-Policy": FRAMED_NOWHERE}, media_type="text/html")

    # ---- who may

    def _is_teacher(self, asked: HTTPConnection) -> bool:
        return secrets.compare_digest(asked.query_params.get("token", "").encode(), self._token.encode())

    def _from_here(self, asked: HTTPConnection) -> bool:
        """Whether a page of this server asks, or a program that is no browser."""
        origin = asked.headers.get("origin")
        return origin is None or urlsplit(origin)[:2] == (self._place.scheme, asked.headers.get("host", ""))

    async def _join(self, request: Request) -> Response:
        """A new pupil's address, for the right code."""
        if not self._from_here(request):
            return PlainTextResponse("Another site's page may not join.\n", 403)
        return await self._door.join(request)

    # ---- a pupil's page, and one that looks over a shoulder

    async def _sit(self, browser: WebSocket) -> None:
        pupil = self.roster.of_key(browser.query_params.get("token", ""))
        if not self._from_here(browser) or (pupil is None and not self._is_teacher(browser)):
            await browser.send_denial_response(PlainTextResponse("This page needs the whole link.\n", 403))
            return
        if pupil is None:
            await self._look(browser)
            return
        opened, now_s = self._opened.setdefault(pupil.number, Often(MOST_OPENED, OPENED_S)), time.monotonic()
        if opened.is_full(now_s):
            await browser.send_denial_response(PlainTextResponse("This page is opened too often: wait.\n", 429))
            return
        opened.happened(now_s)
        await browser.accept()
        page = PupilPage(pupil.number, sender(browser), closer(browser))
        self.room.arrived(page)
        try:
            await self._pass_on(browser, page, sits=True)
        finally:
            self.room.left(page)

    async def _look(self, browser: WebSocket) -> None:
        """A page of the teacher at a pupil's desk: it watches, and answers while it helps."""
        asked = browser.query_params.get("pupil", "")
        number = int(asked) if asked.isdecimal() and len(asked) < 4 else 0
        if number not in self.room.desks or len(self.room.shoulders) >= MOST_LOOKERS:
            await browser.send_denial_response(PlainTextResponse("There is no such pupil, or too many look on.\n", 404))
            return
        await browser.accept()
        page = PupilPage(number, sender(browser), closer(browser))
        self.room.shoulders.add(page)
        try:
            await self._pass_on(browser, page, sits=False)
        finally:
            self.room.shoulders.discard(page)

    async def _pass_on(self, browser: WebSocket, page: PupilPage, sits: bool) -> None:
        """Pass messages between a browser and its desk, until one of them leaves."""
        desk = self.room.desks.get(page.number)
        if desk is None:
            await page.close(REMOVED)
            return
        try:
            upstream = await desk.page(not sits, self.room.name_at(page.number))
        except OSError:
            if desk.is_closed or desk.state in ("idle", "over", "failed", "stopped"):
                await self._show_last(browser, page, desk)
            else:  # it was killed, and is started again
                await asyncio.sleep(AGAIN_S)
                await page.close(RELOAD)
            return
        async with upstream:

            async def say(message: Any) -> None:
                with suppress(ConnectionClosed):
                    await upstream.send(json.dumps(message))

            page.say = say
            down = asyncio.create_task(self._down(upstream, page, sits))
            up = asyncio.create_task(self._up(browser, upstream, page))
            try:
                await asyncio.wait([down, up], return_when=asyncio.FIRST_COMPLETED)
            finally:
                down.cancel()
                up.cancel()
                await asyncio.gather(down, up, return_exceptions=True)
        await page.close(OVER if self.room.ended.is_set() else RELOAD)

    async def _show_last(self, browser: WebSocket, page: PupilPage, desk: Desk) -> None:
        """Show how a lesson ended whose process is not there any more, until the browser leaves."""
        shown = nothing_shown() | desk.parts | {"you": {"seat": False, "free": False, "pages": 1}}
        if desk.state != "over":
            asks_nobody = {"lesson": desk.parts["lesson"] | {"asks": False}} if desk.parts.get("lesson") else {}
            shown |= asks_nobody | {"question": None, "ended": self.room.closed_text(page.number)}
        await page.send(json.dumps({"seat": shown}))
        with suppress(WebSocketDisconnect):
            while True:
                await text_of(browser)

    async def _down(self, upstream: Any, page: PupilPage, sits: bool) -> None:
        with suppress(ConnectionClosed):
            async for message in upstream:
                await page.send(message)
                if FREE in message or TAKEN in message:
                    page.sees_free = FREE in message
                if sits and FREE in message and self.room.takes_free_seat(page.number):
                    await page.say({"seat": "take"})

    async def _up(self, browser: WebSocket, upstream: Any, page: PupilPage) -> None:
        with suppress(WebSocketDisconnect, ConnectionClosed):
            while True:
                message = await text_of(browser)
                if await self.room.passes(page, message):
                    await upstream.send(message)
                await asyncio.sleep(READ_S)

    # ---- the teacher's page

    async def _teach(self, browser: WebSocket) -> None:
        if not (self._from_here(browser) and self._is_teacher(browser)) or len(self._teachers) >= MOST_TEACHERS:
            await browser.send_denial_response(PlainTextResponse("This page needs the teacher's whole link.\n", 403))
            return
        await browser.accept()
        stirred = self._teachers[browser] = asyncio.Event()
        telling = asyncio.create_task(self._tell(browser, stirred))
        try:
            with suppress(WebSocketDisconnect):
                while True:
                    await self._do(await text_of(browser), browser)
                    await asyncio.sleep(READ_S)
        finally:
            telling.cancel()
            del self._teachers[browser]

    def _stir(self) -> None:
        for stirred in self._teachers.values():
            stirred.set()

    async def _tell(self, browser: WebSocket, stirred: asyncio.Event) -> None:
        """Send the tiles and rows that have changed, a few times a second."""
        send = sender(browser)
        seen, told = dict[int, Any](), dict[str, Any]()
        while True:
            stirred.clear()
            tiles, now = (
                self.room.tiles(),
                {"place": self._told, "class": self._known(), "rows": self.room.rows(), "teams": self.room.teams()},
            )
            news = {part: value for part, value in now.items() if told.get(part) != value}
            changed = [tile for number, tile in tiles.items() if seen.get(number) != tile]
            gone = [number for number in seen if number not in tiles]
            seen, told = tiles, now
            if changed or news or gone:
                await send(json.dumps(news | {"tiles": changed, "gone": gone}))
            await asyncio.sleep(TILES_EVERY_S)
            with suppress(TimeoutError):  # the time that questions have waited changes by itself
                await asyncio.wait_for(stirred.wait(), 1.0)

    def _known(self) -> dict[str, Any]:
        return {
            "paused": self.room.paused,
            "study": None if self._study is None else self._study.told(),
            "turns": self.room.turns(),
            "open": self._door.is_open,
            "tried": self._door.tried,
        }

    async def _do(self, message: str, browser: WebSocket) -> None:
        """Carry out what the teacher's page wants; a wrong message is answered with why."""
        try:
            match json.loads(message):
                case {"do": "door", "open": bool(is_open)}:
                    self._door.is_open = is_open
                    self._stir()
                case {"do": "end"}:
                    self.ended.set()
                case said:
                    obey(self.room, said)
        except (BadInput, ValueError, RecursionError) as error:
            await sender(browser)(json.dumps({"refusal": str(error)}))
        except OSError as error:
            await sender(browser)(json.dumps({"refusal": f"The class cannot be written: {error.strerror}."}))
