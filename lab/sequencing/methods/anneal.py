"""Simulated annealing: an order of priorities is changed a little, again and again, and worse ones are kept ever more seldom."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.cell.objectives import check_built_in
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.methods import anneal_kernels
from lab.sequencing.methods.rules import dispatch, usable
from lab.sequencing.search import Log, Search, SequenceResult
from lab.sequencing.simulate.cell_arrays import Ints, cell_arrays, most_moves, run_arrays
from lab.sequencing.simulate.run import Run

ROUND = 500  # sequences between two looks at the clock, the listener and Ctrl-C
HOT, COLD = 0.01, 0.002  # temperatures at first and in the end, as shares of the first order's cost


@dataclass(frozen=True)
class Priorities:
    """An order of priorities, from the highest: a part's number from 0 for each of its moves, and which of its ways it takes.

    It stands for the sequence in which again and again the first move is made that is still to be made and may be made now.
    Every sequence stands for itself; one that gets stuck costs what a deadlock does.
    """

    parts: Ints
    choices: Ints

    @classmethod
    def of(cls, cell: Cell, sequence: Sequence[int]) -> "Priorities":
        """Those of a sequence; beyond it, of moves that its parts do not need, all parts once more."""
        spare = [1 + n % cell.parts for n in range(most_moves(cell) - len(sequence))]
        decisions = [*sequence, *spare]
        parts = np.array([part_of(one, cell.parts) - 1 for one in decisions], np.int64)
        return cls(parts, np.array([choice_of(one, cell.parts) for one in decisions], np.int64))


def anneal(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The best sequence that simulated annealing finds by the mean times; every one that it tries is an episode.

    It begins with the best dispatching rule's. A step moves one entry of the priorities elsewhere, or changes the way that it
    takes. Raises BadInput and WorkFailed as the other methods do. Source: Kirkpatrick, Gelatt and Vecchi 1983; priorities as
    the list of an insertion neighbourhood, Dell'Amico and Trubian 1993.
    """
    search.check(cell)
    check_built_in(search.objective, "annealing")
    log = Log(search)
    annealing = Annealing(cell, search.objective, drawn_seed(rng))
    for sequence, value, done in annealing.begun:
        if len(log.costs) < search.episodes:
            log.note(sequence, value, done)
    total = search.episodes - len(log.costs)
    while len(log.costs) < search.episodes:
        left = search.episodes - len(log.costs)
        found = annealing.advance(min(ROUND, left), 1.0 - left / max(1, total))
        for value in annealing.costs.tolist():
            log.note(found, value, value < annealing.stuck_cost)
    return SequenceResult(*log.found(cell))


class Annealing:
    """An annealing under way. begun: the rules' sequences, their costs, whether they came to an end; costs: of the last round."""

    def __init__(self, cell: Cell, objective: str, seed: int) -> None:
        self.cell = cell
        self._arrays, self._run = cell_arrays(cell, objective), run_arrays(cell)
        self.stuck_cost = float(self._arrays.stuck_cost)
        self.begun = [self._dispatched(name) for name in usable(cell)]
        first = min(self.begun, key=lambda one: one[1])
        now = Priorities.of(cell, first[0] if first[2] else ())
        self._scale = first[1] if first[2] else self.stuck_cost / 10.0
        self._now = now.parts, now.choices
        size = len(now.parts)
        self._work = anneal_kernels.AnnealArrays(
            parts=now.parts.copy(),
            choices=now.choices.copy(),
            tried_parts=now.parts.copy(),
            tried_choices=now.choices.copy(),
            used=np.zeros(size, np.bool_),
            sequence=np.zeros(size, np.int64),
            best=np.zeros(size, np.int64),
            cost=np.array([first[1], first[1]]),
            stream=np.array([seed], np.uint64),
        )
        self._work.best[: len(first[0])] = first[0] if first[2] else ()
        self.costs = np.zeros(0)

    @property
    def best(self) -> tuple[int, ...]:
        """The best sequence so far."""
        return tuple(int(one) for one in self._work.best if one)

    @property
    def best_cost(self) -> float:
        """What it costs."""
        return float(self._work.cost[1])

    def advance(self, steps: int, done: float) -> tuple[int, ...]:
        """So many more steps, a share `done` of all being behind; the best sequence so far."""
        temperature = self._scale * HOT * exp(np.log(COLD / HOT) * done)
        self.costs = np.zeros(steps)
        anneal_kernels.anneal(self._arrays, self._run, self._work, self.costs, temperature)
        return self.best

    def _dispatched(self, name: str) -> tuple[tuple[int, ...], float, bool]:
        run = Run(self.cell)
        sequence = dispatch(run, usable(self.cell)[name])
        value = _cost_of(self._arrays, self._run, sequence)
        return sequence, value, run.done


def _cost_of(arrays: object, run: object, sequence: Sequence[int]) -> float:
    from lab.sequencing.simulate import kernels

    return float(kernels.follow(arrays, run, np.array(sequence, np.int64), np.uint64(0)))
