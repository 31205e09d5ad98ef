"""Lists of priorities: every sequence stands for itself, and what the compiled list comes to is what a run says."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import BUILT_IN, cost
from lab.sequencing.methods.priorities import Orders, Priorities, cost_of
from lab.sequencing.simulate.cell_arrays import moves_each
from lab.sequencing.simulate.follow import follow
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]
Cells = Callable[..., st.SearchStrategy[Cell]]


def carried_out(cell: Cell, listed: Priorities) -> tuple[int, ...]:
    """The rule of `Priorities` once more, with a readable run."""
    run, entries, sequence = Run(cell), list(zip(listed.parts + 1, listed.choices, strict=True)), list[int]()
    while not run.done:
        for n, (part, choice) in enumerate(entries):
            allowed = {(d - 1) // cell.parts: d for d in run.allowed() if (d - 1) % cell.parts + 1 == part}
            if allowed:
                first = min(
                    allowed,
                    key=lambda c: [
                        way.choice for way in cell.positions[run.locations[part - 1]].options if way.choice in allowed
                    ].index(c),
                )
                sequence.append(allowed.get(int(choice), allowed[first]))
                run.move(sequence[-1])
                del entries[n]
                break
        else:
            break
    return tuple(sequence)


def drawn_list(cell: Cell, seed: int) -> Priorities:
    rng = np.random.default_rng(seed)
    parts = np.repeat(np.arange(cell.parts), moves_each(cell))
    rng.shuffle(parts)
    return Priorities(parts, rng.integers(cell.most_choices, size=len(parts)))


@settings(max_examples=60, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1), objective=st.sampled_from(BUILT_IN))
def test_the_compiled_list_is_the_readable_one(
    cells: Cells, shops: Cells, data: st.DataObject, seed: int, objective: str
) -> None:
    """One robot and arrivals, or several robots and servers; every objective that the cell has the data for."""
    cell = data.draw(st.one_of(cells(many=True, max_parts=3), shops()))
    objective = objective if cell.due_s is not None else "makespan"
    orders, listed = Orders(cell, objective, "a test"), drawn_list(cell, seed)
    order = orders.order()
    order.parts[:], order.choices[:] = listed.parts, listed.choices
    value = cost_of(orders.arrays, orders.run, order, np.inf)
    sequence = carried_out(cell, listed)
    assert tuple(order.sequence[order.sequence > 0].tolist()) == sequence
    assert value == pytest.approx(cost(follow(cell, sequence), objective))


@settings(max_examples=40, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1), share=st.floats(0.3, 1.1))
def test_only_what_is_longer_than_the_limit_is_given_up(
    cells: Cells, shops: Cells, data: st.DataObject, seed: int, share: float
) -> None:
    """What is given up is above the limit, and is not said to cost more than it does."""
    cell = data.draw(st.one_of(cells(many=True, max_parts=3), shops()))
    orders, listed = Orders(cell, "makespan", "a test"), drawn_list(cell, seed)
    order = orders.order()
    order.parts[:], order.choices[:] = listed.parts, listed.choices
    whole = cost_of(orders.arrays, orders.run, order, np.inf)
    limit = share * whole
    value = cost_of(orders.arrays, orders.run, order, limit)
    assert value <= whole + 1e-6
    assert value > limit or value == whole


@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_every_sequence_stands_for_itself(shops: Cells, data: st.DataObject) -> None:
    cell, sequence = data.draw(shops()), list[int]()
    run = Run(cell)
    while allowed := run.allowed():
        sequence.append(data.draw(st.sampled_from(allowed)))
        run.move(sequence[-1])
    listed = Priorities.of(cell, sequence)
    assert carried_out(cell, listed)[: len(sequence)] == tuple(sequence)
    assert np.bincount(listed.parts, minlength=cell.parts).tolist() == moves_each(cell)


def test_a_list_by_hand(oven_cell: CellMaker) -> None:
    """Two toasts, one oven: 1 goes in; 2 has to wait until it is out, whatever the list says."""
    cell = oven_cell(2)
    orders = Orders(cell, "makespan", "a test")
    order = orders.order()
    order.parts[:] = [0, 1, 1, 0]
    assert cost_of(orders.arrays, orders.run, order, np.inf) == 29.0
    assert order.sequence.tolist() == [1, 1, 2, 2]
    # It is brought by 2 s and baked by 12 s, and a move of 2 s is left: it cannot end by 10 s.
    assert cost_of(orders.arrays, orders.run, order, 10.0) == 14.0
    assert order.sequence.tolist() == [1, 0, 0, 0]


def test_what_is_not_needed_comes_last_by_turns(oven_cell: CellMaker) -> None:
    assert Priorities.of(oven_cell(2), (2,)).parts.tolist() == [1, 0, 1, 0]
    assert Priorities.of(oven_cell(2), ()).parts.tolist() == [0, 1, 0, 1]


def test_what_rules_begin_with(ex11: Callable[[int], Cell]) -> None:
    """nearest-ready's 110 s is the best of EX11 with two vehicles (optimum: 96)."""
    orders = Orders(ex11(2), "makespan", "a test")
    assert len(orders.begun) == 4
    assert orders.best.cost == orders.scale == min(one.cost for one in orders.begun) == 110.0
    assert tuple(orders.padded()[: len(orders.best.sequence)]) == orders.best.sequence
