"""The records of the compiled sessions, arrays and plain numbers; then the learners of the kernel, which work on them."""

from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning import selection, splitmix
from lab.learning.advice_memory import Now
from lab.learning.compiled import inlined
from lab.learning.gates.gate import CompiledGate
from lab.learning.gates.heard import NOTHING, Heard, HeardNow
from lab.learning.updates import tabular, update
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
    """The learner's settings, see `LearnerSettings`; actions: A numbers, in a tuple if the compiler is to know their count."""

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


# The state of each running session; session -1: none. `converged` is that of `gates.Ccrl`.
LANE = np.dtype(
    [(name, np.int64) for name in ("session", "episode", "is_open", "asked", "helped", "left")]
    + [(name, np.int64) for name in ("last_result", "equal_results", "converged")]
)
COUNTS = np.dtype(
    [(name, np.int64) for name in ("requests", "helped_steps", "misleads", "rejected_at_episode", "moves")]
)
NOW = np.dtype([(field.name, np.int64) for field in fields(Now)])
HEARD_NOW = np.dtype([(field.name, np.float64) for field in fields(HeardNow)])


class KernelSessions(NamedTuple):
    """The inputs and results of N sessions of E episodes; the results are those of `batch.Batch`.

    seeds (N,); per_tau (E,): 1 / temperature; counts (N,) of COUNTS; kept (N, size): the tables, or (0, size) if not wanted.
    greedy (N, E // every), or (N, 0) if not wanted: after each `every`-th episode, the mean steps of `walks` episodes of the
    greedy policy; walk_rng (1,): the state of their generator.
    """

    seeds: NDArray[np.uint64]
    per_tau: FloatArray
    steps: NDArray[np.int32]
    guided: NDArray[np.bool_]
    counts: NDArray[np.void]
    kept: FloatArray
    greedy: FloatArray
    every: int
    walks: int
    walk_rng: NDArray[np.uint64]


class Lanes(NamedTuple):
    """The running sessions: (LANES,) each, but values (A * LANES,), tables (LANES, size), others (LANES, K, size).

    The caller allocates them, because numba would otherwise have to compile np.zeros.
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


# ---- the learners of the kernel -------------------------------------------------------------------------------------


_exp_of: Any = inlined(selection.exp_of)
_following: Any = inlined(splitmix.following)
_mixed: Any = inlined(splitmix.mixed)
_fraction: Any = inlined(splitmix.fraction)
_towards: Any = inlined(update.towards)
_afterstate_value: Any = inlined(tabular.afterstate_value)


@inlined
def draw(rng: Any, j: int) -> float:
    """`splitmix.stream` for lane j."""
    rng[j] = _following(rng[j])
    return float(_fraction(_mixed(rng[j])))


@inlined
def begin_walks(rng: Any, seed: Any, number: int) -> None:
    """`splitmix.stream(splitmix.apart(seed, number))`, whose state is rng[0]."""
    rng[0] = _mixed(seed + np.uint64(number))


@inlined
def gauge(work: Any, table: Any, state: int, action: int) -> float:
    """`Update.gauge` of one action in a flat table."""
    at = np.uint64(state) * np.uint64(len(work.learning.actions)) + np.uint64(action)
    return float(table[np.uint64(work.problem.successor[at]) if work.learning.afterstate else at])


@inlined
def learn(work: Any, table: Any, state: Any, at: Any, entered: Any, reward: float) -> None:
    """`Update.learn` of one step in a flat table; at: state * A + action."""
    problem, learning = work.problem, work.learning
    width = np.uint64(len(learning.actions))
    over = problem.ends[entered]
    if learning.afterstate:
        target = _afterstate_value(problem.step_reward, learning.discount, table[entered])
        table[state] = _towards(table[state], target, learning.alpha)
        if over:
            table[entered] = problem.arrival[entered]
    else:
        best = table[entered * width]
        for a in range(1, len(learning.actions)):
            best = max(best, table[entered * width + np.uint64(a)])
        target = reward + (0.0 if over else learning.discount) * best
        table[at] = _towards(table[at], target, learning.alpha)


@inlined
def prefer(around: Any, state: int, action: int, margin: float) -> None:
    """`Update.prefer` in a lane; around: (work, lane)."""
    work, table = around[0], around[0].lanes.tables[around[1]]
    A, kept = len(work.learning.actions), np.uint64(action)
    at = np.uint64(state) * np.uint64(A)
    if work.learning.afterstate:
        successor = work.problem.successor
        most = table[successor[at + kept]] - margin
        for a in range(A):
            entered = successor[at + np.uint64(a)]
            if entered != successor[at + kept]:
                table[entered] = min(table[entered], most)
    else:
        most = table[at + kept] - margin
        for a in range(A):
            if a != action:
                table[at + np.uint64(a)] = min(table[at + np.uint64(a)], most)


@inlined
def leads(told: Any, around: Any, number: Any) -> Any:
    """`earned_trust.leads` in a lane; around: (work, lane)."""
    led = told.led[number]
    if led == NOTHING and around[0].learning.afterstate:
        return np.int64(around[0].problem.successor[number])
    return np.int64(led)


@inlined
def replay(around: Any, state: int, action: int, reward: float, entered: int) -> None:
    """`Update.replay` in a lane; around: (work, lane)."""
    work, table = around[0], around[0].lanes.tables[around[1]]
    number = np.uint64(state) * np.uint64(len(work.learning.actions)) + np.uint64(action)
    learn(work, table, np.uint64(state), number, np.uint64(entered), reward)


@inlined
def best_action(around: Any, state: int) -> int:
    """The greedy action in a state of a lane; around: (work, lane)."""
    work, j = around
    best, most = 0, gauge(work, work.lanes.tables[j], state, 0)
    for a in range(1, len(work.learning.actions)):
        value = gauge(work, work.lanes.tables[j], state, a)
        if value > most:
            best, most = a, value
    return best


@inlined
def choose(work: Any) -> None:
    """`selection.choose_softmax` in every lane at once; writes `chosen`, and the span of the values to `widths`.

    The values (A * LANES,) are overwritten by cumulative weights. The compiler knows the number of actions, so the lanes of one
    action stay in registers.
    """
    lanes, afterstate = work.lanes, work.learning.afterstate
    values, widths, per_tau, chosen, rng = lanes.values, lanes.widths, lanes.per_tau, lanes.chosen, lanes.rng
    A = len(work.learning.actions)
    offset, factor = (work.problem.step_reward, work.learning.discount) if afterstate else (0.0, 1.0)
    for j in range(LANES):
        at = lanes.states[j] * np.uint64(A)
        for a in range(A):
            i = at + np.uint64(a)
            values[a * LANES + j] = lanes.tables[j, np.uint64(work.problem.successor[i]) if afterstate else i]
    for j in range(LANES):
        top = low = values[j]
        for a in range(1, A):
            top, low = max(top, values[a * LANES + j]), min(low, values[a * LANES + j])
        widths[j] = top - low
        top = offset + factor * top
        total = 0.0
        for a in range(A):
            total += _exp_of((offset + factor * values[a * LANES + j] - top) * per_tau[j])
            values[a * LANES + j] = total
    for j in range(LANES):
        rng[j] = _following(rng[j])
        mark = _fraction(_mixed(rng[j])) * values[(A - 1) * LANES + j] * selection.BELOW_ONE
        action = np.int64(0)
        for a in range(A - 1):
            action += np.int64(values[a * LANES + j] <= mark)
        chosen[j] = action
