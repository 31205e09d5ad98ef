"""The compiled forms of learners and selections, which work on the records of the kernel."""

from typing import Any

import numpy as np

from lab.learning import selection, splitmix
from lab.learning.compiled import inlined, inner
from lab.learning.gates.heard import NOTHING
from lab.learning.kernels.records import LANES
from lab.learning.updates import tabular, update

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
def outcome(chances: Any, number: Any, u: float) -> int:
    """The index of the outcome of a move that u selects (`ChanceTable.step`).

    All are compared, because a branch that cannot be predicted costs more.
    """
    k: Any = 0
    for i in range(chances.below.shape[1] - 1):
        k += np.int64(u >= chances.below[number, i])
    return int(k)


@inlined
def gauge(work: Any, table: Any, state: int, action: int) -> float:
    """`Update.gauge` of one action in a flat table."""
    at = np.uint64(state) * np.uint64(len(work.learning.actions)) + np.uint64(action)
    return float(table[np.uint64(work.problem.successor[at]) if work.learning.afterstate else at])


@inlined
def fill(work: Any, values: Any, j: int, state: Any) -> None:
    """Writes `Update.gauge` of the actions in a state to values (LANES, A), by lane j's table."""
    for a in range(len(work.learning.actions)):
        values[j, a] = gauge(work, work.lanes.tables[j], state, a)


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
def choose(work: Any, count: int) -> None:
    """The learner's own choice in the first `count` lanes, which are in use.

    Writes `chosen`, and the highest value and the span of the values.
    """
    if work.learning.selection == selection.SOFTMAX:
        _choose_softmax(work, count)
    else:
        _choose_greedy(work, count)


@inlined
def _choose_greedy(work: Any, count: int) -> None:
    """`selection.choose_greedy` or `choose_epsilon_greedy` in the lanes in use."""
    lanes, learning = work.lanes, work.learning
    values, actions = lanes.values, len(learning.actions)
    offset, factor = (work.problem.step_reward, learning.discount) if learning.afterstate else (0.0, 1.0)
    for j in range(count):
        top, low = -np.inf, np.inf
        for a in range(actions):
            value = gauge(work, lanes.tables[j], lanes.states[j], a)
            top, low = max(top, value), min(low, value)
            values[a * LANES + j] = offset + factor * value
        lanes.best[j], lanes.widths[j] = top, top - low
        epsilon = 0.0 if learning.selection == selection.GREEDY else lanes.warm[j]
        lanes.chosen[j] = greedy(values, j, LANES, actions, offset + factor * top, epsilon, draw(lanes.rng, j))


@inlined
def _choose_softmax(work: Any, count: int) -> None:
    """`selection.choose_softmax` in the lanes in use at once.

    The values (A * LANES,) are overwritten by cumulative weights. The compiler knows the number of actions, so the lanes of one
    action stay in registers.
    """
    lanes, afterstate = work.lanes, work.learning.afterstate
    values, widths, per_tau, chosen, rng = lanes.values, lanes.widths, lanes.per_tau, lanes.chosen, lanes.rng
    best = lanes.best
    A = len(work.learning.actions)
    offset, factor = (work.problem.step_reward, work.learning.discount) if afterstate else (0.0, 1.0)
    for j in range(count):
        at = lanes.states[j] * np.uint64(A)
        for a in range(A):
            i = at + np.uint64(a)
            values[a * LANES + j] = lanes.tables[j, np.uint64(work.problem.successor[i]) if afterstate else i]
    for j in range(count):
        top = low = values[j]
        for a in range(1, A):
            top, low = max(top, values[a * LANES + j]), min(low, values[a * LANES + j])
        best[j], widths[j] = top, top - low
        top = offset + factor * top
        total = 0.0
        for a in range(A):
            total += _exp_of((offset + factor * values[a * LANES + j] - top) * per_tau[j])
            values[a * LANES + j] = total
    for j in range(count):
        rng[j] = _following(rng[j])
        mark = _fraction(_mixed(rng[j])) * values[(A - 1) * LANES + j] * selection.BELOW_ONE
        action = np.int64(0)
        for a in range(A - 1):
            action += np.int64(values[a * LANES + j] <= mark)
        chosen[j] = action
