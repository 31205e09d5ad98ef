"""A run that was broken off goes on bit for bit as if it had not been: while it learned, moved, was stopped and met trouble."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.learning.requests import AdviceRequest
from lab.production.composer import Conditions
from lab.production.order import Ordered
from lab.production.report import Report
from lab.production.run import run
from lab.production.run_advice import RunAdvice
from lab.production.run_journal import RunBegan, RunJournal, read_run
from lab.production.taught import teach_all
from lab.sequencing.search import SequenceResult
from lab.skills.prepared_scene import prepare
from lab.tasks.fault_fields import FaultFields
from lab.tasks.task import Task
from lab.tasks.task_file import load
from lab.teaching.events import Event, MoveMade, SkillReady
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox

HEAD = RunBegan({}, "toast", "")


@pytest.fixture(scope="module")
def task() -> Task:
    """One slice through a toaster that takes seconds, and on its way the slice is put elsewhere by hand."""
    shipped = load("toast")
    brisk = {name: p.model_copy(update={"speed_m_s": 0.2, "dwell_s": 0.05}) for name, p in shipped.processes.items()}
    quick = tuple(s.model_copy(update={"processing_s": 4.0} if s.name == "toaster" else {}) for s in shipped.stations)
    moved = FaultFields.model_validate({"what": "part moved", "at_s": 0.0, "part": "slice 1", "by_m": (0.06, 0.0)})
    return shipped.changed(stations=quick, processes=brisk, faults=(moved,))


Begin = Callable[[Path, Callable[[Event], None]], Report]


@pytest.fixture(scope="module")
def carry_on(task: Task) -> Begin:
    """Begins a run in a folder, or goes on with it; its toolbox is beside it."""

    def begin(folder: Path, hear: Callable[[Event], None]) -> Report:
        journal = RunJournal.resume(folder) if (folder / "run.jsonl").exists() else RunJournal.begin(folder, HEAD)
        teacher = Teacher(Toolbox(folder.with_name(f"{folder.name}-toolbox")), tell=hear)
        try:
            return run(prepare(task, task.ordered(1), 0), teacher, folder, Conditions(journal=journal))
        finally:
            journal.close()

    return begin


def told(folder: Path) -> tuple[dict[str, Any], list[Any]]:
    """What a run wrote of itself, without how long that took and when its policies were made."""
    document = json.loads((folder / "run.json").read_text())
    del document["wall_s"], document["files"]
    for row in document["skills"]:
        row["parent"] = row["parent"].partition("@")[0]
    lines = [line for line in read_run(folder, "DIR")[1] if type(line).__name__ in ("Moved", "Met", "RunEnded")]
    return document, lines


@pytest.fixture(scope="module")
def whole(carry_on: Begin, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "whole"
    report = carry_on(folder, lambda event: None)
    assert report.success
    assert [row["what"] for row in report.to_json()["faults"]] == ["part moved"]
    return folder


class Breaks:
    """Presses Ctrl-C when it has heard so many events of a kind."""

    def __init__(self, kind: type[Any], count: int) -> None:
        self.kind, self.left = kind, count

    def __call__(self, event: Event) -> None:
        self.left -= isinstance(event, self.kind)
        if isinstance(event, self.kind) and self.left == 0:
            raise KeyboardInterrupt


class Says:
    """Somebody at the terminal who knows the way, and counts how often they were asked."""

    def __init__(self) -> None:
        self.asked = 0

    def __call__(self, request: AdviceRequest) -> int:
        self.asked += 1
        return request.own


def taught_by(task: Task, folder: Path, person: Says, hear: Callable[[Event], None]) -> RunAdvice:
    """The skills of a run that a person advises, its lessons begun or gone on with."""
    again = (folder / "run.jsonl").exists()
    journal = RunJournal.resume(folder) if again else RunJournal.begin(folder, HEAD)
    options = LessonOptions(task="toast", advisors=("terminal",))
    toolbox = Toolbox(folder.with_name(f"{folder.name}-toolbox"))
    advice = RunAdvice(toolbox, options, journal)
    teacher = Teacher(toolbox, options.advising({"terminal": person}), tell=hear, keep=advice.keep)
    try:
        teach_all(prepare(task, task.ordered(1), 0), teacher, journal, advice.again)
    finally:
        journal.close()
    return advice


@pytest.mark.slow
def test_what_a_person_said_before_the_break_still_counts(task: Task, tmp_path: Path) -> None:
    """Their lessons are not held again, and what each was worth is as if the run had not been broken off."""
    whole, first, second = Says(), Says(), Says()
    known = taught_by(task, tmp_path / "whole", whole, lambda event: None)
    with pytest.raises(KeyboardInterrupt):
        taught_by(task, tmp_path / "broken", first, Breaks(SkillReady, 3))
    again = taught_by(task, tmp_path / "broken", second, lambda event: None)
    assert first.asked > 0
    assert first.asked + second.asked == whole.asked
    nothing = Ordered(SequenceResult((), 0.0, ()), None, "", {}, None)  # type: ignore[arg-type]
    worth = {name: one["receipt"] for name, one in known.receipts(nothing)["skills"].items()}
    assert len(worth) > 3
    assert {name: one["receipt"] for name, one in again.receipts(nothing)["skills"].items()} == worth


@pytest.mark.slow
def test_broken_off_while_it_learned_and_again_while_it_moved(whole: Path, carry_on: Begin, tmp_path: Path) -> None:
    folder = tmp_path / "broken"
    with pytest.raises(KeyboardInterrupt):
        carry_on(folder, Breaks(SkillReady, 5))
    interrupted = carry_on(folder, Breaks(MoveMade, 2))
    assert interrupted.outcome.interrupted
    assert (folder / "gantt.png").is_file()  # what came of it until then
    assert (folder / "replay.html").is_file()
    carry_on(folder, lambda event: None)
    assert told(folder) == told(whole)
