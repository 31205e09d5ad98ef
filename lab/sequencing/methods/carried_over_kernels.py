"""Features of decisions compiled, and runs that always take the decision with the highest value."""

from typing import Any

import numpy as np

from lab.learning.compiled import inner, lean
from lab.sequencing.cell.routes import SERVER
from lab.sequencing.simulate.kernels import cost, list_allowed, reached_s, reset, server_for, take


@inner
def _survey(cell: Any, run: Any, known: Any, work: Any) -> None:
    """What is to come at each machine, and when each is through with what it has."""
    parts, none = len(run.locations), len(known.places) - 1
    for station in range(none + 1):
        work.to_come_s[station], work.free_s[station] = 0.0, 0.0
        first, last = 0, 0
        if station < none:
            first, last = cell.first_server[station], cell.first_server[station + 1]
        if last > first:
            free_s = np.inf
            for server in range(first, last):
                free_s = min(free_s, run.servers_s[server])
            work.free_s[station] = free_s
        elif run.room[station] <= 0:
            work.free_s[station] = np.inf
    tail_s, left_s, unfinished, carried_s = 0.0, 0.0, 0, 0.0
    for part in range(parts):
        place = run.locations[part]
        first = cell.first_option[place]
        if first == cell.first_option[place + 1]:
            continue
        unfinished += 1
        left_s += known.left_s[place]
        carried_s += known.carried_s[place]
        tail_s = max(tail_s, run.ready_s[part] + known.left_s[place])
        for station in range(none):
            work.to_come_s[station] += known.load_s[place, station]
        machine = known.machine[place]
        if cell.robot[first] == SERVER:
            machine = cell.target[first]
            work.free_s[machine] = max(work.free_s[machine], run.ready_s[part]) if False else work.free_s[machine]
            work.free_s[machine] += cell.processing_s[cell.to[first]] / known.places[machine]
        elif machine < none and cell.first_server[machine] == cell.first_server[machine + 1]:
            if run.room[machine] <= 0:
                work.free_s[machine] = min(work.free_s[machine], run.ready_s[part])
    ahead_s, load_s = 0.0, 0.0
    for station in range(none):
        if work.to_come_s[station] > 0.0:
            ahead_s = max(ahead_s, _ends(run, work, station))
            load_s = max(load_s, work.to_come_s[station])
    work.most[0], work.most[1], work.most[2] = tail_s, left_s / max(1, unfinished), ahead_s
    carried_s /= max(1, len(run.robots_s))
    work.contexts[1] = left_s / known.whole_s
    work.contexts[2] = carried_s / max(1e-9, carried_s + load_s)


@inner
def _ends(run: Any, work: Any, station: int) -> float:
    """When a machine would end if it never stood still from now on."""
    if work.to_come_s[station] <= 0.0:
        return 0.0
    free_s = work.free_s[station]
    return float(max(run.clock[0], free_s if free_s < np.inf else 0.0) + work.to_come_s[station])


@inner
def _times(cell: Any, run: Any, part: int, o: int) -> Any:
    """When a decision begins and ends, as long as there is room."""
    if cell.robot[o] == SERVER:
        begin_s = server_for(cell, run, part, o)[0]
        return begin_s, begin_s + cell.processing_s[cell.to[o]]
    at_s = reached_s(cell, run, o)
    begin_s = max(at_s, run.ready_s[part]) if cell.waits[o] else at_s
    return begin_s, begin_s + cell.service_s[o] + cell.loaded_s[cell.robot[o], cell.origin[o], cell.target[o]]


