"""A class with real lessons in their own processes, and pupils and teachers that are programs."""

import asyncio
import json
import os
import signal
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosedError, InvalidStatus

from lab.advice.answer_times import read_times
from lab.classroom import class_server
from lab.classroom.class_place import Place
from lab.classroom.class_server import ClassServer
from lab.classroom.door import WRONG
from lab.classroom.room import PupilPage, Room
from lab.classroom.roster import Roster
from lab.seat.lesson_seat import LessonSeat
from lab.seat.run_progress import RunProgress
from lab.teaching.lesson import teach
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.subjects import subject_of
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from lab.view.progress import EscapingConsole
from tests.classroom.conftest import answer, asked, at_page, code_of_closing, frames, join, question, seated, until

Json = dict[str, Any]
ORIGIN = "https://elsewhere.example"


async def taught(page: ClientConnection) -> Json:
    """Answer every question with the learner's own choice; the receipt at the end."""
    receipt: Json = {}
    while True:
        news = await until(page, lambda news: {*news.get("seat", {})} & {"question", "receipt", "ended"})
        parts = news["seat"]
        receipt = parts.get("receipt") or receipt
        if parts.get("ended"):
            return receipt
        if parts.get("question"):
            await answer(page, parts["question"], parts["question"]["own"])


def test_a_lesson_in_a_class_is_the_lesson_alone(server: ClassServer, lesson: LessonOptions, tmp_path: Path) -> None:
    """The same answers give the same journal, but for the times at which they came."""
    receipt = at_page(server, join(server)["page"], taught)
    seat = LessonSeat(RunProgress(EscapingConsole(quiet=True)), None, None)
    own = {"web": lambda request: request.own}
    box = Toolbox(str(tmp_path / "box"))
    teach(subject_of(lesson), lesson, Teacher(box, lesson.advising(own), lesson.seed, seat.hear), tmp_path / "alone")
    pupil = server.roster.pupils[0]
    there = server.roster.folder / pupil.folder / "lesson-1"
    assert entries(there) == entries(tmp_path / "alone")
    assert receipt["taken"] == json.loads((tmp_path / "alone" / "receipt.json").read_text())["taken"]


def entries(folder: Path) -> list[Json]:
    lines = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    return [{name: value for name, value in line.items() if name not in ("seconds", "time", "at")} for line in lines]


def test_pupils_have_learners_of_their_own(server: ClassServer) -> None:
    pages = [join(server)["page"] for _ in range(2)]

    async def both() -> list[str]:
        async with connect(frames(server, pages[0])) as one, connect(frames(server, pages[1])) as two:
            first = await seated(one)
            await question(two)
            await answer(one, first, first["own"])
            return [(await question(one))["title"], first["title"]]

    later, first = asyncio.run(both())
    assert later != first
    assert at_page(server, pages[1], question)["title"] == first


def reopened(server: ClassServer, page: str) -> Json:
    """The question on a page that loads itself again as often as it is told to, as browsers do."""
    while True:
        try:
            return dict(at_page(server, page, question))
        except ConnectionClosedError as closed:
            if closed.rcvd is None or closed.rcvd.code != 4001:
                raise


def test_a_closed_lid_and_a_killed_process_lead_back_to_the_open_question(server: ClassServer) -> None:
    page = join(server)["page"]

    async def two(opened: ClientConnection) -> Json:
        asks = await seated(opened)
        for _ in range(2):
            await answer(opened, asks, asks["own"])
            asks = await question(opened)
        return asks

    open_question = at_page(server, page, two)
    assert at_page(server, page, question)["title"] == open_question["title"]
    process = server.call(lambda: server.room.desks[1]._process.pid)

    async def killed(opened: ClientConnection) -> int | None:
        os.kill(process, getattr(signal, "SIGKILL", signal.SIGTERM))
        return await code_of_closing(opened)

    assert at_page(server, page, killed) == 4001
    again = reopened(server, page)
    assert (again["title"], again["own"]) == (open_question["title"], open_question["own"])


def test_a_class_goes_on_after_its_server_has_ended(server: ClassServer) -> None:
    page = join(server)["page"]

    async def one(opened: ClientConnection) -> Json:
        asks = await seated(opened)
        await answer(opened, asks, asks["own"])
        return await question(opened)

    open_question = at_page(server, page, one)
    server.stop()
    with ClassServer(Roster.read(server.roster.folder), Place()) as again:
        assert at_page(again, page, question)["title"] == open_question["title"]


