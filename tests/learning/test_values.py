"""Ways counted in moves and values of known moves, on a corridor and on boards that hypothesis draws."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.learning.environment import TableEnvironment
from lab.learning.values import fewest_moves, greedy_moves, known_values, values_of_shortest_paths
from lab.mdp import NoPath, Rewards, greedy_path, grid, optimal_values, shortest_steps

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


@given(st.integers(0, 10_000), st.floats(0.0, 0.5), st.sampled_from([0.5, 0.9, 0.99]))
def test_ways_are_a_guess_from_which_the_values_settle_alike(seed: int, density: float, discount: float) -> None:
    rng = np.random.default_rng(seed)
    wall = rng.random((7, 6)) < density
    wall[0, 0] = wall[0, 1] = False
    mdp = grid((7, 6), wall, (0, 0), (0, 1), Rewards(collision=-1000.0))
    exact, guess = optimal_values(mdp, discount), values_of_shortest_paths(mdp, discount)
    np.testing.assert_allclose(optimal_values(mdp, discount, guess), exact, atol=1e-9)
    there = np.isfinite(fewest_moves(mdp))
    best = guess[there].max(axis=1), exact[there].max(axis=1)
    np.testing.assert_allclose(*best, atol=1e-9)  # with crashes that dear, the shortest ways are the best


def test_a_large_table_is_known_at_once() -> None:
    place = TableEnvironment(grid((400, 400), np.zeros((400, 400), bool), (0, 0), (399, 399)))
    assert place.values(0.99)[0].max() == pytest.approx(-0.1 * (1 - 0.99**797) / 0.01 + 0.99**797 * 1.5, rel=1e-9)
