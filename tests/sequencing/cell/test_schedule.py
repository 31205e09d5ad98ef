"""The event simulation, on cells small enough to redo by hand."""

import csv
import json
from collections.abc import Callable
from io import StringIO
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.files import csv_of
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import COLUMNS, Activity, Move, Schedule, rows_of, write_table
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]


def test_one_toast_by_hand(oven_cell: CellMaker) -> None:
    """Carry 0-2, bake 2-12 while the robot waits at the oven, carry 12-14."""
    schedule = simulate(oven_cell(1), [1, 1])
    assert schedule.robot == (
        Activity("robot", "carry", 1, "in", "oven", 0, 2),
        Activity("robot", "wait", 1, "oven", "oven", 2, 12),
        Activity("robot", "carry", 1, "oven", "out", 12, 14),
    )
    assert schedule.machines == (Activity("oven", "process", 1, "oven", "oven", 2, 12),)
    assert [(a.kind, a.start_s, a.end_s) for a in schedule.parts] == [
        ("carry", 0, 2),
        ("process", 2, 12),
        ("carry", 12, 14),
    ]
    assert schedule.makespan_s == 14


def test_two_toasts_by_hand(oven_cell: CellMaker) -> None:
    """Toast 1 out at 14; empty out -> in 14-15; carry 15-17; bake 17-27; carry 27-29."""
    schedule = simulate(oven_cell(2), [1, 1, 2, 2])
    assert [(a.kind, a.start_s, a.end_s) for a in schedule.robot] == [
        ("carry", 0, 2),
        ("wait", 2, 12),
        ("carry", 12, 14),
        ("empty", 14, 15),
        ("carry", 15, 17),
        ("wait", 17, 27),
        ("carry", 27, 29),
    ]
    assert schedule.makespan_s == 29


def test_a_toast_that_is_not_fetched_blocks_its_machine(toast_cell: CellMaker) -> None:
    """Case II: toast 1 reaches the toaster at 60, is done at 150; the robot brings 2, 3 and 4 to the buffer first."""
    cell = toast_cell("II", 4)
    schedule = simulate(cell, [1, 2, 3, 4, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4])
    toaster = [a for a in schedule.machines if a.resource == "toaster"][:2]
    # 60 + (30 + 20) + (30 + 20) + (30 + 20) + 30 to the toaster = 240
    assert [(a.kind, a.part, a.start_s, a.end_s) for a in toaster] == [
        ("process", 1, 60, 150),
        ("blocked", 1, 150, 240),
    ]


def test_the_printed_solution_of_case_ii(toast_cell: CellMaker) -> None:
    """Fig. 7.4 and the Gantt chart of App. IV: 700 s."""
    schedule = simulate(toast_cell("II", 3), [1, 2, 1, 2, 1, 2, 3, 2, 3, 3])
    assert schedule.makespan_s == 700
    assert [(a.origin, a.target) for a in schedule.robot[:5]] == [
        ("toaster buffer", "plate"),
        ("plate", "toaster"),
        ("toaster", "plate"),
        ("plate", "toaster buffer"),
        ("toaster buffer", "toaster"),
    ]
    assert schedule.robot[5].kind == "wait"
    assert (schedule.robot[5].start_s, schedule.robot[5].end_s) == (140, 150)


