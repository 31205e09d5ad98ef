"""The records of the compiled sessions: arrays and plain numbers."""

from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.advice_memory import Now
from lab.learning.gates.gate import CompiledGate
from lab.learning.gates.heard import Heard, HeardNow
from lab.mdp import FloatArray

LANES = 24  # sessions that the kernel runs side by side


class ProblemArrays(NamedTuple):
    """The problem; successor, reward: (S * A,); ends (S,): 0 not terminal, 1 goal, 2 another terminal state."""

    successor: NDArray[np.int32]
    reward: FloatArray
    arrival: FloatArray
    ends: NDArray[np.uint8]
    starts: NDArray[np.int64]
    step_reward: float


class CompiledLearner(NamedTuple):
    """The learner's settings, see `LearnerSettings`; selection: SOFTMAX, EPSILON_GREEDY or GREEDY.

    replays: whether it learns again from a single known step, see `Update.replay`;
    actions: A numbers, in a tuple if the compiler is to know their count.
    """

    afterstate: bool
    alpha: float
    discount: float
    max_moves: int
    max_steps: int
    count_start: bool
    selection: int
    replays: bool
    actions: tuple[int, ...] | FloatArray


class GateNumbers(NamedTuple):
    """The numbers of `GateSettings`."""

    lambda_threshold: float
    omega: int
    first_episode: int
    window: int
    psi: float
    spread: float
    rate: float
    fading: float
    reuse: float
    bonus: float
    consistency: float
    warming: float
    exploring: float
    trust: float
    wandering: float
    retry: float
    strikes: float
    agreement: float
    margin: float
    enough_steps: float
    ensemble: int
    budget: int
    judge_unhelped: bool
    spare_best: bool
    by_evidence: bool
    memory: bool


class Asking(NamedTuple):
    """The gate's rules and settings; max_steps: of the learner.

    judges_unhelped: whether an episode that was open for advice and got none is judged, too.
    """

    gate: CompiledGate
    settings: GateNumbers
    judges_unhelped: bool
    max_steps: int


# The state of each running session; session -1: none. `converged` and `evidence` are those of `gates.Ccrl`.
LANE = np.dtype(
    [(name, np.int64) for name in ("session", "episode", "is_open", "asked", "helped", "left")]
    + [(name, np.int64) for name in ("last_result", "equal_results", "converged")]
    + [("evidence", np.float64)]
)
COUNTS = np.dtype(
    [(name, np.int64) for name in ("requests", "helped_steps", "misleads", "rejected_at_episode", "moves")]
)
NOW = np.dtype([(field.name, np.int64) for field in fields(Now)])
HEARD_NOW = np.dtype([(field.name, np.float64) for field in fields(HeardNow)])


class KernelSessions(NamedTuple):
    """The inputs and results of N sessions of E episodes; the results are those of `batch.Batch`.

    seeds (N,); warm (E,): temperature or epsilon by episode; counts (N,) of COUNTS; kept (N, size): the tables, or (0, size) if
    not wanted.
    greedy (N, E // every), or (N, 0) if not wanted: after each `every`-th episode, the mean steps of `walks` episodes of the
    greedy policy; walk_rng (1,): the state of their generator; walk_moves (S,): the policy's move, state * A + action, in each
    state, -1 where it has not been looked up. returns (N, E), or (0, E) if not wanted: sums of rewards.
    """

    seeds: NDArray[np.uint64]
    warm: FloatArray
    steps: NDArray[np.int32]
    guided: NDArray[np.bool_]
    counts: NDArray[np.void]
    kept: FloatArray
    greedy: FloatArray
    every: int
    walks: int
    walk_rng: NDArray[np.uint64]
    walk_moves: NDArray[np.int64]
    returns: FloatArray


class Lanes(NamedTuple):
    """The running sessions: (LANES,) each, but values (A * LANES,), tables (LANES, size), others (LANES, K, size).
    warm, per_tau: temperature or epsilon, and 1 / temperature; best, widths: the highest value of the state, and the span of
    its values.

    The caller allocates them, because numba would otherwise have to compile np.zeros.
    """

    lane: NDArray[np.void]
    values: FloatArray
    best: FloatArray
    widths: FloatArray
    warm: FloatArray
    per_tau: FloatArray
    chosen: NDArray[np.int64]
    moves: NDArray[np.int64]
    states: NDArray[np.uint64]
    rng: NDArray[np.uint64]
    fresh: NDArray[np.bool_]
    is_open: NDArray[np.bool_]
    returned: FloatArray
    tables: FloatArray
    others: FloatArray


