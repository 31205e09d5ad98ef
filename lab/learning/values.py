"""What a table is worth in a problem, for all states at once: ways counted in moves, and the values of known moves."""

import numpy as np

from lab.mdp import BoolArray, FloatArray, IntArray, TabularMDP

MOST_SWEEPS, SETTLED = 1000, 1e-9


def fewest_moves(mdp: TabularMDP) -> FloatArray:
    """The fewest moves from each state to a goal that enter no other terminal state; (S,) float64, inf where none lead there."""
    return _moves_along(mdp, mdp.successor)


def greedy_moves(q: FloatArray, mdp: TabularMDP) -> FloatArray:
    """The moves to a goal by the best action of each state, as `greedy_path`; (S,) float64, inf where they miss it."""
    return _moves_along(mdp, mdp.successor[np.arange(mdp.n_states), q.argmax(axis=1)][:, None])


def _moves_along(mdp: TabularMDP, onward: IntArray) -> FloatArray:
    """The fewest moves to a goal when a state leads on to `onward` (S, choices)."""
    left = np.where(mdp.goal, 0.0, np.inf)
    while True:
        updated: FloatArray = np.where(mdp.terminal, left, 1.0 + left[onward].min(axis=1))
        if np.array_equal(updated, left):
            return left
        left = updated


def known_values(mdp: TabularMDP, known: BoolArray, others: FloatArray, discount: float) -> FloatArray:
    """The values (S, A) of the moves of which it is `known` (S, A) where they lead, by value iteration over them alone.

    `others` (S, A): what all other moves are worth. The sweeps end when the values have settled, or after MOST_SWEEPS.
    Source: Sutton 1990 (Dyna); Brafman and Tennenholtz 2002 (R-max), where the others are worth as much as can be.
    """
    onward = discount * ~mdp.terminal[mdp.successor]
    q = others
    for _ in range(MOST_SWEEPS):
        found: FloatArray = np.where(known, mdp.reward + onward * q.max(axis=1)[mdp.successor], others)
        settled = bool(np.abs(found - q).max() < SETTLED)
        q = found
        if settled:
            break
    return q
