"""Compiled features of decisions (see `carried_over_features`), and compiled runs that take the decision of highest value."""

from typing import Any, NamedTuple

import numpy as np

from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import SERVER
from lab.sequencing.methods.carried_over_features import WAITED
from lab.sequencing.methods.carried_over_policy import FEATURES
from lab.sequencing.search import SAME
from lab.sequencing.simulate.cell_arrays import Floats, Ints, most_moves
from lab.sequencing.simulate.kernels import cost, list_allowed, pick_times, reached_s, reset, server_for, take

(
    DELAY,
    EMPTY_WAY,
    IDLE,
    PART_WAITED,
    DURATION,
    TAIL,
    WORK_LEFT,
    LOAD_AHEAD,
    STARVES,
    QUEUE,
    LOAD_BEHIND,
    SERVED,
    ROOM,
    MOVES_LEFT,
    SLACK,
    WAY_ON,
    OTHER_WAY,
    ENTERS,
    LOAD_AFTER,
    QUEUED_TAIL,
) = range(len(FEATURES))


class WorkArrays(NamedTuple):
    """Buffers for the features of D decisions of K parts at S stations, and for the L decisions of a run.

    begin_s, end_s (D,): when each decision begins and ends. least_s (K,): the earliest end among each part's decisions. free_s,
    load_s (S + 1,): when each machine has finished the parts that it holds, and its load. compared (4,): the latest tail, the
    mean work left, the highest load, the first begin. features (F,): those of one decision. sequence (L,): the decisions.
    """

    begin_s: Floats
    end_s: Floats
    least_s: Floats
    free_s: Floats
    load_s: Floats
    compared: Floats
    features: Floats
    sequence: Ints


def work_arrays(cell: Cell) -> WorkArrays:
    """Empty buffers for a run of the cell."""
    decisions, size = cell.parts * cell.most_choices, len(cell.stations) + 1
    return WorkArrays(
        begin_s=np.zeros(decisions),
        end_s=np.zeros(decisions),
        least_s=np.zeros(cell.parts),
        free_s=np.zeros(size),
        load_s=np.zeros(size),
        compared=np.zeros(4),
        features=np.zeros(len(FEATURES)),
        sequence=np.zeros(most_moves(cell), np.int64),
    )


@inner
def _survey(cell: Any, run: Any, known: Any, work: Any) -> None:
    """Fills in the values that decisions are compared with, except for the first begin."""
    last, tail_s, left_s, going = len(known.places) - 1, 0.0, 0.0, 0
    for station in range(last):
        work.load_s[station] = 0.0
        if cell.first_server[station + 1] > cell.first_server[station]:
            work.free_s[station] = _first_free(cell, run, station)
        else:
            work.free_s[station] = np.inf
    for part in range(len(run.locations)):
        place = run.locations[part]
        first, machine = cell.first_option[place], known.machine[place]
        if first == cell.first_option[place + 1]:
            continue
        going += 1
        left_s += known.left_s[place]
        tail_s = max(tail_s, max(run.clock[0], run.ready_s[part]) + known.left_s[place])
        for station in range(last):
            work.load_s[station] += known.load_s[place, station]
        if cell.robot[first] == SERVER:
            station = cell.target[first]
            work.free_s[station] += cell.processing_s[cell.to[first]] / known.places[station]
        elif machine < last and cell.first_server[machine + 1] == cell.first_server[machine]:
            work.free_s[machine] = min(work.free_s[machine], run.ready_s[part])
    highest_s = 0.0
    for station in range(last):
        if cell.first_server[station + 1] > cell.first_server[station]:
            free_s = _first_free(cell, run, station)  # parts that wait there are counted in the load
        else:
            if run.room[station] > 0 or work.free_s[station] == np.inf:
                work.free_s[station] = 0.0  # there is room, or the part inside never leaves
            free_s = work.free_s[station]
        if work.load_s[station] > 0.0:
            work.load_s[station] += max(0.0, free_s - run.clock[0])
            highest_s = max(highest_s, work.load_s[station])
    work.compared[0], work.compared[1] = tail_s, left_s / going
    work.compared[2] = highest_s if highest_s > 0.0 else 1.0


@inner
def _first_free(cell: Any, run: Any, station: int) -> float:
    """`Run.free_s`."""
    free_s = np.inf
    for server in range(cell.first_server[station], cell.first_server[station + 1]):
        free_s = min(free_s, run.servers_s[server])
    return free_s


@inner
def _times(cell: Any, run: Any, work: Any, count: int) -> None:
    """Fills in when each decision begins and ends if there is room, the first begin, and the earliest end of each part."""
    parts, first_s = len(run.locations), np.inf
    for i in range(count):
        work.least_s[(run.allowed[i] - 1) % parts] = np.inf
    for i in range(count):
        part, o = (run.allowed[i] - 1) % parts, run.options[i]
        if cell.robot[o] == SERVER:
            begin_s = server_for(cell, run, part, o)[0]
            end_s = begin_s + cell.processing_s[cell.to[o]]
        else:
            begin_s, _, out_s = pick_times(cell, run, part, o)
            end_s = out_s + cell.loaded_s[cell.robot[o], cell.origin[o], cell.target[o]]
        work.begin_s[i], work.end_s[i] = begin_s, end_s
        first_s = min(first_s, begin_s)
        work.least_s[part] = min(work.least_s[part], end_s)
    work.compared[3] = first_s


