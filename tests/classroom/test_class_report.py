"""The report of a class and its hand-outs, from a folder as a class leaves it: five pupils, of whom one cannot be read."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from shutil import copytree

import pytest

from lab.advice.advising import Advising
from lab.advice.entries import FILE
from lab.classroom.class_lesson import ClassLesson, order_lesson_named
from lab.classroom.class_record import LessonRecord, TaughtLesson, class_record
from lab.classroom.class_report import page_now, write_report
from lab.classroom.kept_lesson import KEPT
from lab.classroom.roster import Pupil, Roster
from lab.errors import BadInput
from lab.learning.requests import AdvisorLeft, Ask
from lab.production.order_session import sequenced
from lab.teaching.kept_order import OrderSession, OrderSessionOptions
from lab.teaching.lesson import teach
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.subjects import subject_of
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from tests.classroom.conftest import MAP

ORDER = replace(order_lesson_named("order:toast-case-1", "always", 2, 0), toasts=2)


def own_choice(request: object) -> int:
    return int(request.own)  # type: ignore[attr-defined]


def right(request: object) -> int:
    """The best move in "S.G", whose action is named so."""
    return int(request.mdp.action_labels.index("right"))  # type: ignore[attr-defined]


def left(request: object) -> int:
    return int(request.mdp.action_labels.index("left"))  # type: ignore[attr-defined]


def nobody(request: object) -> int:
    raise KeyboardInterrupt


def gone(request: object) -> int:
    raise AdvisorLeft


def taught(roster: Roster, pupil: Pupil, number: int, ask: Ask) -> None:
    """Leave a pupil's lesson as a desk does."""
    lesson, folder = roster.lessons[number], roster.lesson_folder(pupil, number)
    box = Toolbox(str(roster.folder / pupil.folder / "toolbox"))
    try:
        document = _document(lesson, folder, box, ask)
    except KeyboardInterrupt:
        return
    (folder / KEPT).write_text(json.dumps({"document": document, "page": {}}))


def _document(lesson: ClassLesson, folder: Path, box: Toolbox, ask: Ask) -> dict[str, object]:
    if isinstance(lesson, OrderSessionOptions):
        kept = OrderSession(lesson, box, out=folder)
        return sequenced(kept, {"web": ask}, Teacher(box, Advising.of(("expert",)))) | kept.worth()
    assert isinstance(lesson, LessonOptions)
    return teach(subject_of(lesson), lesson, Teacher(box, lesson.advising({"web": ask})), folder)