def test_a_second_window_takes_over_from_the_first(server: ClassServer) -> None:
    page = join(server)["page"]

    async def twice() -> int | None:
        async with connect(frames(server, page)) as one:
            await question(one)
            async with connect(frames(server, page)) as two:
                asks = await seated(two)
                await answer(two, asks, asks["own"])
                await question(two)
                return await code_of_closing(one)

    assert asyncio.run(twice()) == 4002


# ---- the teacher


def teacher(server: ClassServer) -> str:
    return server.teacher_url.partition(str(server.port))[2]


async def told(page: ClientConnection, number: int, wanted: Any) -> Json:
    """The first tile of a pupil that is wanted."""

    def of(news: Json) -> list[Json]:
        return [tile for tile in news.get("tiles", []) if tile["number"] == number and wanted(tile)]

    return of(await until(page, of))[0]


async def does(page: ClientConnection, **what: Any) -> None:
    await page.send(json.dumps(what))


def test_the_teacher_sees_pauses_hints_helps_and_goes_on(server: ClassServer) -> None:
    server.roster.times = True
    said = join(server)

    async def seen() -> None:
        async with connect(frames(server, teacher(server))) as desk, connect(frames(server, said["page"])) as pupil:
            asks = await seated(pupil)
            tile = await told(desk, 1, lambda tile: tile["asks"])
            assert (tile["name"], tile["here"], tile["lesson"]) == (said["name"], True, 1)
            await does(desk, do="pause", on=True)
            await until(pupil, lambda news: news.get("class", {}).get("paused"))
            await answer(pupil, asks, asks["own"])
            assert "paused" in (await until(pupil, lambda news: news.get("refusal")))["refusal"]
            await does(desk, do="pause", on=False)
            await until(pupil, lambda news: news.get("class", {}).get("paused") is False)
            await does(desk, do="hint", pupil=1, text="<b>left</b>")
            assert (await until(pupil, lambda news: news.get("class", {}).get("hint")))["class"][
                "hint"
            ] == "<b>left</b>"
            await helped(desk, pupil, asks)
            await does(desk, do="next", pupil=1)
            assert await code_of_closing(pupil) == 4001
            assert (await told(desk, 1, lambda tile: tile["lesson"] == 2 and tile["asks"]))["taken"] == 0

    async def helped(desk: ClientConnection, pupil: ClientConnection, asks: Json) -> None:
        await does(desk, do="help", pupil=1, on=True)
        await until(pupil, lambda news: news.get("class", {}).get("helped"))
        await answer(pupil, asks, asks["own"])
        assert "answers for you" in (await until(pupil, lambda news: news.get("refusal")))["refusal"]
        async with connect(frames(server, f"{teacher(server).replace('teacher', 'desk')}&pupil=1")) as shoulder:
            await until(shoulder, lambda news: news.get("seat", {}).get("you", {}).get("free"))
            await shoulder.send(json.dumps({"seat": "take"}))
            await answer(shoulder, asks, asks["own"])
            assert (await question(shoulder))["number"] == asks["number"] + 1
        await does(desk, do="help", pupil=1, on=False)
        await until(pupil, lambda news: news.get("seat", {}).get("you", {}).get("seat"))

    asyncio.run(seen())
    assert server.roster.pupils[0].lesson == 1
    times = read_times(server.roster.folder / server.roster.pupils[0].folder / "lesson-1")
    assert [time.seen["page"]["helped"] for time in times.values()] == [True]


def test_a_finished_lesson_is_a_row_of_the_table_and_is_shown_again(server: ClassServer) -> None:
    page = join(server)["page"]
    at_page(server, page, taught)
    at_page(server, teacher(server), lambda opened: until(opened, lambda news: news.get("rows")))
    status, table = asked(server, f"/teacher/class.csv{teacher(server).partition('/teacher/')[2]}")
    head, row = table.decode().splitlines()
    assert status == 200
    assert dict(zip(head.split(","), row.split(","), strict=True))["state"] == "over"
    for name in ("report.html", "hand-outs.html"):
        status, written = asked(server, f"/teacher/{name}{teacher(server).partition('/teacher/')[2]}")
        assert (status, server.roster.pupils[0].name in written.decode()) == (200, True)
    server.stop()
    with ClassServer(Roster.read(server.roster.folder), Place()) as again:
        shown = at_page(again, page, lambda opened: until(opened, lambda news: news.get("seat", {}).get("receipt")))
        assert shown["seat"]["ended"]
        assert again.call(lambda: [row["state"] for row in again.room.rows()]) == ["over"]


