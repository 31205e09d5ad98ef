"""Exact values: what each decision still costs at best."""

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.exact import ExactValues, optimum
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]


def test_one_toast_by_hand(oven_cell: CellMaker) -> None:
    """2 s to the oven, 10 s in it, 2 s out."""
    run = Run(oven_cell(1))
    values = ExactValues(run.cell)
    assert values.of(run, run.allowed()) == [14.0]
    run.move(1)
    assert values.of(run, run.allowed()) == [12.0]


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_the_best_value_is_the_optimum_and_leads_to_it(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject
) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=3, many=True))
    run, values, best_s = Run(cell), ExactValues(cell), optimum(cell).cost
    while allowed := run.allowed():
        left_s = values.of(run, allowed)
        assert run.now_s + min(left_s) == pytest.approx(best_s, abs=1e-5)
        run.move(allowed[left_s.index(min(left_s))])
    assert run.now_s == pytest.approx(best_s, abs=1e-5)


def test_too_many_parts_to_know(toast_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="41 parts are too many, at most 40"):
        ExactValues(toast_cell("I", 41))
