"""Which cell is where on the teaching page's map, and what the learner thinks of it."""

import numpy as np
import pytest

from lab.learning.selection import chances
from lab.mdp import coverage, grid
from lab.seat.page.page_question import HIGHER, LOWER, MOST_ARROWS, directions, place_of, slice_of, spot

SPACE = ("left", "right", "backward", "forward", "down", "up")


def test_rows_run_down_and_columns_to_the_right() -> None:
    mdp = grid((2, 3), [[0, 1, 0], [0, 0, 0]], (0, 0), (1, 2), action_labels=("up", "down", "left", "right"))
    place = place_of(mdp)
    assert place is not None
    assert (place["rows"], place["columns"], place["layers"]) == (2, 3, 1)
    assert place["goals"] == [[1, 2, 0]]
    assert place["directions"] == [0, 1, 2, 3]
    assert slice_of(mdp, 0, 0, None, "softmax", 1.0)["marks"] == ".#...G"
    assert [spot(mdp, state) for state in range(4)] == [[0, 0, 0], [0, 1, 0], [0, 2, 0], [1, 0, 0]]


def test_a_map_is_shown_from_above_layer_by_layer() -> None:
    """x to the right, y up, z the layer: the start (0, 0, 0) is at the lower left of layer 0."""
    blocked = np.zeros((2, 3, 2), bool)
    blocked[1, 0, 0] = True
    mdp = grid((2, 3, 2), blocked, (0, 0, 0), (1, 2, 1), action_labels=SPACE)
    place = place_of(mdp)
    assert place is not None
    assert (place["rows"], place["columns"], place["layers"]) == (3, 2, 2)
    assert place["goals"] == [[0, 1, 1]]
    assert place["directions"] == [2, 3, 1, 0, LOWER, HIGHER]
    assert spot(mdp, mdp.start) == [2, 0, 0]
    lower, upper = (slice_of(mdp, mdp.start, layer, None, "softmax", 1.0) for layer in (0, 1))
    assert lower["marks"] == "....." + "#"
    assert upper["marks"] == ".G" + "...."


def test_a_row_of_cells_is_one_row() -> None:
    mdp = grid((4,), np.zeros(4, bool), (0,), (3,))
    assert place_of(mdp) is not None
    assert slice_of(mdp, 1, 0, None, "softmax", 1.0)["marks"] == "...G"
    assert spot(mdp, 2) == [0, 2, 0]
    assert directions(mdp) == [2, 3]


def test_axes_beyond_the_third_are_layers_too() -> None:
    mdp = grid((2, 2, 3, 2), np.zeros((2, 2, 3, 2), bool), (0, 0, 0, 0), (1, 1, 2, 1))
    place = place_of(mdp)
    assert place is not None
    assert place["layers"] == 6
    assert place["goals"] == [[1, 1, 5]]
    assert slice_of(mdp, 0, 5, None, "softmax", 1.0)["marks"] == "...G"


def test_values_and_preferences_are_of_cells_that_it_has_an_opinion_of() -> None:
    mdp = grid((1, 3), np.zeros((1, 3), bool), (0, 0), (0, 2), action_labels=("up", "down", "left", "right"))
    q = [[0.0, 0.0, 0.0, 0.5], [0.25, 0.25, 0.25, 0.25], [0.0] * 4]
    shown = slice_of(mdp, 0, 0, q, "softmax", 0.5)
    assert shown["values"] == [0.5, None, None]
    assert shown["prefers"] == [[0, 3, round(chances("softmax", q[0], 0.5)[3], 2)]]


def test_a_wall_and_the_goal_are_worth_nothing() -> None:
    mdp = grid((1, 3), [[0, 0, 1]], (0, 0), (0, 1), action_labels=("up", "down", "left", "right"))
    assert slice_of(mdp, 0, 0, [[1.0, 2.0, 3.0, 4.0]] * 3, "greedy", 0.0)["values"] == [4.0, None, None]


def test_in_covering_a_cell_is_worth_what_the_head_there_would_be() -> None:
    mdp = coverage((1, 2))
    start = mdp.start  # head in cell 0, that one covered
    q = [[float(state), 0.0, 0.0, 0.0] for state in range(mdp.n_states)]
    shown = slice_of(mdp, start, 0, q, "greedy", 0.0)
    assert shown["marks"] == "x."
    assert shown["values"] == [1.0, None]  # to move the head on covers both: the goal
    assert spot(mdp, start) == [0, 0, 0]


def test_large_layers_have_no_arrows_and_huge_ones_no_map() -> None:
    side = int(MOST_ARROWS**0.5) + 1
    mdp = grid((side, side), np.zeros((side, side), bool), (0, 0), (1, 1))
    shown = slice_of(mdp, 0, 0, [[0.0, 1.0, 0.0, 0.0]] * mdp.n_states, "greedy", 0.0)
    assert shown["prefers"] == []
    assert shown["values"].count(1.0) == side * side - 1
    assert place_of(grid((200, 200), np.zeros((200, 200), bool), (0, 0), (1, 1))) is None


@pytest.mark.parametrize("selection", ["softmax", "epsilon-greedy", "greedy"])
def test_the_preference_is_the_likeliest_action(selection: str) -> None:
    mdp = grid((1, 2), np.zeros((1, 2), bool), (0, 0), (0, 1))
    q = [[0.1, 0.9, 0.2, 0.3], [0.0] * 4]
    cell, action, chance = slice_of(mdp, 0, 0, q, selection, 0.4)["prefers"][0]
    assert (cell, action) == (0, 1)
    assert chance == round(chances(selection, q[0], 0.4)[1], 2)
