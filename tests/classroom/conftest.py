"""What the tests of a class stand on: a world of three cells, and a pupil who is a program."""

import asyncio
import json
from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosedError

from lab.classroom.class_place import Place
from lab.classroom.class_server import ClassServer
from lab.classroom.roster import Roster
from lab.teaching.lesson_options import LessonOptions

Json = dict[str, Any]
WITHIN_S = 60.0  # after which a test gives up, on a machine that is busy
MAP = "S.G\n...\n"


@pytest.fixture
def lesson(tmp_path: Path) -> LessonOptions:
    """A lesson of three episodes in a world of six cells, in which the learner always asks."""
    (tmp_path / "small.txt").write_text(MAP)
    return LessonOptions(str(tmp_path / "small.txt"), gate="always", advisors=("web",), episodes=3)


@pytest.fixture
def server(tmp_path: Path, lesson: LessonOptions) -> Iterator[ClassServer]:
    """A class of two lessons with three seats."""
    with ClassServer(Roster.new(tmp_path / "class", [lesson, lesson], 0, 3, False), Place()) as running:
        yield running


def asked(server: ClassServer, path: str, body: object = None, **headers: str) -> tuple[int, Any]:
    """The status and the content of a request."""
    data = None if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    try:
        with urlopen(
            Request(f"http://127.0.0.1:{server.port}{path}", data=data, headers=headers), timeout=WITHIN_S
        ) as got:
            return got.status, got.read()
    except HTTPError as error:
        return error.code, error.read()


def join(server: ClassServer, **more: str) -> Json:
    """What the server says to a pupil with the right code."""
    status, said = asked(server, "/join", {"code": server.roster.code, **more})
    assert status == 200
    return dict(json.loads(said))


def frames(server: ClassServer, page: str) -> str:
    """The address of the websocket of a page."""
    return f"ws://127.0.0.1:{server.port}{page.replace('/?', '/frames?')}"


async def until(page: ClientConnection, wanted: Callable[[Json], object]) -> Json:
    """The first message of a page that is wanted."""

    async def heard() -> Json:
        while True:
            news = json.loads(await page.recv())
            if wanted(news):
                return dict(news)

    return await asyncio.wait_for(heard(), WITHIN_S)


async def code_of_closing(page: ClientConnection) -> int | None:
    """The code with which the server closes a page, after what it still sends."""

    async def ended() -> None:
        with suppress(ConnectionClosedError):
            async for _ in page:
                pass

    await asyncio.wait_for(ended(), WITHIN_S)
    return page.close_code


async def question(page: ClientConnection) -> Json:
    """The next question on a page."""
    return dict((await until(page, lambda news: news.get("seat", {}).get("question")))["seat"]["question"])


async def seated(page: ClientConnection) -> Json:
    """The question on a page that has just been opened, once it may be answered there."""
    known: Json = {}

    def both(news: Json) -> bool:
        known.update(news.get("seat", {}))
        return bool(known.get("question") and known.get("you", {}).get("seat"))

    await until(page, both)
    return dict(known["question"])


async def answer(page: ClientConnection, asks: Json, action: int) -> None:
    """Answer a question."""
    await page.send(json.dumps({"answer": {"question": asks["number"], "action": action}}))


def at_page(server: ClassServer, page: str, do: Callable[[ClientConnection], Awaitable[Any]]) -> Any:
    """The result of what is done with an open page."""

    async def done() -> Any:
        async with connect(frames(server, page), max_size=1 << 24, proxy=None) as opened:
            return await do(opened)

    return asyncio.run(done())
