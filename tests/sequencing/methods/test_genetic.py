"""The genetic algorithm: what it begins with, and that it is no worse than a rule nor over its budget."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import BUILT_IN, cost
from lab.sequencing.methods.genetic import genetic
from lab.sequencing.methods.priorities import Orders
from lab.sequencing.search import EpisodeSequenced, Search
from lab.sequencing.simulate.follow import follow, simulate

CellMaker = Callable[..., Cell]
Cells = Callable[..., st.SearchStrategy[Cell]]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("episodes", [1, 4, 5, 9, 57, 700])
def test_the_budget_is_kept(toast_cell: CellMaker, episodes: int) -> None:
    """Also where it ends within the first population, or within a child; every sequence tried is an episode."""
    seen: list[EpisodeSequenced] = []
    result = genetic(toast_cell("I", 3), Search(episodes, on_episode=seen.append), rng())
    assert len(result.episode_costs) == episodes
    assert tuple(episode.cost for episode in seen) == result.episode_costs
    assert result.cost == min(result.episode_costs)
    assert result.cost == simulate(toast_cell("I", 3), result.sequence).makespan_s


def test_one_part_has_one_sequence(oven_cell: CellMaker) -> None:
    result = genetic(oven_cell(1), Search(100), rng())
    assert result.sequence == (1, 1)
    assert set(result.episode_costs) == {14.0}


def test_it_finds_the_optimum_of_case_i(toast_cell: CellMaker) -> None:
    """Thesis 7.7: 513 s."""
    assert genetic(toast_cell("I", 3), Search(1000), rng()).cost == 513.0


def test_it_finds_a_published_optimum(ex11: Callable[[int], Cell]) -> None:
    """EX11 of Bilge and Ulusoy 1995: 96 with two vehicles, where the best rule needs 110."""
    assert genetic(ex11(2), Search(200_000), rng()).cost == 96.0


def test_same_seed_same_result_and_no_global_stream(toast_cell: CellMaker) -> None:
    before = np.random.get_state(legacy=False)  # noqa: NPY002 the global stream, which nobody here may touch
    first = genetic(toast_cell("I", 4), Search(60), rng(7))
    assert first == genetic(toast_cell("I", 4), Search(60), rng(7))
    assert first != genetic(toast_cell("I", 4), Search(60), rng(8))
    np.testing.assert_equal(np.random.get_state(legacy=False), before)  # noqa: NPY002


@settings(max_examples=25, deadline=None)
@given(data=st.data(), objective=st.sampled_from(BUILT_IN), seed=st.integers(0, 99))
def test_never_worse_than_the_rules(cells: Cells, shops: Cells, data: st.DataObject, objective: str, seed: int) -> None:
    cell = data.draw(st.one_of(cells(many=True, max_parts=3), shops()))
    objective = objective if cell.due_s is not None else "makespan"
    best = Orders(cell, objective, "a test").best
    try:
        result = genetic(cell, Search(80, objective), rng(seed))
    except WorkFailed:
        assert not best.done
        return
    assert not best.done or result.cost <= best.cost
    assert cost(follow(cell, result.sequence), objective) == pytest.approx(result.cost)
    assert result.cost == min(result.episode_costs)


def test_due_times_are_needed_where_they_count(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="due times"):
        genetic(oven_cell(), Search(objective="tardy-parts"), rng())
