"""SRL over elapsed time: it settles on the optimum, and its values are costs that a reader can add up."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.cell.objectives import OBJECTIVES, cost, stuck_cost
from lab.sequencing.cell.stations import Product, Stage, Station
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.srl_time import SrlTimeResult, reacting, srl_time
from lab.sequencing.search import EpisodeSequenced, Search
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run
from lab.sequencing.simulate.several import replicate

CellMaker = Callable[..., Cell]
Cells = Callable[..., st.SearchStrategy[Cell]]


def learned(cell: Cell, episodes: int, seed: int = 0, objective: str = "makespan") -> SrlTimeResult:
    return srl_time(cell, Search(episodes, objective), np.random.default_rng(seed))


@pytest.mark.parametrize("case", ["I", "II", "III"])
@pytest.mark.parametrize(("toasts", "episodes"), [(3, 30), (4, 50)])
def test_it_settles_on_the_optimum(toast_cell: CellMaker, case: str, toasts: int, episodes: int) -> None:
    cell = toast_cell(case, toasts)
    for seed in range(10):
        result = learned(cell, episodes, seed)
        assert result.cost == result.final_cost == optimum(cell).cost


def test_one_toast_by_hand(oven_cell: CellMaker) -> None:
    # pick at once, carry 2 s, process 10 s, carry 2 s: 14 s; the robot stays where the toast is
    result = learned(oven_cell(1), 3)
    assert (result.cost, result.sequence) == (14.0, (1, 1))
    values = sorted(value for row in result.q.values() for value in row.values())
    assert values == pytest.approx([12.0, 14.0])  # from the oven on: 10 s of waiting and 2 s of carrying


def test_a_full_table_holds_no_more_states_and_an_order_is_found_all_the_same(
    toast_cell: CellMaker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lab.sequencing.methods.srl_time.MOST_VALUES", 10)
    cell = toast_cell("I", 3)
    result = learned(cell, 30)
    assert sum(map(len, result.q.values())) <= 10
    assert result.sequence is not None
    assert result.cost == simulate(cell, result.sequence).makespan_s >= optimum(cell).cost


@settings(max_examples=25, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1))
def test_values_never_exceed_the_truth_and_only_rise(cells: Cells, data: st.DataObject, seed: int) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=3, many=True))
    best_s = optimum(cell).cost
    tables = [learned(cell, episodes, seed).q for episodes in (1, 4, 16)]
    start = next(iter(tables[0]))  # of the first episode's first step
    for fewer, more in pairwise(tables):
        for state, row in fewer.items():
            assert all(more[state][action] >= value - 1e-6 for action, value in row.items())
    assert all(min(table[start].values()) <= best_s + 1e-6 for table in tables)


@pytest.mark.parametrize("objective", sorted(OBJECTIVES))
def test_every_objective_is_learned(fms_cell: CellMaker, objective: str) -> None:
    cell = replace(fms_cell("RR", 100), due_s=(500.0, 600.0))
    result = learned(cell, 400, 1, objective)
    run = Run(cell)
    for decision in result.sequence:
        run.move(decision)
    assert cost(run, objective) == pytest.approx(result.cost)
    assert result.cost == pytest.approx(cp_sat(cell, objective, 20.0).cost)


@pytest.mark.parametrize(("case", "optimal_s"), [("I", 63 + 150 * 20), ("II", 100 + 200 * 20), ("III", 110 + 295 * 20)])
def test_what_few_toasts_teach_serves_many(toast_cell: CellMaker, case: str, optimal_s: float) -> None:
    result = learned(toast_cell(case, 20), 200)
    assert result.cost == pytest.approx(optimal_s, rel=0.01)
    assert len(result.episode_costs) == 200 - 3 * 40  # practice with fewer toasts has makespans of its own


def test_few_episodes_for_many_toasts(toast_cell: CellMaker) -> None:
    for episodes in (1, 4, 19, 20):
        assert 1 <= len(learned(toast_cell("I", 9), episodes).episode_costs) <= episodes


def test_alike_toasts_are_one(toast_cell: CellMaker) -> None:
    result = learned(toast_cell("I", 4), 50)
    assert len(result.q) < 200  # by toast there are thousands
    firsts = [result.sequence.index(toast) for toast in (1, 2, 3, 4)]
    assert firsts == sorted(firsts)


def test_same_seed_same_table(toast_cell: CellMaker) -> None:
    assert learned(toast_cell("II", 3), 9, 4).q == learned(toast_cell("II", 3), 9, 4).q


def test_each_episode_is_told(toast_cell: CellMaker) -> None:
    told: list[EpisodeSequenced] = []
    result = srl_time(toast_cell("I", 2), Search(5, on_episode=told.append), np.random.default_rng(0))
    assert [event.cost for event in told] == list(result.episode_costs)


def test_what_cannot_be(toast_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="episodes = 0: allowed are whole numbers from 1"):
        learned(toast_cell("I", 1), 0)
    with pytest.raises(BadInput, match="'tardy-parts': the cell has no due times"):
        learned(toast_cell("I", 1), 1, objective="tardy-parts")


def test_many_parts_that_may_block_one_another(oven_cell: CellMaker) -> None:
    """Eight parts by left and right or by right and left: what few parts taught may end in a deadlock with eight."""
    stations = (*(Station(name, "machine", 1, 5.0) for name in ("left", "right")), Station("in", "storage", 9))
    ways = (("in", "left", "right", "out"), ("in", "right", "left", "out"))
    products = (Product("toast", tuple(tuple(Stage(name) for name in way) for way in ways)),)
    table = 1.0 - np.eye(4)
    more = {"stations": (*stations, Station("out", "storage", 9)), "empty_s": table, "loaded_s": table}
    cell = oven_cell(8, products=products, **more)
    result = learned(cell, 200)
    stuck = [cost for cost in result.episode_costs if cost == stuck_cost(cell, "makespan")]
    assert stuck
    assert result.cost == simulate(cell, result.sequence).makespan_s


@settings(max_examples=25, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1))
def test_without_the_bound_values_begin_at_0_and_still_only_rise(cells: Cells, data: st.DataObject, seed: int) -> None:
    """What is not known of the model is found out: never above the truth, in more episodes."""
    cell = data.draw(cells(max_machines=2, max_parts=2, many=True))
    found = [srl_time(cell, Search(n), np.random.default_rng(seed), bounded=False) for n in (1, 4, 16)]
    start = next(iter(found[0].q))
    assert all(min(one.q[start].values()) <= optimum(cell).cost + 1e-6 for one in found)
    for fewer, more in pairwise(found):
        for state, row in fewer.q.items():
            assert all(0.0 <= value <= more.q[state][action] + 1e-6 for action, value in row.items())


def test_what_the_bound_is_worth(toast_cell: CellMaker) -> None:
    """Four toasts: fifty episodes are enough with the bound and not without it, for which it takes some hundred."""
    cell = toast_cell("II", 4)
    for seed in range(3):
        few, many = (srl_time(cell, Search(n), np.random.default_rng(seed), bounded=False) for n in (50, 500))
        assert few.final_cost > optimum(cell).cost == many.final_cost == learned(cell, 50, seed).final_cost


# ---- srl time reacting ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", ["I", "II", "III"])
def test_without_chance_it_carries_out_the_optimum(toast_cell: CellMaker, case: str) -> None:
    cell = toast_cell(case, 3)
    assert replicate(cell, reacting(cell), NO_CHANCE, 1, 0) == pytest.approx([optimum(cell).cost])


def test_it_is_not_bound_to_a_list_when_a_part_comes_late(fms_cell: CellMaker) -> None:
    """Exponential arrivals: in the same episodes it needs less time on average than the list that is best by the means."""
    cell, chance = fms_cell("RSR", 200), Chance("constant", "exponential")
    fixed = replicate(cell, optimum(cell).sequence, chance, 60, 1)
    reacts = replicate(cell, reacting(cell), chance, 60, 1)
    assert reacts.mean() < fixed.mean()


def test_same_seed_same_costs(toast_cell: CellMaker) -> None:
    cell = toast_cell("I", 2)
    one, other = (replicate(cell, reacting(cell, seed=3), Chance(), 5, 1) for _ in range(2))
    assert np.array_equal(one, other)
