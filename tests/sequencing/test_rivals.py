"""The plain sequencers."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell import Cell
from lab.sequencing.rivals import fifo, random_search

CellMaker = Callable[..., Cell]


def test_fifo_takes_what_has_been_ready_longest(oven_cell: CellMaker, toast_cell: CellMaker) -> None:
    """Without a buffer, toast by toast; with one, all raw slices (ready at 0 s) leave the plate first."""
    assert fifo(oven_cell(2)).sequence == (1, 1, 2, 2)
    assert fifo(toast_cell("I", 3)).sequence[:3] == (1, 2, 3)


def test_random_search_keeps_the_best(toast_cell: CellMaker) -> None:
    result = random_search(toast_cell("I", 3), 50, np.random.default_rng(0))
    assert len(result.episode_makespans_s) == 50
    assert result.makespan_s == min(result.episode_makespans_s) < max(result.episode_makespans_s)


def test_random_search_needs_an_episode(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="episodes = 0"):
        random_search(oven_cell(), 0, np.random.default_rng(0))
