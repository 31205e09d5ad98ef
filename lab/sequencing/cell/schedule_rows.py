"""A schedule as flat rows, for spreadsheets and scheduling libraries: who does what to which part, where, from when to when."""

import csv
import json
from collections.abc import Iterable, Sequence
from io import StringIO
from pathlib import Path
from typing import Any, Literal

from lab.errors import BadInput
from lab.files import write_whole
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Activity, Schedule

COLUMNS = ("part", "product", "operation", "station", "target", "resource", "robot", "start_s", "end_s", "when")
TABLES = (".csv", ".json")


def rows_of(schedule: Schedule, cell: Cell, when: Literal["planned", "measured"]) -> list[dict[str, Any]]:
    """What the robots and the machines do, by start: a row an activity, its values by COLUMNS.

    operation: an `Activity`'s kind. A job-shop library reads them so: a part is a job, a resource a machine, each row of a
    part a task from start_s to end_s. part, product: None where no part is involved. target: where a carry ends. robot: the
    resource, where it is one.
    """
    names = [cell.part_name(number) for number in range(1, cell.parts + 1)]

    def row(activity: Activity, robot: str | None) -> dict[str, Any]:
        part = activity.part
        own = (None, None) if part is None else (names[part - 1], cell.order[part - 1])
        what = (activity.kind, activity.origin, activity.target, activity.resource, robot)
        return dict(zip(COLUMNS, (*own, *what, activity.start_s, activity.end_s, when), strict=True))

    rows = [row(one, one.resource) for one in schedule.robot] + [row(one, None) for one in schedule.machines]
    return sorted(rows, key=lambda one: (one["start_s"], one["end_s"]))


def csv_of(rows: Iterable[dict[str, Any]]) -> str:
    """The rows as a table with a header."""
    text = StringIO()
    table = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()


def check_table(path: Path) -> None:
    """BadInput unless the rows can be written there, by the ending as a table or as a JSON list."""
    if path.suffix.lower() not in TABLES:
        raise BadInput(f"schedule '{path}' (--schedule): wanted a file that ends with {' or '.join(TABLES)}")
    if not path.parent.is_dir():
        raise BadInput(f"schedule '{path}' (--schedule): there is no folder '{path.parent}'")


def write_table(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Writes the rows whole; BadInput where that cannot be."""
    check_table(path)
    text = csv_of(rows) if path.suffix.lower() == ".csv" else json.dumps(list(rows), indent=1) + "\n"
    try:
        write_whole(path, text.encode())
    except OSError as error:
        raise BadInput(f"schedule '{path}' (--schedule): cannot be written: {error.strerror or error}") from None
