"""Sessions: the compiled ones are the readable ones, and what values are kept under."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DataObject, SearchStrategy

from lab.errors import WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import LAWS, Chance
from lab.sequencing.cell.objectives import OBJECTIVES, stuck_cost
from lab.sequencing.methods.session_readable import (
    BLOCK,
    ROWS,
    LearnedSession,
    SessionLearner,
    learn,
    learn_compiled,
    learn_readably,
)
from lab.sequencing.methods.srl import Srl
from lab.sequencing.methods.state_keys import keys_of
from lab.sequencing.search import FACTORS, STATES, VALUES, EpisodeSequenced, Search, SrlSettings
from lab_studies.many_sessions import METHODS, run_sessions, session_seeds

CellMaker = Callable[..., Cell]
SEED = 2**64 - 59


def assert_same(one: LearnedSession, other: LearnedSession) -> None:
    assert one.log.costs == pytest.approx(other.log.costs)
    assert one.log.best == other.log.best
    assert one.log.best_cost == pytest.approx(other.log.best_cost)
    assert one.final_cost == pytest.approx(other.final_cost)
    assert one.table.keys() == other.table.keys()
    for state, row in one.table.items():
        assert row == pytest.approx(other.table[state]), state


def compiled(cell: Cell, search: Search, kind: type[SessionLearner]) -> LearnedSession:
    keys = kind.keys(cell, search.settings)
    assert keys is not None
    return learn_compiled(cell, search, SEED, kind, keys)


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_compiled_and_readable_are_the_same(
    cells: Callable[..., SearchStrategy[Cell]], method: str, data: DataObject
) -> None:
    """Decisions, costs, values; for any cell, objective, chance and settings."""
    cell = data.draw(cells(many=True, max_parts=4))
    share, of = st.sampled_from([0.0, 0.05, 0.5, 0.9, 1.0]), st.sampled_from
    learner = SrlSettings(
        data.draw(share),
        data.draw(share),
        data.draw(of([0.0, 0.5, 1.0, 30.0])),
        data.draw(of(FACTORS)),
        data.draw(of(VALUES)),
        data.draw(of(STATES)),
    )
    chance = Chance(data.draw(of(sorted(LAWS))), data.draw(of(sorted(LAWS))), 0.1)
    search = Search(data.draw(st.integers(1, 25)), data.draw(of(sorted(OBJECTIVES))), chance, learner)
    kind = METHODS[method]
    assert_same(compiled(cell, search, kind), learn_readably(cell, search, SEED, kind))


@pytest.mark.parametrize("values", VALUES)
@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("method", METHODS)
def test_they_are_the_same_in_the_thesis_systems(
    toast_cell: CellMaker, fms_cell: CellMaker, method: str, state: str, values: str, crossing_cell: Callable[[], Cell]
) -> None:
    """Longer sessions, where most values have been updated many times and most choices are greedy ones."""
    for cell in (toast_cell("I", 3), fms_cell("RSR"), crossing_cell()):
        search = Search(80, settings=SrlSettings(values=values, state=state))  # type: ignore[arg-type]
        assert_same(compiled(cell, search, METHODS[method]), learn_readably(cell, search, SEED, METHODS[method]))


@pytest.mark.parametrize("method", METHODS)
def test_deadlocks_are_learned_from_and_never_the_best(method: str, crossing_cell: Callable[[], Cell]) -> None:
    cell = crossing_cell()
    stuck = stuck_cost(cell, "makespan")
    found = learn(cell, Search(40), SEED, METHODS[method])
    assert stuck in found.log.costs
    assert found.log.best_cost < stuck
    ends = {seed: learn(cell, Search(1), seed, METHODS[method]).log for seed in range(12)}
    assert {log.costs == [stuck] for log in ends.values()} == {True, False}
    for log in ends.values():
        if log.costs == [stuck]:
            assert (log.best, log.best_cost) == ((), math.inf)
            with pytest.raises(WorkFailed, match="deadlocks"):
                log.found(cell)
    batch = run_sessions(cell, method, Search(1), 12, 0, keep_costs=True)
    ended = batch.costs[:, 0] < stuck
    assert set(ended.tolist()) == {True, False}
    assert np.array_equal(batch.best_cost, np.where(ended, batch.costs[:, 0], math.inf))
    assert np.array_equal(batch.sequences.any(axis=1), ended)


@pytest.mark.parametrize("method", ["srl", "mc"])
def test_a_table_grows(toast_cell: CellMaker, method: str) -> None:
    """Learning on with what was copied is as learning with a table that was large enough from the start."""
    cell, search = toast_cell("I", 12), Search(2000, settings=SrlSettings(beta=0.2))
    batch = run_sessions(cell, method, search, 1, 5, keep_costs=True)
    grown = learn(cell, search, int(session_seeds(5, 1)[0]), METHODS[method])
    assert sum(map(len, grown.table.values())) > ROWS
    assert grown.log.costs == batch.costs[0].tolist()
    assert grown.final_cost == batch.final_cost[0]


def test_what_does_not_fit_in_a_number_is_learned_readably(toast_cell: CellMaker) -> None:
    cell = toast_cell("I", 30)
    assert keys_of(cell, "pairs", "parts") is None
    assert keys_of(cell, "pairs", "stations") is not None
    result = learn(cell, Search(1), SEED, Srl)
    assert len(next(iter(result.table))) == 30
    assert len(result.log.costs) == 1


def test_the_listener_hears_of_every_episode(toast_cell: CellMaker) -> None:
    seen: list[EpisodeSequenced] = []
    result = learn(toast_cell("II", 3), Search(BLOCK + 10, on_episode=seen.append), SEED, Srl)
    assert [event.episode for event in seen] == list(range(1, BLOCK + 11))
    assert [event.cost for event in seen] == result.log.costs
    assert [event.best_cost for event in seen] == np.minimum.accumulate(result.log.costs).tolist()
