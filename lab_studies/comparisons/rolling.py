"""A policy that averages over random futures: at every decision it tries each allowed one in all futures."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.learning.splitmix import MASK, mixed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance, Episode
from lab.sequencing.cell.objectives import MAKESPAN, check_objective
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.methods.priorities import OrderArrays
from lab.sequencing.methods.rules import dispatch, usable
from lab.sequencing.simulate.cell_arrays import Floats, Ints, RunArrays, cell_arrays, moves_each, run_arrays
from lab.sequencing.simulate.execution import Choose, Observed, Policy
from lab.sequencing.simulate.run import branch
from lab_studies.comparisons.rolling_kernels import mean_cost

FUTURES = 100  # drawn at every decision
TRIES = 30  # draws for a time that has not passed yet


def rolling(
    planned: Sequence[int], chance: Chance, seed: int, objective: str = MAKESPAN, futures: int = FUTURES
) -> Policy:
    """A policy that begins with a planned list of decisions, and departs from it where another decision is better on average.

    At every decision futures are drawn from what can be known: what goes on has not ended yet. In each future each allowed
    decision is followed by the rest of the list, and by each dispatching rule; the decision with the least mean is taken, of
    equal ones that of the list. All decisions meet the same futures. Raises BadInput for fewer than 1 future, and when it is
    run in a cell with several robots, servers or batches: its futures are compiled for one robot, whose decisions follow one
    another in time. They have no breakdowns of the robot, which delay all decisions alike.
    Source: rollout with several heuristics, Bertsekas, Tsitsiklis and Wu 1997; Monte Carlo policy improvement, Tesauro and
    Galperin 1997.
    """
    if futures < 1:
        raise BadInput(f"futures = {futures}: allowed are whole numbers from 1")

    def policy(cell: Cell) -> Choose:
        check_objective(objective, cell)
        if not cell.serial:
            raise BadInput("rolling decisions are for cells with one robot: with several, plan anew by rollout")
        if cell.batches:
            raise BadInput("rolling decisions are for cells without batches, which an order defines before it begins")
        return _Rolling(cell, planned, chance, (seed, futures), objective).choose

    return policy


class _Rolling:
    """An episode of the policy: the rest of the list, and arrays for runs."""

    def __init__(
        self, cell: Cell, planned: Sequence[int], chance: Chance, drawn: tuple[int, int], objective: str
    ) -> None:
        self.cell, self.chance = cell, replace(chance, robot_breaks_every_s=0.0)
        self.seed, self.futures = drawn
        self._arrays = cell_arrays(cell, objective, self.chance)
        self._run, self._now = run_arrays(cell), run_arrays(cell)
        self._left, self._decisions = [*planned], 0

    def choose(self, seen: Observed, allowed: tuple[int, ...]) -> int:
        """The decision with the least mean cost."""
        self._decisions += 1
        first = next((decision for decision in self._left if decision in allowed), allowed[0])
        chosen = first
        if len(allowed) > 1:
            seeds = np.array([self._seed_of(future) for future in range(self.futures)], np.uint64)
            ready_s = np.array([self._ready_s(seen, int(seed)) for seed in seeds])
            _copy_run(self._now, seen, self._arrays.rooms)
            others = [decision for decision in allowed if decision != first]
            chosen = min([first, *others], key=lambda decision: self._mean_cost(seen, decision, ready_s, seeds))
        self._left = self._without(chosen)
        return chosen

    def _mean_cost(self, seen: Observed, decision: int, ready_s: Floats, seeds: NDArray[np.uint64]) -> float:
        """The least mean cost over the ways to continue after a decision."""
        index, way = part_of(decision, self.cell.parts) - 1, seen.option(decision)
        place = seen.locations[index]
        option = int(self._arrays.first_option[place]) + self.cell.positions[place].options.index(way)
        tails = [self._without(decision)]
        for rule in usable(self.cell).values():
            ahead = branch(seen)
            ahead.move(decision)
            tails.append([*dispatch(ahead, rule)])
        return min(
            mean_cost(self._arrays, self._run, self._now, self._order(tail), (index, option), ready_s, seeds)
            for tail in tails
        )

    def _without(self, decision: int) -> list[int]:
        """The rest of the list without a decision, or without the next one of its part if it is not in the list."""
        parts = self.cell.parts
        own = [n for n, entry in enumerate(self._left) if part_of(entry, parts) == part_of(decision, parts)]
        same = [n for n in own if self._left[n] == decision]
        used = next(iter([*same, *own]), len(self._left))
        return [entry for n, entry in enumerate(self._left) if n != used]

    def _order(self, tail: Sequence[int]) -> OrderArrays:
        """A list of priorities: the tail, then spare moves of every part."""
        parts = self.cell.parts
        spare = [part for _ in range(max(moves_each(self.cell))) for part in range(parts)]
        own = np.array([part_of(decision, parts) - 1 for decision in tail] + spare, np.int64)
        choices = np.array([choice_of(decision, parts) for decision in tail] + [0] * len(spare), np.int64)
        size = len(own)
        left_s = np.zeros(len(self.cell.positions))
        return OrderArrays(own, choices, np.zeros(size, np.bool_), np.zeros(size, np.int64), left_s)

    def _seed_of(self, future: int) -> int:
        return int(mixed((self.seed * 1_000_003 + self._decisions * 10_007 + future) & MASK))

    def _ready_s(self, seen: Observed, seed: int) -> list[float]:
        """The times (P,) from which parts may be picked in a future; a time under way is drawn until it has not passed."""
        ready_s = list(seen.ready_s)
        for index, ready in enumerate(seen.ready):
            place = seen.locations[index]
            at_start = place == self.cell.starts[index]
            if ready or (at_start and not self.chance.late_s) or (at_start and self.cell.arrivals is not None):
                continue
            for again in range(TRIES):
                times = Episode(self.cell, self.chance, int(mixed((seed + again) & MASK)))
                took_s = times.late_s(index + 1) if at_start else times.processing_s(index + 1, place)
                if seen.began_s[index] + took_s > seen.now_s:
                    ready_s[index] = seen.began_s[index] + took_s
                    break
        return ready_s


def _copy_run(now: RunArrays, seen: Observed, rooms: Ints) -> None:
    """Copy a run into arrays."""
    now.locations[:] = seen.locations
    now.finished_s[:] = [end_s or 0.0 for end_s in seen.finished_s]
    now.room[:] = rooms
    now.room[: len(seen.occupied)] -= seen.occupied
    now.clock[:] = seen.now_s, seen.waited_s, seen.processed_s, seen.end_s
    now.whole[:] = seen.fetched, sum(end_s is None for end_s in seen.finished_s)
    now.robots_at[:], now.robots_s[:] = seen.robots_at, seen.robots_s
