"""The moves of a cycle, and a bound on its period."""

from collections.abc import Callable

import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cyclic.line import LineSpan, away_s, lines

CellMaker = Callable[..., Cell]


def test_each_way_is_a_line(toast_cell: CellMaker) -> None:
    """Two buffers that may be used or not: four ways; two toasts alike: ten pairs of them."""
    assert [len(line.moves) for line in lines(toast_cell("I", 2), ("toast",))] == [3, 4, 4, 5]
    assert sum(1 for _ in lines(toast_cell("I", 2), ("toast", "toast"))) == 10


def test_what_processing_asks_for(oven_cell: CellMaker) -> None:
    (line,) = lines(oven_cell(), ("toast",))
    assert [(move.place, move.work_s) for move in line.moves] == [(0, 2.0), (1, 2.0)]
    assert line.needs == (LineSpan(0, 1, 10.0),)
    assert line.holds == {1: (0,)}


def test_a_pallet_does_not_hide_the_processing(fms_cell: CellMaker) -> None:
    """The part is on the mill while its pallet is brought on; before the robot takes it, it serves the mill."""
    (line,) = lines(fms_cell("SS"), ("sign",))
    carries = [move.option.carries for move in line.moves]
    assert carries == ["part", "part", "pallet", "part", "part"]
    assert LineSpan(1, 3, 600.0) in line.needs
    assert line.moves[3].work_s == 240.0 + 25.0


def test_the_bound_by_hand(oven_cell: CellMaker) -> None:
    """The robot: 2 + 0 + 2 + 1 s; the oven: 10 s, and 2 + 1 + 2 s from one toast to the next."""
    (line,) = lines(oven_cell(), ("toast",))
    assert line.bound_s(away_s(line.cell)) == 15.0
    assert line.longest_s >= 15.0


def test_too_many_ways(toast_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match=r"product 'toast' has 4 .* too many for a cycle of 30 parts"):
        next(lines(toast_cell("I", 2), ("toast",) * 30))


def test_too_many_moves(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="a cycle of 61 parts has 122 moves; allowed are 120"):
        next(lines(oven_cell(), ("toast",) * 61))
