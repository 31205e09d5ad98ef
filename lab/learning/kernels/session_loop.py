"""The loop of the compiled sessions, many side by side.

A single session would wait for memory and exponentials; 24 keep the processor busy. Each has its own stream of uniform numbers
(`splitmix`), so its result depends on its seed alone, and equals that of `session.Session` with the same numbers.
"""

from functools import partial
from typing import Any

import numpy as np

from lab.learning import advice_memory as memory
from lab.learning import selection
from lab.learning.compiled import inlined, inner, without_refcounts
from lab.learning.gates.heard import NOTHING
from lab.learning.kernels import hearing as hears
from lab.learning.kernels.asking import decided, judge, judge_moved, knows, opens
from lab.learning.kernels.learners import (
    begin_walks,
    choose,
    draw,
    fill,
    learn,
    learn_by_rule,
    learn_following,
    outcome,
    replay,
)
from lab.learning.kernels.records import LANES

_Memory: Any = memory.Memory
_Move: Any = memory.RememberedMove
_clear: Any = inner(memory.clear)
_remembers: Any = inner(memory.opens)
_starts: Any = inlined(memory.starts)
_plan: Any = inner(memory.plan)
_moved: Any = inlined(memory.moved)
_ended: Any = inner(memory.ended)


# Inlined as source, because a compiled function may not return arrays that are not its arguments.
@partial(without_refcounts, inline="always")
def _of_lane(m: Any, j: int) -> Any:
    """The memory of one lane."""
    known = m.led[j], m.path[j], m.came[j], m.queue[j]
    return _Memory(*known, m.on_walk[j], m.place[j], m.walk[j], m.advised[j], m.now[j])


@inlined
def _begin_session(work: Any, hearing: Any, walks: Any, model: Any, j: int, n: int) -> None:
    """Clears lane j for session n."""
    lanes = work.lanes
    lane = lanes.lane[j]
    lane.session, lane.episode, lanes.rng[j] = n, 0, work.sessions.seeds[n]
    lane.last_result, lane.equal_results, lane.converged = 0, 0, 0
    lane.evidence = 0.0
    for i in range(lanes.tables.shape[1]):
        lanes.tables[j, i] = 0.0
    for k in range(lanes.others.shape[1]):
        for i in range(lanes.others.shape[2]):
            lanes.others[j, k, i] = draw(lanes.rng, j) - 0.5
    if hearing is not None:
        hears.hears_nothing_yet(work, hearing, j)
    if walks is not None:
        for state in range(walks.fewest.shape[1]):
            walks.fewest[j, state] = np.inf
    if model is not None:
        model.known[j], model.turn[j] = 0, 0
        for i in range(model.entered.shape[1]):
            model.entered[j, i] = -1


@inlined
def _begin_episode(work: Any, memories: Any, hearing: Any, walks: Any, own_gate: Any, j: int) -> None:
    """Begins the next episode of lane j: decides whether it may ask, sets its temperature and its start."""
    lanes, sessions, asking, starts = work.lanes, work.sessions, work.asking, work.problem.starts
    lane = lanes.lane[j]
    count, steps = sessions.counts[lane.session], sessions.steps[lane.session]
    lane.episode, lane.asked, lane.helped = lane.episode + 1, 0, 0
    lane.left = asking.settings.budget - count.helped_steps
    lane.is_open = opens(work, own_gate, j)
    lanes.warm[j] = sessions.warm[lane.episode - 1]
    if memories is not None:
        mine, may = _of_lane(memories, j), lane.is_open == 1
        lane.is_open = _remembers(mine, lane.episode, len(steps), asking.settings.window, may)
        if mine.now.late == 1:
            lanes.warm[j] = selection.COLDEST
    lanes.per_tau[j] = 1.0 / lanes.warm[j]
    lanes.is_open[j] = lane.is_open
    if len(starts) > 1:
        lanes.states[j] = starts[int(draw(lanes.rng, j) * len(starts))]
    if walks is not None:
        walks.begun[j, lane.episode - 1] = lanes.states[j]
    if hearing is not None:
        hears.begins(work, hearing, j)
    if memories is not None:
        mine, state = _of_lane(memories, j), np.int64(lanes.states[j])
        if _starts(mine, state):
            _plan(mine, state)


@inlined
def _begin(
    work: Any,
    memories: Any,
    hearing: Any,
    walks: Any,
    lookahead: Any,
    model: Any,
    own_gate: Any,
    count: int,
    started: int,
) -> int:
    """Begins the next episode, or session, in each lane whose last one has ended; returns how many sessions have begun."""
    lanes, seeds = work.lanes, work.sessions.seeds
    for j in range(count):
        if lanes.fresh[j]:
            lane = lanes.lane[j]
            lanes.fresh[j], lanes.moves[j], lanes.states[j] = False, 0, work.problem.starts[0]
            lanes.returned[j] = 0.0
            if lookahead is not None:
                lookahead.first[j] = lookahead.last[j] = 0
            if lane.episode == len(work.sessions.warm):
                lane.session = -1  # an idle lane makes no steps
                if started < len(seeds):
                    _begin_session(work, hearing, walks, model, j, started)
                    if memories is not None:
                        _clear(_of_lane(memories, j))
                    started += 1
            if lane.session >= 0:
                _begin_episode(work, memories, hearing, walks, own_gate, j)
    return started


