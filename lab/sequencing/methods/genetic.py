"""A genetic algorithm as a rival: lists of priorities begun with the dispatching rules', crossed part by part, each child improved."""

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods import genetic_kernels
from lab.sequencing.methods.genetic_kernels import Population
from lab.sequencing.methods.priorities import Orders, Priorities
from lab.sequencing.search import Log, Search, SequenceResult

SMALLEST, LARGEST = 4, 50  # lists in a population: a 20th of the root of the budget, within these
CHILDREN = 20  # for each list of the population; what is left of the budget goes into improving them
ROUND = 500  # sequences between two looks at the clock, the listener and Ctrl-C


def genetic(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The best sequence that a genetic algorithm with local improvement finds by the mean times; every one tried is an episode.

    A population holds the lists of all dispatching rules and others that are drawn. Again and again two parents, each the better
    of two drawn ones, have a child, which a short descent improves (a memetic algorithm); it takes the place of the worse
    of two drawn ones if it is no worse, so that the best one always stays. Of makespans, a neighbour that has become too long is given
    up, and its episode costs what it would have cost at the least. Raises BadInput and WorkFailed as the other methods do.
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
        genetic_kernels.evolve(orders.arrays, orders.run, population, costs, neighbours)
        best = tuple(int(one) for one in population.best if one)
        for value in costs.tolist():
            log.note(best, value, value < orders.stuck_cost)
        left = search.episodes - len(log.costs)
    return SequenceResult(*log.found(cell))


def _population(orders: Orders, size: int, seed: int) -> Population:
    """The lists of the rules that come to their ends, the best first, as far as there is room for half of all; others are drawn."""
    ruled = sorted((one for one in orders.begun if one.done), key=lambda one: one.cost)[: max(1, size // 2)]
    first, stream = orders.first, np.array([seed], np.uint64)
    parts, choices = np.tile(first.parts, (size, 1)), np.tile(first.choices, (size, 1))
    most = orders.cell.most_choices
    for n in range(size):
        if n < len(ruled):
            listed = Priorities.of(orders.cell, ruled[n].sequence)
            parts[n], choices[n] = listed.parts, listed.choices
        else:
            genetic_kernels.shuffled(parts[n], choices[n], stream, most)
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
