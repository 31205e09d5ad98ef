"""Ways counted in moves and values of known moves, on a corridor and on boards that hypothesis draws."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.learning.values import fewest_moves, greedy_moves, known_values
from lab.mdp import NoPath, greedy_path, grid, optimal_values, shortest_steps

CORRIDOR = grid((1, 4), np.zeros((1, 4), bool), (0, 1), (0, 3))  # its moves: up and down stay, left, right
LEFT, RIGHT = 2, 3


def test_moves_to_the_goal_of_a_corridor() -> None:
    assert fewest_moves(CORRIDOR).tolist() == [3, 2, 1, 0]
    q = np.zeros((4, 4))
    q[1:, RIGHT] = 1.0
    q[0, LEFT] = 1.0  # there it stays for ever
    assert greedy_moves(q, CORRIDOR).tolist() == [np.inf, 2, 1, 0]


def test_what_is_known_is_worth_what_comes_after_it() -> None:
    """Of two known moves, the one into the goal is worth 1.5, the one before it a step and half of that."""
    known = np.zeros((4, 4), bool)
    known[1, RIGHT] = known[2, RIGHT] = True
    values = known_values(CORRIDOR, known, np.full((4, 4), -9.0), 0.5)
    assert values[2, RIGHT] == 1.5
    assert values[1, RIGHT] == pytest.approx(-0.1 + 0.5 * 1.5)
    assert (values[~known] == -9.0).all()


@given(st.sets(st.tuples(st.integers(0, 2), st.integers(0, 3)), max_size=6), st.randoms(use_true_random=False))
def test_all_states_are_as_each_alone(blocked: set[tuple[int, int]], random: Any) -> None:
    wall = np.zeros((3, 4), bool)
    for cell in blocked - {(0, 0), (2, 3)}:
        wall[cell] = True
    try:
        mdp = grid((3, 4), wall, (0, 0), (2, 3))
    except NoPath:
        return
    assert fewest_moves(mdp)[mdp.start] == shortest_steps(mdp)
    q = np.array([[random.random() for _ in range(4)] for _ in range(12)])
    moves = greedy_moves(q, mdp)
    for state in np.flatnonzero(~mdp.terminal):
        _, actions, reached = greedy_path(q, mdp, 12, int(state))
        assert moves[state] == (len(actions) if reached else np.inf)
    every = np.broadcast_to(~mdp.terminal[:, None], (12, 4))
    best = known_values(mdp, every, np.zeros((12, 4)), 0.9)
    np.testing.assert_allclose(best, optimal_values(mdp, 0.9), atol=1e-6)
