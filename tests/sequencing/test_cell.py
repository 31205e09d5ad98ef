"""The rules of a cell, and what it refuses."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell import Cell, Stage, Station, needed_moves

CellMaker = Callable[..., Cell]
PLATE, TOASTER_BUFFER, TOASTER, BUTTER_BUFFER, BUTTER, DONE = range(6)


@pytest.mark.parametrize(
    ("locations", "toast", "expected"),
    [
        ((PLATE, PLATE), 1, TOASTER),
        ((TOASTER, PLATE), 2, TOASTER_BUFFER),
        ((TOASTER, PLATE), 1, BUTTER),
        ((BUTTER, TOASTER), 2, BUTTER_BUFFER),
        ((TOASTER, TOASTER_BUFFER), 2, None),
        ((BUTTER, TOASTER_BUFFER), 2, TOASTER),
        ((BUTTER, BUTTER_BUFFER), 2, None),
        ((DONE, BUTTER_BUFFER), 2, BUTTER),
        ((BUTTER, DONE), 1, DONE),
        ((BUTTER, DONE), 2, None),
    ],
)
def test_destination(toast_cell: CellMaker, locations: tuple[int, ...], toast: int, expected: int | None) -> None:
    assert toast_cell("I", 2).destination(locations, toast) == expected


def test_the_example_of_the_thesis(toast_cell: CellMaker) -> None:
    """Ch. 7.5: at (3, 2, 1) toasts 1 and 3 can move, toast 2 cannot: the toaster is loaded."""
    cell = toast_cell("I", 3)
    locations = (TOASTER, TOASTER_BUFFER, PLATE)
    assert cell.allowed(locations) == (1, 3)
    assert cell.names[cell.destination(locations, 1) or 0] == "butter"
    assert cell.names[cell.destination(locations, 3) or 0] == "toaster buffer"
    assert cell.refusal(locations, 2) == "toast 2 at 'toaster buffer' cannot move on: 'toaster' full"


def test_full_buffer_stops_the_move(toast_cell: CellMaker) -> None:
    cell = toast_cell("I", 3, buffer_room=1)
    assert cell.allowed((TOASTER, TOASTER_BUFFER, PLATE)) == (1,)
    assert "'toaster' and 'toaster buffer' full" in str(cell.refusal((TOASTER, TOASTER_BUFFER, PLATE), 3))


def test_without_a_buffer_a_full_machine_stops_the_move(oven_cell: CellMaker) -> None:
    assert oven_cell().allowed((1, 0)) == (1,)


@given(data=st.data())
def test_never_a_deadlock(cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject) -> None:
    """Whatever is picked, some toast can move until all are at the end, and no station holds more than it can."""
    cell = data.draw(cells(max_machines=3, max_toasts=5))
    locations = list(cell.start_locations())
    while any(station != cell.last for station in locations):
        toast = data.draw(st.sampled_from(cell.allowed(locations)))
        locations[toast - 1] = cell.destination(locations, toast) or 0
        assert all(count <= room for count, room in zip(cell.counts(locations), cell.capacities, strict=True))
    assert cell.allowed(locations) == ()


def test_needed_moves_of_the_toast_cell(toast_cell: CellMaker) -> None:
    """They are moves that table 7.2 has, all but 4 -> 3 (just emptied) and those that are only made loaded."""
    cell = toast_cell("I", 3)
    moves = needed_moves(cell.stations, cell.route, cell.robot_start, cell.toasts)
    number = {name: index + 1 for index, name in enumerate(cell.names)}
    loaded = {(number[a], number[b]) for a, b in moves.loaded}
    empty = {(number[a], number[b]) for a, b in moves.empty}
    assert loaded == {(1, 2), (1, 3), (2, 3), (3, 4), (3, 5), (4, 5), (5, 6)}
    printed = {(row + 1, column + 1) for row, column in np.argwhere(~np.isnan(cell.empty_s))}
    assert printed - empty == {(1, 2), (1, 3), (4, 3), (5, 6)}
    assert empty <= printed


def test_one_toast_needs_no_empty_way_back(oven_cell: CellMaker) -> None:
    nowhere = np.full((3, 3), np.nan)
    assert oven_cell(1, empty_s=nowhere).toasts == 1
    with pytest.raises(BadInput, match="empty_s 'oven' -> 'in' is missing"):
        oven_cell(2, empty_s=nowhere)


def test_tables_are_copies_that_cannot_be_written(oven_cell: CellMaker) -> None:
    given_table = np.ones((3, 3)) - np.eye(3)
    cell = oven_cell(empty_s=given_table)
    given_table[0, 1] = 99
    assert cell.empty_s[0, 1] == 1
    with pytest.raises(ValueError, match="read-only"):
        cell.empty_s[0, 1] = 5


IN, OVEN, OUT = Station("in", "storage", 9), Station("oven", "machine", 1, 10.0), Station("out", "storage", 9)
ROUTE = (Stage("in"), Stage("oven"), Stage("out"))


def table(value: float) -> np.ndarray:
    """Times of 1 s, and `value` from in to oven."""
    times = np.ones((3, 3)) - np.eye(3)
    times[0, 1] = value
    return times


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"toasts": 0}, "toasts = 0: allowed are 1 to 50"),
        ({"toasts": 51}, "toasts = 51"),
        ({"toasts": True}, "toasts = True"),
        ({"toasts": 10}, "'in': capacity 9 cannot hold all 10"),
        ({"robot_start": "ovn"}, "unknown station 'ovn'.*did you mean 'oven'"),
        ({"stations": (IN, OVEN, OVEN, OUT)}, "'oven': the name is used twice"),
        ({"stations": (IN, Station("robot", "machine", 1), OUT)}, "name other rows"),
        ({"stations": (IN, Station("oven", "grill", 1), OUT)}, "unknown kind 'grill'"),  # type: ignore[arg-type]
        ({"stations": (IN, Station("oven", "machine", 0), OUT)}, "capacity = 0"),
        ({"stations": (IN, Station("oven", "machine", 1, -1.0), OUT)}, "processing_s = -1.0"),
        ({"stations": (IN, Station("oven", "machine", 1, np.nan), OUT)}, "processing_s = nan"),
        ({"stations": (Station("in", "storage", 9, 3.0), OVEN, OUT)}, "only a machine processes"),
        ({"route": (Stage("in"),)}, "at least 2"),
        ({"route": (Stage("in"), Stage("ovens"), Stage("out"))}, "unknown station 'ovens'.*stage 2.*'oven'"),
        ({"route": (Stage("in"), Stage("oven"), Stage("oven"), Stage("out"))}, "'oven' is on the route twice"),
        ({"route": (Stage("in", "oven"), Stage("out"))}, "buffer 'oven' before the start"),
        ({"route": (Stage("in"), Stage("out", "oven"))}, "'oven' is a machine; a buffer fits"),
        ({"route": (Stage("in"), Stage("oven"))}, "'oven' is a machine; a route starts and ends in storage"),
        ({"loaded_s": table(np.nan)}, "loaded_s 'in' -> 'oven' is missing"),
        ({"loaded_s": table(-1)}, "loaded_s 'in' -> 'oven' = -1"),
        ({"empty_s": table(np.inf)}, "empty_s 'in' -> 'oven' = inf"),
        ({"empty_s": np.ones((3, 3))}, "'in' -> 'in' = 1.0; staying takes 0 s"),
        ({"empty_s": np.ones((2, 3))}, r"shape \(2, 3\); 3 stations need \(3, 3\)"),
    ],
)
def test_bad_cells(oven_cell: CellMaker, change: dict[str, object], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        oven_cell(**change)
