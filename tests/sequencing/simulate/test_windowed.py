"""States with waits on purpose: what they come to is what a list comes to, and the best of them is the best of all lists."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DataObject, SearchStrategy

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.cell.ways import TICKS_PER_S
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.follow import simulate, steps
from lab.sequencing.simulate.merged import MergedCell
from lab.sequencing.simulate.rest import rest_of
from lab.sequencing.simulate.run import Run, branch
from lab.sequencing.simulate.windowed import WindowedCell

Cells = Callable[..., SearchStrategy[Cell]]
SIZES = st.sampled_from([(1, 3, False), (2, 2, False), (1, 2, True), (2, 2, True)])


def two_tanks(first_at_most_s: float = 10.0) -> Cell:
    """Two tanks, 10 s and 50 s, to be left within 10 s; each way, empty or loaded, takes 5 s."""
    tanks = (Station("t1", "machine", 1, 10.0, first_at_most_s), Station("t2", "machine", 1, 50.0, 10.0))
    stations = (Station("in", "storage", 9), *tanks, Station("out", "storage", 9))
    table = 5.0 * (1.0 - np.eye(4))
    route = tuple(Stage(station.name) for station in stations)
    return Cell(stations, (Product("p", (route,)),), ("p",) * 2, table, table, one_robot("in"))


def lists(run: Run, made: tuple[int, ...] = ()) -> Iterator[tuple[int, ...]]:
    """All lists of decisions from a run on, to the end."""
    if run.done:
        yield made
    for decision in run.allowed():
        ahead = branch(run)
        ahead.move(decision)
        yield from lists(ahead, (*made, decision))


def least_s(cell: Cell) -> float:
    """The shortest makespan of all lists, each with the waits that it needs; infinite: no list can be kept to."""
    found = [inf]
    for made in lists(Run(cell.without_windows)):
        try:
            found.append(simulate(cell, made).makespan_s)
        except BadInput:
            continue
    return min(found)


def proven_s(cell: Cell) -> float:
    """The optimum; infinite: it is proven that there is none."""
    try:
        best = optimum(cell)
    except WorkFailed as error:
        if "is proven: all were tried" in str(error):
            return inf
        raise
    assert best.proven
    assert best.cost == simulate(cell, best.sequence).makespan_s
    return best.cost


@pytest.mark.parametrize("at_most_s", [10.0, 5.0, 5.0 - 2e-7])
def test_a_part_is_brought_later_so_that_it_is_not_spoilt(at_most_s: float) -> None:
    """Part 1 is in the second tank from 20 to 70 s, and out at 75 s; part 2 can be taken out of the first one at 80 s, and is out
    at 140 s. It has to be brought to the first tank before, but so late that it is done at 70 s or later. Three ways, 15 s,
    are between that and its pick, 5 s longer than it is in work: a window of 5 s is enough, and less than a microsecond too short
    is no matter."""
    cell = two_tanks(at_most_s)
    found = optimum(cell)
    assert found.proven
    assert found.cost == pytest.approx(140.0, abs=1e-6)
    assert sum(wait.pick_s + wait.drop_s for *_, wait in steps(cell, found.sequence)) > 0
    assert optimum(two_tanks(4.0)).cost == 2 * (5 + 10 + 5 + 50 + 5) + 5  # one after the other


def test_a_row_says_what_is_put_off_with_a_part() -> None:
    """Part 1 is in the second tank, part 2 was just brought to the first one, 10 s before it is ready: if that is put off, so is
    all that is done now. Once part 1 is out, at 75 s, part 2 is picked at 80 s at the least, so it is ready at 70 s or later."""
    states = WindowedCell(two_tanks())
    state, slot = states.start(), states.slots[1]
    for place in (0, 1, 0):
        state = next(ahead for ahead in states.successors(state) if ahead.way and ahead.way.place == place)
    assert [(row.now, row.waits[slot]) for row in state.rows[slot]] == [(-10 * TICKS_PER_S, (0,))]
    assert state.waits[slot] == (40 * TICKS_PER_S,)
    [ahead] = states.successors(state)
    assert ahead.waits[slot] == (70 * TICKS_PER_S,)


def test_a_window_as_long_as_rounded_ways_is_kept_to() -> None:
    """Six ways of two thirds of a second; each part is picked two ways after it is done, which is the window. In whole
    nanoseconds two ways are longer than that."""
    stations = (Station("in", "storage", 9), Station("oven", "machine", 2, 0.0, 4 / 3), Station("out", "storage", 9))
    table = 2.0 * (1.0 - np.eye(3))
    empty = table + 98.0 * np.array([[0, 0, 0], [0, 0, 0], [1, 0, 0]])
    route = tuple(Stage(station.name) for station in stations)
    robots = (replace(one_robot("in")[0], speed=3.0),)
    cell = Cell(stations, (Product("p", (route,)),), ("p",) * 2, empty, table, robots)
    assert proven_s(cell) == pytest.approx(4.0, abs=1e-6)


@settings(max_examples=40, deadline=None)
@given(data=st.data(), size=SIZES)
def test_the_optimum_is_the_best_of_all_lists(cells: Cells, data: DataObject, size: tuple[int, int, bool]) -> None:
    cell = data.draw(cells(*size, windows=True))
    assert proven_s(cell) == pytest.approx(least_s(cell), abs=2e-6)


@settings(max_examples=20, deadline=None)
@given(data=st.data(), size=SIZES)
def test_it_is_so_in_the_middle_of_the_work(cells: Cells, data: DataObject, size: tuple[int, int, bool]) -> None:
    """What stands in a machine already cannot be put off any more."""
    cell = data.draw(cells(*size, windows=True))
    if proven_s(cell) == inf:
        return
    sequence = optimum(cell).sequence
    stop = data.draw(st.integers(0, len(sequence) - 1))
    for number, (run, decision, wait) in enumerate(steps(cell, sequence)):
        if number == stop:
            break
        run.move(decision, wait)
    rest = rest_of(run).cell
    assert rest is not None
    assert proven_s(rest) == pytest.approx(least_s(rest), abs=2e-6)


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_a_walk_ends_when_its_list_does(cells: Cells, data: DataObject) -> None:
    """And the same walk without windows ends no later."""
    cell = data.draw(cells(max_machines=2, max_parts=4, many=True, windows=True))
    states, free = WindowedCell(cell), MergedCell(cell.without_windows)
    state = states.start()
    while ahead := list(states.successors(state)):
        state = data.draw(st.sampled_from(ahead))
    if not states.done(state):
        return
    made = states.decisions(state)
    assert state.now / TICKS_PER_S == pytest.approx(simulate(cell, made).makespan_s, abs=2e-6)
    assert simulate(free.cell, made).makespan_s <= state.now / TICKS_PER_S + 2e-6
