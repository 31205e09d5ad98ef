"""SRL improved for large cells: it learns where in the order each move belongs, and every episode is improved before it is learned from."""

from dataclasses import dataclass

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods import srl_improved_kernels
from lab.sequencing.methods.priorities import Orders, Priorities
from lab.sequencing.methods.srl_improved_kernels import LearnedOrders
from lab.sequencing.search import LearnedSequence, Log, Search
from lab.sequencing.simulate.cell_arrays import Floats, moves_each

EPISODE = 10_000  # sequences of an episode at the most: one that is drawn, and neighbours
LEAST_EPISODES = 100
ALPHA, SPREAD, WARM = (
    0.2,
    0.1,
    0.01,
)  # step of learning; how unsure a place is at first; temperature as a share of the cost


@dataclass(frozen=True)
class SrlImprovedResult(LearnedSequence):
    place: Floats
    spread: Floats
    ways: Floats


def srl_improved(cell: Cell, search: Search, rng: np.random.Generator) -> SrlImprovedResult:
    search.check(cell)
    log, orders = Log(search), Orders(cell, search.objective, "srl-improved")
    orders.note_rules(log)
    learned = _begun(orders, drawn_seed(rng))
    longest = max(2, min(EPISODE, search.episodes // LEAST_EPISODES))
    while len(log.costs) < search.episodes:
        costs = np.zeros(min(longest, search.episodes - len(log.costs)))
        srl_improved_kernels.session(orders.arrays, orders.run, learned, costs, ALPHA, WARM * orders.scale)
        best = tuple(int(one) for one in learned.best if one)
        for value in costs.tolist():
            log.note(best, value, value < orders.stuck_cost)
    final = srl_improved_kernels.greedy(orders.arrays, orders.run, learned)
    return SrlImprovedResult(*log.found(cell), final, learned.place, learned.spread, learned.ways)


def _begun(orders: Orders, seed: int) -> LearnedOrders:
    cell, first = orders.cell, orders.first
    begins = np.cumsum([0, *moves_each(cell)])
    size, met = len(first.parts), np.zeros(cell.parts, np.int64)
    place, ways = np.zeros(size), np.full((size, cell.most_choices), 1.0 / cell.most_choices)
    for i, part in enumerate(first.parts.tolist()):
        place[begins[part] + met[part]] = (i + 0.5) / size
        met[part] += 1
    return LearnedOrders(
        first=begins,
        place=place,
        spread=np.full(size, SPREAD),
        ways=ways,
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
