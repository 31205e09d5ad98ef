"""First in, first out: what is possible first is served first, as a list and as a policy."""

from collections.abc import Sequence

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import cost
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.search import Search, SequenceResult, only_one
from lab.sequencing.simulate.execution import WAIT, Choose, Observed, one_by_one


def fifo(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """One sequence, by the cell's own times: what is possible first is served first (see `first_in_first_out`).

    When nothing is possible yet, the robot goes where something will be next and waits there: the sequence costs what
    its simulation does. Raises BadInput and WorkFailed as `lab.sequencing.methods.random_search`.
    """
    search.check(cell)
    execution = one_by_one(cell, lambda cell: _Queue(cell, stays=False))
    run = execution.run
    return only_one(cell, search, tuple(execution.sequence), cost(run, search.objective), run.done)


def first_in_first_out(cell: Cell) -> Choose:
    """The policy of a robot with a queue of tasks: a task joins it when an event makes it possible; the head is served.

    Possible: there is room for it, the part has come, its machine has finished. With an empty queue the robot stays
    where it is until the next event, so it costs more than the simulation of its sequence, where the robot goes ahead.
    Parts that may choose between routes take them in turn, whether another has room or not. Tasks of the same moment:
    first the part that has been ready longest, then the lowest decision. Source: thesis App. III.
    """
    return _Queue(cell, stays=True)


class _Queue:
    """Since when the next task of each part has been possible, as far as room is concerned; an entry a part."""

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
        """Of several robots that are free the one that is there first takes a task."""
        if seen.cell.serial or not self._stays:
            return allowed
        ways = {decision: seen.option(decision) for decision in allowed}
        picks_s = {d: seen.pick_s(part_of(d, seen.cell.parts), way) for d, way in ways.items() if way is not None}
        return sorted(allowed, key=lambda decision: (picks_s[decision], decision))

    def _in_turn(self, seen: Observed, decision: int) -> bool:
        """Whether the route that a part is about to take is the next one of its product; True once it is on one."""
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
    """Whether an event is still to come by itself: the end of a process, or a part that is on its way."""
    cell = seen.cell
    following = None if cell.arrivals is None else cell.coming[seen.fetched : seen.fetched + 1]
    return any(
        not ready and (location != start or following is None or part in following)
        for part, (ready, location, start) in enumerate(zip(seen.ready, seen.locations, cell.starts, strict=True), 1)
    )


def _route_of_choice(cell: Cell) -> dict[str, tuple[int, ...]]:
    """Product -> the number of the route, from 0, that each choice at its start belongs to."""
    return {
        product.name: tuple(
            number
            for number, route in enumerate(product.routes)
            for way in route[1].ways
            for _ in range(2 if way.buffer is not None and cell.buffers == "free" else 1)
        )
        for product in cell.products
    }
