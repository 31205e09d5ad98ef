"""The proven shortest makespan of a job shop with one transport robot, by a beam search, a layer per move, that is widened until
it is exact.

For cells of one robot whose parts have one route each, through machines with one server each and room for all (the instances of
Bilge and Ulusoy with one vehicle); `why_not` says what else a cell has.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN
from lab.sequencing.cell.routes import SERVER, Option, entry
from lab.sequencing.cell.ways import FAR, distances
from lab.sequencing.methods import deferred
from lab.sequencing.methods.cp_sat_times import Times
from lab.sequencing.methods.shared import Shared
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run

TIME_LIMIT_S = 60.0
FIRST_WIDTH = (
    1000  # states kept in a layer, those of least bound; ten times as many after each pass that proved nothing
)
MOST_WIDTH = 3_000_000  # a gigabyte for ten parts
MOST_RESTS = 20_000_000  # entries of the table of bounds, 8 bytes each


@dataclass(frozen=True)
class OneRobot:
    """The best sequence found and the lower bound of all: equal when `proven`. rounded_s: as in `CpSatResult`. states: how many
    were kept."""

    cost: float
    sequence: tuple[int, ...]
    bound: float
    states: int
    wall_s: float
    rounded_s: float

    @property
    def proven(self) -> bool:
        """Whether no sequence is shorter."""
        return self.cost <= self.bound


def why_not(cell: Cell) -> str:
    """The features of the cell that this search does not support, in words; empty when it supports the cell."""
    reasons = {
        "it needs one robot": len(cell.robots) != 1,
        "parts that arrive": cell.arrivals is not None,
        "parts that begin in the middle": cell.begins is not None,
        "time windows": cell.has_windows,
        "setups": any(station.setups for station in cell.stations),
        "machines with several servers": any((station.servers or 1) > 1 for station in cell.stations),
        "machines with batches": bool(cell.batches),
        "alternatives": cell.most_choices > 1 or any(len(place.options) > 1 for place in cell.positions),
        "pallets": any(way.carries == "pallet" for place in cell.positions for way in place.options),
        "room that may be full": _may_be_full(cell),
    }
    reason_found = next((reason for reason, holds in reasons.items() if holds), "")
    if reason_found or _sizes(cell) <= MOST_RESTS:
        return reason_found
    return (
        f"too many states: the order has {_sizes(cell)} combinations of how far each part is, allowed are {MOST_RESTS}"
    )


def one_robot(cell: Cell, time_limit_s: float = TIME_LIMIT_S, shared: Shared | None = None) -> OneRobot:
    """The shortest makespan with its proof; when the time limit [s] or memory runs out, the best sequence found and a bound.

    The first pass, of about a second, is always completed; the first use compiles, which takes half a minute. After each pass
    `shared` receives its order and its bound, and may end the search (see `Shared.look`).
    Raises BadInput for a cell that it does not support (`why_not`). Source: dynamic programming of job shops with bounding,
    Gromicho et al. 2012, as a beam search that is widened until no state left out can be better; bounds by `one_robot_kernels`.
    """
    reason = why_not(cell)
    if reason:
        raise BadInput(f"search of one robot's tours: not for {reason}")
    begin, times = perf_counter(), Times(cell, shortest=0)
    shared = Shared(cell, MAKESPAN) if shared is None else shared
    search = _SequenceSearch(cell, times)
    width, states = FIRST_WIDTH, 0
    while True:
        passed, kept = search.widen(width, begin + time_limit_s, shared.look)
        states += kept
        shared.tell("search of tours", search.sequence)
        shared.tell("search of tours", bound=min(search.low / times.per_s, shared.cost))
        if search.low >= search.best or not passed or width >= MOST_WIDTH:
            break
        width *= 10
    cost = simulate(cell, search.sequence).makespan_s
    bound = cost if search.low >= search.best else search.low / times.per_s
    shared.tell("search of tours", bound=min(bound, cost))
    return OneRobot(cost, search.sequence, min(bound, cost), states, perf_counter() - begin, times.rounded_s)


class _SequenceSearch:
    """The best value and sequence so far, and the bound, in the units of `times`."""

    def __init__(self, cell: Cell, times: Times) -> None:
        kernels = deferred.one_robot_kernels
        self._kernels, self._cell = kernels, cell
        self._work = _work_of(cell, times)
        self._rest = kernels.least_rest(self._work)
        self._start = cell.index(cell.robot_start)
        self.best, self.low, self.sequence = kernels.FAR, 0, tuple[int, ...]()

    def widen(self, width: int, until_s: float, look: Callable[[], None]) -> tuple[bool, int]:
        """Whether one pass with at most `width` states in a layer was completed, and how many states it kept.

        look: called at each layer, to report and to check limits.
        """
        kernels, work, parts = self._kernels, self._work, len(self._work.counts)
        none, zero = np.full(1, -1, np.int64), np.zeros(1, np.int64)
        layer = kernels.SearchLayer(zero, none, zero, work.ready.reshape(1, parts), zero, np.zeros((1, 3), np.int64))
        made, cut, states = list[NDArray[np.int64]](), kernels.FAR, 0
        for _ in range(int(work.counts.sum())):
            look()
            if self.sequence and perf_counter() > until_s:
                return False, states
            layer = kernels.SearchLayer(*kernels.expand(work, self._rest, layer, self._start, self.best))
            order = np.lexsort((layer.ready.sum(1), layer.now, layer.last, layer.code))
            kept = order[kernels.needed(work, layer, order)]
            if len(kept) > width:
                rank = np.lexsort((layer.now[kept], layer.bound[kept]))
                cut = min(cut, int(layer.bound[kept[rank[width]]]))
                kept = kept[rank[:width]]
            layer = kernels.SearchLayer(*(array[kept] for array in layer))
            made.append(layer.made)
            states += len(kept)
        if len(layer.code):
            ends = np.maximum(layer.ready.max(1), layer.now)
            self.best = int(ends.min())
            self.sequence = self._decisions(made, int(ends.argmin()))
        self.low = max(self.low, min(cut, self.best))
        return True, states

    def _decisions(self, made: Sequence[NDArray[np.int64]], number: int) -> tuple[int, ...]:
        """The decisions that lead to a state of the last layer: the robot's moves in order, the servers' by their queues."""
        moves = list[tuple[int, int]]()
        for layer in reversed(made):
            before, part, place = (int(value) for value in layer[number])
            moves.append((part, place))
            number = before
        kernels, work = self._kernels, self._work
        c, ready, last, now = np.zeros(len(work.counts), np.int64), work.ready.copy(), -1, 0
        ends = dict[tuple[int, int], int]()
        for part, place in reversed(moves):
            here = work.at[last, c[last]] if last >= 0 else self._start
            ends |= {(j, int(c[j])): int(ready[j]) for j in range(len(c))}
            drop = int(max(now + work.empty[here, work.at[part, c[part]]], ready[part]) + work.carry[part, c[part]])
            queue = kernels.queue_at(work, c, ready, part, drop)
            c[part] += 1
            begins = drop if place == 0 else ready[queue[place - 1]]
            kernels.put(work, c, ready, part, begins, queue[place:])
            last, now = part, drop
        ends |= {(j, int(c[j])): int(ready[j]) for j in range(len(c))}
        return self._listed([part for part, _ in reversed(moves)], ends)

    def _listed(self, tour: Sequence[int], ends: dict[tuple[int, int], int]) -> tuple[int, ...]:
        """The decisions of a robot's tour through parts, with those of the servers inserted in the order of their ends."""
        run, work, parts, sequence = Run(self._cell), self._work, self._cell.parts, list[int]()
        at = [0] * parts
        served = set[tuple[int, int]]()

        def decide(part: int) -> None:
            sequence.append(entry(part + 1, 0, parts))
            run.move(sequence[-1])

        def when(part: int) -> tuple[int, int]:
            end = ends[part, at[part]]
            return end, end - int(work.process[part, at[part]])

        def serve(part: int) -> None:
            """Decides the work of a part's machine up to and including the part."""
            machine, own_s = work.at[part, at[part]], when(part)
            own = [j for j in range(parts) if at[j] and work.at[j, at[j]] == machine and when(j) <= own_s]
            for j in sorted(own, key=when):
                if _is_served(self._cell, run.locations[j]) and (j, at[j]) not in served:
                    served.add((j, at[j]))
                    decide(j)

        for part in tour:
            serve(part)
            decide(part)
            at[part] += 1
        for part in range(parts):
            serve(part)
        return tuple(sequence)


