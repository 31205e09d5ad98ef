"""The genetic algorithm: what it begins with, and that it is no worse than a rule nor over its budget."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import BUILT_IN, cost
from lab.sequencing.methods.genetic import _population, crossed, evolve, genetic, shuffled
from lab.sequencing.methods.priorities import Orders
from lab.sequencing.search import EpisodeSequenced, Search
from lab.sequencing.simulate.cell_arrays import moves_each
from lab.sequencing.simulate.follow import follow, simulate

CellMaker = Callable[..., Cell]
Cells = Callable[..., st.SearchStrategy[Cell]]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("episodes", [1, 4, 5, 9, 57, 700])
def test_the_budget_is_kept(toast_cell: CellMaker, episodes: int) -> None:
    """Also where it ends within the first population, or within a child; every sequence tried is an episode."""
    seen: list[EpisodeSequenced] = []
    result = genetic(toast_cell("I", 3), Search(episodes, on_episode=seen.append), rng())
    assert len(result.episode_costs) == episodes
    assert tuple(episode.cost for episode in seen) == result.episode_costs
    assert result.cost == min(result.episode_costs)
    assert result.cost == simulate(toast_cell("I", 3), result.sequence).makespan_s


def test_one_part_has_one_sequence(oven_cell: CellMaker) -> None:
    result = genetic(oven_cell(1), Search(100), rng())
    assert result.sequence == (1, 1)
    assert set(result.episode_costs) == {14.0}


def test_it_finds_the_optimum_of_case_i(toast_cell: CellMaker) -> None:
    """Thesis 7.7: 513 s."""
    assert genetic(toast_cell("I", 3), Search(1000), rng()).cost == 513.0


def test_it_finds_a_published_optimum(ex11: Callable[[int], Cell]) -> None:
    """EX11 of Bilge and Ulusoy 1995: 96 with two vehicles, where the best rule needs 110."""
    assert genetic(ex11(2), Search(200_000), rng()).cost == 96.0


def test_same_seed_same_result_and_no_global_stream(toast_cell: CellMaker) -> None:
    before = np.random.get_state(legacy=False)  # noqa: NPY002 the global stream, which nobody here may touch
    first = genetic(toast_cell("I", 4), Search(60), rng(7))
    assert first == genetic(toast_cell("I", 4), Search(60), rng(7))
    assert first != genetic(toast_cell("I", 4), Search(60), rng(8))
    np.testing.assert_equal(np.random.get_state(legacy=False), before)  # noqa: NPY002


@settings(max_examples=25, deadline=None)
@given(data=st.data(), objective=st.sampled_from(BUILT_IN), seed=st.integers(0, 99))
def test_never_worse_than_the_rules(cells: Cells, shops: Cells, data: st.DataObject, objective: str, seed: int) -> None:
    cell = data.draw(st.one_of(cells(many=True, max_parts=3), shops()))
    objective = objective if cell.due_s is not None else "makespan"
    best = Orders(cell, objective, "a test").best
    try:
        result = genetic(cell, Search(80, objective), rng(seed))
    except WorkFailed:
        assert not best.done
        return
    assert not best.done or result.cost <= best.cost
    assert cost(follow(cell, result.sequence), objective) == pytest.approx(result.cost)
    assert result.cost == min(result.episode_costs)


def test_due_times_are_needed_where_they_count(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="due times"):
        genetic(oven_cell(), Search(objective="tardy-parts"), rng())


# ---- genetic kernels --------------------------------------------------------------------------------------------------


def test_crossing_by_hand(oven_cell: Callable[..., Cell]) -> None:
    """Parents 1 1 2 2 3 3 and 3 2 1 3 2 1: what is inherited stays in the first one's places, the rest in the other's order."""
    population = _population(Orders(oven_cell(3), "makespan", "a test"), 2, 0)
    population.parts[0], population.parts[1] = [0, 0, 1, 1, 2, 2], [2, 1, 0, 2, 1, 0]
    seen = dict[tuple[bool, ...], list[int]]()
    for _ in range(100):
        crossed(population, 0, 1)
        seen[tuple(population.inherited.tolist())] = population.child.parts.tolist()
    assert len(seen) == 8
    assert seen[True, True, True] == [0, 0, 1, 1, 2, 2]
    assert seen[False, False, False] == [2, 1, 0, 2, 1, 0]
    assert seen[True, False, False] == [0, 0, 2, 1, 2, 1]
    assert seen[False, True, False] == [2, 0, 1, 1, 2, 0]


@settings(max_examples=30, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**63 - 1))
def test_lists_keep_their_entries_and_the_best_one_stays(shops: Cells, data: st.DataObject, seed: int) -> None:
    cell = data.draw(shops())
    orders, least = Orders(cell, "makespan", "a test"), np.inf
    population = _population(orders, 4, seed)
    for _ in range(5):
        costs = np.zeros(37)
        evolve(orders.arrays, orders.run, population, costs, 5)
        assert population.costs.min() <= least
        least = population.costs.min()
        for row, ways in zip(population.parts, population.choices, strict=True):
            assert np.bincount(row, minlength=cell.parts).tolist() == moves_each(cell)
            assert ((ways >= 0) & (ways < cell.most_choices)).all()


def test_shuffled_evenly() -> None:
    """Three entries: six orders, each as often within what chance does."""
    stream, met = np.array([3], np.uint64), dict[tuple[int, ...], int]()
    for _ in range(6000):
        parts = np.arange(3)
        shuffled(parts, np.zeros(3, np.int64), stream, 1)
        met[tuple(parts.tolist())] = met.get(tuple(parts.tolist()), 0) + 1
    assert len(met) == 6
    assert all(850 < count < 1150 for count in met.values())
