"""Pointless stopovers are left out: by hand, and on drawn cells."""

from collections.abc import Callable

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import OBJECTIVES, cost
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.methods.portfolio import fewer_moves
from lab.sequencing.simulate.follow import follow, simulate
from lab.sequencing.simulate.run import Run


def buffered_cell(parts: int) -> Cell:
    """in > (buffer) > oven, 10 s > out: the buffer may be used, or not; every way takes 1 s."""
    stations = (
        Station("in", "storage", 9),
        Station("buffer", "buffer", 9),
        Station("oven", "machine", 1, 10.0),
        Station("out", "storage", 9),
    )
    product = Product("toast", ((Stage("in"), Stage("oven", "buffer"), Stage("out")),))
    table = 1.0 - np.eye(4)
    return Cell(stations, (product,), ("toast",) * parts, table, table, one_robot("in"), buffers="free")


def ways(cell: Cell, sequence: tuple[int, ...]) -> list[tuple[str, str]]:
    run = Run(cell)
    return [(move.origin, move.target) for move in map(run.move, sequence)]


def through_the_buffer(cell: Cell) -> tuple[int, ...]:
    """The decisions of a single part that stops over."""
    run, taken = Run(cell), list[int]()
    while not run.done:
        before = len(taken)
        for decision in run.allowed():
            option = run.option(decision)
            assert option is not None
            if cell.names[option.target] == "buffer" or len(run.allowed()) == 1:
                taken.append(decision)
                run.move(decision)
                break
        assert len(taken) > before
    return tuple(taken)


def test_a_stopover_for_nothing_is_left_out() -> None:
    """in > buffer > oven > out, 1 + 1 + 10 + 1 s, becomes in > oven > out, 1 + 10 + 1 s."""
    cell = buffered_cell(1)
    stopping = through_the_buffer(cell)
    assert ways(cell, stopping) == [("in", "buffer"), ("buffer", "oven"), ("oven", "out")]
    straight = fewer_moves(cell, stopping)
    assert ways(cell, straight) == [("in", "oven"), ("oven", "out")]
    assert (simulate(cell, stopping).makespan_s, simulate(cell, straight).makespan_s) == (13.0, 12.0)


def test_a_straight_order_stays_as_it_is() -> None:
    cell = buffered_cell(1)
    straight = fewer_moves(cell, through_the_buffer(cell))
    assert fewer_moves(cell, straight) == straight


@settings(max_examples=60, deadline=None)
@given(data=st.data(), objective=st.sampled_from(sorted(OBJECTIVES)))
def test_it_costs_no_more_and_makes_no_more_moves(
    cells: Callable[..., SearchStrategy[Cell]], data: st.DataObject, objective: str
) -> None:
    cell = data.draw(cells(many=True))
    run, sequence = Run(cell), list[int]()
    while allowed := run.allowed():
        sequence.append(data.draw(st.sampled_from(allowed)))
        run.move(sequence[-1])
    if not run.done:
        return
    fewer = fewer_moves(cell, sequence, objective)
    assert len(fewer) <= len(sequence)
    assert follow(cell, fewer).done
    assert cost(follow(cell, fewer), objective) <= cost(run, objective) + 1e-6
