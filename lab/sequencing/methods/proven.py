"""The best sequence there is, by whichever search can prove it, as a sequencer."""

from math import inf

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN
from lab.sequencing.cell.schedule import SequenceResult
from lab.sequencing.methods.exact import optimum
from lab.sequencing.search import Log, Search


def exact(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The proven best sequence by the mean times; it draws nothing from `rng`.

    The makespan is minimised by `optimum`; when that gives up, and for other objectives, by CP-SAT within its time limit,
    which may not prove its sequence. Raises BadInput as these do.
    """
    search.check(cell)
    found = optimum(cell) if search.objective == MAKESPAN else None
    sequence, cost = (found.sequence, found.cost) if found else ((), inf)
    if found is None or not found.proven:
        from lab.sequencing.methods.cp_sat import cp_sat, fits  # only where it is needed: OR-Tools takes its time

        if found is None or fits(cell):
            other = cp_sat(cell, search.objective, hint=sequence or None)
            sequence, cost = min((cost, sequence), (other.cost, other.sequence))[::-1]
    log = Log(search)
    log.note(sequence, cost, complete=bool(sequence))
    log.check(cell)
    return SequenceResult(log.best, log.best_cost, tuple(log.costs))
