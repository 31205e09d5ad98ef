"""When and how answers at a seat were given, and what was seen: kept beside the journal, whose bytes stay the same."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from lab.advice.answer_times import FILE, AnswerTime, AnswerTimes, read_times
from lab.advice.entries import FILE as JOURNAL
from lab.errors import BadInput
from lab.seat.lesson_seat import LessonSeat
from lab.seat.run_progress import RunProgress
from lab.seat.terminal.prompt import TeachingPrompt
from lab.teaching.kept_session import KeptSession
from lab.teaching.lesson import teach
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.lesson_plan import Interrupted
from lab.teaching.subjects import subject_of
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from lab.view.progress import EscapingConsole

SAID = ["right", "undo", "go right and then right", "skip", "path right right", "quit"]


@pytest.fixture
def lesson(tmp_path: Path) -> LessonOptions:
    (tmp_path / "small.txt").write_text("S.G\n...\n")
    return LessonOptions(str(tmp_path / "small.txt"), gate="always", advisors=("terminal",), episodes=9)


def typed(lines: Iterator[str]) -> Any:
    return lambda prompt: next(lines)


def held(
    lesson: LessonOptions, folder: Path, lines: list[str], times: AnswerTimes | None, kept: KeptSession | None = None
) -> None:
    """A lesson with a person who types these lines."""
    prompt = TeachingPrompt(Console(quiet=True, width=80), typed(iter(lines)))
    seat = LessonSeat(RunProgress(EscapingConsole(quiet=True)), prompt, None, times=times)
    box = Toolbox(str(folder.parent / f"box-{folder.name}"))
    teacher = Teacher(box, lesson.advising(seat.people()), lesson.seed, seat.hear)
    with pytest.raises(Interrupted):
        teach(subject_of(lesson), lesson, teacher, folder, kept)


def lines_of(folder: Path, file: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / file).read_text().splitlines()]


def test_each_answer_has_its_time_and_the_journal_is_the_same(tmp_path: Path, lesson: LessonOptions) -> None:
    times = AnswerTimes()
    held(lesson, tmp_path / "timed", SAID, times)
    times.close()
    held(lesson, tmp_path / "plain", SAID, None)
    assert (tmp_path / "timed" / JOURNAL).read_bytes() == (tmp_path / "plain" / JOURNAL).read_bytes()
    assert not (tmp_path / "plain" / FILE).exists()
    journal, kept = lines_of(tmp_path / "timed", JOURNAL), read_times(tmp_path / "timed")
    given = {number: line for number, line in enumerate(journal, start=1) if line["kind"] in ("answer", "undo")}
    assert [*kept] == [*given]
    assert [time.means for time in kept.values()][:3] == ["move", "undo", "sentence"]
    assert {"path", "path goes on", "skip"} <= {time.means for time in kept.values()}
    sentence = next(time for time in kept.values() if time.means == "sentence")
    assert sentence.said == ("go right and then right",)
    for number, time in kept.items():
        assert (time.shown is None) == (time.latency_s is None) == (time.means in ("rule", "path goes on"))
        line = given[number]
        if line["kind"] == "answer":
            assert (time.seen["state"], time.seen["episode"], time.seen["step"]) == (
                line["state"],
                line["episode"],
                line["step"],
            )
            assert (time.seen["label"], time.seen["allowed"]) == (f"(0, {line['state']})", [0, 1, 2, 3])
            assert len(time.seen["values"]) == 4
    assert kept[min(kept)].seen["values"] == [-0.1] * 4  # nothing was learned yet: each is the reward of a step


def test_a_lesson_that_goes_on_adds_its_times_after_a_line_that_was_cut(tmp_path: Path, lesson: LessonOptions) -> None:
    held(lesson, tmp_path / "kept", ["right", "quit"], times := AnswerTimes())
    times.close()
    before = read_times(tmp_path / "kept")
    with (tmp_path / "kept" / FILE).open("a") as file:
        file.write('{"kind": "time", "ent')
    assert read_times(tmp_path / "kept") == before
    kept = KeptSession(tmp_path / "kept", "--resume")
    held(kept.options, tmp_path / "kept", ["right", "quit"], times, kept)
    times.close()
    after = read_times(tmp_path / "kept")
    assert {number: after[number] for number in before} == before
    assert [lines_of(tmp_path / "kept", JOURNAL)[number - 1]["kind"] for number in after] == ["answer", "answer"]


def test_a_damaged_file_of_times_is_refused_with_its_line(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text('{"kind": "time", "entry": 0}\n')
    with pytest.raises(BadInput, match=r"times\.jsonl': line 1: .* entry: "):
        read_times(tmp_path)
    assert AnswerTime(1, "web", "move", None, None).seen == {}
