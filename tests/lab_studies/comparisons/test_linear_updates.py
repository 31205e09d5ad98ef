"""Updates of linear values step by step: what they learn where there is one sequence, and that they learn at all."""

from collections.abc import Callable

import pytest

from lab.sequencing import find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.search import Search
from lab_studies.comparisons.linear_updates import UPDATES, Simulation, UpdateOutcome

CellMaker = Callable[..., Cell]


@pytest.mark.parametrize("name", UPDATES)
def test_one_part_has_one_sequence(oven_cell: CellMaker, name: str) -> None:
    """2 s, 10 s of work, 2 s."""
    assert UPDATES[name](oven_cell(1), 3, 0) == UpdateOutcome(14.0, 14.0)


def test_an_episode_has_the_choices_among_several(oven_cell: CellMaker) -> None:
    """Two parts at the start at 0 s: the first of two decisions; from then on the oven leaves one decision at a time."""
    cost, choices = Simulation(oven_cell(2)).episode(lambda features: (1, features[:, 0]))
    assert cost == 29.0
    assert [(one.chosen, one.now_s, len(one.features)) for one in choices] == [(1, 0.0, 2)]


@pytest.mark.parametrize("name", UPDATES)
def test_it_is_repeated_and_never_below_the_optimum(toast_cell: CellMaker, name: str) -> None:
    cell = toast_cell("I", 4)
    found = UPDATES[name](cell, 40, 1)
    assert found == UPDATES[name](cell, 40, 1)
    assert found.cost >= find_sequence(cell, "exact", Search(1), 0).cost