@inner
def _describe(cell: Any, run: Any, known: Any, work: Any, count: int, i: int) -> None:
    """The features of the i-th allowed decision."""
    parts, none, f = len(run.locations), len(known.places) - 1, work.features
    part, o = (run.allowed[i] - 1) % parts, run.options[i]
    robot, here, there = cell.robot[o], run.locations[part], cell.to[o]
    begin_s, end_s, scale_s = work.begin_s[i], work.end_s[i], known.scale_s
    f[:] = 0.0
    f[0] = begin_s - work.most[3]
    if robot == SERVER:
        f[2] = 0.0
        free_s = np.inf
        for server in range(cell.first_server[cell.target[o]], cell.first_server[cell.target[o] + 1]):
            free_s = min(free_s, run.servers_s[server])
        f[2] = begin_s - free_s
        f[11] = scale_s
    else:
        at_s = reached_s(cell, run, o)
        f[1] = at_s - run.robots_s[robot]
        f[2] = begin_s - at_s
    f[3] = max(0.0, begin_s - run.ready_s[part])
    f[4] = end_s - begin_s
    f[5] = begin_s + known.left_s[here] - work.most[0]
    f[6] = known.left_s[here] - work.most[1]
    ahead = known.next_machine[here]
    if ahead < none:
        f[7] = _ends(run, work, ahead) - work.most[2]
    if robot != SERVER and known.machine[there] == ahead and ahead < none:
        free_s = work.free_s[ahead] if work.free_s[ahead] < np.inf else 0.0
        f[8] = max(0.0, end_s - max(free_s, run.clock[0]))
        f[9] = max(0.0, free_s - end_s)
    f[19] = max(end_s, end_s + f[9]) + known.left_s[there] - work.most[0]
    behind = known.machine[here]
    if behind < none and robot != SERVER and run.room[behind] <= 0:
        f[10] = _ends(run, work, behind) - work.most[2] + scale_s
    need = cell.needs[o, 0]
    if need < none:
        f[12] = scale_s / run.room[need]
    f[13] = known.moves[here] * scale_s
    if known.has_due:
        f[14] = cell.due_s[part] - begin_s - known.left_s[here]
    if robot != SERVER:
        nearest_s = np.inf
        for j in range(count):
            if cell.robot[run.options[j]] == robot and (run.allowed[j] - 1) % parts != part:
                nearest_s = min(nearest_s, max(work_ready(cell, run, j, parts) - end_s, cell.empty_s[robot, cell.target[o], cell.origin[run.options[j]]]))
        f[15] = nearest_s if nearest_s < np.inf else 0.0
    f[16] = end_s - work.least_s[part]
    if here == cell.starts[part]:
        f[17] = scale_s
    after = known.next_machine[there]
    if after < none:
        f[18] = _ends(run, work, after) - work.most[2]
    for k in range(len(f)):
        f[k] /= scale_s


@inner
def work_ready(cell: Any, run: Any, j: int, parts: int) -> float:
    return run.ready_s[(run.allowed[j] - 1) % parts] if cell.waits[run.options[j]] else 0.0


@inner
def _weigh(weights: Any, work: Any) -> None:
    size = len(work.weights)
    for k in range(size):
        work.weights[k] = weights[k]
        for c in range(1, len(work.contexts)):
            work.weights[k] += weights[c * size + k] * work.contexts[c]


@inner
def choose(cell: Any, run: Any, known: Any, work: Any, weights: Any, count: int) -> int:
    """Which of the allowed decisions has the highest value; of several the first."""
    parts = len(run.locations)
    if count == 1:
        return 0
    _survey(cell, run, known, work)
    first_s = np.inf
    for i in range(count):
        work.least_s[(run.allowed[i] - 1) % parts] = np.inf
    for i in range(count):
        part = (run.allowed[i] - 1) % parts
        work.begin_s[i], work.end_s[i] = _times(cell, run, part, run.options[i])
        first_s = min(first_s, work.begin_s[i])
        work.least_s[part] = min(work.least_s[part], work.end_s[i])
    work.most[3] = first_s
    _weigh(weights, work)
    best, best_value = 0, -np.inf
    for i in range(count):
        _describe(cell, run, known, work, count, i)
        value = 0.0
        for k in range(len(work.features)):
            value += work.weights[k] * work.features[k]
        if value > best_value:
            best, best_value = i, value
    return best


@lean
def decide(cell: Any, run: Any, known: Any, work: Any, weights: Any, sequence: Any) -> int:
    """A whole run; how many decisions, which stand in the sequence."""
    reset(cell, run, np.uint64(0))
    parts, made = len(run.locations), 0
    while True:
        count = list_allowed(cell, run)
        if count == 0:
            return made
        i = choose(cell, run, known, work, weights, count)
        sequence[made] = run.allowed[i]
        made += 1
        take(cell, run, (run.allowed[i] - 1) % parts, run.options[i], np.uint64(0))


@lean
def costs_of(cell: Any, run: Any, known: Any, work: Any, candidates: Any, sequence: Any, costs: Any) -> None:
    """What the runs of N candidates cost."""
    for n in range(len(candidates)):
        decide(cell, run, known, work, candidates[n], sequence)
        costs[n] = cost(cell, run)