@pytest.mark.slow
def test_a_lesson_that_ended_as_its_desk_was_killed_is_made_again_from_its_journal(server: ClassServer) -> None:
    page = join(server)["page"]
    at_page(server, page, taught)
    at_page(server, teacher(server), lambda opened: until(opened, lambda news: news.get("rows")))
    before = server.call(server.room.rows)
    journal = server.room.folder(server.roster.pupils[0], 0) / "events.jsonl"
    written = journal.read_bytes()
    server.stop()
    (journal.parent / "lesson.json").unlink()
    with ClassServer(Roster.read(server.roster.folder), Place()) as again:
        at_page(again, teacher(again), lambda opened: until(opened, lambda news: news.get("rows")))
        assert again.call(again.room.rows) == before
    assert journal.read_bytes() == written


def test_a_pupil_gets_the_seat_back_when_help_ends_also_after_the_helping_page_was_closed(
    tmp_path: Path, lesson: LessonOptions
) -> None:
    said: list[Json] = []

    async def say(message: Any) -> None:
        said.append(message)

    async def helped_twice() -> None:
        roster = Roster.new(tmp_path / "class", [lesson], 0, 3, False)
        roster.join(roster.code)
        room, page = Room(roster), PupilPage(1, say, say, say)
        room.pages[1] = page
        for page.sees_free in (True, False):  # the teacher's page was closed; it has the seat still
            room.help(1, True)
            room.help(1, False)
        await room.end()

    asyncio.run(helped_twice())
    assert [message for message in said if "seat" in message] == [{"seat": "give"}, {"seat": "take"}, {"seat": "give"}]


@pytest.mark.parametrize(
    "message",
    [
        "",
        "[]",
        "{}",
        '{"do": "next", "pupil": 7}',
        '{"do": "hint", "pupil": 0, "text": ""}',
        '{"do": "open", "pupil": 9}',
        "[" * 9999,
    ],
)
def test_a_wrong_wish_of_the_teacher_is_answered(server: ClassServer, message: str) -> None:
    async def wished(page: ClientConnection) -> Json:
        await page.send(message)
        return await until(page, lambda news: news.get("refusal"))

    assert at_page(server, teacher(server), wished)["refusal"]


def test_the_teacher_closes_the_door_and_takes_a_seat_away(server: ClassServer) -> None:
    page = join(server)["page"]

    async def swept() -> int | None:
        async with connect(frames(server, teacher(server))) as desk, connect(frames(server, page)) as pupil:
            await seated(pupil)
            await does(desk, do="door", open=False)
            await until(desk, lambda news: news.get("class", {}).get("open") is False)
            await does(desk, do="remove", pupil=1)
            assert (await until(desk, lambda news: news.get("gone")))["gone"] == [1]
            await does(desk, do="hint", pupil=1, text="x")
            assert "pupil 1" in (await until(desk, lambda news: news.get("refusal")))["refusal"]
            return await code_of_closing(pupil)

    assert asyncio.run(swept()) == 1001
    assert asked(server, "/join", {"code": server.roster.code})[0] == 403
    with pytest.raises(InvalidStatus):
        at_page(server, page, question)
    server.stop()
    with ClassServer(Roster.read(server.roster.folder), Place()) as again:
        assert again.call(again.room.tiles) == {}
        assert join(again)["page"]
        assert [*again.call(again.room.tiles)] == [2]


# ---- who may not


def test_without_its_key_nothing_of_a_pupil_is_reached(server: ClassServer) -> None:
    join(server)
    own = teacher(server).partition("token=")[2]
    for page in (
        "/desk/?token=",
        "/desk/?token=x",
        "/teacher/?token=x",
        f"/desk/?token={own}",
        f"/desk/?token={own}&pupil=9",
    ):
        with pytest.raises(InvalidStatus) as refused:
            at_page(server, page, question)
        assert refused.value.response.status_code in (403, 404)
    for name in ("class.csv", "report.html", "hand-outs.html"):
        assert asked(server, f"/teacher/{name}")[0] == 403


