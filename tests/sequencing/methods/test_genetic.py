"""The genetic algorithm: what its keys mean, and that it keeps to the budget."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance
from lab.sequencing.methods.genetic import decode, genetic
from lab.sequencing.search import EpisodeSequenced, Search
from lab.sequencing.simulate.cell_arrays import most_moves
from lab.sequencing.simulate.run import Run, simulate

CellMaker = Callable[..., Cell]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_keys_by_hand(toast_cell: CellMaker) -> None:
    """Two slices. 0.5 of (1, 2) is 2, 0.4 of (1, 2) is 1; then 1 is in the buffer and waits: 2 is the only one, twice."""
    cell = toast_cell("I", 2)
    keys = np.zeros(most_moves(cell))
    keys[:2] = 0.5, 0.4
    run = Run(cell)
    assert decode(run, keys)[:3] == (2, 1, 2)
    assert run.done


def test_the_last_key_stays_within_the_list(oven_cell: CellMaker) -> None:
    assert decode(Run(oven_cell(2)), np.ones(most_moves(oven_cell(2)))) == (2, 2, 1, 1)


def test_a_gene_for_every_decision(oven_cell: CellMaker, toast_cell: CellMaker, fms_cell: CellMaker) -> None:
    """Oven: in and out. A slice by both buffers: five moves. Rooks and signs: five moves each."""
    assert (most_moves(oven_cell(3)), most_moves(toast_cell("I", 4)), most_moves(fms_cell("RSS"))) == (6, 20, 15)


@given(data=st.data())
def test_every_sequence_has_keys(cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=4, many=True))
    run, keys = Run(cell), np.zeros(most_moves(cell))
    sequence: list[int] = []
    while allowed := run.allowed():
        index = data.draw(st.integers(0, len(allowed) - 1))
        keys[len(sequence)] = (index + 0.5) / len(allowed)
        sequence.append(allowed[index])
        run.move(sequence[-1])
    assert decode(Run(cell), keys) == tuple(sequence)


@pytest.mark.parametrize("episodes", [1, 9, 10, 11, 57])
def test_the_budget_is_kept(toast_cell: CellMaker, episodes: int) -> None:
    """Also where it ends within a generation; every sequence tried is an episode."""
    seen: list[EpisodeSequenced] = []
    result = genetic(toast_cell("I", 3), Search(episodes, on_episode=seen.append), rng())
    assert len(result.episode_costs) == episodes
    assert tuple(episode.cost for episode in seen) == result.episode_costs
    assert result.cost == min(result.episode_costs)
    assert result.cost == simulate(toast_cell("I", 3), result.sequence).makespan_s


def test_one_part_has_one_sequence(oven_cell: CellMaker) -> None:
    """Two genes only, and every chromosome means the same."""
    result = genetic(oven_cell(1), Search(100), rng())
    assert result.sequence == (1, 1)
    assert result.episode_costs == (14.0,) * 100


def test_it_finds_the_optimum_of_case_i(toast_cell: CellMaker) -> None:
    """Thesis 7.7: 513 s."""
    assert genetic(toast_cell("I", 3), Search(1000), rng()).cost == 513.0


def test_same_seed_same_result_and_no_global_stream(toast_cell: CellMaker) -> None:
    before = np.random.get_state(legacy=False)  # noqa: NPY002 the global stream, which nobody here may touch
    first = genetic(toast_cell("I", 4), Search(60), rng(7))
    assert first == genetic(toast_cell("I", 4), Search(60), rng(7))
    assert first != genetic(toast_cell("I", 4), Search(60), rng(8))
    np.testing.assert_equal(np.random.get_state(legacy=False), before)  # noqa: NPY002


def test_by_chance_every_episode_has_its_own_times(oven_cell: CellMaker) -> None:
    result = genetic(oven_cell(1), Search(30, chance=Chance("exponential")), rng())
    assert len(set(result.episode_costs)) == 30


@settings(max_examples=15)
@given(data=st.data(), objective=st.sampled_from(["mean-tardiness", "robot-idle", "tardy-parts"]))
def test_any_objective(cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject, objective: str) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=3, many=True))
    result = genetic(cell, Search(12, objective), rng())
    assert result.cost == min(result.episode_costs) >= 0.0


def test_due_times_are_needed_where_they_count(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="due times"):
        genetic(oven_cell(), Search(objective="tardy-parts"), rng())
