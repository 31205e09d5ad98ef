"""Whole sessions compiled with numba, many at once: what studies run.

Many sessions walk side by side: one alone waits for its memory and its exponentials, 24 keep the processor busy.
Each has uniform numbers of its own (`splitmix`), so its result depends on its seed and on nothing else, and
equals that of `session.run_session` with the same numbers. Rules come from `selection`, `updates`, `advice.gates` and
`advice.memory`.
"""

from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from lab.learning import advice_memory as memory
from lab.learning import gates, selection, splitmix, updates
from lab.learning.compiled import compiled
from lab.mdp import FloatArray

LANES = 24
LEARNERS = ("afterstate", "q")  # those that are compiled: what chapter 9 needs
GATES = ("never", "always", "ccrl", "combined", "ia", "cq", "random", "importance", "uncertainty")
_NEVER, _ALWAYS, _CCRL, _COMBINED, _IA, _CQ, _RANDOM, _IMPORTANCE, _UNCERTAINTY = range(len(GATES))
JUDGING = ("ccrl", "combined")

_OWN, _REMEMBERED, _ASKED, _PRACTISED = memory.OWN, memory.REMEMBERED, memory.ASKED, memory.PRACTISED
_NOTHING = memory.NOTHING
_Memory: Any = memory.Memory
_BELOW_ONE = selection.BELOW_ONE
_exp_of: Any = njit(selection.exp_of)
_following: Any = njit(inline="always")(splitmix.following)
_mixed: Any = njit(inline="always")(splitmix.mixed)
_fraction: Any = njit(inline="always")(splitmix.fraction)
_window_mean: Any = njit(gates.window_mean)
_too_slow: Any = njit(gates.too_slow)
_misled: Any = njit(gates.misled)
_unsure: Any = njit(gates.unsure)
_clear: Any = njit(memory.clear)
_remembers: Any = njit(memory.opens)
_starts: Any = njit(memory.starts)
_moved: Any = njit(memory.moved)
_ended: Any = njit(memory.ended)
_towards: Any = njit(updates.towards)
_afterstate_value: Any = njit(updates.afterstate_value)


class Problem(NamedTuple):
    """The problem as arrays; `ends`: 0 goes on, 1 goal, 2 another terminal state."""

    successor: NDArray[np.int32]
    reward: FloatArray
    arrival: FloatArray
    ends: NDArray[np.uint8]
    starts: NDArray[np.int64]
    step_reward: float


class Rules(NamedTuple):
    """Learner and gate as plain numbers."""

    afterstate: bool
    alpha: float
    discount: float
    max_moves: int
    max_steps: int
    count_start: int
    gate: int
    threshold: float
    omega: int
    first_episode: int
    window: int
    psi: float
    spread: float
    rate: float
    enough: float
    ensemble: int
    budget: int
    judge_unhelped: bool


# What each of the sessions under way remembers; session -1: none. `converged` as in `gates.Ccrl`.
LANE = np.dtype(
    [(name, np.int64) for name in ("session", "episode", "is_open", "asked", "helped", "left")]
    + [(name, np.int64) for name in ("last_result", "equal_results", "converged")]
)
COUNTS = np.dtype(
    [(name, np.int64) for name in ("requests", "helped_steps", "misleads", "rejected_at_episode", "moves")]
)


NOW = np.dtype([(field.name, np.int64) for field in fields(memory.Now)])


class Memories(NamedTuple):
    """A `memory.Memory` for each lane: the arrays are (LANES, ...), `now` (LANES,) is of NOW."""

    said: NDArray[np.int32]
    way: NDArray[np.int32]
    on_walk: NDArray[np.int32]
    place: NDArray[np.int32]
    walk: NDArray[np.int32]
    did: NDArray[np.int32]
    own: NDArray[np.int32]
    now: NDArray[np.void]


class Scratch(NamedTuple):
    """What the sessions under way use in every step, (LANES,) each but values (A * LANES,).

    Made here and not in the kernel, where numba would compile all of np.zeros along.
    """

    lanes: NDArray[np.void]
    values: FloatArray
    widths: FloatArray
    per_tau: FloatArray
    chosen: NDArray[np.int64]
    moves: NDArray[np.int64]
    states: NDArray[np.uint64]
    rng: NDArray[np.uint64]
    fresh: NDArray[np.bool_]
    is_open: NDArray[np.bool_]


