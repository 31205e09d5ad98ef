"""The states of a cell of one robot and machines with queues, compiled with numba: successors, bounds and dominance.

A state holds how far each part is (`code`, a mixed-radix number with the digits' `weight`), which part the robot dropped last and
when, and when each part is ready (its machine has finished it). A dropped part enters its machine's queue at once, at any place
among the parts that are not finished yet; the parts behind it are delayed. Parts, operations and stations are numbered from 0;
times are integers.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.compiled import compiled

FAR = 1 << 40
Whole = NDArray[np.int64]


class CellWork(NamedTuple):
    """The work of a cell as arrays, times in units.

    counts (part,): moves of each part. at, process, carry, tail (part, n): after n moves, the part's station, its processing
    there, the move that leaves, service included, and the least time from when the part is ready until it is finished. empty,
    least (station, station): the direct empty drive, and the shortest one by any stations. queues (station,): whether a station
    works on one part after the other. ready (part,): when a part may first be picked. weight (part,): of the part's digit in a
    state's code.
    """

    counts: Whole
    at: Whole
    process: Whole
    carry: Whole
    empty: Whole
    least: Whole
    queues: NDArray[np.bool_]
    ready: Whole
    tail: Whole
    weight: Whole


@compiled
def machine_bound(work: CellWork, c: Whole, ready: Whole, now: int, here: int) -> int:
    """A lower bound of the end by each machine's remaining work: heads, work and the least tail (Carlier 1982)."""
    counts, at, process, carry = work.counts, work.at, work.process, work.carry
    worst, most = 0, int(counts.sum())
    heads, times, tails = np.empty(most, np.int64), np.empty(most, np.int64), np.empty(most, np.int64)
    for machine in range(len(work.queues)):
        if not work.queues[machine]:
            continue
        n = 0
        for j in range(len(counts)):
            k = c[j]
            if k > 0 and at[j, k] == machine and ready[j] > now:
                heads[n] = max(now, ready[j] - process[j, k])
                times[n] = ready[j] - heads[n]
                tails[n] = work.tail[j, k]
                n += 1
            if k < counts[j]:
                t = max(ready[j], now + work.least[here, at[j, k]])
                for i in range(k + 1, counts[j] + 1):
                    t += carry[j, i - 1]
                    if at[j, i] == machine:
                        heads[n], times[n], tails[n] = t, process[j, i], work.tail[j, i]
                        n += 1
                    t += process[j, i]
        total, tail = 0, FAR
        for i in np.argsort(-heads[:n]):
            total += times[i]
            tail = min(tail, tails[i])
            worst = max(worst, heads[i] + total + tail)
    return worst


@compiled
def least_rest(work: CellWork) -> Whole:
    """A table (code, part) of the least time from the robot's drop of that part until the end, if no part were in process.

    It is the best tour through all moves left, by dynamic programming (Held and Karp 1962, with each part's moves in order). The
    robot waits for a part that it picks right after its drop, and each part and machine needs its own time.
    """
    counts, at, carry = work.counts, work.at, work.carry
    parts, size = len(counts), 1
    for count in counts:
        size *= count + 1
    rest = np.full((size, parts), FAR, np.int64)
    c, ready = np.empty(parts, np.int64), np.zeros(parts, np.int64)
    for code in range(size - 1, -1, -1):
        for j in range(parts):
            c[j] = code // work.weight[j] % (counts[j] + 1)
        for last in range(parts):
            if c[last] == 0:
                continue
            here, own = at[last, c[last]], work.process[last, c[last]]
            least = own if code == size - 1 else FAR
            for j in range(parts):
                if c[j] < counts[j]:
                    reach = max(work.empty[here, at[j, c[j]]], own if j == last else 0)
                    least = min(least, reach + carry[j, c[j]] + rest[code + work.weight[j], j])
            ready[:] = 0
            ready[last] = own
            for j in range(parts):
                least = max(least, ready[j] + work.tail[j, c[j]])
            rest[code, last] = max(least, machine_bound(work, c, ready, 0, here))
    return rest


@compiled
def queue_at(work: CellWork, c: Whole, ready: Whole, part: int, now: int) -> Whole:
    """The parts in the queue of the machine that a part's next move leads to, in order, as far as unfinished at a time."""
    queue, n = np.empty(len(c), np.int64), 0
    machine = work.at[part, c[part] + 1]
    if work.queues[machine]:
        for i in range(len(c)):
            if i != part and c[i] > 0 and work.at[i, c[i]] == machine and ready[i] > now:
                b = n
                while b > 0 and ready[queue[b - 1]] > ready[i]:
                    queue[b] = queue[b - 1]
                    b -= 1
                queue[b] = i
                n += 1
    return queue[:n]


@compiled
def put(work: CellWork, c: Whole, ready: Whole, part: int, begins: int, behind: Whole) -> None:
    """Updates `ready` of `part`, whose process begins then, and of the parts that stand behind it in the machine's queue."""
    end = begins + work.process[part, c[part]]
    ready[part] = end
    for i in behind:
        end = max(ready[i] - work.process[i, c[i]], end) + work.process[i, c[i]]
        ready[i] = end


