"""Recorded episodes: their lengths, and where a teacher took over."""

import numpy as np
import pytest

from lab.errors import BadInput
from lab.recordings.episode import Episode, Recording


def episode(corrected: list[bool], width: int = 2) -> Episode:
    n = len(corrected)
    return Episode("move", np.zeros((n, width), np.float32), np.zeros((n, 1), np.float32), np.array(corrected, bool))


def test_the_takeovers_are_the_stretches_of_corrected_steps() -> None:
    assert episode([True, True, False, True, False]).takeovers() == [(0, 2), (3, 4)]
    assert episode([False, False]).takeovers() == []
    assert episode([]).takeovers() == []
    assert episode([True, True]).takeovers() == [(0, 2)]


def test_lengths_that_differ_are_refused() -> None:
    with pytest.raises(BadInput, match="actions: 2 steps"):
        Episode("move", np.zeros((3, 2), np.float32), np.zeros((2, 1), np.float32), np.zeros(3, bool))


def test_values_that_are_not_finite_are_refused() -> None:
    with pytest.raises(BadInput, match="states"):
        Episode("move", np.full((1, 2), np.nan, np.float32), np.zeros((1, 1), np.float32), np.zeros(1, bool))


def test_an_episode_of_another_width_is_refused() -> None:
    with pytest.raises(BadInput, match="episode 1: 3 states"):
        Recording(10, "panda", ("x", "y"), ("vx",), [episode([False]), episode([False], width=3)])
