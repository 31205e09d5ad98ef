"""A run by hand in turns: who operates, what onlookers may do, how the turn passes, and what is kept of it."""

import asyncio
import json
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect

from lab.classroom import turn_room
from lab.classroom.class_place import Place
from lab.classroom.class_report import write_report
from lab.classroom.class_server import ClassServer
from lab.classroom.roster import Roster
from lab.classroom.turn_record import COMMANDS, RUN
from lab.classroom.turn_room import HAND_OVER, TurnRoom
from lab.errors import BadInput
from lab.production.run_journal import Commanded, read_run
from lab.production.run_options import RunOptions
from tests.classroom.conftest import frames, join, until

Json = dict[str, Any]
ONE_SLICE = RunOptions("toast", toasts=1, advisors=("expert",))


@pytest.fixture
def roster(tmp_path: Path) -> Roster:
    return Roster.new(tmp_path / "class", [ONE_SLICE], 0, 4, False)


@pytest.fixture
def server(roster: Roster) -> Iterator[ClassServer]:
    with ClassServer(roster, Place()) as running:
        yield running


class Pupil:
    """A pupil who is a program, at an open page; what the page has shown is in `seat` and `told`."""

    def __init__(self, page: ClientConnection) -> None:
        self._page, self.seat, self.told, self.refusal = page, Json(), Json(), ""

    async def sees(self, wanted: "Callable[[Pupil], object]") -> None:
        """Hear the page until it shows what is wanted."""

        def taken(news: Json) -> object:
            self.seat |= news.get("seat", {})
            self.told |= news.get("class", {})
            self.refusal = news.get("refusal", "")
            return wanted(self)

        await until(self._page, taken)

    async def operates(self) -> None:
        """Wait until this page has the seat of a run that is laid out."""
        await self.sees(lambda at: at.seat.get("you", {}).get("seat") and at.is_still)

    @property
    def is_still(self) -> bool:
        """Whether the scene is laid out, and no command is carried out."""
        return bool(self.seat.get("run")) and not self.seat["run"]["busy"]

    @property
    def done(self) -> list[str]:
        """The commands with results, as the page shows them."""
        return [done["words"] for done in self.seat["run"]["done"]] if self.seat.get("run") else []

    async def say(self, message: Json | str) -> None:
        await self._page.send(message if isinstance(message, str) else json.dumps(message))

    async def command(self, words: str) -> None:
        """Give a command, and wait until it is done."""
        await self.say({"command": words})
        await self.sees(lambda at: words in at.done and at.is_still)


def room(server: ClassServer) -> TurnRoom:
    assert isinstance(server.room, TurnRoom)
    return server.room


def at_pages(server: ClassServer, pages: list[str], do: Callable[..., Awaitable[None]], begins: bool = False) -> None:
    """What is done with the open pages of pupils; begins: the run begins first."""

    async def done() -> None:
        if begins:
            await asyncio.to_thread(server.call, server.room.begin_lessons)
        async with AsyncExitStack() as stack:
            pupils = []
            for page in pages:  # one after another: the first one gets the first turn
                opened = connect(frames(server, page), max_size=1 << 24, proxy=None)
                pupils.append(Pupil(await stack.enter_async_context(opened)))
                await pupils[-1].sees(lambda at: at.told.get("turn"))
            await do(*pupils)

    asyncio.run(done())


def test_only_the_pupil_whose_turn_it_is_operates_and_anybody_stops(server: ClassServer) -> None:
    pages = [join(server)["page"] for _ in range(2)]
    names = [pupil.name for pupil in server.roster.pupils]

    async def operate(first: Pupil, second: Pupil) -> None:
        await first.operates()
        assert first.told["turn"] | {"left_s": None} == {
            "name": names[0],
            "yours": True,
            "before": 0,
            "next": names[1],
            "left_s": None,
        }
        assert second.told["turn"]["yours"] is False
        await first.command("jog +z 20")
        await second.say({"command": "jog +x 20"})
        await second.sees(lambda at: f"{names[0]}'s turn" in at.refusal)
        await second.say({"seat": "take"})
        await second.sees(lambda at: f"{names[0]}'s turn" in at.refusal)
        await second.say({"command": "stop"})
        await first.sees(lambda at: at.seat.get("held", {}).get("kind") == "emergency")
        assert first.seat["held"]["by"] == "onlooker"

    at_pages(server, pages, operate, begins=True)
    tiles = server.call(room(server).tiles)
    assert {number: tile["commands"] for number, tile in tiles.items()} == {1: 1, 2: 1}
    lines = [json.loads(line) for line in (server.roster.folder / RUN / COMMANDS).read_text().splitlines()]
    assert lines == [{"pupil": 1, "command": "jog +z 20"}, {"pupil": 2, "command": "stop"}]


