"""Simulated annealing: an order of priorities is changed a little, again and again, and worse ones are kept ever more seldom."""

from collections.abc import Sequence
from math import exp, inf, log

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods import anneal_kernels
from lab.sequencing.methods.priorities import Orders, Priorities
from lab.sequencing.search import Log, Search, SequenceResult

ROUND = 500  # sequences between two looks at the clock, the listener and Ctrl-C
HOT, COLD = 0.02, 0.004  # temperatures at first and in the end, as shares of the first order's cost


def anneal(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The best sequence that simulated annealing finds by the mean times; every one that it tries is an episode.

    It begins with the best dispatching rule's. A step moves or swaps entries of the priorities, or changes the way that
    one takes. Of makespans, a sequence that has become too long to be kept is given up: its episode costs what it would
    have cost at the least. It is a search and learns nothing. Raises BadInput and WorkFailed as the other methods do.
    Source: Kirkpatrick, Gelatt and Vecchi 1983; priorities as the list of an insertion neighbourhood, Dell'Amico and
    Trubian 1993; what is given up, Dueck and Scheuer 1990, whose limit is known before a neighbour is tried.
    """
    search.check(cell)
    noted, annealing = Log(search), Annealing(cell, search.objective, drawn_seed(rng))
    annealing.orders.note_rules(noted)
    total = search.episodes - len(noted.costs)
    while len(noted.costs) < search.episodes:
        left = search.episodes - len(noted.costs)
        found = annealing.advance(min(ROUND, left), 1.0 - left / max(1, total))
        for value in annealing.costs.tolist():
            noted.note(found, value, value < annealing.orders.stuck_cost)
    return SequenceResult(*noted.found(cell))


class Annealing:
    """An annealing under way. orders: what it begins with, but for a `known` order; costs: of the last round."""

    def __init__(self, cell: Cell, objective: str, seed: int, known: Sequence[int] = ()) -> None:
        self.orders = orders = Orders(cell, objective, "annealing")
        first = Priorities.of(cell, known) if known else orders.first
        cost = inf if known else orders.best.cost if orders.best.done else orders.stuck_cost
        self._work = anneal_kernels.AnnealArrays(
            tried=orders.order(),
            parts=first.parts.copy(),
            choices=first.choices.copy(),
            best=np.zeros_like(first.parts) if known else orders.padded(),
            cost=np.array([cost, cost]),
            stream=np.array([seed], np.uint64),
        )
        self.costs = np.zeros(0)

    @property
    def best(self) -> tuple[int, ...]:
        """The best sequence so far."""
        return tuple(int(one) for one in self._work.best if one)

    @property
    def best_cost(self) -> float:
        """What it costs."""
        return float(self._work.cost[1])

    def advance(self, steps: int, done: float) -> tuple[int, ...]:
        """So many more steps, a share `done` of all being behind; the best sequence so far."""
        temperature = self.orders.scale * HOT * exp(log(COLD / HOT) * done)
        self.costs = np.zeros(steps)
        anneal_kernels.anneal(self.orders.arrays, self.orders.run, self._work, self.costs, temperature)
        return self.best
