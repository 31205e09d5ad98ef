"""A list of priorities becomes a sequence, compiled: what annealing, the genetic algorithm and SRL improved have in common."""

from typing import Any, NamedTuple

import numpy as np

from lab.learning import splitmix
from lab.learning.compiled import inlined, inner, without_refcounts
from lab.sequencing.simulate.cell_arrays import Flags, Floats, Ints
from lab.sequencing.simulate.chance_kernels import fraction, mixed
from lab.sequencing.simulate.kernels import cost, may, reset, take

_following: Any = inner(splitmix.following, inline="always")


class OrderArrays(NamedTuple):
    """What a list of L priorities is carried out with.

    parts, choices (L,): the list. used (L,): which entries are done. sequence (L,): decisions, then zeros. left_s (P,): how
    long a part takes from each position on at least [s]; -inf: nobody may go by it (see `carried_out`).
    """

    parts: Ints
    choices: Ints
    used: Flags
    sequence: Ints
    left_s: Floats


@inner
def drawn(stream: Any) -> float:
    """The next of a stream's numbers from 0 to 1; stream (1,): its state."""
    stream[0] = _following(stream[0])
    return float(fraction(mixed(stream[0])))


@inner
def below(stream: Any, most: int) -> int:
    """A whole number from 0 to most - 1, each as likely."""
    return min(int(drawn(stream) * most), most - 1)


@inlined
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
def carried_out(cell: Any, run: Any, order: Any, limit: float) -> float:
    """What the list costs; its sequence stands in order.sequence, followed by zeros.

    It is given up, parts being left unfinished, where a part cannot end before `limit` any more: then that end is returned.
    """
    reset(cell, run, np.uint64(0))
    for i in range(len(order.parts)):
        order.used[i] = False
    return float(carried_on(cell, run, order, limit, np.uint64(0)))


@inner
def carried_on(cell: Any, run: Any, order: Any, limit: float, seed: Any) -> float:
    """`carried_out` from where the run is, with what is not used of the list, and the times of an episode's seed."""
    size, first, moves = len(order.parts), 0, 0
    for i in range(size):
        order.sequence[i] = 0
    while run.whole[1] > 0:
        i, o = first, -1
        while i < size:
            if not order.used[i]:
                part = order.parts[i]
                o = _way(cell, run, part, order.choices[i])
                if o >= 0:
                    break
                if cell.first_option[run.locations[part]] == cell.first_option[run.locations[part] + 1]:
                    order.used[i] = True  # it is finished: the entry is spare
            i += 1
        if o < 0:
            break
        part = order.parts[i]
        order.used[i] = True
        order.sequence[moves] = part + 1 + cell.choice[o] * len(run.locations)
        moves += 1
        take(cell, run, part, o, seed)
        end_s = run.ready_s[part] + order.left_s[run.locations[part]]
        if end_s > limit and run.whole[1] > 0:
            return float(end_s)
        while first < size and order.used[first]:
            first += 1
    return float(cost(cell, run))


@inner
def changed(order: Any, stream: Any, choices: int) -> None:
    """Turns the list into a neighbour: another way for an entry, or entries moved or swapped, mostly not far.

    Often an entry takes the next one of its part along: a part that is brought earlier is also worked on earlier.
    choices: the most that an entry may have.
    """
    size = len(order.parts)
    at = below(stream, size)
    if choices > 1 and drawn(stream) < 0.2:
        order.choices[at] = below(stream, choices)
        if drawn(stream) < 0.5:
            return
    reach = size if drawn(stream) < 0.2 else min(size, 8)
    to = min(max(at - reach + below(stream, 2 * reach + 1), 0), size - 1)
    kind = drawn(stream)
    if kind < 0.2:
        _swap(order, at, to)
        return
    following = at + 1
    while following < size and order.parts[following] != order.parts[at]:
        following += 1
    if kind < 0.6 or following == size:
        _shift(order, at, to)
    elif to <= at:
        _shift(order, at, to)
        _shift(order, following, to + 1)
    else:
        _shift(order, following, to)
        _shift(order, at, to - 1)


@inlined
def _swap(order: Any, at: int, to: int) -> None:
    part, choice = order.parts[at], order.choices[at]
    order.parts[at], order.choices[at] = order.parts[to], order.choices[to]
    order.parts[to], order.choices[to] = part, choice


@inlined
def _shift(order: Any, at: int, to: int) -> None:
    """An entry goes from one place to another; those between make room."""
    part, choice = order.parts[at], order.choices[at]
    step = 1 if to > at else -1
    while at != to:
        order.parts[at], order.choices[at] = order.parts[at + step], order.choices[at + step]
        at += step
    order.parts[to], order.choices[to] = part, choice


@inner
def copied(parts: Any, choices: Any, into_parts: Any, into_choices: Any) -> None:
    """A list into another one of the same length."""
    for i in range(len(parts)):
        into_parts[i], into_choices[i] = parts[i], choices[i]


@inner
def most_choices(cell: Any) -> int:
    """The most ways that a part may have."""
    most = 1
    for choice in cell.choice:
        most = max(most, choice + 1)
    return int(most)


@without_refcounts
def cost_of(cell: Any, run: Any, order: Any, limit: float) -> float:
    """`carried_out`."""
    return float(carried_out(cell, run, order, limit))
