"""Annealing compiled: a list of priorities becomes a sequence, and a neighbour of the list is tried."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning import splitmix
from lab.learning.compiled import inner, lean
from lab.sequencing.simulate.cell_arrays import Flags, Floats, Ints
from lab.sequencing.simulate.kernels import cost, fraction, may, mixed, reset, take

_following: Any = inner(splitmix.following, inline="always")


class AnnealArrays(NamedTuple):
    """parts, choices (L,): the priorities; tried_...: the neighbour; used (L,): which entries are done. sequence, best (L,):
    decisions, then zeros. cost (2,): of the priorities, and of the best. stream (1,): the state of the random numbers."""

    parts: Ints
    choices: Ints
    tried_parts: Ints
    tried_choices: Ints
    used: Flags
    sequence: Ints
    best: Ints
    cost: Floats
    stream: NDArray[np.uint64]


@inner
def _uniform(stream: Any) -> float:
    stream[0] = _following(stream[0])
    return float(fraction(mixed(stream[0])))


@inner
def _way(cell: Any, run: Any, part: int, choice: int) -> int:
    """The way that a part may take now: by its choice, else the first that it may; -1: none."""
    place = run.locations[part]
    first, last = cell.first_option[place], cell.first_option[place + 1]
    found = -1
    for o in range(first, last):
        if may(cell, run, part, o):
            if cell.choice[o] == choice:
                return int(o)
            if found < 0:
                found = o
    return int(found)


@inner
def _carried_out(cell: Any, run: Any, work: Any) -> float:
    """What the neighbour's priorities cost; its sequence stands in work.sequence, followed by zeros."""
    reset(cell, run, np.uint64(0))
    size, first, moves = len(work.tried_parts), 0, 0
    for i in range(size):
        work.used[i] = False
        work.sequence[i] = 0
    while run.whole[1] > 0:
        i, o = first, -1
        while i < size:
            if not work.used[i]:
                part = work.tried_parts[i]
                o = _way(cell, run, part, work.tried_choices[i])
                if o >= 0:
                    break
                if cell.first_option[run.locations[part]] == cell.first_option[run.locations[part] + 1]:
                    work.used[i] = True  # it is finished: the entry is spare
            i += 1
        if o < 0:
            break
        work.used[i] = True
        work.sequence[moves] = work.tried_parts[i] + 1 + cell.choice[o] * len(run.locations)
        moves += 1
        take(cell, run, work.tried_parts[i], o, np.uint64(0))
        while first < size and work.used[first]:
            first += 1
    return float(cost(cell, run))


@inner
def _change(work: Any, choices: int) -> None:
    """The neighbour: one entry moved elsewhere, mostly not far, or another way for one."""
    size = len(work.parts)
    for i in range(size):
        work.tried_parts[i], work.tried_choices[i] = work.parts[i], work.choices[i]
    at = int(_uniform(work.stream) * size)
    if choices > 1 and _uniform(work.stream) < 0.2:
        work.tried_choices[at] = int(_uniform(work.stream) * choices)
        return
    reach = size if _uniform(work.stream) < 0.2 else min(size, 8)
    to = min(max(at + int((2.0 * _uniform(work.stream) - 1.0) * (reach + 1)), 0), size - 1)
    part, choice = work.tried_parts[at], work.tried_choices[at]
    step = 1 if to > at else -1
    while at != to:
        work.tried_parts[at], work.tried_choices[at] = work.tried_parts[at + step], work.tried_choices[at + step]
        at += step
    work.tried_parts[to], work.tried_choices[to] = part, choice


@lean
def anneal(cell: Any, run: Any, work: Any, costs: Any, temperature: float) -> None:
    """As many steps as there are costs (N,), which are filled, at a temperature in the objective's unit."""
    choices = 1
    for choice in cell.choice:
        choices = max(choices, choice + 1)
    for n in range(len(costs)):
        _change(work, choices)
        value = _carried_out(cell, run, work)
        costs[n] = value
        worse = value - work.cost[0]
        if worse <= 0.0 or _uniform(work.stream) < np.exp(-worse / temperature):
            work.cost[0] = value
            for i in range(len(work.parts)):
                work.parts[i], work.choices[i] = work.tried_parts[i], work.tried_choices[i]
        if value < work.cost[1] and run.whole[1] == 0:
            work.cost[1] = value
            for i in range(len(work.best)):
                work.best[i] = work.sequence[i]