@inner
def _way_on(cell: Any, run: Any, work: Any, count: int, i: int) -> float:
    """The least time after the drop of the i-th decision until its robot can pick another part."""
    parts, robot, at = len(run.locations), cell.robot[run.options[i]], cell.target[run.options[i]]
    part, soonest_s = (run.allowed[i] - 1) % parts, np.inf
    for j in range(count):
        o, other = run.options[j], (run.allowed[j] - 1) % parts
        if cell.robot[o] == robot and other != part:
            on_s = cell.empty_s[robot, at, cell.origin[o]]
            if cell.waits[o] and run.ready_s[other] - work.end_s[i] > on_s:
                on_s = run.ready_s[other] - work.end_s[i]
            if on_s < soonest_s:  # false where the robot never makes this move (NaN)
                soonest_s = on_s
    return soonest_s if soonest_s < np.inf else 0.0


@inner
def _describe(cell: Any, run: Any, known: Any, work: Any, count: int, i: int) -> None:
    """The features of the i-th allowed decision."""
    f, scale_s, last = work.features, known.scale_s, len(known.places) - 1
    part, o = (run.allowed[i] - 1) % len(run.locations), run.options[i]
    here, there, robot = run.locations[part], cell.to[o], cell.robot[o]
    begin_s, end_s, left_s = work.begin_s[i], work.end_s[i], known.left_s[here]
    ahead, behind, after = known.following[here], known.machine[here], known.following[there]
    f[:] = 0.0
    if robot == SERVER:
        f[IDLE] = (begin_s - _first_free(cell, run, cell.target[o])) / scale_s
        f[SERVED] = 1.0
    else:
        at_s = reached_s(cell, run, o)
        f[EMPTY_WAY] = (at_s - run.robots_s[robot]) / scale_s
        f[IDLE] = (begin_s - at_s) / scale_s
        f[WAY_ON] = _way_on(cell, run, work, count, i) / scale_s
        if ahead < last and known.machine[there] == ahead:
            f[STARVES] = max(0.0, end_s - max(work.free_s[ahead], run.clock[0])) / scale_s
            f[QUEUE] = max(0.0, work.free_s[ahead] - end_s) / scale_s
        if behind < last and run.room[behind] <= 0:
            f[LOAD_BEHIND] = work.load_s[behind] / work.compared[2]
    if here == cell.starts[part]:
        f[ENTERS] = 1.0
    else:
        f[PART_WAITED] = min(WAITED, max(0.0, begin_s - run.ready_s[part]) / scale_s)
    f[DELAY] = (begin_s - work.compared[3]) / scale_s
    f[DURATION] = (end_s - begin_s) / scale_s
    f[TAIL] = (begin_s + left_s - work.compared[0]) / scale_s
    f[WORK_LEFT] = (left_s - work.compared[1]) / scale_s
    if ahead < last:
        f[LOAD_AHEAD] = work.load_s[ahead] / work.compared[2] - 1.0
    if cell.needs[o, 0] < last:
        f[ROOM] = 1.0 / max(1, run.room[cell.needs[o, 0]])
    f[MOVES_LEFT] = known.moves[here]
    if known.due:
        f[SLACK] = (cell.due_s[part] - begin_s - left_s) / scale_s
    f[OTHER_WAY] = (end_s - work.least_s[part]) / scale_s
    if after < last:
        f[LOAD_AFTER] = work.load_s[after] / work.compared[2] - 1.0
    work_s = cell.processing_s[there] if robot != SERVER and cell.begins[there] else 0.0
    f[QUEUED_TAIL] = f[QUEUE] + (end_s + work_s + known.left_s[there] - work.compared[0]) / scale_s


@without_refcounts
def describe_all(cell: Any, run: Any, known: Any, work: Any, found: Any) -> int:
    """The number of allowed decisions; their features (see `features`) are written into the rows of `found`."""
    count = list_allowed(cell, run)
    if count > 0:
        _survey(cell, run, known, work)
        _times(cell, run, work, count)
    for i in range(count):
        _describe(cell, run, known, work, count, i)
        for k in range(len(work.features)):
            found[i, k] = work.features[k]
    return count


@inner
def _best(cell: Any, run: Any, known: Any, work: Any, weights: Any, count: int) -> int:
    """The index of the allowed decision of highest value; ties go to the first."""
    if count == 1:
        return 0
    _survey(cell, run, known, work)
    _times(cell, run, work, count)
    best, highest = 0, -np.inf
    for i in range(count):
        _describe(cell, run, known, work, count, i)
        value = 0.0
        for k in range(len(weights)):
            value += weights[k] * work.features[k]
        if value > highest + SAME:
            best, highest = i, value
    return best


@without_refcounts
def decide(cell: Any, run: Any, known: Any, work: Any, weights: Any) -> int:
    """The number of decisions of a whole run with the weights (F,); the decisions are written into work.sequence."""
    reset(cell, run, np.uint64(0))
    parts, made = len(run.locations), 0
    while True:
        count = list_allowed(cell, run)
        if count == 0:
            return made
        i = _best(cell, run, known, work, weights, count)
        work.sequence[made] = run.allowed[i]
        made += 1
        take(cell, run, (run.allowed[i] - 1) % parts, run.options[i], np.uint64(0))


@without_refcounts
def costs_of(cell: Any, run: Any, known: Any, work: Any, candidates: Any, costs: Any) -> None:
    """Writes the costs (N,) of runs with N candidate weights (N, F) into `costs`."""
    for n in range(len(candidates)):
        decide(cell, run, known, work, candidates[n])
        costs[n] = cost(cell, run)
