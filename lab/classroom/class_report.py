"""The report of a class and its hand-outs: HTML pages without scripts, which hold their pictures and print on A4."""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lab.advice.receipt import WIDTH
from lab.classroom.class_lesson import name_of
from lab.classroom.class_record import LessonRecord, TaughtLesson, class_record
from lab.classroom.curve_chart import Chart, Curve, Kind, chart_of
from lab.classroom.roster import Pupil, Roster
from lab.classroom.tile import HAND_OUTS, REPORT, TABLE, Number
from lab.classroom.turn_record import columns_of, kept_rows
from lab.errors import BadInput, counted
from lab.files import csv_of, write_whole
from lab.version import __version__
from lab.view.printed_page import printed_page

HERE = Path(__file__).parent
HAND_OUT = "hand-out.html"
PNG = b"\x89PNG\r\n\x1a\n"
LEGEND = {  # of the lines of a report's picture
    "believed": "believed to the end",
    "dropped": "advice dropped",
    "open": "not over",
    "best": "best teacher by receipt",
    "middle": "median",
}
Json = dict[str, Any]


# ---- what the pages say --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class HandOutLesson:
    """A lesson on a pupil's page: the curve beside the median of the class, and the map as a data URL, "" for none."""

    record: LessonRecord
    taught: TaughtLesson
    chart: Chart | None
    map: str


HandOut = tuple[Pupil, list[HandOutLesson]]


def how_it_ended(one: TaughtLesson, about_order: bool) -> str:
    """What became of the lesson, in words."""
    row = one.row
    if row is None:
        return f"still learning after {counted(len(one.curve), 'episode')}"
    if about_order:
        return "found a best order" if row.solved else "its order is not proven the best"
    return "solved" if row.solved else "not solved"


def what_was_believed(one: TaughtLesson) -> str:
    """Whether the learner believed its pupil, in words."""
    if one.dropped_at is not None:
        return f"dropped in episode {one.dropped_at}"
    if one.worth is None:
        return "unknown"
    if not one.worth.taken:
        return "not given"
    believed = "believed to the end" if one.row is not None else "believed so far"
    return f"{believed}, but not {' and '.join(one.dropped)}" if one.dropped else believed


def better_episodes(one: TaughtLesson) -> str:
    """How many of the episodes with advice were better than before, or as good as the best; "" without any."""
    worth = one.worth
    return f"{worth.better + worth.best} of {worth.guided}" if worth is not None and worth.guided else ""


def before_and_after(one: TaughtLesson) -> str:
    """The means of the episodes before the first advice and after the last, "" if one of them is unknown."""
    worth = one.worth
    if worth is None or worth.mean_before is None or worth.mean_after is None:
        return ""
    return f"{number(worth.mean_before)} → {number(worth.mean_after)}"


def best_answers(one: TaughtLesson) -> str:
    """How many answers were the best ones, "" if unknown."""
    worth = one.worth
    if worth is None or worth.against_best is None or not worth.taken:
        return ""
    return f"{worth.taken - worth.against_best} of {worth.taken}"