class Work(NamedTuple):
    """All records except the optional ones, which are arguments of their own: if one is None, numba leaves out its code.

    thresholds, region: those of the advisor's `Advice`. The optional memories are an `advice_memory.Memory` of arrays (LANES,
    ...), with `now` (LANES,) of NOW.
    """

    problem: ProblemArrays
    learning: CompiledLearner
    asking: Asking
    thresholds: FloatArray
    region: NDArray[np.bool_]
    sessions: KernelSessions
    lanes: Lanes


class Hearing(NamedTuple):
    """The data of gates that weigh advice and of advisors that are late or hold back; see `heard`, `Advice`.

    heard: a `Heard` of arrays (LANES, ...), with `now` (LANES,) of HEARD_NOW; values (LANES, A): of the current state;
    u (LANES,): the uniform number of the step; before (LANES,): the state of the previous question, -1 for none;
    chose (LANES, S): the learner's own choice when it last asked in a state, -1 if it never did.
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
    """The outcomes of stochastic moves, (S * A, K) each: cumulative probability, state entered, reward."""

    below: FloatArray
    entered: NDArray[np.int32]
    reward: FloatArray


class Walks(NamedTuple):
    """The data of gates that judge episodes which begin in different states, see `gates.Ccrl`.

    fewest (LANES, S): the fewest known steps to the goal, inf if unknown; walk (LANES, moves): the states of the episode;
    begun (LANES, E): the first state of each episode.
    """

    fewest: FloatArray
    walk: NDArray[np.int32]
    begun: NDArray[np.int32]


class Lookahead(NamedTuple):
    """The data of learners that need the next action (`Update.lookahead`), with or without traces.

    number, reward (LANES,): the last move, state * A + action, and its reward; it is learned from when the next action is chosen.
    listed, strength (LANES, M): the moves with a trace, and their eligibilities, from index `first` up to `last` (LANES,).
    decay: gamma lambda, 0 without traces; on_policy: SARSA's target, otherwise Q-learning's.
    """

    number: NDArray[np.uint64]
    reward: FloatArray
    listed: NDArray[np.uint32]
    strength: FloatArray
    first: NDArray[np.uint64]
    last: NDArray[np.uint64]
    decay: float
    growing: bool
    on_policy: bool


class Model(NamedTuple):
    """The learned model of Dyna-Q, see `updates.tabular.DynaQ`.

    entered, reward (LANES, S * A): the last outcome of each move, -1 if it was never made; moves (LANES, S * A): the known moves
    in the order in which they were first made; known, turn (LANES,): their number, and the index of the last one replayed.
    """

    entered: NDArray[np.int32]
    reward: FloatArray
    moves: NDArray[np.int32]
    known: NDArray[np.int64]
    turn: NDArray[np.int64]
    planning: int


class OwnRule(NamedTuple):
    """The rule of a `RuleUpdate`, compiled, with the settings that it reads.

    q (LANES, S, A), others (LANES, K, S, A): the tables of `Lanes` in that shape; wrong (1,): the number of values that were not
    finite when their session ended.
    """

    rule: Any
    settings: "NumberSettings"
    q: FloatArray
    others: FloatArray
    wrong: NDArray[np.int64]


class OwnGate(NamedTuple):
    """The rules of a `RuleGate`, compiled, with what they read.

    steps (N, E): those of `KernelSessions`; values (LANES, A): of the current states; shown: the same memory, which the rules
    cannot write to, as they cannot to `steps`.
    """

    opens: Any
    asks: Any
    steps: NDArray[np.int32]
    values: FloatArray
    shown: FloatArray


class NumberSettings(NamedTuple):
    """The numbers of `LearnerSettings`."""

    alpha: float
    discount: float
    trace: float
    replacing: bool
    start_value: float
    planning: int
    exploration: float
    beta: float
    episodes: int
    max_steps: int
