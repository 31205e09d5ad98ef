"""SRL improved, compiled: a list of priorities is drawn from what was learned, improved, and learned from."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.methods.priority_kernels import OrderArrays, carried_out, changed, copied, drawn
from lab.sequencing.simulate.cell_arrays import Floats, Ints


class LearnedOrders(NamedTuple):
    """What is learned of the L entries of a list, and the episode under way.

    An entry is a part and which of its moves; first (K + 1,): where the entries of each part begin. place, spread (L,): where
    in the list it should stand, from 0 to 1, and how unsure that is. ways (L, C): the probability of each way. drawn (L,):
    the places of an episode; by (L,): the entries in their order. tried: the neighbour of parts, choices (L,), which cost
    cost (2,): of these, and the least so far. nth (K,): how many entries of a part were met. best (L,): the best decisions,
    then zeros. stream (1,): the state of the random numbers.
    """

    first: Ints
    place: Floats
    spread: Floats
    ways: Floats
    drawn: Floats
    by: Ints
    tried: OrderArrays
    parts: Ints
    choices: Ints
    cost: Floats
    nth: Ints
    best: Ints
    stream: NDArray[np.uint64]


@inner
def _way_of(learned: Any, entry: int, explores: bool) -> int:
    """A way for an entry: drawn by their probabilities, or the likeliest one."""
    count, best = learned.ways.shape[1], 0
    for way in range(count):
        if learned.ways[entry, way] > learned.ways[entry, best]:
            best = way
    if not explores or count == 1:
        return best
    left = drawn(learned.stream)
    for way in range(count):
        left -= learned.ways[entry, way]
        if left < 0.0:
            return way
    return best


@inner
def _listed(learned: Any, explores: bool) -> None:
    """A list drawn from what was learned, or the one that it comes to without chance, into `tried`."""
    size = len(learned.place)
    for part in range(len(learned.nth)):
        learned.nth[part] = 0
        for entry in range(learned.first[part], learned.first[part + 1]):
            learned.parts[entry] = part  # only until the list is kept
    for entry in range(size):
        at = learned.place[entry]
        if explores:
            wide = drawn(learned.stream) + drawn(learned.stream) - 1.0  # a triangle, of variance 1 / 6
            at += wide * np.sqrt(6.0) * learned.spread[entry]
        learned.drawn[entry] = at
        i = entry
        while i > 0 and learned.drawn[learned.by[i - 1]] > at:
            learned.by[i] = learned.by[i - 1]
            i -= 1
        learned.by[i] = entry
    for i in range(size):
        part = learned.parts[learned.by[i]]
        entry = learned.first[part] + learned.nth[part]
        learned.nth[part] += 1
        learned.tried.parts[i], learned.tried.choices[i] = part, _way_of(learned, entry, explores)


@inner
def _learn(learned: Any, alpha: float) -> None:
    """What was learned goes towards the list kept, by a share alpha."""
    size = len(learned.parts)
    for part in range(len(learned.nth)):
        learned.nth[part] = 0
    for i in range(size):
        part = learned.parts[i]
        entry = learned.first[part] + learned.nth[part]
        learned.nth[part] += 1
        off = (i + 0.5) / size - learned.place[entry]
        learned.place[entry] += alpha * off
        learned.spread[entry] = np.sqrt((1.0 - alpha) * learned.spread[entry] ** 2 + alpha * off * off)
        for way in range(learned.ways.shape[1]):
            learned.ways[entry, way] *= 1.0 - alpha
        learned.ways[entry, learned.choices[i]] += alpha


@inner
def _try(cell: Any, run: Any, learned: Any, limit: float) -> float:
    """What the list in `tried` costs; up to the limit it is kept."""
    value = carried_out(cell, run, learned.tried, limit)
    if value <= limit:
        learned.cost[0] = value
        copied(learned.tried.parts, learned.tried.choices, learned.parts, learned.choices)
        if value < learned.cost[1] and run.whole[1] == 0:
            learned.cost[1] = value
            for i in range(len(learned.best)):
                learned.best[i] = learned.tried.sequence[i]
    return float(value)


@without_refcounts
def lesson(cell: Any, run: Any, learned: Any, costs: Any, alpha: float, temperature: float) -> None:
    """As many sequences as there are costs (N,), which are filled: one drawn, the others to improve it; then it is learned."""
    _listed(learned, True)
    learned.cost[0] = np.inf
    costs[0] = _try(cell, run, learned, np.inf)
    for n in range(1, len(costs)):
        copied(learned.parts, learned.choices, learned.tried.parts, learned.tried.choices)
        changed(learned.tried, learned.stream, learned.ways.shape[1])
        warm = temperature * (1.0 - n / len(costs))
        costs[n] = _try(cell, run, learned, learned.cost[0] - warm * np.log(1.0 - drawn(learned.stream)))
    if learned.cost[1] < np.inf:  # else nothing has come to its end yet
        _learn(learned, alpha * np.exp((learned.cost[1] - learned.cost[0]) / max(1e-9, temperature)))


@without_refcounts
def greedy(cell: Any, run: Any, learned: Any) -> float:
    """What the list costs that was learned, without chance; its sequence stands in `tried`."""
    _listed(learned, False)
    return float(carried_out(cell, run, learned.tried, np.inf))
