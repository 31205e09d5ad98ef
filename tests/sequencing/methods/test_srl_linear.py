"""SRL with linear values: what it decides by, what it learns from, and the policy that is left."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lab.errors import BadInput, WorkFailed
from lab.sequencing import find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.carried_over_policy import CarriedPolicy
from lab.sequencing.methods.rules import dispatch, nearest_ready
from lab.sequencing.methods.srl_linear import POPULATION, srl_linear
from lab.sequencing.search import EpisodeSequenced, Search
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]
NEAR = ((0, 1, 1), (1, 0, 1), (1, 1, 0))  # one second between any two of LU, M1 and M2


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_one_part_by_hand(oven_cell: CellMaker) -> None:
    """2 s, 10 s of work, 2 s: there is one sequence, so that no weight makes a difference, and none is kept."""
    result = srl_linear(oven_cell(1), Search(30), rng())
    assert (result.sequence, result.cost, result.final_cost) == ((1, 1), 14.0, 14.0)
    assert result.episode_costs == (14.0,) * 30
    assert result.policy == CarriedPolicy({})


@pytest.mark.parametrize(("weight", "first", "cost"), [(1.0, 1, 9.0), (-1.0, 2, 11.0)])
def test_the_weight_of_the_work_left_by_hand(job_shop: CellMaker, weight: float, first: int, cost: float) -> None:
    """Two jobs of one operation, on M1 8 s and on M2 4 s, and one vehicle; every way takes 1 s.

    Brought first, job 1 is done at 1 + 8 = 9 s and job 2, brought at 1 + 1 + 1 = 3 s, at 7 s. The other way round job 1 is
    brought at 3 s and done at 11 s.
    """
    cell = job_shop([[(1, 8.0)], [(2, 4.0)]], NEAR)
    result = srl_linear(cell, Search(1, policy=CarriedPolicy({"work-left": weight})), rng())
    assert result.sequence[0] == first
    assert result.episode_costs == (cost,)


def test_it_finds_the_optimum_of_case_i_and_good_orders_of_many(toast_cell: CellMaker) -> None:
    """Thesis 7.7: 513 s. With ten toasts random search is far behind."""
    assert srl_linear(toast_cell("I", 3), Search(200), rng()).cost == 513.0
    cell = toast_cell("I", 10)
    learned, drawn = (find_sequence(cell, method, Search(200), 0) for method in ("srl-linear", "random"))
    assert learned.cost < 0.9 * drawn.cost


def test_what_it_learned_decides_elsewhere(toast_cell: CellMaker) -> None:
    """Learned on four toasts and used for twelve, without search: better than what begins soonest."""
    policy = srl_linear(toast_cell("I", 4), Search(400), rng()).policy
    cell = toast_cell("I", 12)
    carried = find_sequence(cell, "carried", Search(1, policy=policy), 0)
    dispatch(run := Run(cell), nearest_ready)
    assert carried.cost < run.end_s
    assert find_sequence(cell, "srl-linear", Search(50, policy=policy), 0).cost <= carried.cost


def test_its_greedy_policy_is_the_one_that_is_kept(fms_cell: CellMaker) -> None:
    cell = fms_cell("RSRS")
    result = srl_linear(cell, Search(60), rng(3))
    assert find_sequence(cell, "carried", Search(1, policy=result.policy), 0).cost == result.final_cost
    assert "slack" not in result.policy.weights  # no due times counted
    assert np.linalg.norm(result.policy.vector) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("episodes", [1, POPULATION - 1, POPULATION, POPULATION + 1, 50])
def test_the_budget_is_kept_and_every_episode_told(fms_cell: CellMaker, episodes: int) -> None:
    seen: list[EpisodeSequenced] = []
    cell = fms_cell("RSR")
    result = srl_linear(cell, Search(episodes, on_episode=seen.append), rng())
    assert len(result.episode_costs) == episodes
    assert tuple(one.cost for one in seen) == result.episode_costs
    assert simulate(cell, result.sequence).makespan_s == result.cost == min(result.episode_costs)


def test_practice_cells_count_and_cost_no_episodes(toast_cell: CellMaker) -> None:
    """The first candidates are the same; what is learned of them is not."""
    cell, search = toast_cell("I", 3), Search(60)
    alone = srl_linear(cell, search, rng())
    beside = srl_linear(cell, replace(search, practice=(toast_cell("III", 5), toast_cell("II", 4))), rng())
    assert len(beside.episode_costs) == 60
    assert beside.episode_costs[:POPULATION] == alone.episode_costs[:POPULATION]  # nothing is learned yet
    assert beside.policy != alone.policy


def test_due_times_are_learned_by_the_objective(fms_cell: CellMaker) -> None:
    cell = replace(fms_cell("RSRS"), due_s=(1900.0, 1500.0, 1200.0, 900.0))
    result = srl_linear(cell, Search(200, "mean-tardiness"), rng())
    assert result.policy.objective == "mean-tardiness"
    assert result.cost < find_sequence(cell, "nearest-ready", Search(1, "mean-tardiness"), 0).cost
    with pytest.raises(BadInput, match="due times"):
        srl_linear(cell, Search(20, "mean-tardiness", practice=(fms_cell("RS"),)), rng())


def test_deadlocks_are_told(crossing_cell: CellMaker) -> None:
    """The one episode is that of a policy that takes both parts in at once."""
    with pytest.raises(WorkFailed, match="no sequence for 2 parts came to its end in 1 episode: deadlocks"):
        srl_linear(crossing_cell(), Search(1, policy=CarriedPolicy({"enters": 1.0})), rng())
    assert srl_linear(crossing_cell(), Search(40), rng()).cost > 0.0


def test_same_seed_same_result(fms_cell: CellMaker) -> None:
    first = srl_linear(fms_cell("RSRS"), Search(100), rng(7))
    assert first == srl_linear(fms_cell("RSRS"), Search(100), rng(7))
    assert first != srl_linear(fms_cell("RSRS"), Search(100), rng(8))
