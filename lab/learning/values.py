"""What a table is worth in a problem, for all states at once: ways counted in moves, and the values of known moves."""

from itertools import pairwise

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
    left, moves = np.where(mdp.goal, 0.0, np.inf), 0
    order = np.argsort(onward, axis=None, kind="stable")  # the moves by the state that they enter
    before, number = order // onward.shape[1], np.bincount(onward.ravel(), minlength=mdp.n_states)
    first = np.cumsum(number) - number
    frontier = np.flatnonzero(mdp.goal)
    while frontier.size:
        moves, each = moves + 1, number[frontier]
        within = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
        found = np.unique(before[np.repeat(first[frontier], each) + within])
        frontier = found[np.isinf(left[found]) & ~mdp.terminal[found]]
        left[frontier] = moves
    return left


def values_of_ways(mdp: TabularMDP, discount: float) -> FloatArray:
    """What the moves (S, A) are worth to one who then goes a shortest way to a goal: a guess at the optimal values.

    Where no way leads to one, all moves are worth walking for ever; discount: below 1.
    """
    left = fewest_moves(mdp)
    for_ever = float(np.median(mdp.reward[~mdp.terminal])) / (1.0 - discount)
    values = np.where(np.isinf(left) & ~mdp.terminal, for_ever, 0.0)
    reached = np.flatnonzero(np.isfinite(left) & ~mdp.terminal)
    order = reached[np.argsort(left[reached], kind="stable")]
    ends = np.cumsum(np.bincount(left[reached].astype(int)))
    for start, end in pairwise(ends.tolist()):  # the states at 1, 2, ... moves from a goal
        at = order[start:end]
        entered = mdp.successor[at]
        nearer = left[entered] < left[at][:, None]
        onward = mdp.reward[at] + discount * np.where(mdp.terminal[entered], 0.0, values[entered])
        values[at] = np.where(nearer, onward, -np.inf).max(axis=1)
    q: FloatArray = mdp.reward + discount * np.where(mdp.terminal[mdp.successor], 0.0, values[mdp.successor])
    q[mdp.terminal] = 0.0
    return q


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
