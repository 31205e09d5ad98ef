"""Annealing compiled: a neighbour of the list of priorities is tried, and kept when it is hardly worse."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.methods.priority_kernels import OrderArrays, carried_out, changed, copied, drawn, most_choices
from lab.sequencing.simulate.cell_arrays import Floats, Ints


class AnnealArrays(NamedTuple):
    """tried: the neighbour, carried out. parts, choices (L,): the list that it is one of. best (L,): the best decisions, then
    zeros. cost (2,): of the list, and of the best. stream (1,): the state of the random numbers."""

    tried: OrderArrays
    parts: Ints
    choices: Ints
    best: Ints
    cost: Floats
    stream: NDArray[np.uint64]


@inner
def annealed(cell: Any, run: Any, work: Any, choices: int, temperature: float) -> float:
    """One step; what the neighbour costs, or more than what is kept where it was given up."""
    copied(work.parts, work.choices, work.tried.parts, work.tried.choices)
    changed(work.tried, work.stream, choices)
    limit = work.cost[0] - temperature * np.log(1.0 - drawn(work.stream))
    value = carried_out(cell, run, work.tried, limit)
    if value <= limit:
        work.cost[0] = value
        copied(work.tried.parts, work.tried.choices, work.parts, work.choices)
        if value < work.cost[1] and run.whole[1] == 0:
            work.cost[1] = value
            for i in range(len(work.best)):
                work.best[i] = work.tried.sequence[i]
    return value


@without_refcounts
def anneal(cell: Any, run: Any, work: Any, costs: Any, temperature: float) -> None:
    """As many steps as there are costs (N,), which are filled, at a temperature in the objective's unit."""
    choices = most_choices(cell)
    for n in range(len(costs)):
        costs[n] = annealed(cell, run, work, choices, temperature)