@pytest.mark.parametrize(
    ("sequence", "says"),
    [
        ([1, 3, 1, 2], "position 2 of the sequence: there is no part 3, only 1 to 2; allowed here: 1"),
        ([1, 2], "position 2 of the sequence: toast 2 at 'in' cannot move on: 'oven' full; allowed here: 1"),
        ([1, 1, 1], "position 3 of the sequence: toast 1 is already at 'out'; allowed here: 2"),
        ([1, 1, 2], "the sequence ends after 3 moves, but toast 2 is still at 'oven'"),
        ([], "the sequence ends after 0 moves, but toast 1 is still at 'in'"),
        ([1, 1, 2, 2, 2], "position 5 .*allowed here: none, all are done"),
    ],
)
def test_sequences_that_cannot_be(oven_cell: CellMaker, sequence: list[int], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        simulate(oven_cell(2), sequence)


def test_a_run_refuses_too(oven_cell: CellMaker) -> None:
    run = Run(oven_cell(2))
    run.move(1)
    with pytest.raises(BadInput, match="'oven' full"):
        run.move(2)


@given(data=st.data())
def test_rows_have_neither_gaps_nor_overlaps(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject
) -> None:
    cell = data.draw(cells(max_machines=3, max_parts=4))
    run, sequence = Run(cell), []
    while allowed := run.allowed():
        sequence.append(data.draw(st.sampled_from(allowed)))
        run.move(sequence[-1])
    schedule = simulate(cell, sequence)
    rows = [list(schedule.robot)]
    rows += [[a for a in schedule.parts if a.part == toast] for toast in range(1, cell.parts + 1)]
    for row in rows:
        assert row[0].start_s == 0
        assert row[-1].end_s == schedule.makespan_s
        assert all(before.end_s == after.start_s for before, after in pairwise(row))
        assert all(before.target == after.origin for before, after in pairwise(row))
    for station in cell.stations:
        starts = [a.start_s for a in schedule.machines if a.resource == station.name]
        for at_s in starts:
            busy = [a for a in schedule.machines if a.resource == station.name and a.start_s <= at_s < a.end_s]
            assert len(busy) <= station.capacity


def test_json_says_everything(oven_cell: CellMaker) -> None:
    schedule = simulate(oven_cell(1), [1, 1])
    document = json.loads(json.dumps(schedule.to_json()))
    assert (document["makespan_s"], document["sequence"]) == (14.0, [1, 1])
    for name in ("robot", "machines", "parts"):
        assert [Activity(**entry) for entry in document[name]] == list(getattr(schedule, name))


def test_a_measured_schedule_from_timed_moves(oven_cell: CellMaker) -> None:
    """A run that was slower, and fetched the toast 0.5 s before its nominal end: processing ends with the pick."""
    moves = [Move(1, "in", "in", "oven", 0, 0.5, 0.5, 3, 10.0), Move(1, "oven", "oven", "out", 3, 3, 12.5, 15)]
    schedule = Schedule.from_moves(oven_cell(1), moves)
    assert schedule.makespan_s == 15
    assert schedule.sequence == (1, 1)
    assert schedule.machines == (Activity("oven", "process", 1, "oven", "oven", 3, 12.5),)


@pytest.mark.parametrize(
    ("kind", "start_s", "end_s", "says"),
    [
        ("carry", 2, 1, "it ends before it starts"),
        ("carry", 0, np.nan, "times must be finite"),
        ("fly", 0, 1, "unknown kind 'fly'"),
    ],
)
def test_bad_activities(kind: str, start_s: float, end_s: float, says: str) -> None:
    activity = Activity("robot", kind, 1, "in", "oven", start_s, end_s)  # type: ignore[arg-type]
    with pytest.raises(BadInput, match=says):
        Schedule((activity,), (), (), 2.0, (1,))


def test_pallets_and_vacuuming_are_rows_of_their_own(fms_cell: CellMaker) -> None:
    """One sign: see `test_a_sign_takes_five_moves_and_its_pallet_follows` for the times."""
    schedule = simulate(fms_cell("S"), [1] * 5)
    assert [(a.kind, a.start_s, a.end_s) for a in schedule.robot] == [
        ("wait", 0, 200),
        ("carry", 200, 230),
        ("carry", 230, 280),
        ("empty", 280, 305),
        ("pallet", 305, 320),
        ("empty", 320, 345),
        ("wait", 345, 880),
        ("service", 880, 1120),
        ("carry", 1120, 1145),
        ("carry", 1145, 1175),
    ]
    assert [(a.kind, a.start_s, a.end_s) for a in schedule.machines] == [("process", 280, 880), ("blocked", 880, 1120)]
    assert schedule.parts[0] == Activity("sign 1", "carry", 1, "incoming", "mill in", 200, 230)
    assert schedule.makespan_s == 1175


# ---- schedule rows ----------------------------------------------------------------------------------------------------


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
    read = list(csv.DictReader(StringIO(csv_of(rows, COLUMNS))))
    assert [{name: "" if value is None else str(value) for name, value in row.items()} for row in rows] == read
    assert float(read[-1]["end_s"]) == 14.0


def test_a_row_without_a_part_has_empty_fields(cell: Cell) -> None:
    two = Cell(cell.stations, cell.products, ("toast", "toast"), cell.empty_s, cell.loaded_s, one_robot("in"))
    rows = rows_of(simulate(two, [1, 1, 2, 2]), two, "planned")
    (empty,) = {(row["part"], row["product"]) for row in rows if row["operation"] == "empty"}
    assert empty == (None, None)
    assert "\n,,empty,out,in,robot," in csv_of(rows, COLUMNS)


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
    assert (tmp_path / "plan.csv").read_text() == csv_of(rows, COLUMNS)
    write_table(rows, tmp_path / "plan.json")
    assert json.loads((tmp_path / "plan.json").read_text()) == rows
    with pytest.raises(BadInput, match=r"wanted a file that ends with \.csv or \.json"):
        write_table(rows, tmp_path / "plan.txt")
    with pytest.raises(BadInput, match="there is no folder"):
        write_table(rows, tmp_path / "nowhere" / "plan.csv")
