"""The shortest period of an order, by hand."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cyclic.cycle import shortest_period
from lab.sequencing.cyclic.line import Line, lines
from lab.sequencing.simulate.follow import Arc, earliest

CellMaker = Callable[..., Cell]


def line_of(cell: Cell, parts: int = 1) -> Line:
    (line,) = lines(cell, ("toast",) * parts)
    return line


def test_an_oven(oven_cell: CellMaker) -> None:
    """2 s into the oven, 10 s in it, 2 s out, 1 s back."""
    line = line_of(oven_cell())
    timed = shortest_period(line, (0, 1), (0,))
    assert timed is not None
    assert (timed.period_s, timed.begin_s, timed.recurs) == (15.0, (0.0, 12.0), 1)


@pytest.mark.parametrize(("at_most_s", "period_s"), [(None, 5.0), (100.0, 5.0), (0.0, None)])
def test_two_parts_in_the_oven_at_once(oven_cell: CellMaker, at_most_s: float | None, period_s: float | None) -> None:
    """A toast of the cycle before is fetched in each: the robot's 2 + 0 + 2 + 1 s, or the oven's, 10 s in two cycles and 1 s."""
    cell = oven_cell()
    cell = replace(cell, stations=tuple(replace(one, capacity=3) for one in cell.stations))
    if at_most_s is not None:
        window = replace(cell.stations[1], at_most_s=at_most_s)
        cell = replace(cell, stations=(cell.stations[0], window, cell.stations[2]))
    timed = shortest_period(line_of(cell), (0, 1), (3,))
    if period_s is None:  # three cycles and what is left of the fourth take 10 s, in cycles of 5 s and more: never
        assert timed is None
    else:
        assert timed is not None
        assert timed.period_s == period_s


def test_a_circle_that_cannot_be_kept_is_found() -> None:
    """Each of two moves is to begin a second after the other one."""
    arcs = [Arc(0, 1, 1.0, 0), Arc(1, 0, 1.0, 0), Arc(1, 2, 5.0, 0)]
    _, broken = earliest(arcs, 3, 0, 0.0)
    assert sorted(broken) == arcs[:2]
    begin_s, broken = earliest(arcs[::2], 3, 0, 0.0)
    assert (begin_s, broken) == ([0.0, 1.0, 6.0], [])


def test_a_way_that_is_never_made_has_no_period(oven_cell: CellMaker) -> None:
    """The empty ways of a cell for one toast alone do not lead back to the beginning."""
    cell = oven_cell(1)
    empty_s = cell.empty_s.copy()
    empty_s[2, 0] = float("nan")
    assert shortest_period(line_of(replace(cell, empty_s=empty_s)), (0, 1), (0,)) is None
