"""A class in teams: who is asked, who watches, what the teacher sees, and that nothing of it is lost."""

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from lab.advice.entries import FILE, read_journal
from lab.classroom.class_place import Place
from lab.classroom.class_server import ClassServer
from lab.classroom.holding import closing
from lab.classroom.roster import Roster
from lab.errors import BadInput
from lab.teaching.kept_session import KeptSession
from lab.teaching.lesson import replay as replay_session
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.subjects import subject_of
from tests.classroom.conftest import WITHIN_S, answer, frames, join, seated, until

RIGHT, LEFT = 3, 2


@pytest.fixture
def roster(tmp_path: Path, lesson: LessonOptions) -> Roster:
    """A class of two lessons with two teams."""
    made = Roster.new(tmp_path / "class", [lesson, lesson], 0, 6, False)
    made.teams = 2
    return made


@pytest.fixture
def server(roster: Roster) -> Iterator[ClassServer]:
    with ClassServer(roster, Place()) as running:
        yield running


async def teaches(server: ClassServer, page: str, action: int, ends: str = "The lesson is over.") -> dict[str, Any]:
    """Answer each question with one action, or "skip" where it is not allowed, until the lesson is over; returns its parts."""
    known: dict[str, Any] = {}
    while True:  # the page is closed when the lesson begins: load again
        async with connect(frames(server, page), max_size=1 << 24, proxy=None) as opened:
            async for message in opened:
                parts = json.loads(message).get("seat", {})
                known |= parts
                if known.get("ended") == ends:
                    return known
                if (asks := parts.get("question")) and known.get("you", {}).get("seat"):
                    await answer(opened, asks, action)


def teach_all(server: ClassServer, pages: dict[str, int]) -> list[dict[str, Any]]:
    """The last parts of the pages, of pupils who each always say one thing."""

    async def all_of_them() -> list[dict[str, Any]]:
        taught = [asyncio.create_task(teaches(server, page, action)) for page, action in pages.items()]
        await asyncio.to_thread(server.call, server.room.begin_lessons)
        shown = await asyncio.wait_for(asyncio.gather(*taught), WITHIN_S)
        async with connect(server.teacher_url.replace("http", "ws").replace("/?", "/frames?"), proxy=None) as teacher:
            await until(teacher, lambda news: len(news.get("rows", ())) == len(server.room.teams()))
        return shown

    return asyncio.run(all_of_them())


def test_pupils_are_spread_over_the_teams(server: ClassServer) -> None:
    for _ in range(4):
        join(server)
    assert [pupil.team for pupil in server.roster.pupils] == [1, 2, 1, 2]
    assert [(team["name"], team["state"]) for team in server.call(server.room.teams)] == [
        ("team 1", "idle"),
        ("team 2", "idle"),
    ]


def test_each_team_has_a_learner_that_all_of_its_pupils_advise(server: ClassServer) -> None:
    pages = [join(server)["page"] for _ in range(4)]
    names = [pupil.name for pupil in server.roster.pupils]
    shown = teach_all(server, {pages[0]: RIGHT, pages[1]: RIGHT, pages[2]: RIGHT, pages[3]: LEFT})
    rows = server.call(server.room.rows)
    assert [(row["name"], row["solved"]) for row in rows if row["name"] == "team 1"] == [("team 1", True)]
    assert {row["name"] for row in rows} == {"team 1", "team 2"}
    journal = read_journal(server.roster.folder / "01-team-1" / "lesson-1", "test")
    assert journal.session.words["advisors"] == [f"web:{names[0]}", f"web:{names[2]}"]
    assert {entry.by for entry in journal.entries if hasattr(entry, "by")} == {f"web:{names[0]}", f"web:{names[2]}"}
    board = {team["name"]: [member["name"] for member in team["board"]] for team in server.call(server.room.teams)}
    assert board == {"team 1": [names[0], names[2]], "team 2": [names[1], names[3]]}
    assert [member["name"] for member in shown[1]["members"]] == [names[1], names[3]]


def test_a_teams_lesson_replays_bit_for_bit(server: ClassServer) -> None:
    teach_all(server, {join(server)["page"]: RIGHT, join(server)["page"]: RIGHT, join(server)["page"]: LEFT})
    folder = server.roster.folder / "01-team-1" / "lesson-1"
    kept = KeptSession(folder, "DIR", read_only=True)
    document = replay_session(kept, subject_of(kept.options, kept), lambda event: None)
    taught = json.loads((folder / "lesson.json").read_text())["document"]
    assert document["receipt"] == taught["receipt"]
    assert {voice["name"]: voice["said"] for voice in document["receipt"]["voices"]} != {}


def test_who_comes_late_watches_until_the_next_lesson(server: ClassServer) -> None:
    first = join(server)["page"]
    join(server)
    server.call(server.room.begin_lessons)

    async def late() -> None:
        async with connect(frames(server, first), max_size=1 << 24, proxy=None) as there:
            asks = await seated(there)
            third = await asyncio.to_thread(join, server)
            async with connect(frames(server, third["page"]), max_size=1 << 24, proxy=None) as watching:
                told = (await until(watching, lambda news: "class" in news))["class"]
                assert told["late"]
                assert told["fellows"] == [server.roster.pupils[0].name]
                await watching.send(json.dumps({"answer": {"question": asks["number"], "action": LEFT}}))
                assert "watch" in (await until(watching, lambda news: "refusal" in news))["refusal"]
            await answer(there, asks, RIGHT)
            await until(there, lambda news: (news.get("seat", {}).get("question") or asks)["number"] > asks["number"])
        await asyncio.to_thread(server.call, lambda: server.room.go_on(3))
        async with connect(frames(server, third["page"]), max_size=1 << 24, proxy=None) as sits:
            assert await seated(sits)

    asyncio.run(late())
    assert [pupil.lesson for pupil in server.roster.pupils] == [1, 0, 1]


def test_a_killed_server_leads_back_to_the_teams_open_question(server: ClassServer, roster: Roster) -> None:
    pages = [join(server)["page"] for _ in range(3)]
    server.call(server.room.begin_lessons)

    async def one_answer(where: ClassServer) -> int:
        async with connect(frames(where, pages[0]), max_size=1 << 24, proxy=None) as first:
            asks = await seated(first)
            await answer(first, asks, RIGHT)  # nobody else is there: the others are not waited for
            await until(first, lambda news: (news.get("seat", {}).get("question") or asks)["number"] > asks["number"])
        return int(asks["number"])

    asyncio.run(one_answer(server))
    server.stop()
    folder = roster.folder / "01-team-1" / "lesson-1"
    before = folder.joinpath(FILE).read_bytes()
    with ClassServer(Roster.read(roster.folder), Place()) as again:
        asyncio.run(one_answer(again))
    assert folder.joinpath(FILE).read_bytes().startswith(before)


def test_the_class_ends_with_a_page_for_each_team_also_after_a_pupil_was_removed(server: ClassServer) -> None:
    for _ in range(4):
        join(server)
    server.call(lambda: server.room.remove(1))
    server.call(lambda: server.room.remove(2))
    document = closing(server)
    known = [(team["name"], team["state"], Path(team["hand_out"]).parent.name) for team in document["pupils"]]
    assert known == [("team 1", "idle", "01-team-1"), ("team 2", "idle", "02-team-2")]


def test_lessons_begin_once(server: ClassServer) -> None:
    with pytest.raises(BadInput, match="nobody has joined"):
        server.call(server.room.begin_lessons)
    join(server)
    server.call(server.room.begin_lessons)
    with pytest.raises(BadInput, match="no team waits"):
        server.call(server.room.begin_lessons)
