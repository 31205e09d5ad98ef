"""A run in which alike parts are one: what stands at each position, not who. The simulation that `srl_time` learns in."""

from bisect import insort
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, field

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import machine_places
from lab.sequencing.cell.routes import Option, entry
from lab.sequencing.methods.lower_bound import Least, LeastLeft
from lab.sequencing.methods.robot_bound import TICKS_PER_S, ticks
from lab.sequencing.simulate.run import Run

State = tuple[object, ...]
Action = tuple[int, int, int]  # position, choice, and the part where parts are told apart (else 0)


@dataclass(frozen=True)
class Layout:
    """What all runs of a cell share, in plain lists of ticks (nanoseconds)."""

    cell: Cell
    empty: list[list[int]]
    loaded: list[list[int]]
    process: list[int]  # by position
    intervals: list[int]  # before each part, where parts arrive
    machines: int
    starts: frozenset[int]
    worked: tuple[int, ...]  # positions in which something is processed, or goes on being processed
    timed: tuple[int, ...]  # these, and the starts where parts arrive
    bounds: LeastLeft
    known: dict[tuple[int, ...], Least] = field(default_factory=dict)

    @classmethod
    def of(cls, cell: Cell) -> "Layout":
        """The layout of a cell."""
        empty, loaded = ([ticks(row) for row in table.tolist()] for table in (cell.empty_s, cell.loaded_s))
        for place in range(len(empty)):
            empty[place][place] = 0
        starts = frozenset(cell.starts)
        process = [place.processing_s for place in cell.positions]
        worked = tuple(place for place, seconds in enumerate(process) if seconds is None or seconds > 0)
        timed = (*worked, *sorted(starts)) if cell.arrivals else worked
        one_by_one = cell.arrivals is not None and cell.arrivals.after == "pick"
        slots = {place: slot for slot, place in enumerate(worked)}
        bounds = LeastLeft(cell, slots, len(worked) if one_by_one else None)
        spans = [round((seconds or 0.0) * TICKS_PER_S) for seconds in process]
        intervals = ticks(cell.arrivals.interval_s) if cell.arrivals else []
        return cls(cell, empty, loaded, spans, intervals, machine_places(cell), starts, worked, timed, bounds)

    def least(self, counts: list[int]) -> Least:
        """The bounds for counts of parts by position, found once."""
        key = tuple(counts)
        if key not in self.known:
            self.known[key] = self.bounds.of(key)
        return self.known[key]


