"""A desk alone: its process, which is given the code that the teacher has named, and what becomes of it."""

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest

from lab.advice.entries import read_journal
from lab.classroom.desk import Desk, processes
from lab.classroom.desk_process import DeskOrder
from lab.teaching.lesson_options import LessonOptions
from tests.classroom.conftest import answer, question, seated

RIGHT = 3
SECOND = """
from lab import Gate

class Second(Gate):
    "Asks in the second episode alone."

    def opens(self, episode, scores):
        return episode == 2
"""


async def opened(order: DeskOrder) -> tuple[Desk, asyncio.Event]:
    """An open desk, and the event of its next news."""
    desk, stirred = Desk(order), asyncio.Event()
    desk.on_news = stirred.set
    await desk.open(processes())
    await desk.ready.wait()
    return desk, stirred


def test_a_gate_from_a_file_decides_at_a_desk(tmp_path: Path, lesson: LessonOptions) -> None:
    (tmp_path / "own.py").write_text(SECOND)
    files = {"own.Second": ("gates", f"{tmp_path / 'own.py'}:Second")}
    order = DeskOrder(replace(lesson, gate="own.Second"), tmp_path / "lesson", tmp_path / "toolbox", files)

    async def first() -> str:
        desk, _ = await opened(order)
        async with await desk.page() as page:
            asked = await question(page)
        await desk.close()
        return str(asked["title"])

    assert asyncio.run(first()).startswith("Episode 2, step 1")


def test_a_gate_whose_file_nobody_named_is_not_run(tmp_path: Path, lesson: LessonOptions) -> None:
    (tmp_path / "own.py").write_text(SECOND)
    order = DeskOrder(replace(lesson, gate="own.Second"), tmp_path / "lesson", tmp_path / "toolbox", {})

    async def fails() -> str:
        desk, stirred = await opened(order)
        while desk.state == "open":
            stirred.clear()
            await stirred.wait()
        await desk.close()
        return f"{desk.state}: {desk.text}"

    said = asyncio.run(fails())
    assert said.startswith("failed: gate 'own.Second'")
    assert "not run unasked" in said


@pytest.mark.parametrize("turns", [0, 1, 20])
def test_a_lesson_that_is_over_when_its_desk_is_closed_hands_out_its_document(
    tmp_path: Path, lesson: LessonOptions, turns: int
) -> None:
    """The desk is closed while the last answer is on its way, or a little later; nothing in between is lost."""

    async def closed() -> Desk:
        desk, _ = await opened(DeskOrder(replace(lesson, episodes=1), tmp_path / "lesson", tmp_path / "toolbox"))
        async with await desk.page() as page:
            await answer(page, await seated(page), RIGHT)
            await answer(page, await question(page), RIGHT)
            for _ in range(turns):
                await asyncio.sleep(0)
            await desk.close()
            for _ in range(100):  # what the pipe's thread has handed over
                await asyncio.sleep(0)
        return desk

    desk = asyncio.run(closed())
    is_over = read_journal(tmp_path / "lesson", "test").closed is not None
    assert (desk.state, desk.result is not None) == (("over", True) if is_over else ("stopped", False))


def test_a_desk_that_is_closed_before_it_opens_has_no_process(tmp_path: Path, lesson: LessonOptions) -> None:
    async def closed() -> Desk:
        desk = Desk(DeskOrder(lesson, tmp_path / "lesson", tmp_path / "toolbox"))
        await desk.close()
        await desk.open(processes())
        return desk

    desk = asyncio.run(closed())
    assert desk.ready.is_set()
    assert not (tmp_path / "lesson").exists()
