"""The compiled simulation: step by step the same as the readable one."""

import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import accumulate

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DataObject, SearchStrategy

from lab.sequencing.cell import objectives
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import LAWS, NO_CHANCE, Chance, Episode
from lab.sequencing.simulate import kernels
from lab.sequencing.simulate.cell_arrays import CellArrays, RunArrays, cell_arrays, most_moves, run_arrays
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]
SEEDS = st.integers(0, 2**64 - 1)


def with_due_times(cell: Cell, after_s: float) -> Cell:
    """The cell with parts wanted soon after they come, so that some are late."""
    intervals = cell.arrivals.interval_s if cell.arrivals else (0.0,) * cell.parts
    return replace(cell, due_s=tuple(after_s + came_s for came_s in accumulate(intervals)))


def assert_alike(run: Run, there: RunArrays, count: int) -> None:
    """Every quantity of a run, to rounding where chance has a say."""
    assert run.allowed() == tuple(there.allowed[:count].tolist())
    assert run.locations == there.locations.tolist()
    assert run.robots_at == there.robots_at.tolist()
    assert there.robots_s.tolist() == pytest.approx(run.robots_s)
    assert run.fetched == there.whole[0]
    assert [room - taken for room, taken in zip(run.cell.capacities, run.occupied, strict=True)] == (
        there.room[: len(run.occupied)].tolist()
    )
    assert there.clock.tolist() == pytest.approx([run.now_s, run.waited_s, run.processed_s, run.end_s])
    assert there.ready_s.tolist() == pytest.approx(run.ready_s)
    assert there.whole[1] == run.finished_s.count(None)
    finished = [(part, end) for part, end in enumerate(run.finished_s) if end is not None]
    assert [float(there.finished_s[part]) for part, _ in finished] == pytest.approx([end for _, end in finished])


def walk_both(cell: Cell, chance: Chance, seed: int, pick: Callable[[int], int]) -> tuple[Run, CellArrays, RunArrays]:
    """A run in both simulations, compared after every move."""
    run, arrays, there = Run(cell, Episode(cell, chance, seed)), cell_arrays(cell, chance=chance), run_arrays(cell)
    kernels.reset(arrays, there, np.uint64(seed))
    while True:
        count = kernels.list_allowed(arrays, there)
        assert_alike(run, there, count)
        if count == 0:
            return run, arrays, there
        i = pick(count)
        run.move(int(there.allowed[i]))
        kernels.move(arrays, there, i, np.uint64(seed))


MISHAPS = st.tuples(
    *(st.sampled_from([0.0, 5.0]), st.floats(0, 10), st.sampled_from([0.0, 20.0])),
    *(st.sampled_from([0.0, 15.0]), st.floats(0, 10)),
)


@settings(max_examples=80, deadline=None)
@given(data=st.data())
def test_it_is_the_readable_run(cells: Callable[..., SearchStrategy[Cell]], data: DataObject) -> None:
    """Several products and routes, buffers of both kinds, pallets, arrivals; the times of the cell, and drawn ones."""
    cell = with_due_times(data.draw(cells(many=True, max_parts=4)), data.draw(st.floats(0, 100)))
    laws = st.sampled_from(sorted(LAWS))
    chance = Chance(data.draw(laws), data.draw(laws), data.draw(st.floats(0, 1)), *data.draw(MISHAPS))
    choices = data.draw(st.randoms(use_true_random=False))
    run, _, there = walk_both(cell, chance, data.draw(SEEDS), choices.randrange)
    for name in objectives.OBJECTIVES:
        judged = cell_arrays(cell, name)
        assert kernels.cost(judged, there) == pytest.approx(objectives.cost(run, name)), name


@settings(max_examples=80, deadline=None)
@given(data=st.data())
def test_robots_and_servers_too(shops: Callable[..., SearchStrategy[Cell]], data: DataObject) -> None:
    cell = with_due_times(data.draw(shops()), data.draw(st.floats(0, 100)))
    law = data.draw(st.sampled_from(sorted(LAWS)))
    chance = Chance(law, "constant", data.draw(st.floats(0, 1)), *data.draw(MISHAPS))
    if not cell.robots or cell.track:
        chance = replace(chance, robot_breaks_every_s=0.0)
    choices = data.draw(st.randoms(use_true_random=False))
    run, _, there = walk_both(cell, chance, data.draw(SEEDS), choices.randrange)
    for name in objectives.OBJECTIVES:
        assert kernels.cost(cell_arrays(cell, name), there) == pytest.approx(objectives.cost(run, name)), name


def test_without_chance_the_times_are_the_same_to_the_last_bit(fms_cell: CellMaker) -> None:
    run, _, there = walk_both(fms_cell("RSRRS"), NO_CHANCE, 0, lambda count: count - 1)
    assert run.done
    assert [run.now_s, run.waited_s, run.processed_s, run.end_s] == there.clock.tolist()


def test_a_deadlock_costs_more_than_any_finished_run(crossing_cell: Callable[[], Cell]) -> None:
    cell, order = crossing_cell(), iter((0, 1))  # part 1 to the left, then part 2 to the right
    run, arrays, there = walk_both(cell, NO_CHANCE, 0, lambda count: next(order))
    assert (run.allowed(), run.done) == ((), False)
    assert kernels.cost(arrays, there) == objectives.stuck_cost(cell, "makespan") > run.now_s


def test_most_moves(toast_cell: CellMaker, fms_cell: CellMaker, oven_cell: CellMaker) -> None:
    """A toast at most takes 5 moves, through both buffers; a part of the FMS 5, one of them its pallet's."""
    assert most_moves(toast_cell("I", 3)) == 15
    assert most_moves(fms_cell("RS")) == 10
    assert most_moves(oven_cell(4)) == 8


def test_following_a_sequence(oven_cell: CellMaker) -> None:
    """One part, 2 s there, 10 s in it, 2 s on; what may not be done is NaN, what is left undone a deadlock."""
    cell = oven_cell(1)
    sequences, lengths = np.array([[1, 1, 9], [2, 1, 9], [1, 9, 9], [1, 1, 1], [1, -1, 9]]), np.array([2, 2, 1, 3, 2])
    costs = np.zeros((5, 2))
    kernels.follow_all(cell_arrays(cell), run_arrays(cell), sequences, lengths, np.zeros(2, np.uint64), costs)
    stuck = objectives.stuck_cost(cell, "makespan")
    assert np.array_equal(costs[:, 0], [14.0, np.nan, stuck, np.nan, np.nan], equal_nan=True)
    assert np.array_equal(costs[:, 0], costs[:, 1], equal_nan=True)


def test_arguments_are_not_held(oven_cell: CellMaker) -> None:
    """References are not counted inside: those of the arrays must be as before."""
    cell = oven_cell(1)
    arrays, there = cell_arrays(cell), run_arrays(cell)
    before = [sys.getrefcount(array) for array in (*arrays, *there)]
    for _ in range(100):
        kernels.reset(arrays, there, np.uint64(0))
        kernels.list_allowed(arrays, there)
    assert [sys.getrefcount(array) for array in (*arrays, *there)] == before
