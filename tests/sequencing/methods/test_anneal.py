"""Annealing: never worse than the rules that it begins with, and the same again with the same seed."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import BUILT_IN, OBJECTIVES, cost
from lab.sequencing.methods.anneal import AnnealArrays, Annealing, anneal, annealed_session
from lab.sequencing.methods.priorities import Orders, cost_of
from lab.sequencing.search import EpisodeSequenced, Search
from lab.sequencing.simulate.cell_arrays import moves_each
from lab.sequencing.simulate.follow import follow, simulate

CellMaker = Callable[..., Cell]
Cells = Callable[..., st.SearchStrategy[Cell]]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_one_part_has_one_sequence(oven_cell: CellMaker) -> None:
    result = anneal(oven_cell(1), Search(50), rng())
    assert (result.sequence, result.cost) == ((1, 1), 14.0)
    assert set(result.episode_costs) == {14.0}


def test_it_finds_the_optimum_of_case_i(toast_cell: CellMaker) -> None:
    """Thesis 7.7: 513 s."""
    assert anneal(toast_cell("I", 3), Search(2000), rng()).cost == 513.0


def test_it_finds_a_published_optimum(ex11: Callable[[int], Cell]) -> None:
    """EX11 of Bilge and Ulusoy 1995: 96 with two vehicles, proven; 161 with one."""
    assert anneal(ex11(2), Search(200_000), rng(1)).cost == 96.0
    assert anneal(ex11(1), Search(100_000), rng()).cost == 161.0


@pytest.mark.parametrize("episodes", [1, 3, 4, 5, 600])
def test_the_budget_is_kept_and_every_episode_told(ex11: Callable[[int], Cell], episodes: int) -> None:
    """The rules come first: four, where there are no due times."""
    seen: list[EpisodeSequenced] = []
    result = anneal(ex11(2), Search(episodes, on_episode=seen.append), rng())
    assert len(result.episode_costs) == episodes
    assert tuple(one.cost for one in seen) == result.episode_costs
    rules = Orders(ex11(2), "makespan", "a test").begun
    assert result.episode_costs[:4] == tuple(one.cost for one in rules)[:episodes]


@settings(max_examples=25, deadline=None)
@given(data=st.data(), objective=st.sampled_from(BUILT_IN), seed=st.integers(0, 99))
def test_never_worse_than_the_rules(cells: Cells, shops: Cells, data: st.DataObject, objective: str, seed: int) -> None:
    cell = data.draw(st.one_of(cells(many=True, max_parts=3), shops()))
    objective = objective if cell.due_s is not None else "makespan"
    orders = Orders(cell, objective, "a test")
    try:
        result = anneal(cell, Search(60, objective), rng(seed))
    except WorkFailed:
        assert not orders.best.done
        return
    assert not orders.best.done or result.cost <= orders.best.cost
    run = follow(cell, result.sequence)
    assert run.done
    assert cost(run, objective) == pytest.approx(result.cost)
    assert result.cost == min(result.episode_costs)


def test_same_seed_same_result(ex11: Callable[[int], Cell]) -> None:
    first = anneal(ex11(2), Search(3000), rng(7))
    assert first == anneal(ex11(2), Search(3000), rng(7))
    assert first != anneal(ex11(2), Search(3000), rng(8))


def test_what_is_under_way(ex11: Callable[[int], Cell]) -> None:
    """The best sequence so far is always one, and costs what is said."""
    annealing = Annealing(ex11(2), "makespan", 3)
    for done in (0.0, 0.5, 0.9):
        before = annealing.best_cost
        sequence = annealing.advance(2000, done)
        assert simulate(ex11(2), sequence).makespan_s == annealing.best_cost <= before
        assert len(annealing.costs) == 2000


def test_an_objective_that_the_kernels_do_not_know(oven_cell: CellMaker, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(OBJECTIVES, "odd", lambda run: 1.0)
    with pytest.raises(BadInput, match="annealing"):
        anneal(oven_cell(2), Search(5, "odd"), rng())


# ---- anneal kernels ---------------------------------------------------------------------------------------------------


def begun(orders: Orders, seed: int) -> AnnealArrays:
    order = orders.order()
    value = cost_of(orders.arrays, orders.run, order, np.inf)
    parts, choices = orders.first.parts.copy(), orders.first.choices.copy()
    return AnnealArrays(
        orders.order(),
        parts,
        choices,
        np.zeros(len(parts), np.int64),
        np.array([value, np.inf]),
        np.array([seed], np.uint64),
    )


@settings(max_examples=40, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**64 - 1), temperature=st.sampled_from([0.0, 5.0, 1e9]))
def test_what_is_kept(cells: Cells, shops: Cells, data: st.DataObject, seed: int, temperature: float) -> None:
    """The list has its entries still and costs what is said; the best sequence is the cheapest that was tried and finished."""
    cell = data.draw(st.one_of(cells(many=True, max_parts=3), shops()))
    orders = Orders(cell, "makespan", "a test")
    work, first = begun(orders, seed), cost_of(orders.arrays, orders.run, orders.order(), np.inf)
    costs = np.zeros(40)
    annealed_session(orders.arrays, orders.run, work, costs, temperature)
    assert np.bincount(work.parts, minlength=cell.parts).tolist() == moves_each(cell)
    assert ((work.choices >= 0) & (work.choices < cell.most_choices)).all()
    order = orders.order()
    order.parts[:], order.choices[:] = work.parts, work.choices
    assert cost_of(orders.arrays, orders.run, order, np.inf) == work.cost[0]
    if temperature == 0.0:
        assert work.cost[0] == min(first, *costs)
    if temperature == 1e9:
        assert work.cost[0] == costs[-1]  # nothing is too long to be kept
    finished = costs[costs < orders.stuck_cost]
    if work.best.any():
        sequence = tuple(work.best[work.best > 0].tolist())
        assert simulate(cell, sequence).makespan_s == pytest.approx(work.cost[1]) == pytest.approx(finished.min())


def test_neighbours_reach_every_order_and_way(ex11: Callable[[int], Cell]) -> None:
    """At a temperature where all is kept, an entry comes to stand anywhere, and is done by either vehicle."""
    orders = Orders(ex11(2), "makespan", "a test")
    work, stood, ways = begun(orders, 5), set[int](), set[int]()
    for _ in range(600):
        annealed_session(orders.arrays, orders.run, work, np.zeros(50), 1e9)
        at = int(np.flatnonzero(work.parts == 0)[0])
        stood.add(at)
        ways.add(int(work.choices[at]))
    assert len(stood) > 8
    assert ways == {0, 1}
