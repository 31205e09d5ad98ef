"""SRL over elapsed time: it settles on the optimum, and its values are times that a reader can add up."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.bound import TICKS_PER_S, RobotWork
from lab.sequencing.cell import Cell
from lab.sequencing.exact import optimum
from lab.sequencing.srl_time import SrlTimeResult, srl_time


def learned(cell: Cell, episodes: int, seed: int = 0) -> SrlTimeResult:
    return srl_time(cell, episodes, np.random.default_rng(seed))


@pytest.mark.parametrize("case", ["I", "II", "III"])
@pytest.mark.parametrize(("toasts", "episodes"), [(3, 40), (4, 120)])
def test_it_settles_on_the_optimum(toast_cell: Callable[..., Cell], case: str, toasts: int, episodes: int) -> None:
    cell = toast_cell(case, toasts)
    for seed in range(10):
        result = learned(cell, episodes, seed)
        assert result.makespan_s == result.final_makespan_s == optimum(cell).makespan_s


def test_one_toast_by_hand(oven_cell: Callable[..., Cell]) -> None:
    # pick at once, carry 2 s, process 10 s, carry 2 s: 14 s; the robot stays where the toast is
    result = learned(oven_cell(1), 3)
    assert (result.makespan_s, result.sequence) == (14.0, (1, 1))
    values = sorted(value for row in result.q.values() for value in row.values())
    assert values == pytest.approx([12.0, 14.0])  # from the oven on: 10 s of waiting and 2 s of carrying


@settings(max_examples=25, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1))
def test_values_never_exceed_the_truth_and_only_rise(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject, seed: int
) -> None:
    cell = data.draw(cells(max_machines=2, max_toasts=3))
    best_s = optimum(cell).makespan_s
    tables = [learned(cell, episodes, seed).q for episodes in (1, 4, 16)]
    start = next(iter(tables[0]))  # of the first episode's first step
    for fewer, more in pairwise(tables):
        for state, row in fewer.items():
            assert all(more[state][station] >= value - 1e-6 for station, value in row.items())
    assert all(min(table[start].values()) <= best_s + 1e-6 for table in tables)


@pytest.mark.parametrize(("case", "optimal_s"), [("I", 63 + 150 * 20), ("II", 100 + 200 * 20), ("III", 110 + 295 * 20)])
def test_what_few_toasts_teach_serves_many(toast_cell: Callable[..., Cell], case: str, optimal_s: float) -> None:
    result = learned(toast_cell(case, 20), 1000)
    assert result.makespan_s == pytest.approx(optimal_s, rel=0.01)
    assert len(result.episode_makespans_s) == 1000 - 3 * 200  # practice with fewer toasts has makespans of its own


def test_few_episodes_for_many_toasts(toast_cell: Callable[..., Cell]) -> None:
    for episodes in (1, 4, 19, 20):
        assert 1 <= len(learned(toast_cell("I", 9), episodes).episode_makespans_s) <= episodes


def test_alike_toasts_are_one(toast_cell: Callable[..., Cell]) -> None:
    result = learned(toast_cell("I", 4), 50)
    assert len(result.q) < 200  # by toast there are thousands
    firsts = [result.sequence.index(toast) for toast in (1, 2, 3, 4)]
    assert firsts == sorted(firsts)


def test_same_seed_same_table(toast_cell: Callable[..., Cell]) -> None:
    assert learned(toast_cell("II", 3), 9, 4).q == learned(toast_cell("II", 3), 9, 4).q


def test_no_episodes(toast_cell: Callable[..., Cell]) -> None:
    with pytest.raises(BadInput, match="episodes = 0: allowed are whole numbers from 1"):
        learned(toast_cell("I", 1), 0)


def test_the_robots_work_by_hand(oven_cell: Callable[..., Cell]) -> None:
    # a toast in "in" has 2 s of carrying ahead, then at least 1 s to come back for it or 10 s of waiting, and 2 s more
    work = RobotWork(oven_cell(2))
    cell = oven_cell(2)
    everything = work.left(cell.counts(cell.start_locations()), cell.index("in"))
    assert 0 < everything / TICKS_PER_S <= optimum(cell).makespan_s
    assert work.left([0, 0, 2], 2) == 0
    shorter = replace(cell, loaded_s=cell.loaded_s / 2)
    assert RobotWork(shorter).left([2, 0, 0], 0) < everything
