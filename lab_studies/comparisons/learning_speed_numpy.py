"""The rival of the speed benchmark in numpy: all sessions side by side, one move of each at a time."""

from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from lab.learning.settings import LearnerSettings
from lab.mdp import FloatArray, TabularMDP
from lab_studies.comparisons.learning_speed_session import MOVES, Measured, Session, batch_sizes, session_of

LANES = 2000  # sessions side by side, which share the cost of a call
BLOCK = 64  # moves after which finished sessions are removed

Index = NDArray[np.intp]


def numpy_lock_step(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
    """The measurement of sessions side by side in numpy arrays, one move of each at a time."""
    session, rng = session_of(mdp, settings, sessions), np.random.default_rng(seed)
    began = perf_counter()
    batches = [_batch(session, lanes, rng) for lanes in batch_sizes(sessions, LANES)]
    seconds = perf_counter() - began
    return Measured(sum(moves for moves, _ in batches), seconds, 100.0 * sum(won for _, won in batches) / sessions)


@dataclass(eq=False)
class _Lanes:
    """Sessions under way, (n,) each: the begin of their table, their state, their episode, and the move that it began at."""

    base: Index
    state: Index
    episode: Index
    begun: Index
    sharpness: FloatArray

    def those(self, going: NDArray[np.bool_]) -> "_Lanes":
        """The sessions that are chosen."""
        return _Lanes(*(column[going] for column in vars(self).values()))


class _Move:
    """A move of all lanes, with arrays that are made once for a block."""

    def __init__(self, session: Session, lanes: _Lanes, table: FloatArray) -> None:
        n = len(lanes.state)
        self._session, self._lanes, self._table = session, lanes, table
        self._neighbours = np.ascontiguousarray(session.successor.T, np.intp)  # (6, S)
        self._near, self._lane = np.empty((MOVES, n), np.intp), np.arange(n)
        self._value, self._weight = np.empty((MOVES, n)), np.empty((MOVES, n))
        self._steps_of_sum = list(pairwise(self._weight))
        self._top, self._old, self._new = np.empty((3, n))
        self._here, self._entered, self._picked = np.empty((3, n), np.intp)
        self._beyond, self._action = np.empty((MOVES - 1, n), np.bool_), np.empty(n, np.int8)

    def __call__(self, mark: FloatArray) -> Index:
        """The place in the table that each lane enters (n,), by a uniform number each; `mark` is overwritten."""
        lanes, near, value, weight = self._lanes, self._near, self._value, self._weight
        np.take(self._neighbours, lanes.state, axis=1, out=near, mode="clip")
        np.add(near, lanes.base, out=near)
        np.take(self._table, near, out=value, mode="clip")
        np.maximum.reduce(value, axis=0, out=self._top)
        np.subtract(value, self._top, out=weight)
        np.multiply(weight, lanes.sharpness, out=weight)
        np.maximum(weight, -700.0, out=weight)  # exp is slow where it underflows
        np.exp(weight, out=weight)
        for below, above in self._steps_of_sum:  # much faster than cumsum along this axis
            np.add(below, above, out=above)
        np.multiply(mark, weight[-1], out=mark)
        np.less_equal(weight[:-1], mark, out=self._beyond)
        np.add.reduce(self._beyond.view(np.int8), axis=0, dtype=np.int8, out=self._action)
        np.multiply(self._action, len(mark), out=self._picked, dtype=np.intp)
        np.add(self._picked, self._lane, out=self._picked)
        near.take(self._picked, out=self._entered, mode="clip")
        self._learn()
        np.subtract(self._entered, lanes.base, out=lanes.state)
        return self._entered

    def _learn(self) -> None:
        session, old, new = self._session, self._old, self._new
        self._value.take(self._picked, out=new, mode="clip")
        np.add(self._lanes.state, self._lanes.base, out=self._here)
        self._table.take(self._here, out=old, mode="clip")
        np.multiply(new, session.alpha * session.discount, out=new)
        np.add(new, session.alpha * session.loss, out=new)
        np.multiply(old, 1.0 - session.alpha, out=old)
        np.add(new, old, out=new)
        self._table[self._here] = new


def _batch(session: Session, n: int, rng: np.random.Generator) -> tuple[int, int]:
    """The moves and the won sessions of n lanes. A finished session walks on, uncounted, until the end of the block."""
    sharpness = np.pad(session.sharpness, (0, BLOCK), "edge")
    table, zeros = np.zeros(n * session.states), np.zeros(n, np.intp)
    lanes = _Lanes(np.arange(n) * session.states, zeros + session.start, zeros, zeros.copy(), zeros + sharpness[0])
    now = oldest = moves = won = 0  # oldest: the earliest begin of an episode under way
    while len(lanes.state):
        move = _Move(session, lanes, table)
        for mark in rng.random((BLOCK, len(lanes.state))):
            entered = move(mark)
            now += 1
            over = session.terminal.take(lanes.state).nonzero()[0]
            table[entered.take(over)] = session.arrival.take(lanes.state.take(over))
            if now == oldest + session.max_moves:
                over = np.union1d(over, (lanes.begun == oldest).nonzero()[0])
            following = lanes.episode.take(over) + 1
            ended = following == session.episodes
            if np.count_nonzero(ended):
                last = over[ended]
                moves += now * len(last)  # a lane never pauses
                shortest = now - lanes.begun[last] == session.optimal
                won += int(np.count_nonzero(session.goal[lanes.state[last]] & shortest))
            lanes.episode[over], lanes.sharpness[over] = following, sharpness.take(following)
            lanes.state[over], lanes.begun[over] = session.start, now
            if now == oldest + session.max_moves:
                oldest = int(lanes.begun.min())
        lanes = lanes.those(lanes.episode < session.episodes)
    return moves, won