@compiled
def bound(work: CellWork, rest: Whole, code: int, last: int, now: int, c: Whole, ready: Whole) -> int:
    """A lower bound of the end of a state."""
    here, least, all_done, most = work.at[last, c[last]], FAR, True, now + rest[code, last]
    for i in range(len(c)):
        most = max(most, ready[i] + work.tail[i, c[i]])
        if c[i] < work.counts[i]:
            all_done = False
            pick = max(now + work.empty[here, work.at[i, c[i]]], ready[i])
            least = min(least, pick + work.carry[i, c[i]] + rest[code + work.weight[i], i])
    if not all_done:
        most = max(most, least)
    return int(max(most, machine_bound(work, c, ready, now, here)))


class SearchLayer(NamedTuple):
    """The n states with equally many moves made: code, last, now and bound (n,), ready (n, parts).

    made (n, 3): how each came from the layer before: the state's number there, the part, and its place in the queue.
    """

    code: Whole
    last: Whole
    now: Whole
    ready: Whole
    bound: Whole
    made: Whole


@compiled
def expand(
    work: CellWork, rest: Whole, layer: SearchLayer, start: int, below: int
) -> tuple[Whole, Whole, Whole, Whole, Whole, Whole]:
    """The fields of the layer of all successors whose bound is below a value; start: the robot's first station.

    The result is a plain tuple: a named tuple would be built in Python, where Ctrl-C may be raised inside compiled code.
    """
    parts, n, cap = len(work.counts), 0, max(64, 2 * len(layer.code))
    out, times, made = np.empty((cap, 4), np.int64), np.empty((cap, parts), np.int64), np.empty((cap, 3), np.int64)
    c, ready = np.empty(parts, np.int64), np.empty(parts, np.int64)
    for a in range(len(layer.code)):
        for j in range(parts):
            c[j] = layer.code[a] // work.weight[j] % (work.counts[j] + 1)
        last, now = layer.last[a], layer.now[a]
        here = work.at[last, c[last]] if last >= 0 else start
        for j in range(parts):
            if c[j] == work.counts[j]:
                continue
            code = layer.code[a] + work.weight[j]
            drop = max(now + work.empty[here, work.at[j, c[j]]], layer.ready[a, j]) + work.carry[j, c[j]]
            if drop + rest[code, j] >= below:
                continue
            queue = queue_at(work, c, layer.ready[a], j, drop)
            c[j] += 1
            for place in range(len(queue) + 1):
                ready[:] = layer.ready[a]
                begins = drop if place == 0 else ready[queue[place - 1]]
                put(work, c, ready, j, begins, queue[place:])
                least = bound(work, rest, code, j, drop, c, ready)
                if least >= below:
                    continue
                if n == cap:
                    cap *= 2
                    out, times, made = _longer(out, cap), _longer(times, cap), _longer(made, cap)
                for i in range(parts):
                    # Finishing the part before the robot can be there is no better.
                    reach = drop + (work.least[work.at[j, c[j]], work.at[i, c[i]]] if c[i] < work.counts[i] else 0)
                    times[n, i] = max(ready[i], reach)
                out[n, 0], out[n, 1], out[n, 2], out[n, 3] = code, j, drop, least
                made[n, 0], made[n, 1], made[n, 2] = a, j, place
                n += 1
            c[j] -= 1
    last_ones, nows, bounds = out[:n, 1].copy(), out[:n, 2].copy(), out[:n, 3].copy()
    return out[:n, 0].copy(), last_ones, nows, times[:n].copy(), bounds, made[:n].copy()


@compiled
def _longer(array: Whole, rows: int) -> Whole:
    longer = np.empty((rows, array.shape[1]), np.int64)
    longer[: len(array)] = array
    return longer


@compiled
def needed(work: CellWork, layer: SearchLayer, order: Whole) -> NDArray[np.bool_]:
    """A mask of the states that no earlier state dominates, in an order that groups equal codes and last parts.

    A state dominates another one if none of its times is later and the queues have the unfinished parts of both in one order.
    """
    n, parts, low = len(order), len(work.counts), 0
    keep, c = np.ones(n, np.bool_), np.empty(parts, np.int64)
    while low < n:
        first, high = order[low], low
        while (
            high < n and layer.code[order[high]] == layer.code[first] and layer.last[order[high]] == layer.last[first]
        ):
            high += 1
        for j in range(parts):
            c[j] = layer.code[first] // work.weight[j] % (work.counts[j] + 1)
        for y in range(low, high):
            for x in range(low, y):
                if keep[x] and _as_good(work, layer, c, order[x], order[y]):
                    keep[y] = False
                    break
        low = high
    return keep


@compiled
def _as_good(work: CellWork, layer: SearchLayer, c: Whole, x: int, y: int) -> bool:
    one, other, now = layer.ready[x], layer.ready[y], layer.now[y]
    if layer.now[x] > now:
        return False
    for j in range(len(c)):
        if one[j] > other[j]:
            return False
    for j in range(len(c)):
        if c[j] == 0 or not work.queues[work.at[j, c[j]]] or one[j] <= now:
            continue
        for i in range(j):
            both = c[i] > 0 and work.at[i, c[i]] == work.at[j, c[j]] and one[i] > now
            if both and (one[i] < one[j]) != (other[i] < other[j]):
                return False
    return True