@njit(inline="always")
def _draw(rng: Any, lane: int) -> float:
    """`splitmix.stream` for one lane."""
    rng[lane] = _following(rng[lane])
    return float(_fraction(_mixed(rng[lane])))


@njit
def _gauge(problem: Any, rules: Any, table: Any, state: int, action: int) -> float:
    """`Update.gauge` of one action in a flat table."""
    actions = problem.successor.shape[1]
    if rules.afterstate:
        return float(table[problem.successor[state, action]])
    return float(table[state * actions + action])


@njit
def _learn(problem: Any, rules: Any, table: Any, state: int, action: int) -> None:
    """`Update.learn` of one step in a flat table."""
    actions = problem.successor.shape[1]
    entered = problem.successor[state, action]
    over = problem.ends[entered] != 0
    if rules.afterstate:
        target = _afterstate_value(problem.step_reward, rules.discount, table[entered])
        table[state] = _towards(table[state], target, rules.alpha)
        if over:
            table[entered] = problem.arrival[entered]
        return
    best = table[entered * actions]
    for a in range(1, actions):
        best = max(best, table[entered * actions + a])
    at = state * actions + action
    target = problem.reward[state, action] + (0.0 if over else rules.discount) * best
    table[at] = _towards(table[at], target, rules.alpha)


@njit
def _deviation(problem: Any, rules: Any, tables: Any, state: int) -> float:
    """gates.deviation of the ensemble's values in a state."""
    actions, count = problem.successor.shape[1], len(tables)
    total = 0.0
    for a in range(actions):
        summed = 0.0
        for k in range(count):
            summed += _gauge(problem, rules, tables[k], state, a)
        mean, squares = summed / count, 0.0
        for k in range(count):
            off = _gauge(problem, rules, tables[k], state, a) - mean
            squares += off * off
        total += squares / count
    return float((total / actions) ** 0.5)


@njit
def _opens(rules: Any, lane: Any, steps: Any, rejected: bool) -> bool:
    """`Gate.opens`: whether the episode that begins in a lane may ask; steps (E,) are those of its session."""
    gate, episode = rules.gate, lane.episode
    if gate in (_IA, _RANDOM, _IMPORTANCE, _UNCERTAINTY):
        return bool(episode >= rules.first_episode)
    if gate == _CQ:
        enough = episode >= rules.first_episode and episode > rules.window
        return bool(enough and _window_mean(steps, episode - 1, rules.window) > rules.enough)
    if gate not in (_CCRL, _COMBINED):
        return bool(gate == _ALWAYS)
    if rejected or episode < rules.first_episode or episode <= 2 * rules.window:
        return False
    result = steps[episode - 2]
    if result == lane.last_result and result < rules.max_steps:
        lane.equal_results += 1
        if lane.equal_results > 2 * rules.window:
            lane.converged = 1
    else:
        lane.last_result, lane.equal_results = result, 0
    current = _window_mean(steps, episode - 1, rules.window)
    previous = _window_mean(steps, episode - 1 - rules.window, rules.window)
    slow = _too_slow(current, previous, rules.threshold)
    return bool(slow and lane.converged == 0 and episode < len(steps))


@njit
def _judge(rules: Any, lane: Any, steps: Any, count: Any) -> None:
    """`Ccrl.judges`: whether the episode that is over was misled; steps (E,) are those of its session."""
    episode, window = lane.episode, rules.window
    if count.rejected_at_episode > 0 or episode <= window or not (rules.judge_unhelped or lane.helped > 0):
        return
    if _misled(steps[episode - 1], _window_mean(steps, episode - 1, window)):
        count.misleads += 1
        if count.misleads > rules.omega:
            count.rejected_at_episode = episode


@njit
def _begin_session(lane: Any, j: int, n: int, seed: Any, tables: Any, others: Any, rng: Any) -> None:
    """Clears a lane for session n."""
    lane.session, lane.episode, rng[j] = n, 0, seed
    lane.last_result, lane.equal_results, lane.converged = 0, 0, 0
    for i in range(tables.shape[1]):
        tables[j, i] = 0.0
    for k in range(others.shape[1]):
        for i in range(others.shape[2]):
            others[j, k, i] = _draw(rng, j) - 0.5


