"""What a compiled session keeps: a table of values, what it learns by, and the episode under way."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.state_keys import Keys
from lab.sequencing.simulate.cell_arrays import CellArrays, Flags, Floats, Ints, RunArrays, most_moves, run_arrays

LEARNER_CODES = {"random": 0, "srl": 1, "mc": 2}
DENSE_KEYS = 2**18  # up to so many keys a table has a place for each, above it is a hash table


class ValueTable(NamedTuple):
    """Values by key. Rows are filled from 1; row 0 has the value of every key that is not in the table.

    rows: the row by key where `dense`, else an open hash table of rows. visits: by row, for averages. used (1,): the
    last row filled.
    """

    rows: NDArray[np.int32]
    keys: Ints
    values: Floats
    visits: Ints
    used: Ints
    dense: bool


class LearningRules(NamedTuple):
    """What is learned by. learner: one of LEARNER_CODES; the logarithms are those of the step update's factors.

    log_keep: 1 - alpha, log_take: alpha times discount. end_keep and end_add: what the last value of a finished episode
    is multiplied by, and what is added. type_a: the reward factor. offset: see `gain`.
    """

    learner: int
    log_keep: float
    log_take: float
    end_keep: float
    end_add: float
    type_a: bool
    offset: float


class Method(NamedTuple):
    """How a session learns: the keys of its values, and its rules."""

    keys: Keys
    rules: LearningRules


class Learning(NamedTuple):
    """What sessions learn in and how: the cell, the same without chance."""

    cell: CellArrays
    calm: CellArrays
    method: Method


class Found(NamedTuple):
    """What N sessions of E episodes of up to L moves come to.

    costs, complete (N, E): of the episodes. sequences (N, L): the best so far, then zeros; ends (N, 2): its cost, and
    the greedy policy's.
    """

    costs: Floats
    complete: Flags
    sequences: Ints
    ends: Floats

    @classmethod
    def room(cls, sessions: int, episodes: int, moves: int) -> "Found":
        """Room for so many."""
        shape = sessions, episodes
        ends = np.zeros((sessions, 2))
        return cls(np.zeros(shape), np.zeros(shape, np.bool_), np.zeros((sessions, moves), np.int64), ends)


class SessionArrays(NamedTuple):
    """What a session of sequences of up to L moves writes to.

    values: those of the allowed decisions. trail, sequence (L,): rows and decisions of the episode under way. best (L,),
    best_cost (1,): the best sequence so far, then zeros; inf: none. stream (1,): the state of the random numbers.
    """

    run: RunArrays
    memory: ValueTable
    values: Floats
    trail: Ints
    sequence: Ints
    best: Ints
    best_cost: Floats
    stream: NDArray[np.uint64]


def value_table(keys: int, rows: int, first: float) -> ValueTable:
    """An empty table for so many keys and up to so many rows; `first`: the value of what was never visited."""
    rows = min(rows, keys)
    dense = keys <= DENSE_KEYS
    values = np.zeros(rows + 1)
    values[0] = first
    return ValueTable(
        rows=np.zeros(keys if dense else 1 << (2 * rows).bit_length(), np.int32),
        keys=np.zeros(rows + 1, np.int64),
        values=values,
        visits=np.zeros(rows + 1, np.int64),
        used=np.zeros(1, np.int64),
        dense=dense,
    )


def session_arrays(cell: Cell, memory: ValueTable) -> SessionArrays:
    """Room for a session; `session_kernels.advance` makes it ready."""
    run, moves = run_arrays(cell), most_moves(cell)
    trail, sequence, best = np.zeros((3, moves), np.int64)
    return SessionArrays(
        run, memory, np.zeros(len(run.allowed)), trail, sequence, best, np.zeros(1), np.zeros(1, np.uint64)
    )