class Flow:
    """One pass through a cell, move by move. With `distinct` alike parts are told apart, as due times need it.

    queues: the (ready tick, part) pairs at each position, the one that may be picked first ahead. now, waited,
    processed: ticks. last_finished: the part that the last move brought to its end, else 0.
    """

    def __init__(self, layout: Layout, *, distinct: bool = False) -> None:
        cell = layout.cell
        self.layout, self.distinct = layout, distinct
        self.queues: list[list[tuple[int, int]]] = [[] for _ in cell.positions]
        self.counts = [0] * len(cell.positions)
        self.occupied = [0] * len(cell.stations)
        self.robot = cell.index(cell.robot_start)
        self.now = self.waited = self.processed = self.fetched = self.finished = self.last_finished = 0
        came = self._first_arrivals()
        for part, place in enumerate(cell.starts, 1):
            self.queues[place].append((came[part - 1], part))
            self.counts[place] += 1

    @classmethod
    def from_run(cls, layout: Layout, run: Run, *, distinct: bool = False) -> "Flow":
        """A pass that goes on, by the cell's own times, from where a run is."""
        flow = cls(layout, distinct=distinct)
        flow.queues = [[] for _ in layout.cell.positions]
        for part, (place, ready_s) in enumerate(zip(run.locations, run.ready_s, strict=True), 1):
            if layout.cell.positions[place].options:
                insort(flow.queues[place], (round(ready_s * TICKS_PER_S), part))
        for place in layout.starts if layout.cell.arrivals else ():
            flow.queues[place].sort(key=lambda entry: entry[1])
        flow.counts = [run.locations.count(place) for place in range(len(layout.cell.positions))]
        flow.occupied, flow.robot, flow.fetched = run.occupied.copy(), run.robot, run.fetched
        flow.now, flow.waited = round(run.now_s * TICKS_PER_S), round(run.waited_s * TICKS_PER_S)
        flow.processed = round(run.processed_s * TICKS_PER_S)
        flow.finished = sum(end_s is not None for end_s in run.finished_s)
        return flow

    @property
    def done(self) -> bool:
        """Whether every part is finished."""
        return self.finished == self.layout.cell.parts

    def actions(self) -> Iterator[Action]:
        """What may be done now: from which position, by which of its ways, and with which part where that matters."""
        cell = self.layout.cell
        for place, queue in enumerate(self.queues):
            if not queue or (place in self.layout.starts and not self._in_turn(queue)):
                continue
            for option in cell.positions[place].options:
                if self._enabled(option):
                    if not self.distinct:
                        yield place, option.choice, 0
                        continue
                    for _, part in queue[:1] if cell.arrivals and place in self.layout.starts else queue:
                        yield place, option.choice, part

    def take(self, action: Action) -> int:
        """Carry an allowed action out; the decision that it is (an entry of a sequence)."""
        place, choice, wanted = action
        layout, queue = self.layout, self.queues[place]
        positions = layout.cell.positions
        option = next(o for o in positions[place].options if o.choice == choice and self._enabled(o))
        here, there = positions[place], positions[option.to]
        ready, part = queue.pop(0) if not wanted else queue.pop([p for _, p in queue].index(wanted))
        reach = self.now + layout.empty[self.robot][option.origin]
        begin = max(reach, ready) if option.waits else reach
        pick = begin + round(option.service_s * TICKS_PER_S)
        drop = pick + layout.loaded[option.origin][option.target]
        if not here.holds:
            self._fetch(pick)
        for station in here.holds:
            self.occupied[station] -= 1
        for station in there.holds:
            self.occupied[station] += 1
        if there.processing_s is not None:
            process = layout.process[option.to]
            ready = drop + process
            self.processed += process
        self.counts[place] -= 1
        self.counts[option.to] += 1
        self.robot, self.now, self.waited = option.target, drop, self.waited + begin - reach
        self.last_finished = 0
        if there.options:
            insort(self.queues[option.to], (ready, part))
        else:
            self.finished += 1
            self.last_finished = part
        return entry(part, option.choice, layout.cell.parts)

    def state(self) -> State:
        """All that the future depends on, but not who is who: counts, robot, and how long there is still to wait."""
        now = self.now
        waits = tuple((place, at - now) for place in self.layout.timed for at, _ in self.queues[place] if at > now)
        if self.distinct:
            return (self.robot, now, waits, *(tuple(part for _, part in queue) for queue in self.queues))
        return (tuple(self.counts), self.robot, waits)

    def branch(self) -> "Flow":
        """Another pass that goes on from where this one is."""
        other = copy(self)
        other.queues = [queue.copy() for queue in self.queues]
        other.counts, other.occupied = self.counts.copy(), self.occupied.copy()
        return other

    def least_left(self) -> int:
        """Ticks that are still needed at least (see `lab.sequencing.methods.robot_bound`)."""
        now, layout = self.now, self.layout
        waits = [[max(at, now) for at, _ in self.queues[place]] for place in layout.worked]
        if layout.cell.arrivals is not None and self.fetched < layout.cell.parts:
            waits.append([self.queues[layout.cell.starts[self.fetched]][0][0]])
        return layout.least(self.counts).left(now, self.robot, waits)

    def _first_arrivals(self) -> list[int]:
        cell = self.layout.cell
        came = [0] * cell.parts
        if cell.arrivals is None:
            return came
        for part in range(1, cell.parts + 1) if cell.arrivals.after == "clock" else (1,):
            came[part - 1] = (came[part - 2] if part > 1 else 0) + self.layout.intervals[part - 1]
        return came

    def _fetch(self, pick: int) -> None:
        """The next part sets out, where parts are brought one at a time."""
        self.fetched += 1
        cell = self.layout.cell
        if cell.arrivals is None or cell.arrivals.after == "clock" or self.fetched == cell.parts:
            return
        part = self.fetched + 1
        queue = self.queues[cell.starts[part - 1]]
        queue[0] = (pick + self.layout.intervals[part - 1], part)

    def _in_turn(self, queue: list[tuple[int, int]]) -> bool:
        return self.layout.cell.arrivals is None or queue[0][1] == self.fetched + 1

    def _enabled(self, option: Option) -> bool:
        room, occupied = self.layout.cell.capacities, self.occupied
        if option.if_full is not None and occupied[option.if_full] < room[option.if_full]:
            return False
        return all(occupied[station] < room[station] for station in option.needs)
