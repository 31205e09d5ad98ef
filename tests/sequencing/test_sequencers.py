"""What every registered sequencer must do."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.sequencing import SEQUENCERS
from lab.sequencing.cell import Cell
from lab.sequencing.events import EpisodeSequenced, SequenceResult, simulate
from lab.sequencing.exact import optimum

NAMES = sorted(SEQUENCERS)


def run(name: str, cell: Cell, seed: int, seen: list[EpisodeSequenced] | None = None) -> SequenceResult:
    return SEQUENCERS[name](cell, 5, np.random.default_rng(seed), None if seen is None else seen.append)


def test_the_table() -> None:
    assert NAMES == ["exact", "fifo", "random", "srl", "srl-time"]


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=20, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1))
def test_contract(cells: Callable[..., st.SearchStrategy[Cell]], name: str, data: st.DataObject, seed: int) -> None:
    """The sequence is allowed, its makespan is the simulated one, and none is below the optimum."""
    cell = data.draw(cells(max_machines=2, max_toasts=4))
    seen: list[EpisodeSequenced] = []
    result = run(name, cell, seed, seen)
    assert simulate(cell, result.sequence).makespan_s == result.makespan_s
    assert result.makespan_s >= optimum(cell).makespan_s - 1e-6
    assert result.makespan_s == min(result.episode_makespans_s)
    assert tuple(event.makespan_s for event in seen) == result.episode_makespans_s


@pytest.mark.parametrize("name", NAMES)
def test_same_seed_same_result(toast_cell: Callable[..., Cell], name: str) -> None:
    assert run(name, toast_cell("I", 4), seed=7) == run(name, toast_cell("I", 4), seed=7)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("toasts", [1, 50])
def test_smallest_and_largest_job(oven_cell: Callable[..., Cell], name: str, toasts: int) -> None:
    """One machine, no buffer: the only way is toast by toast, 14 s and 15 s more for each after the first."""
    stations = tuple(
        type(s)(s.name, s.kind, 1 if s.kind == "machine" else 50, s.processing_s) for s in oven_cell().stations
    )
    result = run(name, oven_cell(toasts, stations=stations), seed=0)
    assert result.makespan_s == pytest.approx(14 + 15 * (toasts - 1))
