"""Lists of priorities: what stands for a sequence where whole orders are changed, crossed or learned."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, check_built_in
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.methods.priority_kernels import OrderArrays
from lab.sequencing.methods.rules import dispatch, usable, work_left_s
from lab.sequencing.search import Log
from lab.sequencing.simulate import kernels
from lab.sequencing.simulate.cell_arrays import Floats, Ints, cell_arrays, moves_each, run_arrays
from lab.sequencing.simulate.run import Run


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
