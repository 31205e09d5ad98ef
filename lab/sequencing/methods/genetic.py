"""A genetic algorithm on lists of priorities: it begins with the dispatching rules' lists and improves each child locally."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods.priorities import (
    OrderArrays,
    Orders,
    Priorities,
    below,
    carried_out,
    changed,
    copied,
    drawn,
    most_choices,
)
from lab.sequencing.search import Log, Search, SequenceResult
from lab.sequencing.simulate.cell_arrays import Flags, Floats, Ints


class Population(NamedTuple):
    """A population of N lists of L priorities for K parts, and the child that is being improved.

    parts, choices (N, L), costs (N,): the lists and their costs; tried (1,): how many of them were simulated so far. child_parts,
    child_choices (L,), child_cost (1,): the child; child: the neighbour of it under trial; left (1,): neighbours still to try,
    -1: there is no child. inherited (K,): the parts that the child has from its first parent. best (L,): the incumbent's
    decisions, then zeros; best_cost (1,). stream (1,): the state of the random number generator.
    """

    parts: Ints
    choices: Ints
    costs: Floats
    tried: Ints
    child: OrderArrays
    child_parts: Ints
    child_choices: Ints
    child_cost: Floats
    left: Ints
    inherited: Flags
    best: Ints
    best_cost: Floats
    stream: NDArray[np.uint64]


@without_refcounts
def shuffled(parts: Any, choices: Any, stream: Any, most: int) -> None:
    """Shuffles a list (L,) uniformly and draws one of `most` choices for each entry. Source: Fisher and Yates 1938."""
    for i in range(len(parts) - 1, -1, -1):
        other = below(stream, i + 1)
        parts[i], parts[other] = parts[other], parts[i]
        choices[i] = below(stream, most)


@inner
def _tournament(population: Any, best: bool) -> int:
    """The index of the better, or the worse, of two lists that are drawn."""
    one = below(population.stream, len(population.costs))
    other = below(population.stream, len(population.costs))
    return one if (population.costs[one] < population.costs[other]) == best else other


@without_refcounts
def crossed(population: Any, one: int, other: int) -> None:
    """Makes the child of two lists: the inherited parts stay where the first has them, the rest follow in the second's order.

    Source: job-based order crossover, Ono, Yamamura and Kobayashi 1996.
    """
    child = population.child
    for part in range(len(population.inherited)):
        population.inherited[part] = drawn(population.stream) < 0.5
    at, size = 0, len(child.parts)
    for i in range(size):
        if population.inherited[population.parts[one, i]]:
            child.parts[i], child.choices[i] = population.parts[one, i], population.choices[one, i]
            continue
        while population.inherited[population.parts[other, at]]:
            at += 1
        child.parts[i], child.choices[i] = population.parts[other, at], population.choices[other, at]
        at += 1


@inner
def _note(cell: Any, run: Any, population: Any, limit: float) -> float:
    """The cost of the child's list, simulated up to `limit`; a new incumbent is kept."""
    value = carried_out(cell, run, population.child, limit)
    if value < population.best_cost[0] and run.whole[1] == 0:
        population.best_cost[0] = value
        for i in range(len(population.best)):
            population.best[i] = population.child.sequence[i]
    return float(value)


@inner
def _survives(population: Any) -> None:
    """Replaces the worse of two drawn lists by the child, unless the child is worse than it."""
    n = _tournament(population, False)
    if population.child_cost[0] <= population.costs[n]:
        copied(population.child_parts, population.child_choices, population.parts[n], population.choices[n])
        population.costs[n] = population.child_cost[0]
    population.left[0] = -1


