"""Values of all states of a problem at once: distances to the goal in moves, values of shortest paths, values of known moves."""

from itertools import pairwise

import numpy as np

from lab.mdp import BoolArray, FloatArray, IntArray, TabularMDP

MOST_SWEEPS, SETTLED = 1000, 1e-9


def fewest_moves(mdp: TabularMDP) -> FloatArray:
    """The length in moves of the shortest path from each state to a goal, (S,) float64, inf if there is none."""
    return _moves_along(mdp, mdp.successor)


def greedy_moves(q: FloatArray, mdp: TabularMDP) -> FloatArray:
    """The length in moves of the greedy path from each state, (S,) float64, inf if it misses the goal."""
    return _moves_along(mdp, mdp.successor[np.arange(mdp.n_states), q.argmax(axis=1)][:, None])


def _moves_along(mdp: TabularMDP, onward: IntArray) -> FloatArray:
    """The fewest moves to a goal from each state if its moves lead to `onward` (S, choices); breadth-first from the goals."""
    left, moves = np.where(mdp.goal, 0.0, np.inf), 0
    order = np.argsort(onward, axis=None, kind="stable")  # the moves by the state that they enter
    before, number = order // onward.shape[1], np.bincount(onward.ravel(), minlength=mdp.n_states)
    first = np.cumsum(number) - number
    frontier = np.flatnonzero(mdp.goal)
    while frontier.size:
        moves, each = moves + 1, number[frontier]
        within = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
        predecessors = np.unique(before[np.repeat(first[frontier], each) + within])
        frontier = predecessors[np.isinf(left[predecessors]) & ~mdp.terminal[predecessors]]
        left[frontier] = moves
    return left


def values_of_shortest_paths(mdp: TabularMDP, discount: float) -> FloatArray:
    """The value (S, A) of each move if a shortest path to a goal follows it: a first guess at the optimal values.

    States without a path to a goal have the value of moving for ever; discount: below 1.
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
    """The action values (S, A) by value iteration over the moves whose outcomes are known.

    known: (S, A) bool; others: (S, A), the values of all other moves. The sweeps end on convergence, or after MOST_SWEEPS.
    Source: Sutton 1990 (Dyna); Brafman and Tennenholtz 2002 (R-max), where unknown moves have the highest possible value.
    """
    onward = discount * ~mdp.terminal[mdp.successor]
    q = others
    for _ in range(MOST_SWEEPS):
        updated: FloatArray = np.where(known, mdp.reward + onward * q.max(axis=1)[mdp.successor], others)
        settled = bool(np.abs(updated - q).max() < SETTLED)
        q = updated
        if settled:
            break
    return q