@inlined
def _learn(work: Any, hearing: Any, lookahead: Any, own: Any, j: int, following: Any, best: float) -> None:
    """Learns from lane j's last move, now that the next action is chosen; best: the highest value of the state entered."""
    lanes, number, reward = work.lanes, lookahead.number[j], lookahead.reward[j]
    entered = lanes.states[j]
    if own is None:
        learn_following(work, lookahead, lanes.tables[j], j, number, entered, reward, following, best)
    else:
        learn_by_rule(work, own, own.q[j], number, entered, reward, following)
    for k in range(lanes.others.shape[1]):
        if draw(lanes.rng, j) < 0.5:
            table = lanes.others[j, k]
            if own is None:
                learn_following(work, lookahead, table, j, number, entered, reward, following, best)
            else:
                learn_by_rule(work, own, own.others[j, k], number, entered, reward, following)
    if hearing is not None:
        over = work.problem.ends[entered] != 0
        hears.saw(work, hearing, j, number // np.uint64(len(work.learning.actions)), number, entered, reward, over)


@inlined
def _learn_at_once(work: Any, own: Any, j: int, state: Any, number: Any, entered: Any, reward: float) -> None:
    """Learns from lane j's move without knowing the next action."""
    lanes = work.lanes
    if own is None:
        learn(work, lanes.tables[j], state, number, entered, reward)
    else:
        learn_by_rule(work, own, own.q[j], number, entered, reward, 0)
    for k in range(lanes.others.shape[1]):
        if draw(lanes.rng, j) < 0.5:
            if own is None:
                learn(work, lanes.others[j, k], state, number, entered, reward)
            else:
                learn_by_rule(work, own, own.others[j, k], number, entered, reward, 0)


@inlined
def _step(
    work: Any,
    memories: Any,
    hearing: Any,
    chances: Any,
    walks: Any,
    lookahead: Any,
    model: Any,
    own: Any,
    own_gate: Any,
    j: int,
) -> bool:
    """Makes one step of lane j and learns from it; returns whether its episode has ended.

    With `lookahead` it first learns from the step before, because the next action is known now; the last step of a truncated
    episode is learned from in a call of its own, which makes no step.
    """
    lanes, problem, learning = work.lanes, work.problem, work.learning
    state = lanes.states[j]
    truncated = lookahead is not None and lanes.moves[j] == learning.max_moves
    if truncated:
        action, source = np.uint64(lanes.chosen[j]), np.int64(memory.OWN)
    else:
        if own_gate is not None and lanes.is_open[j]:
            fill(work, own_gate.values, j, lanes.states[j])
        action, source = decided(work, memories, hearing, own_gate, j)
    if lookahead is not None and lanes.moves[j] > 0:
        _learn(work, hearing, lookahead, own, j, action, lanes.best[j])
    if truncated:
        return True
    number = state * np.uint64(len(learning.actions)) + action
    if chances is None:
        entered, reward = np.uint64(problem.successor[number]), problem.reward[number]
    else:
        k = outcome(chances, number, draw(lanes.rng, j))
        entered, reward = np.uint64(chances.entered[number, k]), chances.reward[number, k]
    ends = problem.ends[entered]
    if lookahead is None:
        _learn_at_once(work, own, j, state, number, entered, reward)
    if model is not None:
        replay(work, model, j, number, entered, reward)
    if memories is not None:
        mine = _of_lane(memories, j)
        _moved(mine, _Move(np.int64(number), source, np.int64(entered), ends != 0, ends == 1))
        if mine.now.trust < 0:
            lanes.is_open[j] = False
    if lookahead is None and hearing is not None:
        hears.saw(work, hearing, j, state, number, entered, reward, ends != 0)
    if walks is not None:
        walks.walk[j, lanes.moves[j]] = state
    lanes.states[j] = entered
    lanes.moves[j] += 1
    lanes.returned[j] += reward
    if lookahead is not None:
        lookahead.number[j], lookahead.reward[j] = number, reward
        if ends != 0:
            _learn(work, hearing, lookahead, own, j, np.uint64(0), 0.0)
        return bool(ends != 0)
    return bool(ends != 0 or lanes.moves[j] == learning.max_moves)


@inner
def _greedy_steps(work: Any, chances: Any, table: Any, seed: Any, number: int) -> float:
    """`batch.greedy_steps` of a flat table."""
    sessions, problem, learning = work.sessions, work.problem, work.learning
    width, starts, total = np.uint64(len(learning.actions)), problem.starts, 0.0
    offset, factor = (problem.step_reward, learning.discount) if learning.afterstate else (0.0, 1.0)
    begin_walks(sessions.walk_rng, seed, number)
    known = sessions.walk_moves
    for place in range(len(problem.ends)):
        known[place] = NOTHING
    for _ in range(sessions.walks):
        state, moves = np.uint64(starts[0]), 0
        if len(starts) > 1:
            state = np.uint64(starts[int(draw(sessions.walk_rng, 0) * len(starts))])
        while moves < learning.max_moves and problem.ends[state] == 0:
            if known[state] == NOTHING:
                best, known[state] = -np.inf, state * width
                for a in range(len(learning.actions)):
                    move = state * width + np.uint64(a)
                    value = offset + factor * table[np.uint64(problem.successor[move]) if learning.afterstate else move]
                    if value > best:
                        best, known[state] = value, move
            at = np.uint64(known[state])
            if chances is None:
                state = np.uint64(problem.successor[at])
            else:
                k = outcome(chances, at, draw(sessions.walk_rng, 0))
                state = np.uint64(chances.entered[at, k])
            moves += 1
        total += moves + learning.count_start if problem.ends[state] == 1 else learning.max_steps + 1
    return float(total / sessions.walks)


@inlined
def _end(work: Any, memories: Any, hearing: Any, chances: Any, walks: Any, own: Any, j: int) -> int:
    """Records the last episode of lane j; returns 1 if its session has ended, too."""
    lanes, sessions, learning = work.lanes, work.sessions, work.learning
    lane, moves, won = lanes.lane[j], lanes.moves[j], work.problem.ends[lanes.states[j]] == 1
    lanes.fresh[j] = True
    n, episode, count = lane.session, lane.episode, sessions.counts[lane.session]
    sessions.steps[n, episode - 1] = moves + learning.count_start if won else learning.max_steps + 1
    sessions.guided[n, episode - 1] = lane.helped > 0
    if len(sessions.returns):
        sessions.returns[n, episode - 1] = lanes.returned[j]
    count.requests += lane.asked
    count.helped_steps += lane.helped
    count.moves += moves
    if walks is not None:
        knows(lane, sessions.steps[n], moves, walks.fewest[j], walks.walk[j], learning.max_steps)
        if lane.is_open:
            told = sessions.steps[n], sessions.guided[n]
            judge_moved(work.asking, lane, told, count, moves, walks.fewest[j], walks.begun[j])
    elif lane.is_open and work.asking.gate.judges:
        judge(work.asking, lane, (sessions.steps[n], sessions.guided[n]), count, moves)
    if hearing is not None:
        hears.ended(work, hearing, j, sessions.steps[n, episode - 1], won, work.problem.ends[lanes.states[j]] != 0)
    if memories is not None:
        went = moves if won else learning.max_moves + 1
        _ended(_of_lane(memories, j), went, won, lane.helped)
    if sessions.greedy.shape[1] and episode % sessions.every == 0:
        number = episode // sessions.every
        sessions.greedy[n, number - 1] = _greedy_steps(work, chances, lanes.tables[j], sessions.seeds[n], number)
    if episode < len(sessions.warm):
        return 0
    lanes.is_open[j] = False
    if own is not None:
        for i in range(lanes.tables.shape[1]):
            own.wrong[0] += np.int64(not np.isfinite(lanes.tables[j, i]))
    if len(sessions.kept):
        for i in range(lanes.tables.shape[1]):
            sessions.kept[n, i] = lanes.tables[j, i]
    return 1


@without_refcounts
def run(
    work: Any,
    memories: Any,
    hearing: Any,
    chances: Any,
    walks: Any,
    lookahead: Any,
    model: Any,
    own: Any,
    own_gate: Any,
) -> None:
    """Runs all sessions; each lane takes the next one when its own has ended.

    memories: None without memory; hearing: None if the gate weighs no advice and the advisor answers at once; chances: None for
    deterministic moves; walks: None if no gate judges, or if all episodes begin in one state; lookahead: None for a learner that
    does not need the next action; model: None without planning; own, own_gate: None for a shipped learner, and for a
    shipped gate.
    """
    started = over = 0
    fresh, count = True, min(LANES, len(work.sessions.seeds))
    while over < len(work.sessions.seeds):
        if fresh:
            started = _begin(work, memories, hearing, walks, lookahead, model, own_gate, count, started)
            fresh = False
        choose(work, count)
        for j in range(count):
            busy = work.lanes.lane[j].session >= 0
            if busy and _step(work, memories, hearing, chances, walks, lookahead, model, own, own_gate, j):
                fresh = True
                over += _end(work, memories, hearing, chances, walks, own, j)
