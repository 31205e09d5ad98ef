"""The best order in hindsight: the optimum where nothing is drawn, and never above what a policy came to."""

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance, Episode
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.follow import follow
from lab.tasks.task_file import load_cell
from lab_studies.comparisons.hindsight import in_hindsight, known_cell

CellMaker = Callable[..., Cell]
CHANCE = Chance("exponential", breaks_every_s=50.0, repair_s=20.0, late_s=30.0)


@pytest.mark.parametrize("order", ["R", "SR", "RSR"])
def test_without_chance_it_is_the_optimum(fms_cell: CellMaker, order: str) -> None:
    cell = fms_cell(order)
    assert in_hindsight(cell, Episode(cell, NO_CHANCE, 0)).cost == optimum(cell).cost


@settings(max_examples=15)
@given(episode=st.integers(0, 1000))
def test_the_known_cell_is_the_episode(toast_cell: CellMaker, fms_cell: CellMaker, episode: int) -> None:
    """The same list comes to the same end in both, and no list is better than in hindsight."""
    for cell in (toast_cell("I", 3), fms_cell("SR")):
        times, best = Episode(cell, CHANCE, episode), optimum(cell).sequence
        kept = follow(cell, best, times)
        assert follow(known_cell(cell, times), best).end_s == pytest.approx(kept.end_s)
        assert in_hindsight(cell, times).cost <= kept.end_s + 1e-6


def test_of_several_robots_it_is_a_bound() -> None:
    """Two robots, one box: 10 s to a press, 30 s there, 10 s out, whoever breaks down."""
    cell = load_cell("two-carriers").cell(1)
    chance = Chance("constant", robot_breaks_every_s=20.0, robot_repair_s=20.0)
    found = in_hindsight(cell, Episode(cell, chance, 4))
    assert found.cost == pytest.approx(50.0)
    assert not found.proven
    assert in_hindsight(cell, Episode(cell)).proven
