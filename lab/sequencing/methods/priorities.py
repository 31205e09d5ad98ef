"""Lists of priorities: what stands for a sequence where whole orders are changed, crossed or learned."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any, NamedTuple

import numpy as np

from lab.learning import splitmix
from lab.learning.compiled import inlined, inner, without_refcounts
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, check_built_in
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.methods.rules import dispatch, usable, work_left_s
from lab.sequencing.search import Log
from lab.sequencing.simulate import kernels
from lab.sequencing.simulate.cell_arrays import Flags, Floats, Ints, cell_arrays, moves_each, run_arrays
from lab.sequencing.simulate.kernels import cost, may, reset, take
from lab.sequencing.simulate.room_kernels import fraction, mixed
from lab.sequencing.simulate.run import Run

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


# ---- priorities -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Priorities:
    """A list of priorities, from the highest: a part's number from 0 for each of its moves, and which of its ways it takes.

    It stands for the sequence in which again and again the first move is made that is still to be made and may be made now.
    Every sequence stands for itself; one that gets stuck costs what a deadlock does. Each part has as many entries as it
    has moves at the most.
    """

    parts: Ints
    choices: Ints

    @classmethod
    def of(cls, cell: Cell, sequence: Sequence[int]) -> "Priorities":
        """Those of a sequence; beyond it, of moves that its parts did not need, part after part by turns."""
        spare = moves_each(cell)
        for one in sequence:
            spare[part_of(one, cell.parts) - 1] -= 1
        rounds = [part for turn in range(max(spare)) for part in range(cell.parts) if spare[part] > turn]
        parts = [part_of(one, cell.parts) - 1 for one in sequence] + rounds
        choices = [choice_of(one, cell.parts) for one in sequence] + [0] * len(rounds)
        return cls(np.array(parts, np.int64), np.array(choices, np.int64))


@dataclass(frozen=True)
class Begun:
    """A dispatching rule's sequence, its cost, and whether it came to its end."""

    sequence: tuple[int, ...]
    cost: float
    done: bool


class Orders:
    """Where lists are carried out: the cell and a run as arrays, and what the dispatching rules come to there.

    begun: of each rule that the cell has the data for. first: the best one's list; scale: its cost, or a tenth of a
    deadlock's where every rule ends in one. Raises BadInput for an objective that the kernels do not know.
    """

    def __init__(self, cell: Cell, objective: str, who: str) -> None:
        check_built_in(objective, who)
        self.cell, self.arrays, self.run = cell, cell_arrays(cell, objective), run_arrays(cell)
        self._left_s = _left_s(cell, objective)
        self.stuck_cost = float(self.arrays.stuck_cost)
        self.begun = [self._dispatched(name) for name in usable(cell)]
        self.best = min(self.begun, key=lambda one: (not one.done, one.cost))
        self.first = Priorities.of(cell, self.best.sequence if self.best.done else ())
        self.scale = self.best.cost if self.best.done else self.stuck_cost / 10.0

    def order(self) -> OrderArrays:
        """Room for a list to be carried out: the first one."""
        size = len(self.first.parts)
        used, sequence = np.zeros(size, np.bool_), np.zeros(size, np.int64)
        return OrderArrays(self.first.parts.copy(), self.first.choices.copy(), used, sequence, self._left_s)

    def padded(self) -> Ints:
        """The best rule's decisions, then zeros; only these, where it does not come to its end."""
        row = np.zeros(len(self.first.parts), np.int64)
        if self.best.done:
            row[: len(self.best.sequence)] = self.best.sequence
        return row

    def note_rules(self, log: Log) -> None:
        """The rules' sequences as the first episodes, as far as the budget goes."""
        for one in self.begun[: log.search.episodes]:
            log.note(one.sequence, one.cost, one.done)

    def _dispatched(self, name: str) -> Begun:
        run = Run(self.cell)
        sequence = dispatch(run, usable(self.cell)[name])
        value = kernels.follow(self.arrays, self.run, np.array(sequence, np.int64), np.uint64(0))
        return Begun(sequence, float(value), run.done)


def _left_s(cell: Cell, objective: str) -> Floats:
    """How long a part takes from each position on at least [s]; -inf where an order's cost is not bounded by it."""
    waits = all(way.waits for place in cell.positions for way in place.options)
    if objective == MAKESPAN and waits:
        return np.array(work_left_s(cell))
    return np.full(len(cell.positions), -inf)
