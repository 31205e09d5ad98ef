"""SRL improved for large cells: where in the order each move belongs is learned, from episodes that are improved before."""

from dataclasses import dataclass

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods import srl_improved_kernels
from lab.sequencing.methods.priorities import Orders
from lab.sequencing.methods.srl_improved_kernels import LearnedOrders
from lab.sequencing.search import LearnedSequence, Log, Search
from lab.sequencing.simulate.cell_arrays import moves_each

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
        srl_improved_kernels.lesson(orders.arrays, orders.run, learned, costs, ALPHA, WARM * orders.scale)
        best = tuple(int(one) for one in learned.best if one)
        for value in costs.tolist():
            log.note(best, value, value < orders.stuck_cost)
    final_cost = float(srl_improved_kernels.greedy(orders.arrays, orders.run, learned))
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
