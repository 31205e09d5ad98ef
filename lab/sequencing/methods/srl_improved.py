"""SRL improved for large cells: where in the order each move belongs is learned, from episodes that are improved before."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods.priorities import OrderArrays, Orders, carried_out, changed, copied, drawn
from lab.sequencing.search import LearnedSequence, Log, Search
from lab.sequencing.simulate.cell_arrays import Floats, Ints, moves_each


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


# ---- srl improved -----------------------------------------------------------------------------------------------------


LONGEST, LESSONS = (
    10_000,
    100,
)  # sequences between two lessons: at most so many, and so few that there are as many lessons
ALPHA = 0.2  # share by which a lesson as good as the best one moves what is learned
SPREAD, WARM = (
    0.1,
    0.01,
)  # how unsure a place is at first; the temperature of improving, as a share of the best rule's cost


@dataclass(frozen=True)
class SrlImprovedResult(LearnedSequence):
    """A sequencer's result, and what was learned of the L moves, part after part (see `Priorities`).

    place, spread (L,): where in the order a move belongs, from 0, first, to 1, and how unsure that is. ways (L, C): the
    probability of each choice. `final_cost` is that of the order which the places alone come to, without improving.
    """

    place: tuple[float, ...]
    spread: tuple[float, ...]
    ways: tuple[tuple[float, ...], ...]


def srl_improved(cell: Cell, search: Search, rng: np.random.Generator) -> SrlImprovedResult:
    """Learn where in the order each move belongs and by which way; the best sequence found is the result.

    It begins with the places of the best dispatching rule. A lesson draws an order from what was learned, improves it by a
    short annealing, and moves place, spread and ways towards it: by ALPHA exp((best - cost) / temperature), so that, as
    in SRL, the reward of the whole counts. Every sequence tried, the neighbours too, is an episode; what has become too long is
    given up as in `anneal`. Most of what it finds is the search's: on the 80 of Bilge and Ulusoy what was learned, alone
    (`final_cost`), is no better than a dispatching rule. It works by the mean times. Raises BadInput and WorkFailed as the
    other methods do.
    Source: population-based incremental learning of real values, Sebag and Ducoulombier 1998; learning from improved
    solutions, Whitley, Gordon and Mathias 1994.
    """
    search.check(cell)
    log, orders = Log(search), Orders(cell, search.objective, "srl-improved")
    orders.note_rules(log)
    learned = _begun(orders, drawn_seed(rng))
    longest = max(2, min(LONGEST, search.episodes // LESSONS))
    while len(log.costs) < search.episodes:
        costs = np.zeros(min(longest, search.episodes - len(log.costs)))
        lesson(orders.arrays, orders.run, learned, costs, ALPHA, WARM * orders.scale)
        best = tuple(int(one) for one in learned.best if one)
        for value in costs.tolist():
            log.note(best, value, value < orders.stuck_cost)
    final_cost = float(greedy(orders.arrays, orders.run, learned))
    place, spread = tuple(learned.place.tolist()), tuple(learned.spread.tolist())
    ways = tuple(tuple(row) for row in learned.ways.tolist())
    return SrlImprovedResult(*log.found(cell), final_cost, place, spread, ways)


def _begun(orders: Orders, seed: int) -> LearnedOrders:
    """Nothing learned yet but the first list's places; all ways are alike."""
    cell, first = orders.cell, orders.first
    begins, size = np.cumsum([0, *moves_each(cell)]), len(first.parts)
    place, met = np.zeros(size), np.zeros(cell.parts, np.int64)
    for i, part in enumerate(first.parts.tolist()):
        place[begins[part] + met[part]] = (i + 0.5) / size
        met[part] += 1
    return LearnedOrders(
        first=begins,
        place=place,
        spread=np.full(size, SPREAD),
        ways=np.full((size, cell.most_choices), 1.0 / cell.most_choices),
        drawn=np.zeros(size),
        by=np.zeros(size, np.int64),
        tried=orders.order(),
        parts=first.parts.copy(),
        choices=first.choices.copy(),
        cost=np.array([0.0, orders.best.cost if orders.best.done else np.inf]),
        nth=met,
        best=orders.padded(),
        stream=np.array([seed], np.uint64),
    )
