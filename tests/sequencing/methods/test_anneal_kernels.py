"""Annealing compiled: neighbours have the same entries, and what is kept is no worse than chance allows."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.anneal import AnnealArrays, annealed_session
from lab.sequencing.methods.priorities import Orders, cost_of
from lab.sequencing.simulate.cell_arrays import moves_each
from lab.sequencing.simulate.follow import simulate

Cells = Callable[..., st.SearchStrategy[Cell]]


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
