"""Lessons on an order: at a desk, in the roster, and in the table of the class."""

import asyncio
import json
import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from lab.advice.advising import Advising
from lab.classroom.class_lesson import ADVISORS, check_lesson, lesson_to_json, order_lesson_named, title_of
from lab.classroom.desk import Desk, processes
from lab.classroom.desk_process import DeskOrder
from lab.classroom.order_lesson import order_lesson
from lab.classroom.roster import FILE, Pupil, Roster
from lab.classroom.tile import best_first, row_of
from lab.errors import BadInput
from lab.production.order_session import sequenced
from lab.seat.lesson_seat import LessonSeat
from lab.seat.run_progress import RunProgress
from lab.teaching.kept_order import OrderSession, OrderSessionOptions
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from lab.view.progress import EscapingConsole
from tests.classroom.conftest import answer, seated, until

ORDER = replace(order_lesson_named("order:toast-case-1", "always", 2, 0), toasts=2)
PUPIL = Pupil(1, "silver deer", "")


def alone(folder: Path) -> dict[str, Any]:
    """The document of the lesson without a class, in which the person answers with the learner's own choice."""
    box = Toolbox(str(folder / "box"))
    kept = OrderSession(ORDER, box, out=folder)
    teacher = Teacher(box, Advising.of(("expert",)), ORDER.seed)
    return sequenced(kept, {"web": lambda request: request.own}, teacher) | kept.worth()


async def at_desk(order: DeskOrder, answers: int | None, kill: bool = False) -> Desk:
    """The desk after so many answers with the learner's own choice (None: until the lesson is over), closed or killed."""
    desk = Desk(order)
    await desk.open(processes())
    async with await desk.page() as page:
        await _answered(page, answers)
        if kill:
            os.kill(desk._process.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
            try:
                while True:
                    await page.recv()
            except ConnectionClosed:
                pass
    await desk.close()
    return desk


async def _answered(page: ClientConnection, answers: int | None) -> None:
    asks = await seated(page)
    while answers is None or answers > 0:
        await answer(page, asks, asks["own"])
        answers = None if answers is None else answers - 1
        news = await until(page, lambda news: news.get("seat", {}).get("question") or news.get("seat", {}).get("ended"))
        if news["seat"].get("ended"):
            return
        asks = news["seat"]["question"]


@pytest.mark.slow
def test_an_order_at_a_desk_is_the_order_alone_also_after_the_desk_was_killed(tmp_path: Path) -> None:
    """The journal is the same byte for byte: at one go, and killed and closed in the middle."""
    document = alone(tmp_path / "alone")
    written = (tmp_path / "alone" / "events.jsonl").read_bytes()
    order = DeskOrder(ORDER, tmp_path / "lesson", tmp_path / "toolbox")

    async def three_times() -> Desk:
        await at_desk(order, 1, kill=True)
        stopped = await at_desk(order, 1)
        assert stopped.state == "stopped"
        return await at_desk(order, None)

    desk = asyncio.run(three_times())
    assert desk.state == "over"
    assert (tmp_path / "lesson" / "events.jsonl").read_bytes() == written
    assert desk.result is not None
    assert {**desk.result, "session": ""} == {**document, "session": ""}
    assert desk.parts["curve"]["count"] == 2
    assert desk.parts["lesson"]["kind"] == "order"

    async def again() -> Desk:  # as after a server that ended before it kept the document
        opened = Desk(order)
        await opened.open(processes())
        async with await opened.page() as page:
            await until(page, lambda news: news.get("seat", {}).get("ended"))
        await opened.close()
        return opened

    assert asyncio.run(again()).result == desk.result


def test_a_journal_of_another_lesson_is_refused(tmp_path: Path) -> None:
    alone(tmp_path / "alone")
    seat, box = LessonSeat(RunProgress(EscapingConsole(quiet=True)), None, None), Toolbox(str(tmp_path / "box"))
    for changed in ({"episodes": 3}, {"advisor": "none", "method": "srl-linear", "keep_policy": "mine"}):
        with pytest.raises(BadInput, match="another lesson"):
            order_lesson(replace(ORDER, **changed), tmp_path / "alone", box, seat)


def test_the_row_of_an_order_has_its_cost_and_the_optimum(tmp_path: Path) -> None:
    document = alone(tmp_path / "alone")
    row = row_of(PUPIL, 0, document)
    assert (row["skill"], row["cost"], row["optimal_cost"]) == (
        "order of toast-case-1",
        document["cost"],
        document["optimal_cost"],
    )
    assert (row["answers"], row["final_steps"], row["believed"]) == (document["receipt"]["taken"], None, True)
    assert row["solved"] == (row["cost"] == row["optimal_cost"])
    worse = row_of(replace(PUPIL, number=2), 0, document | {"cost": document["cost"] + 1, "gap": 0.1})
    assert best_first([worse, row])[0] is row


def test_a_roster_keeps_the_kind_of_a_lesson(tmp_path: Path, lesson: LessonOptions) -> None:
    made = Roster.new(tmp_path / "class", [lesson, ORDER], 0, 3, False)
    made.write()
    kept = json.loads((tmp_path / "class" / FILE).read_text())["lessons"]
    assert ["kind" in one for one in kept] == [False, True]
    assert Roster.read(tmp_path / "class").lessons == (lesson, ORDER)


@pytest.mark.parametrize(
    "changed",
    [{"kind": "dance"}, {"kind": 3}, {"kind": []}, {"advisor": "none"}, {"task": ""}, {"episodes": 0}, {"seed": "x"}],
)
def test_a_damaged_lesson_on_an_order_is_refused(tmp_path: Path, changed: dict[str, Any]) -> None:
    Roster.new(tmp_path / "class", [ORDER], 0, 3, False).write()
    path = tmp_path / "class" / FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | {"lessons": [lesson_to_json(ORDER) | changed]}))
    with pytest.raises(BadInput) as refused:
        Roster.read(tmp_path / "class")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"task": "world-1"}, "nothing to sequence"),
        ({"gate": "ia"}, "table of states"),
        ({"method": "fifo"}, "only srl asks"),
        ({"keep_policy": "mine"}, "only srl-linear"),
        ({"objective": "mean-tardiness"}, "due times"),
        ({"case": "I"}, "--case"),
    ],
)
def test_what_cannot_be_asked_is_refused_before_anybody_joins(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        check_lesson(replace(ORDER, toasts=None, **changed))


def test_a_task_whose_moves_are_timed_later_is_checked_without_measuring() -> None:
    check_lesson(OrderSessionOptions("toast", method="srl", advisor=ADVISORS[0]))
    with pytest.raises(BadInput, match="due times"):
        check_lesson(OrderSessionOptions("toast", method="srl", advisor=ADVISORS[0], objective="mean-tardiness"))


def test_lessons_are_named_for_people(lesson: LessonOptions) -> None:
    assert title_of(ORDER) == "order of toast-case-1"
    assert title_of(replace(lesson, subtask="insert", task="toast")) == "insert of toast"
