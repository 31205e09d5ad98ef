"""SRL improved for large cells: it learns where in the order each move belongs, from episodes improved by local search."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods.priorities import OrderArrays, Orders, carried_out, changed, copied, drawn, tried
from lab.sequencing.search import LearnedSequence, Log, Search
from lab.sequencing.simulate.cell_arrays import Floats, Ints, moves_each


class LearnedOrders(NamedTuple):
    """The learned distribution of lists with L entries, and the present episode.

    An entry is one move of one of K parts; first (K + 1,): where the entries of each part begin. place, spread (L,): mean and
    spread of an entry's place in the list, from 0 to 1. ways (L, C): the probability of each choice. drawn (L,): the places of an
    episode; by (L,): the entries sorted by them. parts, choices (L,): the current list; tried: its neighbour. cost (2,): of the
    current list, and the least so far. nth (K,): how many entries of a part were met. best (L,): the incumbent's decisions, then
    zeros. stream (1,): the state of the random number generator.
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
    """The choice of an entry: drawn by the probabilities, or without exploring the likeliest one."""
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
    """Writes a list drawn from the learned distribution into `tried`, or without exploring its mean."""
    size = len(learned.place)
    for part in range(len(learned.nth)):
        learned.nth[part] = 0
        for entry in range(learned.first[part], learned.first[part + 1]):
            learned.parts[entry] = part  # temporarily, until the list is kept
    for entry in range(size):
        at = learned.place[entry]
        if explores:
            wide = drawn(learned.stream) + drawn(learned.stream) - 1.0  # triangular distribution of variance 1 / 6
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
    """Moves the learned distribution towards the current list, by a share alpha."""
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


@without_refcounts
def lesson(cell: Any, run: Any, learned: Any, costs: Any, alpha: float, temperature: float) -> None:
    """One lesson: draws a list, improves it by N - 1 neighbours, learns from it, and writes the N costs into `costs` (N,)."""
    _listed(learned, True)
    learned.cost[0] = np.inf
    costs[0] = tried(cell, run, learned, np.inf)
    for n in range(1, len(costs)):
        copied(learned.parts, learned.choices, learned.tried.parts, learned.tried.choices)
        changed(learned.tried, learned.stream, learned.ways.shape[1])
        warm = temperature * (1.0 - n / len(costs))
        costs[n] = tried(cell, run, learned, learned.cost[0] - warm * np.log(1.0 - drawn(learned.stream)))
    if learned.cost[1] < np.inf:  # otherwise every sequence so far ended in a deadlock
        _learn(learned, alpha * np.exp((learned.cost[1] - learned.cost[0]) / max(1e-9, temperature)))


@without_refcounts
def greedy(cell: Any, run: Any, learned: Any) -> float:
    """The cost of the learned list without exploring; its decisions are written into `tried`."""
    _listed(learned, False)
    return float(carried_out(cell, run, learned.tried, np.inf))


# ---- The method `srl-improved` ----------------------------------------------------------------------------------------


LONGEST = 10_000  # the most sequences in a lesson
LESSONS = 100  # the least number of lessons, in which a small budget is divided
ALPHA = 0.2  # step size of a lesson whose cost equals the best one's
SPREAD = 0.1  # the spread of every place before the first lesson
WARM = 0.01  # the temperature of the annealing in a lesson, as a share of the best rule's cost


@dataclass(frozen=True)
class SrlImprovedResult(LearnedSequence):
    """A sequencer's result and the learned distribution over the L moves, part after part (see `Priorities`).

    place, spread (L,): mean and spread of a move's place in the order, from 0, first, to 1. ways (L, C): the probability of each
    choice. final_cost: the cost of the order of the mean places, without local search.
    """

    place: tuple[float, ...]
    spread: tuple[float, ...]
    ways: tuple[tuple[float, ...], ...]


def srl_improved(cell: Cell, search: Search, rng: np.random.Generator) -> SrlImprovedResult:
    """The best sequence found while it learns where in the order each move belongs, and which choice it takes.

    It begins with the places of the best dispatching rule. A lesson draws an order from the learned distribution, improves it by
    a short annealing, and moves place, spread and ways towards it by ALPHA exp((best - cost) / temperature), so that, as in SRL,
    the reward of the whole episode counts. Every sequence tried, neighbours too, is an episode; simulations are cut off as in
    `anneal`. Most of the quality comes from the search: on the 80 instances of Bilge and Ulusoy the learned order alone
    (`final_cost`) is no better than a dispatching rule. It works by the mean times. Raises BadInput and WorkFailed as the other
    methods do.
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
        best = tuple(int(decision) for decision in learned.best if decision)
        for value in costs.tolist():
            log.note(best, value, value < orders.stuck_cost)
    final_cost = float(greedy(orders.arrays, orders.run, learned))
    place, spread = tuple(learned.place.tolist()), tuple(learned.spread.tolist())
    ways = tuple(tuple(row) for row in learned.ways.tolist())
    return SrlImprovedResult(*log.found(cell), final_cost, place, spread, ways)


def _begun(orders: Orders, seed: int) -> LearnedOrders:
    """The distribution before the first lesson: the places of the first list, and equal probabilities of all choices."""
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