@njit(inline="always")
def _of_lane(m: Any, j: int) -> Any:
    """The memory of one lane."""
    return _Memory(m.said[j], m.way[j], m.on_walk[j], m.place[j], m.walk[j], m.did[j], m.own[j], m.now[j])


@njit
def _choose(
    values: Any, reward: float, discount: float, per_tau: Any, rng: Any, actions: Any, chosen: Any, widths: Any
) -> None:
    """`selection.choose_softmax` in every lane at once; values (A * LANES,) are used up, the rest is (LANES,).

    The values become rewards + discount * value; `widths` is how far those before that span. `actions` is a tuple of A
    numbers: its length is known to the compiler, which keeps all of one action's lanes in registers.
    """
    for j in range(LANES):
        top = low = values[j]
        for a in range(1, len(actions)):
            top, low = max(top, values[a * LANES + j]), min(low, values[a * LANES + j])
        widths[j] = top - low
        top = reward + discount * top
        total = 0.0
        for a in range(len(actions)):
            x = (reward + discount * values[a * LANES + j] - top) * per_tau[j]
            total += _exp_of(x)
            values[a * LANES + j] = total
    for j in range(LANES):
        rng[j] = _following(rng[j])
        mark = _fraction(_mixed(rng[j])) * values[(len(actions) - 1) * LANES + j] * _BELOW_ONE
        action = np.int64(0)
        for a in range(len(actions) - 1):
            action += np.int64(values[a * LANES + j] <= mark)
        chosen[j] = action