def receipt_lines(one: TaughtLesson) -> list[tuple[int, str]]:
    """The receipt in words: (level of its indent, text), with the lines joined that were broken at the receipt's width."""
    joined: list[tuple[int, str]] = []
    before = ""
    for line in one.worth.lines if one.worth is not None else []:
        words = line.split()
        if joined and words and line.startswith("    ") and len(before) + 1 + len(words[0]) > WIDTH:
            level, text = joined[-1]
            joined[-1] = level, f"{text} {' '.join(words)}"
        elif words:
            joined.append(((len(line) - len(line.lstrip())) // 2, " ".join(words)))
        before = line
    return joined


def why_best(record: LessonRecord) -> str:
    """Who was the best teacher of a lesson, or several, and by which share of good advice, in words; "" for nobody."""
    best = record.best_teachers
    if not best or best[0].worth is None:
        return ""
    names = ", ".join(one.pupil.name for one in best)
    if best[0].worth.against_best is None:
        return f"{names}: {better_episodes(best[0])} advised episodes were better than before, or as good as the best"
    return f"{names}: {best_answers(best[0])} answers were best"


def number(value: Number) -> str:
    """A number for reading, "" if it is unknown."""
    return "" if value is None else f"{value:.10g}" if isinstance(value, int) or value.is_integer() else f"{value:.1f}"


def cost(record: LessonRecord, value: Number) -> str:
    """The steps of a path, or the cost of an order with its unit, "" if it is unknown."""
    return number(value) + " s" * (record.is_timed and value is not None)


def class_chart(record: LessonRecord) -> Chart | None:
    """The curves of all pupils in one picture, the best teachers' last, and their median."""
    best = record.best_teachers
    drawn = [one for one in record.taught if one not in best] + best
    curves: list[tuple[Kind, str, Curve]] = [
        ("best" if one in best else _kind(one), one.pupil.name, record.curve(one)) for one in drawn
    ]
    return chart_of(curves, record.optimum, record.middle, from_zero=not record.about_order)


def own_chart(record: LessonRecord, one: TaughtLesson) -> Chart | None:
    """The curve of one pupil, and the median of the class."""
    curves: list[tuple[Kind, str, Curve]] = [("own", one.pupil.name, record.curve(one))]
    return chart_of(curves, record.optimum, record.middle, from_zero=not record.about_order)


def _kind(one: TaughtLesson) -> Kind:
    return "open" if one.row is None else "dropped" if one.dropped_at is not None else "believed"


# ---- the pages -----------------------------------------------------------------------------------------------------------


def report_page(title: str, records: Sequence[LessonRecord], pupils: int, run: Sequence[Json] = ()) -> str:
    """The report: for each lesson all curves in one picture, the table, what advice was worth, and the best teacher.

    run: the rows of a finished run by hand, see `lab.classroom.turn_record.rows_of_run`.
    """
    return _rendered(
        "class_report.html",
        title=title,
        pupils=pupils,
        run=run,
        lessons=[(record, class_chart(record), why_best(record)) for record in records],
    )


def hand_outs(records: Sequence[LessonRecord], pupils: Sequence[Pupil]) -> list[HandOut]:
    """What is handed out to each of these pupils."""
    handed = []
    for pupil in pupils:
        own = [(record, one) for record in records for one in record.taught if one.pupil.number == pupil.number]
        lessons = [HandOutLesson(record, one, own_chart(record, one), _data_url(one.value_map)) for record, one in own]
        handed.append((pupil, lessons))
    return handed


def hand_out_page(title: str, handed: Sequence[HandOut], run: Sequence[Json] = ()) -> str:
    """A page for each pupil: the curve, the receipt in words, and the map with the learned path, or the learned order.

    run: as in `report_page`.
    """
    return _rendered("hand_out.html", title=title, handed=handed, run={row["pupil"]: row for row in run})


def _rendered(template: str, **known: Any) -> str:
    words = (
        *(how_it_ended, what_was_believed, better_episodes, before_and_after),
        *(best_answers, receipt_lines, number, cost, counted),
    )
    functions = {function.__name__: function for function in words}
    return printed_page(HERE / template, **known, **functions, version=__version__, legend=LEGEND)


def _data_url(picture: bytes | None) -> str:
    if picture is None or not picture.startswith(PNG):
        return ""
    return f"data:image/png;base64,{b64encode(picture).decode()}"


def title_of_class(roster: Roster) -> str:
    """The title of a class's pages: the name of its folder."""
    return f"The class '{roster.folder.resolve().name}'"


def page_now(roster: Roster, name: str) -> str:
    """The report or the hand-outs of a class at this moment; name: REPORT or HAND_OUTS."""
    records, pupils, title = class_record(roster), roster.learners, title_of_class(roster)
    run = kept_rows(roster)
    if name == REPORT:
        return report_page(title, records, len(roster.present), run)
    return hand_out_page(title, hand_outs(records, pupils), run)


# ---- the files -----------------------------------------------------------------------------------------------------------


def write_report(roster: Roster, rows: Sequence[Json] | None = None) -> Json:
    """The document of a class, whose table, report and hand-outs are written into its folder.

    rows: of the finished lessons (see `lab.classroom.tile.row_of`), None for those that the folder tells. Raises BadInput if a
    file cannot be written.
    """
    records, pupils, title = class_record(roster), roster.learners, title_of_class(roster)
    run = kept_rows(roster)
    if rows is None:
        rows = [asdict(row) for record in records for row in record.finished] + run
    handed = hand_outs(records, pupils)
    pages = {
        TABLE: csv_of(rows, columns_of(roster)),
        REPORT: report_page(title, records, len(roster.present), run),
        HAND_OUTS: hand_out_page(title, handed, run),
    }
    pages |= {f"{one[0].folder}/{HAND_OUT}": hand_out_page(title, [one], run) for one in handed}
    for name, text in pages.items():
        path = roster.folder / name
        try:
            path.parent.mkdir(exist_ok=True)
            write_whole(path, text.encode(errors="replace"))
        except OSError as error:
            raise BadInput(f"report of the class '{path}': {error.strerror or error}") from None
    over = {(row["pupil"], row["lesson"]) for row in rows}
    return {
        "class": str(roster.folder),
        "lessons": [name_of(lesson) for lesson in roster.lessons],
        "seed": roster.seed,
        "teams": roster.teams,
        "pupils": [
            {
                "number": pupil.number,
                "name": pupil.name,
                "lesson": pupil.lesson + 1,
                "state": "over" if (pupil.number, pupil.lesson + 1) in over else "open",
                "text": "",
                "hand_out": str(roster.folder / pupil.folder / HAND_OUT),
            }
            for pupil in pupils
        ],
        "rows": rows,
        "files": {
            "table": str(roster.folder / TABLE),
            "report": str(roster.folder / REPORT),
            "hand_outs": str(roster.folder / HAND_OUTS),
        },
    }
