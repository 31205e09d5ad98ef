"""Many sessions: each as if it were alone."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance, Episode
from lab.sequencing.methods.session_readable import episode_seed, learn
from lab.sequencing.search import Search
from lab.sequencing.simulate.follow import simulate
from lab_studies import many_sessions as batch
from lab_studies.many_sessions import METHODS, evaluate, run_sessions, session_seeds

CellMaker = Callable[..., Cell]


def assert_same(one: batch.Sessions, other: batch.Sessions) -> None:
    for name in batch.Sessions._fields:
        assert np.array_equal(getattr(one, name), getattr(other, name), equal_nan=name == "final_cost"), name


@pytest.mark.parametrize("chance", [NO_CHANCE, Chance()])
@pytest.mark.parametrize("method", METHODS)
def test_each_is_the_session_of_its_seed(toast_cell: CellMaker, method: str, chance: Chance) -> None:
    cell, search = toast_cell("I", 3), Search(20, chance=chance)
    found = run_sessions(cell, method, search, 4, 7, keep_costs=True)
    for n, seed in enumerate(session_seeds(7, 4).tolist()):
        alone = learn(cell, search, seed, METHODS[method])
        assert found.costs[n].tolist() == alone.log.costs
        assert found.best_cost[n] == alone.log.best_cost
        assert tuple(found.sequences[n][found.sequences[n] > 0].tolist()) == alone.log.best
        assert found.final_cost[n] == alone.final_cost or (method == "random" and np.isnan(found.final_cost[n]))


@pytest.mark.parametrize("method", METHODS)
def test_it_does_not_matter_who_runs_which(toast_cell: CellMaker, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In small chunks, one by one: the same."""
    cell, search = toast_cell("II", 3), Search(15)
    whole = run_sessions(cell, method, search, 9, 3, keep_costs=True)
    monkeypatch.setattr(batch, "CHUNK", 40)
    assert_same(whole, run_sessions(cell, method, search, 9, 3, keep_costs=True))
    monkeypatch.setattr(batch, "MOST_ROWS", -1)
    assert_same(whole, run_sessions(cell, method, search, 9, 3, keep_costs=True))


def test_sessions_and_seeds_differ(toast_cell: CellMaker) -> None:
    """Of 200 seeds no two are alike, nor are the first episodes of sessions."""
    assert len(set(session_seeds(0, 100).tolist()) | set(session_seeds(1, 100).tolist())) == 200
    with_chance = run_sessions(toast_cell("I", 3), "srl", Search(20, chance=Chance()), 20, 0, keep_costs=True).costs
    assert len(np.unique(with_chance)) == with_chance.size


def test_the_best_under_chance_is_what_its_sequence_costs_in_its_episode(toast_cell: CellMaker) -> None:
    cell, chance = toast_cell("I", 3), Chance()
    found = run_sessions(cell, "srl", Search(12, chance=chance), 3, 1, keep_costs=True)
    for n, seed in enumerate(session_seeds(1, 3).tolist()):
        times = [episode_seed(seed, episode) for episode in range(1, 13)]
        costs = evaluate(cell, [found.sequences[n][found.sequences[n] > 0].tolist()], times, chance)[0]
        assert costs[found.costs[n].argmin()] == found.best_cost[n] == found.costs[n].min()


@pytest.mark.parametrize("method", METHODS)
def test_convergence_is_the_first_episode_of_the_equal_ones_at_the_end(toast_cell: CellMaker, method: str) -> None:
    found = run_sessions(toast_cell("I", 2), method, Search(40), 50, 2, keep_costs=True)
    for costs, convergence in zip(found.costs.tolist(), found.convergence.tolist(), strict=True):
        alike = 1
        while alike < len(costs) and costs[-1 - alike] == costs[-1]:
            alike += 1
        assert convergence == len(costs) - alike + 1


def test_without_a_choice_it_has_converged_from_the_start(oven_cell: CellMaker) -> None:
    found = run_sessions(oven_cell(1), "srl", Search(5), 2, 0)
    assert found.convergence.tolist() == [1, 1]
    assert found.best_cost.tolist() == found.final_cost.tolist() == [14.0, 14.0]
    assert found.sequences.tolist() == [[1, 1], [1, 1]]
    assert found.costs.shape == (0, 5)
    assert run_sessions(oven_cell(1), "mc", Search(1), 1, 0).convergence.tolist() == [1]


def test_random_search_has_no_greedy_policy_and_no_limit_of_parts(toast_cell: CellMaker) -> None:
    found = run_sessions(toast_cell("III", 60), "random", Search(2), 2, 0)
    assert np.isnan(found.final_cost).all()
    assert (found.best_cost > 60 * 2 * 120 / 2).all()  # the toaster alone has 7200 s of work


@pytest.mark.parametrize("law", ["normal", "exponential"])
def test_evaluating_sequences(toast_cell: CellMaker, fms_cell: CellMaker, law: str) -> None:
    """The same makespans as the readable simulation has with the same seeds."""
    chance, seeds = Chance(law, law, 0.3), [0, 1, 2**63 + 5]
    for cell, sequence in (
        (toast_cell("II", 3), (1, 2, 1, 2, 1, 2, 3, 2, 3, 3)),
        (fms_cell("R"), (2, 1, 1, 1, 1)),
    ):
        expected = [simulate(cell, sequence, Episode(cell, chance, seed)).makespan_s for seed in seeds]
        assert evaluate(cell, [sequence], seeds, chance).tolist() == [pytest.approx(expected)]
        assert len(set(expected)) == 3
    assert evaluate(toast_cell("II", 3), [(1, 2, 1, 2, 1, 2, 3, 2, 3, 3)], [0]).tolist() == [[700.0]]


def test_bad_questions(oven_cell: CellMaker) -> None:
    cell = oven_cell(1)
    with pytest.raises(BadInput, match="unknown method 'slr'"):
        run_sessions(cell, "slr", Search(1), 1, 0)
    with pytest.raises(BadInput, match="sessions = 0"):
        run_sessions(cell, "srl", Search(1), 0, 0)
    with pytest.raises(BadInput, match="no due times"):
        run_sessions(cell, "srl", Search(1, "mean-tardiness"), 1, 0)
    with pytest.raises(BadInput, match=r"sequence \[1, 2\]"):
        evaluate(cell, [[1, 1], [1, 2]], [0])
    with pytest.raises(BadInput, match=r"sequence \[1, 0\]"):
        evaluate(cell, [[1, 0]], [0])
    with pytest.raises(BadInput, match="no due times"):
        evaluate(cell, [[1, 1]], [0], objective="tardy-parts")
