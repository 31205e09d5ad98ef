"""Rolling decisions: the list where nothing is drawn, another decision where it pays, and no look into what is drawn."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance, Episode
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.execution import Execution
from lab.sequencing.simulate.several import carry_out, replicate
from lab.tasks.task_file import load_cell
from lab_studies.comparisons.rolling import rolling

CellMaker = Callable[..., Cell]


def test_the_best_list_is_kept_where_nothing_is_drawn(toast_cell: CellMaker) -> None:
    cell = toast_cell("I", 4)
    best = optimum(cell)
    done = carry_out(cell, rolling(best.sequence, NO_CHANCE, 0, futures=2))
    assert tuple(done.sequence) == best.sequence
    assert done.run.end_s == best.cost


def test_a_bad_list_is_left(oven_cell: CellMaker) -> None:
    """A list for two toasts that is no worse than any other is kept, whatever the seed; in both orders they take 29 s."""
    cell = oven_cell(2)
    done = carry_out(cell, rolling((2, 2, 1, 1), NO_CHANCE, 0, futures=3))
    assert (tuple(done.sequence), done.run.end_s) == ((2, 2, 1, 1), 29.0)


def test_it_saves_where_times_are_far_off(fms_cell: CellMaker) -> None:
    """In ten episodes with exponential times, the same for both."""
    cell, chance = fms_cell("RSRSR"), Chance("exponential")
    best = optimum(cell).sequence
    kept, rolled = (replicate(cell, how, chance, 10, 3) for how in (best, rolling(best, chance, 3, futures=40)))
    assert rolled.mean() < kept.mean()


def test_the_same_seed_decides_the_same(toast_cell: CellMaker) -> None:
    cell, chance = toast_cell("II", 3), Chance("exponential")
    best = optimum(cell).sequence
    first, again = (replicate(cell, rolling(best, chance, 5, futures=20), chance, 4, 0) for _ in range(2))
    assert np.array_equal(first, again)


def test_it_does_not_look_into_what_is_drawn(toast_cell: CellMaker) -> None:
    """Two episodes that differ only in how long the toaster still takes: the same is decided in both."""
    cell, chance = toast_cell("I", 3), Chance("exponential")
    best = optimum(cell).sequence
    decided = []
    for episode in (1, 2):
        execution = Execution(cell, Episode(cell, chance, episode))
        choose = rolling(best, chance, 7, futures=20)(cell)
        execution.step(choose(execution.observe(), execution.run.allowed()))  # toast 1 goes into the toaster
        decided.append((execution.run.ready_s[0], choose(execution.observe(), execution.run.allowed())))
    assert decided[0][0] != decided[1][0]
    assert decided[0][1] == decided[1][1]


@pytest.mark.parametrize(("futures", "says"), [(0, r"^futures = 0: allowed are whole numbers from 1$")])
def test_what_is_refused(futures: int, says: str) -> None:
    with pytest.raises(BadInput, match=says):
        rolling((1,), NO_CHANCE, 0, futures=futures)


def test_several_robots_are_refused() -> None:
    with pytest.raises(BadInput, match="cells with one robot"):
        carry_out(load_cell("two-carriers").cell(), rolling((1,), NO_CHANCE, 0))
