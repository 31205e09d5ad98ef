"""Simulated annealing of a list of priorities: its compiled steps, the method `anneal`, and `Annealing`, which can be resumed."""

from collections.abc import Sequence
from math import exp, inf, log
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.compiled import without_refcounts
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods.priorities import (
    OrderArrays,
    Orders,
    Priorities,
    changed,
    copied,
    drawn,
    most_choices,
    tried,
)
from lab.sequencing.search import Log, Search, SequenceResult
from lab.sequencing.simulate.cell_arrays import Floats, Ints


class AnnealArrays(NamedTuple):
    """The state of an annealing of a list of L priorities.

    tried: the neighbour, carried out. parts, choices (L,): the current list. best (L,): the incumbent's decisions, then zeros.
    cost (2,): of the current list and of the incumbent. stream (1,): the state of the random number generator.
    """

    tried: OrderArrays
    parts: Ints
    choices: Ints
    best: Ints
    cost: Floats
    stream: NDArray[np.uint64]


@without_refcounts
def annealed_session(cell: Any, run: Any, work: Any, costs: Any, temperature: float) -> None:
    """Makes N steps at a temperature in the objective's unit and writes their costs into `costs` (N,)."""
    choices = most_choices(cell)
    for n in range(len(costs)):
        copied(work.parts, work.choices, work.tried.parts, work.tried.choices)
        changed(work.tried, work.stream, choices)
        costs[n] = tried(cell, run, work, work.cost[0] - temperature * np.log(1.0 - drawn(work.stream)))


# ---- The method, and an annealing that can be resumed -----------------------------------------------------------------


ROUND = 500  # sequences between two looks at the clock, the listener and Ctrl-C
HOT, COLD = 0.02, 0.004  # temperatures at first and in the end, as shares of the first order's cost


def anneal(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The best sequence that simulated annealing finds by the mean times; every one that it tries is an episode.

    It begins with the sequence of the best dispatching rule. A step moves or swaps entries of the list, or changes the route
    of one entry. When the makespan is minimised, the simulation of a neighbour stops as soon as it is too long to be
    accepted; its episode then costs the lower bound reached. It is a search and learns nothing. Raises BadInput and
    WorkFailed as the other methods do.
    Source: Kirkpatrick, Gelatt and Vecchi 1983; priorities as the list of an insertion neighbourhood, Dell'Amico and
    Trubian 1993; cutting off neighbours, Dueck and Scheuer 1990, whose limit is known before a neighbour is tried.
    """
    search.check(cell)
    noted, annealing = Log(search), Annealing(cell, search.objective, drawn_seed(rng))
    annealing.orders.note_rules(noted)
    total = search.episodes - len(noted.costs)
    while len(noted.costs) < search.episodes:
        left = search.episodes - len(noted.costs)
        sequence = annealing.advance(min(ROUND, left), 1.0 - left / max(1, total))
        for value in annealing.costs.tolist():
            noted.note(sequence, value, value < annealing.orders.stuck_cost)
    return SequenceResult(*noted.found(cell))


class Annealing:
    """An annealing under way. orders: the rules' lists that it may begin with, unless an order is `known`; costs: those of
    the last round."""

    def __init__(self, cell: Cell, objective: str, seed: int, known: Sequence[int] = ()) -> None:
        self.orders = orders = Orders(cell, objective, "annealing")
        first = Priorities.of(cell, known) if known else orders.first
        cost = inf if known else orders.best.cost if orders.best.done else orders.stuck_cost
        self._work = AnnealArrays(
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
        return tuple(int(decision) for decision in self._work.best if decision)

    @property
    def best_cost(self) -> float:
        """What it costs."""
        return float(self._work.cost[1])

    def advance(self, steps: int, done: float) -> tuple[int, ...]:
        """The best sequence after `steps` more steps; done: the share of all steps made before, which sets the temperature."""
        temperature = self.orders.scale * HOT * exp(log(COLD / HOT) * done)
        self.costs = np.zeros(steps)
        annealed_session(self.orders.arrays, self.orders.run, self._work, self.costs, temperature)
        return self.best
