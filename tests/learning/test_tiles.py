"""Tile coding: shifts and tiles by hand, one tile of each tiling, cells that are all that can be told apart."""

from math import gcd

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.learning.settings import LearnerSettings
from lab.learning.splitmix import stream
from lab.learning.tiles import Bounds, TileCoding, cell_along
from lab.learning.updates import update_of
from lab.learning.updates.linear import OnTiles
from lab.mdp import grid

codings = st.builds(TileCoding, st.lists(st.integers(1, 9), min_size=1, max_size=3).map(tuple), st.integers(1, 6))


def test_four_cells_in_two_tilings_by_hand() -> None:
    coding = TileCoding((4,), 2)  # tiles of two cells: |01|23| and, shifted by one, |0|12|3|
    assert coding.per_tiling == (3,)
    assert [coding.tiles_of(cell) for cell in range(4)] == [[0, 3], [0, 4], [1, 4], [1, 5]]


def test_tilings_are_shifted_by_odd_numbers_of_cells() -> None:
    coding = TileCoding((8, 8), 4)
    assert coding.tiles_of(0) == [0, 9, 18, 27]  # no shift reaches the next tile of the first cell
    assert coding.tiles_of(3 * 8) == [0, 9 + 3, 18 + 3, 27 + 3]  # row 3, column 0: shifted by 1 to 3 rows
    assert coding.tiles_of(1) == [0, 9 + 1, 18, 27]  # column 1: shifted by 0, 3, 2 (6), 1 (9)


@given(codings)
def test_each_cell_has_one_tile_of_each_tiling_and_neighbours_share_most(coding: TileCoding) -> None:
    states = int(np.prod(coding.shape))
    np.testing.assert_array_equal(coding.active, [coding.tiles_of(state) for state in range(states)])
    per_tiling = coding.count // coding.tilings
    np.testing.assert_array_equal(coding.active // per_tiling, np.tile(np.arange(coding.tilings), (states, 1)))
    tiles = coding.active.reshape(*coding.shape, coding.tilings)
    for axis in range(len(coding.shape)):
        differ = (np.diff(tiles, axis=axis) != 0).sum(axis=-1)
        if differ.size and gcd(2 * axis + 1, coding.tilings) == 1:  # else several tilings are shifted alike
            assert differ.max() <= 1


@given(codings, st.integers(0, 99))
def test_weights_are_found_again_from_the_values_that_they_made(coding: TileCoding, seed: int) -> None:
    values = coding.values(np.random.default_rng(seed).normal(size=(coding.count, 2)))
    np.testing.assert_allclose(coding.values(coding.weights(values)), values, atol=1e-8)


def test_cells_of_a_continuous_space() -> None:
    bounds = Bounds((-1.0, 0.0), (1.0, 10.0), (4, 5))
    assert [cell_along(x, -1.0, 1.0, 4) for x in (-9.0, -1.0, -0.5, 0.99, 1.0, 9.0)] == [0, 0, 1, 3, 3, 3]
    assert bounds.number((-0.5, 9.0)) == 1 * 5 + 4
    assert bounds.centre(1 * 5 + 4) == (-0.25, 9.0)


def test_one_step_moves_all_tiles_of_a_state_by_their_shares() -> None:
    mdp = grid((4,), np.zeros(4, bool), (0,), (3,))
    learner = update_of(LearnerSettings("q", alpha=0.5, tilings=2), mdp, np.zeros((4, 2)), stream(0))
    learner.learn(1, 1, 1.0, 0.0, 2, 0)  # the tiles 0 and 4 of cell 1 get a quarter each
    np.testing.assert_array_equal(learner.table()[:, 1], [0.25, 0.5, 0.25, 0.0])


def test_a_replacing_trace_is_set_to_one_and_an_accumulating_one_grows() -> None:
    mdp = grid((4,), np.zeros(4, bool), (0,), (3,))
    found = []
    for replacing in (True, False):
        settings = LearnerSettings("sarsa-lambda", alpha=1.0, discount=1.0, trace=0.5, replacing=replacing, tilings=2)
        learner = update_of(settings, mdp, np.zeros((4, 2)), stream(0))
        learner.learn(0, 1, 0.0, 1.0, 0, 1)
        learner.learn(0, 1, 1.0, 0.0, 1, 1)
        found.append(learner.table()[0, 1])
    assert found == [1.0, 1.5]


def test_the_ensemble_begins_with_values_within_a_half() -> None:
    mdp = grid((6, 6), np.zeros((6, 6), bool), (0, 0), (5, 5))
    learner = update_of(LearnerSettings("q", tilings=4), mdp, np.zeros((36, 4)), stream(0))
    learner.scatter(np.random.default_rng(0).random)
    assert isinstance(learner, OnTiles)
    assert 0.0 < np.abs(learner.table()).max() <= 0.5


def test_what_is_no_grid_has_no_tiles() -> None:
    with pytest.raises(BadInput, match="no grid"):
        TileCoding((), 4)