@compiled
def run(
    problem: Any,
    rules: Any,
    advice: Any,
    region: Any,
    seeds: Any,
    temperatures: Any,
    actions: Any,
    scratch: Any,
    memories: Any,
    all_tables: Any,
    others: Any,
    steps: Any,
    guided: Any,
    counts: Any,
    kept: Any,
) -> None:
    """All sessions: each lane takes the next one when its own is over; all_tables (LANES, size), others: their tables.

    memories None: nothing is remembered, and numba leaves all that is about it out.

    What is done in every step is written out here over plain arrays: a call that hands on a record of arrays counts
    references, which costs more than the step itself.
    """
    A, episodes, sessions = len(actions), steps.shape[1], len(seeds)
    successor, ends, reward, arrival = problem.successor.ravel(), problem.ends, problem.reward.ravel(), problem.arrival
    afterstate, alpha, discount, step_reward = rules.afterstate, rules.alpha, rules.discount, problem.step_reward
    offset, factor = (step_reward, discount) if afterstate else (0.0, 1.0)
    gate, psi, max_moves, starts = rules.gate, rules.psi, rules.max_moves, problem.starts
    max_steps, count_start = rules.max_steps, rules.count_start
    tables, size, ensemble = all_tables.ravel(), np.uint64(all_tables.shape[1]), others.shape[1]
    lanes, rng, per_tau, fresh = scratch.lanes, scratch.rng, scratch.per_tau, scratch.fresh
    values, widths, chosen = scratch.values, scratch.widths, scratch.chosen
    states, moves, is_open = scratch.states, scratch.moves, scratch.is_open
    following = over_all = 0
    some_fresh = True
    while over_all < sessions:
        if some_fresh:
            some_fresh = False
            for j in range(LANES):
                if fresh[j]:
                    fresh[j], moves[j], states[j] = False, 0, starts[0]
                    if lanes[j].episode == episodes:
                        lanes[j].session = -1  # a lane without a session walks on, and nobody looks
                        if following < sessions:
                            _begin_session(lanes[j], j, following, seeds[following], all_tables, others, rng)
                            if memories is not None:
                                _clear(_of_lane(memories, j))
                            following += 1
                    if lanes[j].session >= 0:
                        lane = lanes[j]
                        n, lane.episode, lane.asked, lane.helped = lane.session, lane.episode + 1, 0, 0
                        if gate != _NEVER:
                            lane.left = rules.budget - counts[n].helped_steps
                            lane.is_open = _opens(rules, lane, steps[n], counts[n].rejected_at_episode > 0)
                        if memories is not None:
                            mine, may = _of_lane(memories, j), lane.is_open == 1
                            lane.is_open = _remembers(mine, lane.episode, episodes, rules.window, may)
                        per_tau[j], is_open[j] = temperatures[lanes[j].episode - 1], lanes[j].is_open
                        if len(starts) > 1:
                            states[j] = starts[int(_draw(rng, j) * len(starts))]
                        if memories is not None:
                            _starts(_of_lane(memories, j), np.int64(states[j]))
        for j in range(LANES):
            base, at = np.uint64(j) * size, states[j] * np.uint64(A)
            for a in range(A):
                i = at + np.uint64(a)
                values[a * LANES + j] = tables[base + (np.uint64(successor[i]) if afterstate else i)]
        _choose(values, offset, factor, per_tau, rng, actions, chosen, widths)
        for j in range(LANES):
            state, action, base = states[j], np.uint64(chosen[j]), np.uint64(j) * size
            said = np.int64(_NOTHING)
            source = np.int64(_OWN)
            if memories is not None:
                if is_open[j]:
                    said = np.int64(memories.said[j, state])
                elif memories.now[j].practises == 1 and memories.way[j, state] != _NOTHING:
                    action, source = np.uint64(memories.way[j, state]), np.int64(_PRACTISED)
            if is_open[j] and (said != _NOTHING or lanes[j].helped < lanes[j].left):
                if gate in (_IA, _COMBINED):
                    asks = _unsure(widths[j], psi)
                elif gate == _IMPORTANCE:
                    asks = widths[j] >= psi
                elif gate == _RANDOM:
                    asks = _draw(rng, j) < rules.rate
                elif gate == _UNCERTAINTY:
                    asks = _deviation(problem, rules, others[j], np.int64(state)) >= rules.spread
                else:
                    asks = gate in (_ALWAYS, _CCRL, _CQ)
                if asks and said != _NOTHING:
                    action, source = np.uint64(said), np.int64(_REMEMBERED)
                elif asks:
                    lane = lanes[j]
                    lane.asked = 1
                    if region[state]:
                        lane.helped += 1
                        row = min(lane.episode, advice.shape[0]) - 1
                        mark, action = _draw(rng, j) * advice[row, state, A - 1], np.uint64(0)
                        for a in range(A - 1):
                            action += np.uint64(advice[row, state, a] <= mark)
                        source = np.int64(_ASKED)
                        if memories is not None:
                            memories.said[j, state] = action
            step = state * np.uint64(A) + action
            entered = np.uint64(successor[step])
            over = ends[entered]
            if afterstate:
                target = _afterstate_value(step_reward, discount, tables[base + entered])
                tables[base + state] = _towards(tables[base + state], target, alpha)
                if over:
                    tables[base + entered] = arrival[entered]
            else:
                best = tables[base + entered * np.uint64(A)]
                for a in range(1, A):
                    best = max(best, tables[base + entered * np.uint64(A) + np.uint64(a)])
                target = reward[step] + (0.0 if over else discount) * best
                tables[base + step] = _towards(tables[base + step], target, alpha)
            for k in range(ensemble):
                if _draw(rng, j) < 0.5:
                    _learn(problem, rules, others[j, k], np.int64(state), np.int64(action))
            if memories is not None and lanes[j].session >= 0:
                mine = _of_lane(memories, j)
                _moved(mine, np.int64(state), np.int64(action), source, np.int64(entered), over != 0, over == 1)
                if mine.now.trust < 0:
                    is_open[j] = False
            states[j] = entered
            moves[j] += 1
            if over or moves[j] == max_moves:
                fresh[j] = some_fresh = True
                if lanes[j].session >= 0:
                    lane = lanes[j]
                    n, episode = lane.session, lane.episode
                    steps[n, episode - 1] = moves[j] + count_start if over == 1 else max_steps + 1
                    guided[n, episode - 1] = lane.helped > 0
                    counts[n].requests += lane.asked
                    counts[n].helped_steps += lane.helped
                    counts[n].moves += moves[j]
                    if lane.is_open and gate in (_CCRL, _COMBINED):
                        _judge(rules, lane, steps[n], counts[n])
                    if memories is not None:
                        went = moves[j] if over == 1 else max_moves + 1
                        _ended(_of_lane(memories, j), episodes, went, over == 1, lane.helped)
                    if lanes[j].episode == episodes:
                        over_all, is_open[j] = over_all + 1, False
                        if len(kept):
                            for i in range(all_tables.shape[1]):
                                kept[lanes[j].session, i] = all_tables[j, i]
