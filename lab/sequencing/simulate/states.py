"""The decision states of a cell with alike parts merged, in ticks: what the exact search and its picture walk through."""

from collections import deque
from collections.abc import Iterator
from itertools import accumulate, chain
from typing import NamedTuple

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import entry
from lab.sequencing.methods.lower_bound import Least, LeastLeft
from lab.sequencing.methods.robot_bound import TICKS_PER_S, Way, ticks, ways_of

_BITS = 8  # a count in the code of all counts; MAX_PARTS fits
_LOW = (1 << _BITS) - 1


class State(NamedTuple):
    """Between two moves, in ticks: how many parts stand in each position, the robot's station, what is waited for.

    Which part stands where is left out: those of one product in one position are alike, and the first that came goes
    first. waits: by slot (see `Moves`), when each part there is finished, ascending, never before `now`.
    """

    now: int
    counts: int
    robot: int
    waits: tuple[tuple[int, ...], ...]
    way: Way | None = None
    parent: "State | None" = None


class Moves:
    """The cell in ticks, and the states that follow one another.

    slots: by position where something is waited for, where the state has it in `waits`; after these, where parts arrive
    one after the pick of the other, the slot of the next one.
    """

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self._empty = [ticks(row) for row in cell.empty_s.tolist()]
        for place in range(len(self._empty)):
            self._empty[place][place] = 0
        process = [place.processing_s for place in cell.positions]
        self._loaded = [ticks(row) for row in cell.loaded_s.tolist()]
        self._process = [None if seconds is None else round(seconds * TICKS_PER_S) for seconds in process]
        timed = [place for place, seconds in enumerate(process) if seconds is None or seconds > 0]
        self.slots = {place: slot for slot, place in enumerate(timed)}
        self._picked = len(timed) if cell.arrivals is not None and cell.arrivals.after == "pick" else None
        self._intervals = ticks(cell.arrivals.interval_s) if cell.arrivals is not None else []
        self._came = list(accumulate(self._intervals))
        self._starts = sorted(set(cell.starts))
        self._ways: list[list[Way]] = [[] for _ in cell.positions]
        for way in ways_of(cell):
            self._ways[way.place].append(way)
        self._least = LeastLeft(cell, self.slots, self._picked)
        self._known: dict[int, tuple[tuple[Way, ...], Least]] = {}

    def start(self) -> State:
        """Where all begins."""
        counts = sum(1 << _BITS * place for place in self.cell.starts)
        waits: tuple[tuple[int, ...], ...] = ((),) * len(self.slots)
        if self._picked is not None:
            waits = (*waits, (self._intervals[0],))
        return State(0, counts, self.cell.index(self.cell.robot_start), waits)

    def done(self, state: State) -> bool:
        """Whether all parts are finished."""
        return all(not self._ways[place] for place, count in enumerate(self.counted(state.counts)) if count)

    def left(self, state: State) -> int:
        """Ticks still needed at least."""
        return self._here(state.counts)[1].left(state.now, state.robot, state.waits)

    def successors(self, state: State) -> Iterator[State]:
        """The states after each possible move: one an option of a position, since its parts are alike."""
        for way in self._here(state.counts)[0]:
            yield self._after(state, way)

    def counted(self, counts: int) -> list[int]:
        """The parts in each position."""
        return [counts >> _BITS * place & _LOW for place in range(len(self._ways))]

    def _here(self, counts: int) -> tuple[tuple[Way, ...], Least]:
        """What depends on the counts only: the ways that may be taken, and the bounds."""
        known = self._known.get(counts)
        if known is None:
            counted = self.counted(counts)
            known = self._known[counts] = self._allowed(counted), self._least.of(counted)
        return known

    def _allowed(self, counted: list[int]) -> tuple[Way, ...]:
        cell = self.cell
        occupied = [0] * len(cell.stations)
        for count, place in zip(counted, cell.positions, strict=True):
            for station in place.holds:
                occupied[station] += count
        room = [occupied[station] < most for station, most in enumerate(cell.capacities)]
        waiting = sum(counted[place] for place in self._starts)
        in_turn = cell.starts[cell.parts - waiting] if waiting and cell.arrivals is not None else None
        return tuple(
            way
            for place, count in enumerate(counted)
            if count and (in_turn in (None, place) or place not in self._starts)
            for way in self._ways[place]
            if all(room[station] for station in way.option.needs)
            and (way.option.if_full is None or not room[way.option.if_full])
        )

    def _after(self, state: State, way: Way) -> State:
        place, option, work = way
        waits = list(state.waits)
        now = state.now + self._empty[state.robot][option.origin]
        ready = 0
        slot = self.slots.get(place)
        if slot is not None:
            ready, *others = waits[slot]
            waits[slot] = tuple(others)
        elif self._intervals and place in self._starts:
            ready = waits[self._picked][0] if self._picked is not None else self._came[self._fetched(state)]
        now = (max(now, ready) if option.waits else now) + work
        slot = self.slots.get(option.to)
        if slot is not None:
            process = self._process[option.to]
            waits[slot] = (*waits[slot], ready if process is None else now + process)
        if self._picked is not None and place in self._starts:
            pick, coming = now - self._loaded[option.origin][option.target], self._fetched(state) + 1
            waits[self._picked] = (pick + self._intervals[coming],) if coming < self.cell.parts else ()
        # A part that finished earlier is ready now: forgetting since when lets more states be equal.
        ready_at = tuple([tuple([max(tick, now) for tick in ticks]) if ticks else () for ticks in waits])
        counts = state.counts + (1 << _BITS * option.to) - (1 << _BITS * place)
        return State(now, counts, option.target, ready_at, way, state)

    def _fetched(self, state: State) -> int:
        """How many parts have left their first station."""
        return self.cell.parts - sum(state.counts >> _BITS * place & _LOW for place in self._starts)


def times_of(state: State) -> tuple[int, ...]:
    """Now and all that is waited for: of two states with equal counts and robot, one that is nowhere later is no worse."""
    return (state.now, *chain.from_iterable(state.waits))


def sequence_of(cell: Cell, state: State) -> tuple[int, ...]:
    """The decisions on the way to `state`, each position first in, first out."""
    taken: list[Way] = []
    while state.way is not None and state.parent is not None:
        taken.append(state.way)
        state = state.parent
    queues: list[deque[int]] = [deque() for _ in cell.positions]
    for part, start in enumerate(cell.starts, 1):
        queues[start].append(part)
    sequence = []
    for place, option, _ in reversed(taken):
        part = queues[place].popleft()
        queues[option.to].append(part)
        sequence.append(entry(part, option.choice, cell.parts))
    return tuple(sequence)
