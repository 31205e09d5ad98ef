"""First in, first out in the flexible manufacturing system (thesis App. III), as in the listing of App. VIII."""

from math import inf
from typing import NamedTuple

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.methods.fifo import something_comes
from lab.sequencing.simulate.execution import WAIT, Observed, Policy

MACHINES = ("mill", "lathe-1", "lathe-2")  # in the order of tasks that become possible together
MILL = 0
FETCH, LOAD, PALLET, UNLOAD, SHIP = range(5)  # in the order of tasks of one machine
BY_EVENTS = (FETCH, UNLOAD)  # tasks that an arrival or the end of a process makes possible; moves make the others so
STARTS = ("listing", "idle-start")


def queued_fifo(start: str) -> Policy:
    """The policy of a robot with a queue of tasks, for the task `fms`; start: one of STARTS, when an idle robot begins.

    After each move, arrival and end of a process every possible task joins the queue, and its head is served. Tasks are
    possible as follows. Fetch: the part has come, and the in-buffer of its machine is free; lathes take turns, even if only
    the other one is free. Load: the machine is free, and so is a lathe's out-buffer. Pallet: the out-buffer is free. Unload:
    the machine has finished, and the pallet is there. Ship: the part is on its pallet.
    A robot that finds the queue empty after a move is idle. With "listing" it then sleeps until no process goes on and no
    part is on its way, even if tasks join the queue; with "idle-start" only until one does.
    """
    return lambda cell: _Fifo(cell, sleeps=start == "listing")


class _Task(NamedTuple):
    """A task of the robot, sorted by machine and kind as in the listing."""

    machine: int
    kind: int
    decision: int
    part: int  # from 0


class _Fifo:
    """The queue of one episode."""

    def __init__(self, cell: Cell, *, sleeps: bool) -> None:
        self._cell, self._sleeps = cell, sleeps
        self._queue: list[_Task] = []
        self._possible: set[_Task] = set()  # the tasks possible at the last decision, apart from events to wait for
        self._looked_s = 0.0
        self._idle = self._fetched = True

    def __call__(self, seen: Observed, allowed: tuple[int, ...]) -> int:
        possible = {task for decision in allowed if self._is_possible(seen, task := self._task(seen, decision))}
        ready = [task for task in possible if task.kind not in BY_EVENTS or seen.ready[task.part]]
        joining = [task for task in ready if task not in self._queue]
        self._queue += sorted(joining, key=lambda task: (self._joins_s(seen, task), task))
        self._possible, self._looked_s = possible, seen.now_s
        if not self._queue or (self._idle and self._sleeps and something_comes(seen)):
            self._idle = True
            return WAIT
        head = self._queue.pop(0)
        self._idle, self._fetched = False, head.kind == FETCH
        return head.decision

    def _task(self, seen: Observed, decision: int) -> _Task:
        """The task of an allowed decision; the stations' names begin with those of their machines."""
        cell, option, part = self._cell, seen.option(decision), part_of(decision, self._cell.parts) - 1
        assert option is not None
        fetch = seen.locations[part] == cell.starts[part]
        name = cell.names[option.target if fetch else option.origin]
        machine = next(number for number, machine in enumerate(MACHINES) if name.startswith(machine))
        if fetch:
            kind = FETCH
        elif option.carries == "pallet":
            kind = PALLET
        elif cell.stations[option.target].kind == "machine":
            kind = LOAD
        else:
            kind = UNLOAD if cell.positions[option.to].options else SHIP
        return _Task(machine, kind, decision, part)

    def _is_possible(self, seen: Observed, task: _Task) -> bool:
        """Whether the listing allows a task, apart from events to wait for."""
        cell = self._cell
        if task.kind == LOAD and task.machine != MILL:
            return seen.occupied[cell.index(f"{MACHINES[task.machine]}-out")] == 0
        if task.kind == FETCH:
            product = cell.order[task.part]
            routes = next(len(known.routes) for known in cell.products if known.name == product)
            return choice_of(task.decision, cell.parts) == cell.order[: seen.fetched].count(product) % routes
        return True

    def _joins_s(self, seen: Observed, task: _Task) -> float:
        """The time at which a task joins the queue: that of the event that made it possible; inf: only now, after the move.

        An event during the move meets the state before it; only a fetched part has already left.
        """
        event_s = seen.ready_s[task.part]
        before = task in self._possible or (task.kind == FETCH and self._fetched)
        return event_s if task.kind in BY_EVENTS and before and event_s > self._looked_s else inf
