"""The compiled forms of the learners and of softmax: `updates.QLearning`, `updates.Afterstate`, `selection.choose_softmax`."""

from typing import Any

import numpy as np

from lab.learning import selection, splitmix
from lab.learning.compiled import inlined
from lab.learning.kernels.records import LANES
from lab.learning.updates import afterstate, update

_exp_of: Any = inlined(selection.exp_of)
_following: Any = inlined(splitmix.following)
_mixed: Any = inlined(splitmix.mixed)
_fraction: Any = inlined(splitmix.fraction)
_towards: Any = inlined(update.towards)
_afterstate_value: Any = inlined(afterstate.afterstate_value)


@inlined
def draw(rng: Any, j: int) -> float:
    """`splitmix.stream` for lane j."""
    rng[j] = _following(rng[j])
    return float(_fraction(_mixed(rng[j])))


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
def choose(work: Any) -> None:
    """`selection.choose_softmax` in every lane at once; `widths` becomes how far the values span.

    The values (A * LANES,) are used up: they become sums of weights. All of one action's lanes stay in registers, for the
    compiler knows how many actions there are.
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