def _is_served(cell: Cell, place: int) -> bool:
    options = cell.positions[place].options
    return bool(options) and options[0].robot == SERVER


def _may_be_full(cell: Cell) -> bool:
    holding = [station for place in cell.positions for station in place.holds]
    return any(cell.capacities[station] < cell.parts for station in set(holding))


def _ways(cell: Cell, part: int) -> list[Option]:
    """The options along a part's only route."""
    place, options = cell.begin_at[part], list[Option]()
    while cell.positions[place].options:
        options.append(cell.positions[place].options[0])
        place = options[-1].to
    return options


def _sizes(cell: Cell) -> int:
    """The number of entries of the table of bounds."""
    size = cell.parts
    for part in range(cell.parts):
        size *= 1 + sum(way.robot != SERVER for way in _ways(cell, part))
    return size


def _work_of(cell: Cell, times: Times) -> "deferred.one_robot_kernels.CellWork":
    routes = [_ways(cell, part) for part in range(cell.parts)]
    counts = np.array([sum(way.robot != SERVER for way in route) for route in routes], np.int64)
    shape = cell.parts, int(counts.max()) + 1
    at, process, carry, tail = (np.zeros(shape, np.int64) for _ in range(4))
    stations, queues = range(len(cell.stations)), np.zeros(len(cell.stations), np.bool_)
    for part, route in enumerate(routes):
        n = 0
        at[part, 0] = cell.positions[cell.begin_at[part]].station
        for way in route:
            if way.robot == SERVER:
                queues[way.target] = True
            else:
                carry[part, n] = times.work(way)
                n += 1
                at[part, n] = way.target
            process[part, n] += times.processing(way.to)
        for k in range(n - 1, -1, -1):
            tail[part, k] = carry[part, k] + process[part, k + 1] + tail[part, k + 1]
    empty = np.array([[times.travel(a, b) if times.known(a, b) else FAR for b in stations] for a in stations], np.int64)
    least = np.array(distances(cell, times.per_s), np.int64)
    ready = np.array([times.whole(seconds) for seconds in cell.begin_s], np.int64)
    weight = np.cumprod(np.concatenate([[1], counts[:-1] + 1])).astype(np.int64)
    return deferred.one_robot_kernels.CellWork(counts, at, process, carry, empty, least, queues, ready, tail, weight)
