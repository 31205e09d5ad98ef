"""A policy that goes on learning while the work goes on: in the cell's own times it does what the optimum does."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.srl_time_reacting import reacting
from lab.sequencing.simulate.execution import replicate
from lab.sequencing.simulate.merged import Flow, Layout
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]
Cells = Callable[..., st.SearchStrategy[Cell]]


@pytest.mark.parametrize("case", ["I", "II", "III"])
def test_without_chance_it_carries_out_the_optimum(toast_cell: CellMaker, case: str) -> None:
    cell = toast_cell(case, 3)
    assert replicate(cell, reacting(cell), NO_CHANCE, 1, 0) == pytest.approx([optimum(cell).cost])


def test_it_is_not_bound_to_a_list_when_a_part_comes_late(fms_cell: CellMaker) -> None:
    """Exponential arrivals: in the same episodes it needs less time on average than the list that is best by the means."""
    cell, chance = fms_cell("RSR", 200), Chance("constant", "exponential")
    fixed = replicate(cell, optimum(cell).sequence, chance, 60, 1)
    reacts = replicate(cell, reacting(cell), chance, 60, 1)
    assert reacts.mean() < fixed.mean()


def test_same_seed_same_costs(toast_cell: CellMaker) -> None:
    cell = toast_cell("I", 2)
    one, other = (replicate(cell, reacting(cell, seed=3), Chance(), 5, 1) for _ in range(2))
    assert np.array_equal(one, other)


@given(data=st.data())
def test_a_flow_goes_on_from_a_run(cells: Cells, data: st.DataObject) -> None:
    """Built from a run on its way, a flow allows the same and ends at the same time as one that took the same way."""
    cell = data.draw(cells(max_machines=2, max_parts=4, many=True))
    layout = Layout.of(cell)
    flow, run = Flow(layout), Run(cell)
    for _ in range(data.draw(st.integers(0, 8))):
        if actions := list(flow.actions()):
            run.move(flow.take(data.draw(st.sampled_from(actions))))
    other = Flow.from_run(layout, run)
    while actions := list(flow.actions()):
        assert list(other.actions()) == actions
        action = data.draw(st.sampled_from(actions))
        assert flow.take(action) == other.take(action)
        assert other.now == pytest.approx(flow.now, abs=10)
        assert other.least_left() == pytest.approx(flow.least_left(), abs=100)