@pytest.mark.slow
def test_the_turn_passes_by_handing_over_and_by_the_teacher(server: ClassServer) -> None:
    pages = [join(server)["page"] for _ in range(3)]

    async def operate(first: Pupil, second: Pupil, third: Pupil) -> None:
        await first.operates()
        await second.sees(lambda at: at.told["turn"]["before"] == 0)
        await third.sees(lambda at: at.told["turn"]["before"] == 1)
        await first.say(HAND_OVER)
        await second.operates()
        await second.command("jog +z 20")
        await asyncio.to_thread(server.call, lambda: room(server).give_turn(1))
        await first.sees(lambda at: at.told["turn"]["yours"])
        await first.operates()
        await first.command("jog +x 20")

    at_pages(server, pages, operate, begins=True)
    assert {number: tile["commands"] for number, tile in server.call(room(server).tiles).items()} == {1: 1, 2: 1, 3: 0}


@pytest.mark.slow
def test_a_turn_ends_with_its_time(roster: Roster) -> None:
    roster.turn_s = 0.5
    with ClassServer(roster, Place()) as server:
        pages = [join(server)["page"] for _ in range(2)]

        async def operate(first: Pupil, second: Pupil) -> None:
            for pupil in (first, second, first):
                await pupil.sees(lambda at: at.told["turn"]["yours"] and at.told["turn"]["left_s"] is not None)

        at_pages(server, pages, operate, begins=True)
    assert Roster.read(roster.folder).turn_s == 0.5


@pytest.mark.slow
def test_the_turn_of_a_pupil_who_has_gone_passes_on(server: ClassServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(turn_room, "AWAY_S", 0.01)
    pages = [join(server)["page"] for _ in range(2)]

    async def operate(second: Pupil) -> None:
        async with connect(frames(server, pages[0]), max_size=1 << 24, proxy=None) as opened:
            first = Pupil(opened)
            await first.sees(lambda at: at.told.get("turn"))
            await asyncio.to_thread(server.call, lambda: room(server).give_turn(1))
            await first.operates()
        await second.sees(lambda at: at.told["turn"] and at.told["turn"]["yours"])
        await second.operates()

    at_pages(server, pages[1:], operate, begins=True)


@pytest.mark.slow
def test_a_killed_server_goes_on_with_the_run(server: ClassServer, roster: Roster) -> None:
    pages = [join(server)["page"] for _ in range(2)]

    async def jog(first: Pupil, second: Pupil) -> None:
        await first.operates()
        await first.command("jog +z 20")

    async def finish(first: Pupil, second: Pupil) -> None:
        await first.operates()
        assert first.done == ["jog +z 20"]
        await first.say(HAND_OVER)
        await second.operates()
        await second.command("jog +x 20")
        await asyncio.to_thread(server.call, room(server).finish)
        await second.sees(lambda at: at.seat.get("ended"))

    at_pages(server, pages, jog, begins=True)
    server.stop()
    with ClassServer(Roster.read(roster.folder), Place()) as server:
        at_pages(server, pages, finish)

        async def over() -> None:
            async with connect(server.teacher_url.replace("http", "ws").replace("/?", "/frames?"), proxy=None) as page:
                await until(page, lambda news: news.get("rows"))

        asyncio.run(over())
        rows = server.call(room(server).rows)
    assert [(row["name"], row["delivered"], row["parts"], row["solved"], row["commands"]) for row in rows] == [
        (pupil.name, 0, 1, False, 1) for pupil in roster.pupils
    ]
    _, entries, _ = read_run(roster.folder / RUN, "test")
    assert [entry.words for entry in entries if isinstance(entry, Commanded)] == ["jog +z 20", "jog +x 20"]
    assert write_report(Roster.read(roster.folder))["rows"] == rows
    assert (roster.folder / "class.csv").read_text().splitlines() == [
        "pupil,name,lesson,skill,state,solved,delivered,parts,commands",
        *(f"{pupil.number},{pupil.name},1,toast by hand,over,False,0,1,1" for pupil in roster.pupils),
    ]


def test_before_the_run_nobody_operates(server: ClassServer) -> None:
    for do in (room(server).begin_lessons, room(server).finish):
        with pytest.raises(BadInput):
            server.call(do)
    join(server)
    with pytest.raises(BadInput, match="not under way"):
        server.call(lambda: room(server).give_turn(1))
    with pytest.raises(BadInput, match="only lesson"):
        server.call(lambda: room(server).go_on(1))
    with pytest.raises(BadInput, match="give somebody the turn"):
        server.call(lambda: room(server).help(1, True))
    assert not (server.roster.folder / RUN).exists()