@without_refcounts
def evolve(cell: Any, run: Any, population: Any, costs: Any, improved: int) -> None:
    """Simulates N lists and writes their costs into `costs` (N,); improved: how many neighbours of each child are tried."""
    choices, child = most_choices(cell), population.child
    for n in range(len(costs)):
        if population.tried[0] < len(population.costs):
            i = population.tried[0]
            copied(population.parts[i], population.choices[i], child.parts, child.choices)
            costs[n] = population.costs[i] = _note(cell, run, population, np.inf)
            population.tried[0] += 1
            continue
        if population.left[0] < 0:
            crossed(population, _tournament(population, True), _tournament(population, True))
            population.child_cost[0] = np.inf
            population.left[0] = improved + 1
        else:
            copied(population.child_parts, population.child_choices, child.parts, child.choices)
            changed(child, population.stream, choices)
        costs[n] = _note(cell, run, population, population.child_cost[0])
        if costs[n] <= population.child_cost[0]:
            population.child_cost[0] = costs[n]
            copied(child.parts, child.choices, population.child_parts, population.child_choices)
        population.left[0] -= 1
        if population.left[0] == 0:
            _survives(population)


# ---- The method `ga` --------------------------------------------------------------------------------------------------


SMALLEST, LARGEST = 4, 50  # limits of the population's size, which is a 20th of the budget's square root
CHILDREN = 20  # for each list of the population; the rest of the budget goes into improving them
ROUND = 500  # sequences between two looks at the clock, the listener and Ctrl-C


def genetic(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The best sequence that a genetic algorithm with local improvement finds by the mean times; every one tried is an episode.

    The population begins with the lists of all dispatching rules and random ones. In each step two parents, each the winner of
    a tournament of two, have a child, which a short descent improves (a memetic algorithm); it replaces the worse of two drawn
    lists if it is no worse, so that the best list always stays. When the makespan is minimised, the simulation of a neighbour
    stops as soon as it is too long, and its episode costs the lower bound reached. It is a search and learns nothing. Raises
    BadInput and WorkFailed as the other methods do.
    Source: Moscato 1989; steady state, Whitley 1989; job-based order crossover, Ono, Yamamura and Kobayashi 1996;
    lists of operations as chromosomes, Bierwirth 1995.
    """
    search.check(cell)
    log, orders = Log(search), Orders(cell, search.objective, "the genetic algorithm")
    orders.note_rules(log)
    left = search.episodes - len(log.costs)
    size = min(max(round(left**0.5 / 20), SMALLEST), LARGEST)
    population = _population(orders, size, drawn_seed(rng))
    neighbours = left // (CHILDREN * size)
    while left > 0:
        costs = np.zeros(min(ROUND, left))
        evolve(orders.arrays, orders.run, population, costs, neighbours)
        best = tuple(int(decision) for decision in population.best if decision)
        for value in costs.tolist():
            log.note(best, value, value < orders.stuck_cost)
        left = search.episodes - len(log.costs)
    return SequenceResult(*log.found(cell))


def _population(orders: Orders, size: int, seed: int) -> Population:
    """The first population: the lists of the rules that end without a deadlock, the best first and at most half of all, and
    random lists."""
    ruled = sorted((order for order in orders.begun if order.done), key=lambda order: order.cost)[: max(1, size // 2)]
    first, stream = orders.first, np.array([seed], np.uint64)
    parts, choices = np.tile(first.parts, (size, 1)), np.tile(first.choices, (size, 1))
    most = orders.cell.most_choices
    for n in range(size):
        if n < len(ruled):
            listed = Priorities.of(orders.cell, ruled[n].sequence)
            parts[n], choices[n] = listed.parts, listed.choices
        else:
            shuffled(parts[n], choices[n], stream, most)
    costs, one = np.full(size, np.inf), np.zeros(1, np.int64)
    return Population(
        parts=parts,
        choices=choices,
        costs=costs,
        tried=one.copy(),
        child=orders.order(),
        child_parts=first.parts.copy(),
        child_choices=first.choices.copy(),
        child_cost=np.zeros(1),
        left=one - 1,
        inherited=np.zeros(orders.cell.parts, np.bool_),
        best=orders.padded(),
        best_cost=np.array([orders.best.cost if orders.best.done else np.inf]),
        stream=stream,
    )
