"""Lists of priorities, the encoding of sequences for local search, crossover and learning: their simulation and neighbours."""

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
    """The buffers with which a list of L priorities is simulated.

    parts, choices (L,): the list. used (L,): which entries are done. sequence (L,): the decisions, then zeros. left_s (P,): the
    least time of a part from each position to its end [s]; -inf: it gives no bound of the cost (see `carried_out`).
    """

    parts: Ints
    choices: Ints
    used: Flags
    sequence: Ints
    left_s: Floats


@inner
def drawn(stream: Any) -> float:
    """The next uniform number in [0, 1) of a stream; stream (1,): its state."""
    stream[0] = _following(stream[0])
    return float(fraction(mixed(stream[0])))


@inner
def below(stream: Any, most: int) -> int:
    """A uniform integer from 0 to most - 1."""
    return min(int(drawn(stream) * most), most - 1)


@inlined
def _way(cell: Any, run: Any, part: int, choice: int) -> int:
    """The number of the option that a part takes now: that of its choice if allowed, else the first allowed; -1: none."""
    place = run.locations[part]
    first, last = cell.first_option[place], cell.first_option[place + 1]
    chosen = -1
    for o in range(first, last):
        if may(cell, run, part, o):
            if cell.choice[o] == choice:
                return int(o)
            if chosen < 0:
                chosen = o
    return int(chosen)


@inner
def carried_out(cell: Any, run: Any, order: Any, limit: float) -> float:
    """The cost of the list; its decisions are written into order.sequence, followed by zeros.

    The simulation stops when a part can no longer end by `limit`; the lower bound of that part's end is then returned.
    """
    reset(cell, run, np.uint64(0))
    for i in range(len(order.parts)):
        order.used[i] = False
    return float(carried_on(cell, run, order, limit, np.uint64(0)))


@inner
def carried_on(cell: Any, run: Any, order: Any, limit: float, seed: Any) -> float:
    """`carried_out` from the run's state, with the unused entries of the list and the times of an episode's seed."""
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
                    order.used[i] = True  # the part is finished, so the entry is spare
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
    """Turns the list into a neighbour: another choice for an entry, or entries shifted or swapped, mostly over short distances.

    An entry often takes along the next one of its part, since a part that is brought earlier is also worked on earlier.
    choices: the largest number of choices of an entry.
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
    """Moves an entry from one place to another; the entries between shift by one."""
    part, choice = order.parts[at], order.choices[at]
    step = 1 if to > at else -1
    while at != to:
        order.parts[at], order.choices[at] = order.parts[at + step], order.choices[at + step]
        at += step
    order.parts[to], order.choices[to] = part, choice


@inner
def copied(parts: Any, choices: Any, into_parts: Any, into_choices: Any) -> None:
    """Copies a list into another one of the same length."""
    for i in range(len(parts)):
        into_parts[i], into_choices[i] = parts[i], choices[i]


@inner
def tried(cell: Any, run: Any, work: Any, limit: float) -> float:
    """The cost of the list `work.tried`, which becomes the current list if its cost is at most `limit`.

    Where its simulation is cut off as too long, a lower bound of the cost. A list that ends the work and is better than the
    incumbent becomes that. work: with `tried`, `parts`, `choices`, `best` and `cost` as in `AnnealArrays`.
    """
    value = carried_out(cell, run, work.tried, limit)
    if value <= limit:
        work.cost[0] = value
        copied(work.tried.parts, work.tried.choices, work.parts, work.choices)
        if value < work.cost[1] and run.whole[1] == 0:
            work.cost[1] = value
            for i in range(len(work.best)):
                work.best[i] = work.tried.sequence[i]
    return float(value)


@inner
def most_choices(cell: Any) -> int:
    """The largest number of choices that a part may have."""
    most = 1
    for choice in cell.choice:
        most = max(most, choice + 1)
    return int(most)


@without_refcounts
def cost_of(cell: Any, run: Any, order: Any, limit: float) -> float:
    """`carried_out`, callable from Python."""
    return float(carried_out(cell, run, order, limit))


# ---- Lists for Python, and the dispatching rules' sequences as first lists --------------------------------------------


@dataclass(frozen=True)
class Priorities:
    """A list of priorities, the highest first: for each move of each part an entry of the part (from 0) and its choice.

    It encodes the sequence that repeatedly takes the first unused entry whose move is allowed. Every sequence is encoded by
    itself. A list that ends in a deadlock has the cost of one. Each part has as many entries as it makes moves at most.
    """

    parts: Ints
    choices: Ints

    @classmethod
    def of(cls, cell: Cell, sequence: Sequence[int]) -> "Priorities":
        """The list of a sequence, followed by entries for the moves that its parts did not need, by turns of all parts."""
        spare = moves_each(cell)
        for decision in sequence:
            spare[part_of(decision, cell.parts) - 1] -= 1
        rounds = [part for turn in range(max(spare)) for part in range(cell.parts) if spare[part] > turn]
        parts = [part_of(decision, cell.parts) - 1 for decision in sequence] + rounds
        choices = [choice_of(decision, cell.parts) for decision in sequence] + [0] * len(rounds)
        return cls(np.array(parts, np.int64), np.array(choices, np.int64))


@dataclass(frozen=True)
class Begun:
    """A dispatching rule's sequence, its cost, and whether it finished all parts."""

    sequence: tuple[int, ...]
    cost: float
    done: bool


class Orders:
    """A cell and a run as arrays, in which lists are simulated, and the sequences of the dispatching rules.

    begun: the result of each rule that the cell has the data for. first: the list of the best rule. scale: its cost, or a tenth
    of a deadlock's cost where every rule ends in one. Raises BadInput for an objective that the kernels do not know.
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
        """New buffers for a list, filled with the first one."""
        size = len(self.first.parts)
        used, sequence = np.zeros(size, np.bool_), np.zeros(size, np.int64)
        return OrderArrays(self.first.parts.copy(), self.first.choices.copy(), used, sequence, self._left_s)

    def padded(self) -> Ints:
        """The best rule's decisions followed by zeros; only zeros where it ends in a deadlock."""
        row = np.zeros(len(self.first.parts), np.int64)
        if self.best.done:
            row[: len(self.best.sequence)] = self.best.sequence
        return row

    def note_rules(self, log: Log) -> None:
        """Notes the rules' sequences as the first episodes, within the budget."""
        for one in self.begun[: log.search.episodes]:
            log.note(one.sequence, one.cost, one.done)

    def _dispatched(self, name: str) -> Begun:
        run = Run(self.cell)
        sequence = dispatch(run, usable(self.cell)[name])
        value = kernels.follow(self.arrays, self.run, np.array(sequence, np.int64), np.uint64(0))
        return Begun(sequence, float(value), run.done)


def _left_s(cell: Cell, objective: str) -> Floats:
    """The least time of a part from each position to its end [s]; -inf where it does not bound the cost of a sequence."""
    waits = all(way.waits for place in cell.positions for way in place.options)
    if objective == MAKESPAN and waits:
        return np.array(work_left_s(cell))
    return np.full(len(cell.positions), -inf)
