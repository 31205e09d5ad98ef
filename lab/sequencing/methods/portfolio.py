"""All methods in turn: rules, annealing, and the exact search that proves most, each beginning with the best order so far."""

from dataclasses import dataclass
from functools import lru_cache
from math import inf

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, cost
from lab.sequencing.methods.anneal import Annealing
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.fewer_moves import fewer_moves
from lab.sequencing.methods.one_robot import one_robot, why_not
from lab.sequencing.search import SAME, Search, SequenceResult, only_one
from lab.sequencing.simulate.cell_arrays import most_moves
from lab.sequencing.simulate.run import follow

MOVES, ROUND = 12_000_000, 3_000  # of all sequences that annealing tries; how many it tries between two looks at Ctrl-C
TIME_LIMIT_S = 60.0
WORKERS = 6  # threads of CP-SAT, also on two cores: they look in different ways


Found = tuple[tuple[int, ...], float, str]  # a sequence, its cost, and by whom


@dataclass(frozen=True)
class BestKnown:
    """The best order that was found and by whom, the bound that no order is below and whose it is; `proven`: they are equal.

    sequence: without pointless hops; empty, and the cost infinite, where none was found.
    """

    sequence: tuple[int, ...]
    cost: float
    found_by: str
    bound: float
    bound_by: str

    @property
    def proven(self) -> bool:
        """Whether no order costs less."""
        return self.cost <= self.bound + SAME


@lru_cache(maxsize=4)
def best_known(
    cell: Cell, objective: str = MAKESPAN, time_limit_s: float = TIME_LIMIT_S, seed: int = 0, workers: int = 1
) -> BestKnown:
    """The best order by the mean times, and what is proven of it; CP-SAT is looked at only where nothing faster proves it.

    Of a cell with one robot that does all the work the shortest makespan is searched by states (`optimum`), of a job shop with
    one robot by its tours (`one_robot`); else CP-SAT begins with the order that annealing found. time_limit_s: of each of
    these [s]. workers: of CP-SAT; more than one may find another of several orders that cost the same.
    Raises BadInput as they do, WorkFailed where it is proven, or seems, that no order comes to its end.
    """
    best: Found = ((), inf, "")
    bound, bound_by = 0.0, "nothing"
    if objective == MAKESPAN and cell.serial:
        found = optimum(cell)
        return BestKnown(fewer_moves(cell, found.sequence), found.cost, "A*", found.bound_s, "A*")
    if objective == MAKESPAN and not why_not(cell):
        tour = one_robot(cell, time_limit_s)
        best, bound, bound_by = (tour.sequence, tour.cost, "search of tours"), tour.bound, "search of tours"
    if best[1] > bound + SAME:
        best = min(best, _annealed(cell, objective, seed), key=lambda one: one[1])
        sequence, least, theirs = _solved(cell, objective, time_limit_s, seed, best[0], workers)
        best = min(best, (sequence, _cost(cell, sequence, objective), "CP-SAT"), key=lambda one: one[1])
        bound, bound_by = max((least, theirs), (bound, bound_by), key=lambda one: one[0])
    sequence = fewer_moves(cell, best[0], objective) if best[0] else ()
    return BestKnown(sequence, _cost(cell, sequence, objective), best[2], min(bound, best[1]), bound_by)


def portfolio(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The best order that any method finds within its time, one sequence; it draws nothing from `rng`."""
    search.check(cell)
    found = best_known(cell, search.objective, TIME_LIMIT_S, workers=WORKERS)
    return only_one(cell, search, found.sequence, found.cost, bool(found.sequence))


def _annealed(cell: Cell, objective: str, seed: int) -> Found:
    annealing, steps = Annealing(cell, objective, seed), max(ROUND, MOVES // most_moves(cell))
    for done in range(0, steps, ROUND):
        annealing.advance(ROUND, done / steps)
    return annealing.best, annealing.best_cost if annealing.best else inf, "annealing"


def _solved(
    cell: Cell, objective: str, time_limit_s: float, seed: int, hint: tuple[int, ...], workers: int
) -> tuple[tuple[int, ...], float, str]:
    """What CP-SAT finds, the bound, and whose it is."""
    from lab.sequencing.methods.cp_sat import cp_sat, fits  # only where it is needed: OR-Tools takes its time

    if not fits(cell):
        return (), 0.0, "nothing: too many moves for CP-SAT"
    found = cp_sat(cell, objective, time_limit_s, seed, hint or None, workers)
    return found.sequence, found.bound, "CP-SAT"


def _cost(cell: Cell, sequence: tuple[int, ...], objective: str) -> float:
    return cost(follow(cell, sequence), objective) if sequence else inf
