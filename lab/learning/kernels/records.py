"""The records of the compiled sessions, arrays and plain numbers; then the learners of the kernel, which work on them."""

from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning import selection, splitmix
from lab.learning.advice_memory import Now
from lab.learning.compiled import inlined, inner
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
    reuse: float
    bonus: float
    consistency: float
    enough_steps: float
    budget: int
    judge_unhelped: bool
    spare_best: bool
    by_evidence: bool
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
    greedy policy; walk_rng (1,): the state of their generator. returns (N, E), or (0, E) if not wanted: sums of rewards.
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
def learn_following(
    work: Any, lookahead: Any, table: Any, j: int, number: Any, entered: Any, reward: float, following: Any, best: float
) -> None:
    """`Update.learn` of a learner with `lookahead`; number: state * A + action; best: the highest value of `entered`."""
    learning = work.learning
    over = work.problem.ends[entered] != 0
    value = table[entered * np.uint64(len(learning.actions)) + following]
    after = value if lookahead.on_policy else best
    step = learning.alpha * (reward + (0.0 if over else learning.discount) * after - table[number])
    if lookahead.decay == 0.0:
        table[number] += step
    else:
        follow = not over and (lookahead.on_policy or value == best)
        _spread(lookahead, table, j, number, step, follow)


@inlined
def learn_by_rule(work: Any, own: Any, q: Any, number: Any, entered: Any, reward: float, following: Any) -> None:
    """`RuleUpdate.learn` of one step in a table (S, A); number: state * A + action."""
    move, actions = np.int64(number), len(work.learning.actions)
    discount = 0.0 if work.problem.ends[entered] != 0 else work.learning.discount
    place = move // actions, move % actions
    own.rule(q, own.settings, *place, reward, discount, np.int64(entered), np.int64(following))


@inlined
def _spread(lookahead: Any, table: Any, j: int, number: Any, step: float, follow: bool) -> None:
    """`tabular.Traced._spread` in lane j; step: alpha times the error. Traces decay at the beginning of the next step."""
    listed, strength, decay = lookahead.listed[j], lookahead.strength[j], lookahead.decay
    first, last, one = lookahead.first[j], lookahead.last[j], np.uint64(1)
    i, own = first, 1.0
    faint: Any = 0
    while i < last:  # a loop with two exits, which LLVM does not unroll: that is slower for so few traces
        move = listed[i]
        if move == number:
            break
        eligibility = strength[i] * decay
        strength[i] = eligibility
        table[move] += step * eligibility
        faint += np.int64(eligibility <= tabular.TRACE_FLOOR)
        i += one
    at = i
    if i < last:
        own += strength[i] * decay if lookahead.growing else 0.0
        for k in range(i + one, last):
            eligibility = strength[k] * decay
            strength[k] = eligibility
            table[listed[k]] += step * eligibility
            faint += np.int64(eligibility <= tabular.TRACE_FLOOR)
    elif i == np.uint64(len(listed)):
        first, at = np.uint64(0), _kept_traces(listed, strength, first, last)
        last, faint = at, 0
    table[number] += step * own
    listed[at], strength[at] = number, own
    last = max(last, at + one)
    oldest = np.int64(strength[first] <= tabular.TRACE_FLOOR)  # usually no other is to be dropped
    first += np.uint64(oldest)
    if faint > oldest:
        first, last = np.uint64(0), _kept_traces(listed, strength, first, last)
    lookahead.first[j], lookahead.last[j] = (first, last) if follow else (np.uint64(0), np.uint64(0))


@inner
def _kept_traces(listed: Any, strength: Any, first: Any, last: Any) -> Any:
    """Moves the traces that are not to be dropped to the beginning; returns how many there are."""
    kept = np.uint64(0)
    for i in range(first, last):
        if strength[i] > tabular.TRACE_FLOOR:
            listed[kept], strength[kept] = listed[i], strength[i]
            kept += np.uint64(1)
    return kept


@inlined
def replay(work: Any, model: Any, j: int, number: Any, entered: Any, reward: float) -> None:
    """Records a step in lane j's model, then learns from known moves (`tabular.DynaQ.learn`)."""
    if model.entered[j, number] < 0:
        model.moves[j, model.known[j]] = number
        model.known[j] += 1
    model.entered[j, number], model.reward[j, number] = entered, reward
    known, turn, width = model.known[j], model.turn[j], np.uint64(len(work.learning.actions))
    for _ in range(min(model.planning, known)):
        turn = (known if turn == 0 else turn) - 1
        move = np.uint64(model.moves[j, turn])
        then = np.uint64(model.entered[j, move])
        learn(work, work.lanes.tables[j], move // width, move, then, model.reward[j, move])
    model.turn[j] = turn


@inlined
def greedy(values: Any, first: int, stride: int, actions: int, best: float, epsilon: float, u: float) -> int:
    """`selection.choose_epsilon_greedy` of the values at first, first + stride ...; best: the highest of them.

    Everything is computed, whether it explores or not, because a branch that cannot be predicted costs more.
    """
    explored = np.int64(min(u / max(epsilon, selection.COLDEST) * actions, actions - 1.0))
    left = (u - epsilon) / (1.0 - min(epsilon, selection.BELOW_ONE))
    ties: Any = 0
    for a in range(actions):
        ties += np.int64(values[first + a * stride] == best)
    chosen: Any = 0
    seen: Any = 0
    tie: Any = min(np.int64(left * ties), ties - 1)
    for a in range(actions):
        seen += np.int64(values[first + a * stride] == best)
        chosen += np.int64(seen <= tie)
    return int(explored if u < epsilon else chosen)


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
def replay_step(around: Any, state: int, action: int, reward: float, entered: int) -> None:
    """`Update.replay` in a lane; around: (work, lane)."""
    work, table = around[0], around[0].lanes.tables[around[1]]
    if not work.learning.replays:
        return
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
    """The learner's own choice in every lane; writes `chosen`, and the highest value and the span of the values."""
    if work.learning.selection == selection.SOFTMAX:
        _choose_softmax(work)
    else:
        _choose_greedy(work)


@inlined
def _choose_greedy(work: Any) -> None:
    """`selection.choose_greedy` or `choose_epsilon_greedy` in every lane."""
    lanes, learning = work.lanes, work.learning
    values, actions = lanes.values, len(learning.actions)
    offset, factor = (work.problem.step_reward, learning.discount) if learning.afterstate else (0.0, 1.0)
    for j in range(LANES):
        top, low = -np.inf, np.inf
        for a in range(actions):
            value = gauge(work, lanes.tables[j], lanes.states[j], a)
            top, low = max(top, value), min(low, value)
            values[a * LANES + j] = offset + factor * value
        lanes.best[j], lanes.widths[j] = top, top - low
        epsilon = 0.0 if learning.selection == selection.GREEDY else lanes.warm[j]
        lanes.chosen[j] = greedy(values, j, LANES, actions, offset + factor * top, epsilon, draw(lanes.rng, j))


@inlined
def _choose_softmax(work: Any) -> None:
    """`selection.choose_softmax` in every lane at once.

    The values (A * LANES,) are overwritten by cumulative weights. The compiler knows the number of actions, so the lanes of one
    action stay in registers.
    """
    lanes, afterstate = work.lanes, work.learning.afterstate
    values, widths, per_tau, chosen, rng = lanes.values, lanes.widths, lanes.per_tau, lanes.chosen, lanes.rng
    best = lanes.best
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
        best[j], widths[j] = top, top - low
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