@pytest.fixture(scope="module")
def left_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A class of two lessons: a world of six cells, and an order. Pupil 1 is good, 2 bad, 3 silent, 4 stopped, 5 damaged."""
    folder = tmp_path_factory.mktemp("left")
    (folder / "small.txt").write_text(MAP)
    world = LessonOptions(str(folder / "small.txt"), gate="always", advisors=("web",), episodes=3)
    made = Roster.new(folder / "class", [world, ORDER], 0, 9, False)
    made.write()
    asks: list[Callable[..., int]] = [right, left, gone, nobody, right]
    for ask in asks:
        joined = made.join(made.code)
        assert joined is not None
        taught(made, joined[0], 0, ask)
    taught(made, made.pupils[0], 1, own_choice)
    damaged = made.lesson_folder(made.pupils[4], 0)
    kept = json.loads((damaged / KEPT).read_text())
    del kept["document"]["solved"]
    (damaged / KEPT).write_text(json.dumps(kept))
    (damaged / FILE).write_text("no journal\n")
    return folder / "class"


@pytest.fixture
def roster(left_folder: Path, tmp_path: Path) -> Roster:
    """A copy of that class, in a folder whose name would be HTML."""
    copied = tmp_path / "1 < 2 & <b>"
    copytree(left_folder, copied)
    return Roster.read(copied)


def record_of(roster: Roster) -> tuple[LessonRecord, LessonRecord]:
    first, second = class_record(roster)
    return first, second


def test_the_folder_tells_what_was_taught(roster: Roster) -> None:
    world, order = record_of(roster)
    names = {one.pupil.number: one for one in world.taught}
    assert [*names][-2:] == [4, 5], "those who have finished come first"
    assert (names[1].row is not None, names[1].good) == (True, (2 * 3, 2 * 3)), (
        "two steps right in each of three episodes"
    )
    assert [value for value, _ in names[1].curve] == [2.0, 2.0, 2.0]
    assert all(advised for _, advised in names[1].curve)
    assert names[2].good is not None
    assert names[2].good[0] == 0
    assert names[3].worth is not None
    assert (names[3].worth.taken, names[3].good) == (0, None)
    assert (names[4].row, names[4].curve) == (None, ())
    assert (names[5].row, names[5].worth) == (None, None)
    assert names[5].trouble
    assert world.best_teachers == [names[1]]
    assert (world.optimum, order.optimum is not None) == (2, True)
    assert [one.pupil.number for one in order.taught] == [1]
    assert order.taught[0].moves
    least = [value for value, _ in order.taught[0].best_so_far]
    assert least == sorted(least, reverse=True)


def test_the_best_teachers_are_good_most_surely_and_equals_are_named_together(roster: Roster) -> None:
    good = record_of(roster)[0].best_teachers[0]
    assert good.worth is not None

    def with_answers(number: int, taken: int, wrong: int) -> TaughtLesson:
        assert good.worth is not None
        worth = replace(good.worth, taken=taken, against_best=wrong)
        return replace(good, pupil=replace(good.pupil, number=number), worth=worth)

    few, as_few, many, dropped = (
        *(with_answers(1, 6, 0), with_answers(2, 6, 0), with_answers(3, 60, 1)),
        replace(with_answers(4, 99, 0), dropped_at=9),
    )
    open_still, silent = replace(with_answers(5, 99, 0), row=None), with_answers(6, 0, 0)
    others = [few, as_few, dropped, open_still, silent]
    assert LessonRecord(0, "world", False, others).best_teachers == [few, as_few]
    assert LessonRecord(0, "world", False, [*others, many]).best_teachers == [many]


def test_a_class_has_a_report_and_a_page_for_each_pupil(roster: Roster) -> None:
    document = write_report(roster)
    report = Path(document["files"]["report"]).read_text(encoding="utf-8")
    for pupil in roster.pupils:
        assert pupil.name in report
    assert "<script" not in report
    assert "http" not in re.sub(r'http-equiv="Content-Security-Policy"', "", report)
    assert report.count("<polyline") >= 5
    assert "1 &lt; 2 &amp; &lt;b&gt;" in report
    assert "<b>'" not in report
    pages = [Path(pupil["hand_out"]).read_text(encoding="utf-8") for pupil in document["pupils"]]
    whole = Path(document["files"]["hand_outs"]).read_text(encoding="utf-8")
    for pupil, page in zip(roster.pupils, pages, strict=True):
        assert f"<h1>{pupil.name}</h1>" in page
        assert f"<h1>{pupil.name}</h1>" in whole
        assert sum(other.name in page for other in roster.pupils) == 1, "nobody else's name"
    assert "data:image/png;base64," in pages[0]
    assert "data:image/png;base64," not in pages[3]
    assert "6 of them with your help" in pages[0]
    assert "The best order that your learner found" in pages[0]
    assert "Your advice was: believed to the end." in pages[0]
    assert "Your advice was: not given." in pages[2]
    assert "still learning after 0 episodes" in pages[3]
    table = Path(document["files"]["table"]).read_text(encoding="utf-8").splitlines()
    assert len(table) == 1 + len(document["rows"]) == 1 + 4
    assert [pupil["state"] for pupil in document["pupils"]] == ["over", "over", "over", "open", "open"]


def test_the_same_folder_gives_the_same_report(roster: Roster) -> None:
    files = [Path(path) for path in write_report(roster)["files"].values()]
    before = [path.read_bytes() for path in files]
    write_report(Roster.read(roster.folder, "--report"))
    assert [path.read_bytes() for path in files] == before
    assert page_now(roster, "report.html").encode() in before
    assert page_now(roster, "hand-outs.html").encode() in before


def test_a_class_without_pupils_has_a_report(tmp_path: Path, lesson: LessonOptions) -> None:
    made = Roster.new(tmp_path / "empty", [lesson], 0, 9, False)
    made.write()
    document = write_report(made)
    assert "Nobody has begun this lesson." in Path(document["files"]["report"]).read_text(encoding="utf-8")
    assert "Nobody has joined this class." in Path(document["files"]["hand_outs"]).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "kept",
    [
        "",
        "[]",
        '{"document": {}, "page": {}}',
        '{"document": {"best_sequence": 1, "advice": [], "task": "x"}, "page": {}}',
        '{"document": {"skill": "x", "receipt": 3}, "page": {}}',
        '{"document": 1e999, "page": NaN}',
    ],
)
def test_a_damaged_end_of_a_lesson_is_told(roster: Roster, kept: str) -> None:
    (roster.lesson_folder(roster.pupils[0], 0) / KEPT).write_text(kept)
    world, _ = record_of(roster)
    assert next(one for one in world.taught if one.pupil.number == 1).row is None
    write_report(roster)


def test_a_report_that_cannot_be_written_is_one_line(roster: Roster) -> None:
    (roster.folder / "report.html").mkdir()
    with pytest.raises(BadInput, match=r"report\.html") as refused:
        write_report(roster)
    assert "\n" not in str(refused.value)
