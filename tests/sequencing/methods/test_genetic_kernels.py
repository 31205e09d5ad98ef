"""The genetic algorithm compiled: crossing by hand, and what every child keeps."""

from collections.abc import Callable

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.genetic import _population, crossed, evolve, shuffled
from lab.sequencing.methods.priorities import Orders
from lab.sequencing.simulate.cell_arrays import moves_each

Cells = Callable[..., st.SearchStrategy[Cell]]


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
