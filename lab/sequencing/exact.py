"""The proven optimum of a cell: best-first search over its decision states, with alike toasts merged."""

import heapq
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from operator import le
from typing import NamedTuple

from lab.sequencing.bound import TICKS_PER_S, RobotWork, ticks
from lab.sequencing.cell import Cell
from lab.sequencing.events import simulate
from lab.sequencing.rivals import fifo

MAX_EXPANDED = 1_000_000


@dataclass(frozen=True)
class Optimum:
    """The best sequence known, and what is proven: no sequence is shorter than `bound_s`.

    `proven`: the sequence is optimal (to a nanosecond a move) and `bound_s` is its makespan. `expanded`: states opened.
    """

    makespan_s: float
    sequence: tuple[int, ...]
    proven: bool
    bound_s: float
    expanded: int

    @property
    def optimal_s(self) -> float | None:
        """The makespan when it is proven to be optimal, else None [s]."""
        return self.makespan_s if self.proven else None

    def gap(self, makespan_s: float) -> float:
        """How much longer a makespan is than the proven optimum, or than the bound when there is none; a fraction."""
        return makespan_s / self.bound_s - 1.0


class _State(NamedTuple):
    """Between two moves, in ticks: toasts per station, robot's station, when the toasts of each machine are finished.

    Which toast stands where is left out: they are alike, and at each station the one that came first goes first.
    """

    now: int
    counts: tuple[int, ...]
    robot: int
    finish: tuple[tuple[int, ...], ...]  # by station, ascending, never before `now`
    left: int = 0
    parent: "_State | None" = None


def optimum(cell: Cell, max_expanded: int = MAX_EXPANDED) -> Optimum:
    """The shortest makespan of the cell and a sequence that reaches it, toasts numbered first in, first out.

    States are opened in the order of time so far + a bound on what the robot still has to do, so the first complete one
    is optimal. After `max_expanded` states it gives up: the FIFO sequence, `proven` False and the bound reached so far.
    Source: uniform-cost search (Dijkstra 1959) with an admissible bound (A*, Hart et al. 1968); the pruning of later
    states that are otherwise alike is the thesis's branch and bound, App. IV.
    """
    search = _Search(cell)
    # Of equally promising states the newest comes first, hence the falling serial number.
    heap = [(search.bound(search.start), 0, search.start)]
    fronts: dict[tuple[tuple[int, ...], int], list[tuple[int, ...]]] = {}
    expanded = serial = bound = 0
    while heap:
        bound, _, state = heapq.heappop(heap)
        if state.parent is not None and _times(state) not in fronts[state.counts, state.robot]:
            continue  # overtaken since it was queued
        if state.counts[cell.last] == cell.toasts:
            sequence = _sequence(cell, state)
            makespan_s = simulate(cell, sequence).makespan_s
            return Optimum(makespan_s, sequence, True, makespan_s, expanded)
        if expanded >= max_expanded:
            break
        expanded += 1
        for successor in search.successors(state):
            if _enters(fronts.setdefault((successor.counts, successor.robot), []), _times(successor)):
                serial -= 1
                heapq.heappush(heap, (successor.now + search.bound(successor), serial, successor))
    fallback = fifo(cell)
    return Optimum(fallback.makespan_s, fallback.sequence, False, bound / TICKS_PER_S, expanded)


class _Search:
    """The cell in whole ticks, the moves from a state, and the bound."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self.empty = [ticks(row) for row in cell.empty_s.tolist()]
        self.loaded = [ticks(row) for row in cell.loaded_s.tolist()]
        self.processing = [round(station.processing_s * TICKS_PER_S) for station in cell.stations]
        self.is_machine = [station.kind == "machine" for station in cell.stations]
        self.origins = [place for place, ahead in enumerate(cell.ahead) if ahead is not None]
        self.work = RobotWork(cell)
        for place in range(len(cell.stations)):
            self.empty[place][place] = 0
        counts = tuple(cell.counts(cell.start_locations()))
        self.start = _State(0, counts, cell.index(cell.robot_start), ((),) * len(counts))

    def bound(self, state: _State) -> int:
        """Ticks that the robot still needs at least."""
        return self.work.left(state.counts, state.robot)

    def successors(self, state: _State) -> Iterator[_State]:
        """The states after each possible move: one a station, since its toasts are alike."""
        for origin in self.origins:
            target = self.cell.target(state.counts, origin) if state.counts[origin] else None
            if target is None:
                continue
            finish = list(state.finish)
            now = state.now + self.empty[state.robot][origin]
            if self.is_machine[origin]:
                now = max(now, finish[origin][0])
                finish[origin] = finish[origin][1:]
            now += self.loaded[origin][target]
            if self.is_machine[target]:
                finish[target] = (*finish[target], now + self.processing[target])
            counts = list(state.counts)
            counts[origin] -= 1
            counts[target] += 1
            # A toast that finished earlier is ready now: forgetting since when lets more states be equal.
            ready = tuple(tuple(max(tick, now) for tick in ticks) if ticks else () for ticks in finish)
            yield _State(now, tuple(counts), target, ready, origin, state)


def _times(state: _State) -> tuple[int, ...]:
    """Now and all finishing times: of two states with equal counts and robot, one that is nowhere later is no worse."""
    return state.now, *(tick for ticks in state.finish for tick in ticks)


def _enters(front: list[tuple[int, ...]], times: tuple[int, ...]) -> bool:
    """Put `times` into the front unless one there is no later anywhere; those that it beats leave."""
    if any(all(map(le, other, times)) for other in front):
        return False
    front[:] = [other for other in front if not all(map(le, times, other))]
    front.append(times)
    return True


def _sequence(cell: Cell, state: _State) -> tuple[int, ...]:
    """The toasts moved on the way to `state`, each station first in, first out."""
    moves: list[tuple[int, int]] = []
    while state.parent is not None:
        moves.append((state.left, state.robot))
        state = state.parent
    queues: list[deque[int]] = [deque() for _ in cell.stations]
    queues[cell.first].extend(range(1, cell.toasts + 1))
    sequence = []
    for origin, target in reversed(moves):
        toast = queues[origin].popleft()
        queues[target].append(toast)
        sequence.append(toast)
    return tuple(sequence)