def test_a_pupil_may_not_teach(server: ClassServer) -> None:
    key = join(server)["page"].partition("token=")[2]
    with pytest.raises(InvalidStatus):
        at_page(server, f"/teacher/?token={key}", question)
    for name in ("class.csv", "report.html", "hand-outs.html"):
        assert asked(server, f"/teacher/{name}?token={key}")[0] == 403


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 400),
        (b"[]", 400),
        (b'{"code": ', 400),
        (b"x" * 9999, 413),
        (b'{"code": "zzzzzz"}', 403),
        (b'{"code": {}}', 403),
        (b"[" * 2000, 400),
    ],
)
def test_a_wrong_request_to_join_is_refused(server: ClassServer, body: bytes, status: int) -> None:
    assert asked(server, "/join", body)[0] == status
    assert server.roster.pupils == []


def test_codes_cannot_be_tried_one_after_the_other(server: ClassServer) -> None:
    states = [asked(server, "/join", {"code": f"wrong{n}"})[0] for n in range(WRONG + 2)]
    assert states == [403] * WRONG + [429] * 2
    assert asked(server, "/join", {"code": server.roster.code})[0] == 429


def test_a_page_that_comes_and_goes_has_to_wait(server: ClassServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(class_server, "MOST_OPENED", 2)
    page = join(server)["page"]
    for _ in range(2):
        at_page(server, page, question)
    with pytest.raises(InvalidStatus) as refused:
        at_page(server, page, question)
    assert refused.value.response.status_code == 429


def test_a_message_that_is_no_text_is_refused_and_the_page_stays(server: ClassServer) -> None:
    async def said(page: ClientConnection) -> Json:
        await seated(page)
        await page.send(b"\0")
        await until(page, lambda news: news.get("refusal"))
        await page.send("{}")
        return await until(page, lambda news: news.get("refusal"))

    assert at_page(server, join(server)["page"], said)["refusal"]


def test_another_site_and_another_host_are_refused(server: ClassServer) -> None:
    page = join(server)["page"]
    assert asked(server, "/join", {"code": server.roster.code}, Origin=ORIGIN)[0] == 403
    assert asked(server, "/", Host="elsewhere.example")[0] == 400

    async def foreign() -> None:
        async with connect(frames(server, page), origin=ORIGIN):  # type: ignore[arg-type]
            pass

    with pytest.raises(InvalidStatus):
        asyncio.run(foreign())


@pytest.mark.parametrize(
    "path", ["/class.json", "/../class.json", "/desk/../class.json", "/teacher/roster.py", "/desk/%2e%2e/x", "/key.pem"]
)
def test_no_file_of_the_teacher_is_served(server: ClassServer, path: str) -> None:
    assert asked(server, path)[0] == 404


def test_pages_bring_what_they_need(server: ClassServer) -> None:
    for page, inside in (("/", b"join.js"), ("/teacher/", b"teacher.js"), ("/desk/", b"class_bar.js")):
        status, text = asked(server, page)
        assert status == 200
        assert inside in text
        assert b"token" not in text.replace(b"token=", b"") or page == "/desk/"


def test_a_full_class_says_so(server: ClassServer) -> None:
    for _ in range(3):
        join(server)
    status, said = asked(server, "/join", {"code": server.roster.code})
    assert (status, "full" in json.loads(said)["error"]) == (409, True)


def test_the_times_of_answers_are_kept_on_request(server: ClassServer) -> None:
    server.roster.times = True

    async def twice(opened: ClientConnection) -> Json:
        for _ in range(2):
            asks = await question(opened)
            await answer(opened, asks, asks["own"])
        return await question(opened)

    at_page(server, join(server)["page"], twice)
    folder = server.roster.folder / server.roster.pupils[0].folder / "lesson-1"
    times = read_times(folder)
    lines = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert [lines[number - 1]["kind"] for number in times] == ["answer", "answer"]
    assert [(time.by, time.means) for time in times.values()] == [("web", "move")] * 2
    assert [{**time.seen["page"], "sha256": ""} for time in times.values()] == [
        {"episodes": 0, "notices": 0, "helped": False, "sha256": ""}
    ] * 2
    assert all(time.latency_s is not None for time in times.values())
