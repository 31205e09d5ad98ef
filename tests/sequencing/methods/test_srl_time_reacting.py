"""A policy that goes on learning while the work goes on: in the cell's own times it does what the optimum does."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.srl_time import reacting
from lab.sequencing.simulate.several import replicate

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
