"""First in, first out: the task that became possible first is served first; as a sequencer and as a policy."""

from collections.abc import Sequence

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import cost
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.search import Search, SequenceResult, only_one
from lab.sequencing.simulate.execution import WAIT, Choose, Observed, one_by_one


def fifo(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """One sequence by the cell's own times, in which the task that became possible first is served first.

    The policy is `first_in_first_out`. In the simulated sequence, the robot drives ahead to the next task and waits there
    instead of staying where it is. Raises BadInput and WorkFailed as `lab.sequencing.methods.random_search`.
    """
    search.check(cell)
    execution = one_by_one(cell, lambda cell: _Queue(cell, stays=False))
    run = execution.run
    return only_one(cell, search, tuple(execution.sequence), cost(run, search.objective), run.done)


def first_in_first_out(cell: Cell) -> Choose:
    """The policy of a robot with a queue of tasks: a task joins it when an event makes it possible; the head is served.

    A task is possible when there is room for it, its part has arrived, and its machine has finished. With an empty queue the
    robot stays where it is until the next event, so a run costs more than the simulation of its sequence, where the robot
    drives ahead. Parts that may choose between routes take them in turn, even if only another route has room. Ties go to the
    part that has been ready longest, then to the lowest decision. Source: thesis App. III.
    """
    return _Queue(cell, stays=True)


class _Queue:
    """The queue: for each part, since when there has been room for its next task."""

    def __init__(self, cell: Cell, *, stays: bool) -> None:
        self._routes = _route_of_choice(cell)
        self._stays = stays
        self._room_since_s: dict[int, float] = {}

    def __call__(self, seen: Observed, allowed: tuple[int, ...]) -> int:
        parts = seen.cell.parts
        tasks: dict[int, int] = {}
        for decision in self._soonest_first(seen, allowed):
            if self._in_turn(seen, decision):
                tasks.setdefault(part_of(decision, parts), decision)
        self._room_since_s = {part: self._room_since_s.get(part, seen.now_s) for part in tasks}
        waiting = {part for part, decision in tasks.items() if _waits(seen, decision) and not seen.ready[part - 1]}
        if self._stays and len(waiting) == len(tasks) and something_comes(seen):
            return WAIT
        if not tasks:
            return allowed[0]

        def order(part: int) -> tuple[float, float, int]:
            ready_s = seen.ready_s[part - 1]
            possible_s = max(self._room_since_s[part], ready_s if _waits(seen, tasks[part]) else 0.0)
            return possible_s, ready_s, tasks[part]

        ready = [part for part in tasks if part not in waiting]
        return tasks[min(ready or tasks, key=order)]

    def _soonest_first(self, seen: Observed, allowed: tuple[int, ...]) -> Sequence[int]:
        """The allowed decisions by when their robot would arrive: of several free robots, the nearest takes a task."""
        if seen.cell.serial or not self._stays:
            return allowed
        ways = {decision: seen.option(decision) for decision in allowed}
        picks_s = {d: seen.pick_s(part_of(d, seen.cell.parts), way) for d, way in ways.items() if way is not None}
        return sorted(allowed, key=lambda decision: (picks_s[decision], decision))

    def _in_turn(self, seen: Observed, decision: int) -> bool:
        """Whether a part's first decision takes the route whose turn it is for its product; True for parts already on a route."""
        cell, part = seen.cell, part_of(decision, seen.cell.parts)
        if seen.locations[part - 1] != cell.starts[part - 1] or not cell.serial:
            return True
        alike = [other for other in range(1, cell.parts + 1) if cell.order[other - 1] == cell.order[part - 1]]
        gone = sum(seen.locations[other - 1] != cell.starts[other - 1] for other in alike)
        routes = self._routes[cell.order[part - 1]]
        return routes[choice_of(decision, cell.parts)] == gone % (routes[-1] + 1)


def _waits(seen: Observed, decision: int) -> bool:
    option = seen.option(decision)
    return option is None or option.waits


def something_comes(seen: Observed) -> bool:
    """Whether an event will happen without a decision: the end of a process, or an arrival."""
    cell = seen.cell
    following = None if cell.arrivals is None else cell.coming[seen.fetched : seen.fetched + 1]
    return any(
        not ready and (location != start or following is None or part in following)
        for part, (ready, location, start) in enumerate(zip(seen.ready, seen.locations, cell.starts, strict=True), 1)
    )


def _route_of_choice(cell: Cell) -> dict[str, tuple[int, ...]]:
    """For each product, the number of the route (from 0) that each choice at its start belongs to."""
    return {
        product.name: tuple(
            number
            for number, route in enumerate(product.routes)
            for way in route[1].ways
            for _ in range(2 if way.buffer is not None and cell.buffers == "free" else 1)
        )
        for product in cell.products
    }
