"""Schedules as rows: a cell by hand, as a table for spreadsheets, and as a job shop that a scheduling library takes."""

import csv
import json
from io import StringIO
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import COLUMNS, csv_of, rows_of, write_table
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.simulate.follow import simulate

STATIONS = (Station("in", "storage", 9), Station("oven", "machine", 1, 10.0), Station("out", "storage", 9))


@pytest.fixture
def cell() -> Cell:
    """A toast takes 2 s into the oven, 10 s in it, 2 s out of it; the empty robot needs 1 s for any way."""
    route = (Stage("in", None), Stage("oven", None), Stage("out", None))
    empty, loaded = np.full((3, 3), 1.0), np.full((3, 3), 2.0)
    for table in (empty, loaded):
        np.fill_diagonal(table, 0.0)
    return Cell(STATIONS, (Product("toast", (route,)),), ("toast",), empty, loaded, one_robot("in"))


def test_the_rows_of_one_toast_by_hand(cell: Cell) -> None:
    rows = rows_of(simulate(cell, [1, 1]), cell, "planned")
    assert [tuple(row[name] for name in COLUMNS) for row in rows] == [
        ("toast 1", "toast", "carry", "in", "oven", "robot", "robot", 0.0, 2.0, "planned"),
        ("toast 1", "toast", "wait", "oven", "oven", "robot", "robot", 2.0, 12.0, "planned"),
        ("toast 1", "toast", "process", "oven", "oven", "oven", None, 2.0, 12.0, "planned"),
        ("toast 1", "toast", "carry", "oven", "out", "robot", "robot", 12.0, 14.0, "planned"),
    ]


def test_a_spreadsheet_reads_the_table(cell: Cell) -> None:
    rows = rows_of(simulate(cell, [1, 1]), cell, "measured")
    read = list(csv.DictReader(StringIO(csv_of(rows))))
    assert [{name: "" if value is None else str(value) for name, value in row.items()} for row in rows] == read
    assert float(read[-1]["end_s"]) == 14.0


def test_a_row_without_a_part_has_empty_fields(cell: Cell) -> None:
    two = Cell(cell.stations, cell.products, ("toast", "toast"), cell.empty_s, cell.loaded_s, one_robot("in"))
    rows = rows_of(simulate(two, [1, 1, 2, 2]), two, "planned")
    (empty,) = {(row["part"], row["product"]) for row in rows if row["operation"] == "empty"}
    assert empty == (None, None)
    assert "\n,,empty,out,in,robot," in csv_of(rows)


def test_a_job_shop_of_the_rows_keeps_to_its_machines(cell: Cell) -> None:
    """As a library takes it: jobs are parts, machines resources; no machine does two tasks at once, no part is in two."""
    two = Cell(cell.stations, cell.products, ("toast", "toast"), cell.empty_s, cell.loaded_s, one_robot("in"))
    rows = rows_of(simulate(two, [1, 1, 2, 2]), two, "planned")
    tasks = [row for row in rows if row["operation"] != "wait"]
    for key in ("resource", "part"):
        for owner in {row[key] for row in tasks} - {None}:
            own = sorted((row["start_s"], row["end_s"]) for row in tasks if row[key] == owner)
            assert all(before[1] <= after[0] for before, after in pairwise(own))


def test_a_file_has_the_rows_by_its_ending(cell: Cell, tmp_path: Path) -> None:
    rows = rows_of(simulate(cell, [1, 1]), cell, "planned")
    write_table(rows, tmp_path / "plan.csv")
    assert (tmp_path / "plan.csv").read_text() == csv_of(rows)
    write_table(rows, tmp_path / "plan.json")
    assert json.loads((tmp_path / "plan.json").read_text()) == rows
    with pytest.raises(BadInput, match=r"wanted a file that ends with \.csv or \.json"):
        write_table(rows, tmp_path / "plan.txt")
    with pytest.raises(BadInput, match="there is no folder"):
        write_table(rows, tmp_path / "nowhere" / "plan.csv")
