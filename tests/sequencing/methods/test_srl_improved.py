"""SRL improved: what is learned can be read, and it is learned from what was improved."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import BUILT_IN, cost
from lab.sequencing.methods.priorities import Orders
from lab.sequencing.methods.srl_improved import SPREAD, srl_improved
from lab.sequencing.search import EpisodeSequenced, Search
from lab.sequencing.simulate.cell_arrays import moves_each
from lab.sequencing.simulate.follow import follow, simulate

CellMaker = Callable[..., Cell]
Cells = Callable[..., st.SearchStrategy[Cell]]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_one_part_by_hand(oven_cell: CellMaker) -> None:
    """Two moves: they belong to the first and second half of the order, and every lesson says so again: the spread falls."""
    result = srl_improved(oven_cell(1), Search(200), rng())
    assert (result.sequence, result.cost, result.final_cost) == ((1, 1), 14.0, 14.0)
    assert result.place == pytest.approx((0.25, 0.75))
    assert result.ways == ((1.0,), (1.0,))
    assert max(result.spread) < 0.01 * SPREAD


def test_it_finds_a_published_optimum_and_learns(ex11: Callable[[int], Cell]) -> None:
    """EX11 of Bilge and Ulusoy 1995 with two vehicles: 96. By the end it is sure where moves belong."""
    result = srl_improved(ex11(2), Search(200_000), rng())
    assert result.cost == 96.0
    assert np.mean(result.spread) < SPREAD
    begins = np.cumsum([0, *moves_each(ex11(2))])
    for first, last in pairwise(begins.tolist()):
        assert list(result.place[first:last]) == sorted(result.place[first:last])
    assert np.array(result.ways).sum(axis=1) == pytest.approx(1.0)


@pytest.mark.parametrize("episodes", [1, 4, 5, 6, 333])
def test_the_budget_is_kept_and_every_episode_told(ex11: Callable[[int], Cell], episodes: int) -> None:
    seen: list[EpisodeSequenced] = []
    result = srl_improved(ex11(2), Search(episodes, on_episode=seen.append), rng())
    assert len(result.episode_costs) == episodes
    assert tuple(one.cost for one in seen) == result.episode_costs
    assert simulate(ex11(2), result.sequence).makespan_s == result.cost == min(result.episode_costs)


@settings(max_examples=25, deadline=None)
@given(data=st.data(), objective=st.sampled_from(BUILT_IN), seed=st.integers(0, 99))
def test_never_worse_than_the_rules(cells: Cells, shops: Cells, data: st.DataObject, objective: str, seed: int) -> None:
    cell = data.draw(st.one_of(cells(many=True, max_parts=3), shops()))
    objective = objective if cell.due_s is not None else "makespan"
    best = Orders(cell, objective, "a test").best
    try:
        result = srl_improved(cell, Search(80, objective), rng(seed))
    except WorkFailed:
        assert not best.done
        return
    assert not best.done or result.cost <= best.cost
    assert cost(follow(cell, result.sequence), objective) == pytest.approx(result.cost)
    assert np.isfinite([*result.place, *result.spread]).all()


def test_same_seed_same_result(ex11: Callable[[int], Cell]) -> None:
    first = srl_improved(ex11(2), Search(3000), rng(7))
    assert first == srl_improved(ex11(2), Search(3000), rng(7))
    assert first != srl_improved(ex11(2), Search(3000), rng(8))
