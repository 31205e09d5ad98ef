"""What the compiled sessions work on: records of arrays and plain numbers."""

from dataclasses import fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.advice_memory import Now
from lab.learning.gates.gate_rules import CompiledGate
from lab.learning.gates.heard import Heard, HeardNow
from lab.mdp import FloatArray

LANES = 24


class ProblemArrays(NamedTuple):
    """The problem; successor, reward: (S * A,) flat; `ends`: 0 goes on, 1 goal, 2 another terminal state."""

    successor: NDArray[np.int32]
    reward: FloatArray
    arrival: FloatArray
    ends: NDArray[np.uint8]
    starts: NDArray[np.int64]
    step_reward: float


class Learning(NamedTuple):
    """The learner's settings, see `LearnerSettings`; actions: a tuple of A numbers, whose length the compiler knows, or an
    array of them.
    """

    afterstate: bool
    alpha: float
    discount: float
    max_moves: int
    max_steps: int
    count_start: bool
    actions: tuple[int, ...] | FloatArray


class Asking(NamedTuple):
    """The gate's rules and settings, see `GateSettings`."""

    gate: CompiledGate
    lambda_threshold: float
    omega: int
    first_episode: int
    window: int
    psi: float
    spread: float
    rate: float
    fading: float
    consistency: float
    enough_steps: float
    budget: int
    judge_unhelped: bool
    spare_best: bool
    max_steps: int


# What each of the sessions under way remembers; session -1: none. `converged` as in `gates.Ccrl`.
LANE = np.dtype(
    [(name, np.int64) for name in ("session", "episode", "is_open", "asked", "helped", "left")]
    + [(name, np.int64) for name in ("last_result", "equal_results", "converged")]
)
COUNTS = np.dtype(
    [(name, np.int64) for name in ("requests", "helped_steps", "misleads", "rejected_at_episode", "moves")]
)
NOW = np.dtype([(field.name, np.int64) for field in fields(Now)])
HEARD_NOW = np.dtype([(field.name, np.float64) for field in fields(HeardNow)])


class Sessions(NamedTuple):
    """What N sessions of E episodes begin with, and what came of them, as in `batch.Batch`.

    seeds (N,), per_tau (E,): one over the temperature; counts (N,) of COUNTS; kept (N, size): the tables, or of none.
    """

    seeds: NDArray[np.uint64]
    per_tau: FloatArray
    steps: NDArray[np.int32]
    guided: NDArray[np.bool_]
    counts: NDArray[np.void]
    kept: FloatArray


class Lanes(NamedTuple):
    """The sessions under way, (LANES,) each, but values (A * LANES,), tables (LANES, size), others (LANES, K, size).

    Made by the caller and not in the kernel, where numba would compile all of np.zeros along.
    """

    lane: NDArray[np.void]
    values: FloatArray
    widths: FloatArray
    per_tau: FloatArray
    chosen: NDArray[np.int64]
    moves: NDArray[np.int64]
    states: NDArray[np.uint64]
    rng: NDArray[np.uint64]
    fresh: NDArray[np.bool_]
    is_open: NDArray[np.bool_]
    tables: FloatArray
    others: FloatArray


class Work(NamedTuple):
    """All but the memories: where there are none, numba leaves out what needs them, if they are handed on by themselves.

    The memories are an `advice_memory.Memory` with arrays (LANES, ...); `now` (LANES,) is of NOW. thresholds, region: as in
    the advisor's `Advice`.
    """

    problem: ProblemArrays
    learning: Learning
    asking: Asking
    thresholds: FloatArray
    region: NDArray[np.bool_]
    sessions: Sessions
    lanes: Lanes


class Hearing(NamedTuple):
    """What gates that weigh what they are told keep, and advisors that are late or hold back; see `heard`, `Advice`.

    heard: a `Heard` with arrays (LANES, ...), `now` (LANES,) is of HEARD_NOW; values (LANES, A): of the state under way;
    u (LANES,): the uniform number of the step; before (LANES,): the state of the question before, -1: none; chose
    (LANES, S): what the learner would have chosen when it last asked there, -1: it did not.
    """

    heard: Heard
    values: FloatArray
    u: FloatArray
    before: NDArray[np.int64]
    chose: NDArray[np.int32]
    late: bool
    speaks: int
    several: float


class Chances(NamedTuple):
    """The outcomes of the moves of a problem that is left to chance; (S * A, K) each: cumulated chance, state entered, reward."""

    below: FloatArray
    entered: NDArray[np.int32]
    reward: FloatArray


class Walks(NamedTuple):
    """What gates that judge know where episodes begin in different states, as `gates.Ccrl` does.

    fewest (LANES, S): the known steps to the goal, inf where none are; walk (LANES, moves): the states that the episode left;
    begun (LANES, E): where each episode began.
    """

    fewest: FloatArray
    walk: NDArray[np.int32]
    begun: NDArray[np.int32]
