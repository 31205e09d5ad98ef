"""Deadlocks: what cannot be finished is told from what only takes care, and the way out is a way."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from lab.cellfile import CellFile
from lab.errors import WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.simulate.deadlock import completion, forced
from lab.sequencing.simulate.run import Run, simulate
from lab.taskfile import load_cell, names_of
from lab.tomltext import TomlText

# A lathe and a mill with room for one part each and no buffers: pins go through them one way, nuts the other; an oven
# for caps stands beside them.
CROSSING = """
kind = "cell"
name = "crossing"
order = ["pin", "nut", "cap"]
stations = [
  { name = "in", kind = "storage", capacity = 9 },
  { name = "lathe", kind = "machine", capacity = 1, processing_s = 1 },
  { name = "mill", kind = "machine", capacity = 1, processing_s = 1 },
  { name = "oven", kind = "machine", capacity = 1, processing_s = 1 },
  { name = "out", kind = "storage", capacity = 9 },
]
products = [
  { name = "pin", routes = [["in", "lathe", "mill", "out"]] },
  { name = "nut", routes = [["in", "mill", "lathe", "out"]] },
  { name = "cap", routes = [["in", "oven", "out"]] },
]
robot.start = "in"
[travel]
in = { lathe = 1, mill = 1, oven = 1, out = 1 }
lathe = { in = 1, mill = 1, oven = 1, out = 1 }
mill = { in = 1, lathe = 1, oven = 1, out = 1 }
oven = { in = 1, lathe = 1, mill = 1, out = 1 }
out = { in = 1, lathe = 1, mill = 1, oven = 1 }
"""


def crossing(*order: str) -> Cell:
    return CellFile.checked(TomlText.parsed(Path("crossing.toml"), CROSSING)).cell(order)


def after(cell: Cell, *decisions: int) -> Run:
    run = Run(cell)
    for decision in decisions:
        run.move(decision)
    return run


def finishes(cell: Cell, decisions: tuple[int, ...], tried: set[tuple[int, ...]]) -> bool:
    """Whether some sequence that begins with these decisions finishes, by trying all; `tried`: places of parts that do not."""
    run = after(cell, *decisions)
    if run.done:
        return True
    if tuple(run.locations) in tried:
        return False
    tried.add(tuple(run.locations))
    return any(finishes(cell, (*decisions, decision), tried) for decision in run.allowed())


def test_a_part_in_each_of_two_crossing_machines_is_a_deadlock() -> None:
    run = after(crossing("pin", "nut"), 1, 2)
    said = "deadlock: pin 1 at 'lathe' cannot move on: 'mill' full; nut 2 at 'mill' cannot move on: 'lathe' full"
    assert run.deadlock() == said
    assert completion(run) is None


def test_what_is_bound_for_a_deadlock_is_known_before() -> None:
    run = after(crossing("pin", "nut", "cap"), 1, 2)
    assert run.allowed() == (3,)
    assert run.deadlock() is None
    assert completion(run) is None
    assert completion(after(crossing("pin", "nut", "cap"), 1, 3)) == (3, 1, 1, 2, 2, 2)


def test_from_the_start_one_part_after_the_other_gets_through() -> None:
    cell = crossing("pin", "nut", "pin")
    assert forced(cell) is None
    way = completion(Run(cell))
    assert way is not None
    assert len(simulate(cell, way).sequence) == 9


@pytest.mark.parametrize("name", names_of("cell"))
def test_no_cell_that_ships_is_a_deadlock(name: str) -> None:
    cell = load_cell(name).cell()
    assert forced(cell) is None
    way = completion(Run(cell))
    assert way is not None
    assert simulate(cell, way).makespan_s > 0


def test_a_cell_that_asks_for_the_room_it_takes_is_a_forced_deadlock() -> None:
    """Rules of today never do: the positions are laid by hand, so that a part in the lathe needs room in the lathe."""
    cell = crossing("nut", "pin", "pin")
    places = list(cell.positions)
    lathe = cell.names.index("lathe")
    stuck = next(n for n, p in enumerate(places) if (p.product, p.station) == (0, lathe))
    (way,) = places[stuck].options
    places[stuck] = replace(places[stuck], options=(replace(way, needs=(lathe,)),))
    cell.__dict__["positions"] = tuple(places)
    said = forced(cell)
    assert said is not None
    assert said.startswith("deadlock: ")
    assert "pin 2 at 'lathe' cannot move on: 'lathe' full" in said
    assert forced(cell, most=5) is None  # so few do not tell
    with pytest.raises(WorkFailed, match="5 states did not suffice"):
        completion(Run(cell), most=5)


def test_a_finished_run_needs_nothing() -> None:
    assert completion(after(crossing("pin"), 1, 1, 1)) == ()


@settings(max_examples=100)
@given(data=st.data())
def test_there_is_a_way_out_just_where_trying_all_finds_one(
    data: st.DataObject, cells: Callable[..., SearchStrategy[Cell]]
) -> None:
    cell = data.draw(st.one_of(cells(max_parts=3, max_machines=1, many=True), crossings()))
    run = Run(cell)
    begun: list[int] = []
    while (allowed := run.allowed()) and len(begun) < 6 and data.draw(st.booleans()):
        begun.append(data.draw(st.sampled_from(allowed)))
        run.move(begun[-1])
    before = deepcopy(run.locations), run.now_s, deepcopy(run.ready_s)
    way = completion(run)
    assert (run.locations, run.now_s, run.ready_s) == before
    assert (way is not None) == finishes(cell, tuple(begun), set())
    for decision in way or ():
        run.move(decision)
    assert run.done == (way is not None)


@given(data=st.data())
def test_from_the_start_there_always_is_a_way(data: st.DataObject, cells: Callable[..., SearchStrategy[Cell]]) -> None:
    cell = data.draw(cells(max_parts=5, max_machines=3, many=True))
    assert forced(cell) is None
    assert completion(Run(cell)) is not None


@st.composite
def crossings(draw: st.DrawFn) -> Cell:
    """The crossing cell with a random short order and some room."""
    cell = crossing(*draw(st.lists(st.sampled_from(["pin", "nut", "cap"]), min_size=1, max_size=4)))
    room = draw(st.integers(1, 2))
    stations = tuple(replace(one, capacity=room) if one.name == "mill" else one for one in cell.stations)
    return replace(cell, stations=stations, empty_s=np.array(cell.empty_s), loaded_s=np.array(cell.loaded_s))
