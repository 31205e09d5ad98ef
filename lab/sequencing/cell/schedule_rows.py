"""A schedule as flat rows, for spreadsheets and scheduling libraries: who does what to which part, where, from when to when."""

import csv
from collections.abc import Iterable, Sequence
from io import StringIO
from typing import Any, Literal

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Activity, Schedule

COLUMNS = ("part", "product", "operation", "station", "target", "resource", "start_s", "end_s", "when")


def rows_of(schedule: Schedule, cell: Cell, when: Literal["planned", "measured"]) -> list[dict[str, Any]]:
    """What the robot and the machines do, by start: a row an activity, its values by COLUMNS.

    operation: an `Activity`'s kind. A job-shop library reads them so: a part is a job, a resource a machine, each row of a
    part a task from start_s to end_s. part, product: None where no part is involved. target: where a carry ends.
    """
    names = [cell.part_name(number) for number in range(1, cell.parts + 1)]

    def row(activity: Activity) -> dict[str, Any]:
        part = activity.part
        own = (None, None) if part is None else (names[part - 1], cell.order[part - 1])
        where = (activity.kind, activity.origin, activity.target, activity.resource, activity.start_s, activity.end_s)
        return dict(zip(COLUMNS, (*own, *where, when), strict=True))

    activities: Iterable[Activity] = (*schedule.robot, *schedule.machines)
    return [row(activity) for activity in sorted(activities, key=lambda one: (one.start_s, one.end_s))]


def csv_of(rows: Sequence[dict[str, Any]]) -> str:
    """The rows as a table with a header."""
    text = StringIO()
    table = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()
