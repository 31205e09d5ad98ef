"""The highest of the lower bounds of what a cell still needs: robot, machines, parts alone, and parts that still arrive."""

from collections.abc import Iterator, Sequence
from itertools import accumulate
from typing import NamedTuple

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import from_the_ends
from lab.sequencing.cell.ways import FAR, TICKS_PER_S, Way, distances, ticks, ways_of
from lab.sequencing.methods.robot_bound import RobotWork, least_rest
from lab.sequencing.simulate.merged import MergedCell, MergedState

NEVER = -(1 << 61)
Spans = tuple[tuple[int, int], ...]


class Term(NamedTuple):
    """A bound that shrinks as time passes: `plus`, + the least of `ways` for what is waited for longest in a slot.

    ways: (stay, after) ticks: all takes `stay` at least, and `after` from when the waiting ends.
    """

    slot: int
    which: int  # 0 the first that is waited for, -1 the last
    ways: Spans
    plus: int


class Least(NamedTuple):
    """What bounds the time left while the counts stay as they are, in ticks; `latest`: no end before that moment."""

    rest: int
    here: Sequence[int]
    fixed: int
    terms: tuple[Term, ...]
    latest: int

    def left(self, now: int, robot: int, waits: Sequence[Sequence[int]]) -> int:
        """Ticks still needed at least; waits: by slot, until when (see `merged.MergedState`)."""
        most = max(self.fixed, self.rest + self.here[robot], self.latest - now)
        for slot, which, ways, plus in self.terms:
            wait = waits[slot][which] - now
            most = max(most, plus + min([max(stay, wait + after) for stay, after in ways]))
        return most


class LowerBound:
    """The highest of all bounds: the robot's work, each part alone, each machine with room for one, and what arrives."""

    def __init__(self, merged: MergedCell) -> None:
        self._cell, self._merged, self._slots = merged.cell, merged, merged.slots
        self._known: dict[int, Least] = {}
        cell = merged.cell
        self._robot = RobotWork(cell)
        self._to_end = _Spans(cell, None)
        used = sorted({station for place in cell.positions for station in place.holds})
        single = [s for s in used if cell.capacities[s] == 1 and cell.stations[s].kind == "machine"]
        self._machines = [_MachineWork(cell, station, self._to_end) for station in single if _passed(cell, station)]
        self._after_arrival = _after_arrival(cell, self._to_end)

    def left(self, state: MergedState) -> int:
        """Ticks still needed at least; FAR when a part can no longer be fetched in time."""
        if self._merged.latest and self._merged.too_late(state):
            return FAR
        known = self._known.get(state.counts)
        if known is None:
            known = self._known[state.counts] = self._of(self._merged.counted(state.counts))
        return known.left(state.now, state.robot, state.waits)

    def _of(self, counts: Sequence[int]) -> Least:
        """The bounds for counts of parts by position."""
        cell = self._cell
        there = [place for place, count in enumerate(counts) if count]
        moving = [place for place in there if cell.positions[place].options]
        fixed = max(self._to_end.least[place] for place in there)
        terms = [
            Term(self._slots[place], -1, self._to_end.ways[place], 0)
            for place in there
            if place in self._slots and not any(cell.capacities[s] == 1 for s in cell.positions[place].holds[:1])
        ]
        for machine in self._machines:
            inside = next((place for place in moving if machine.station in cell.positions[place].holds), None)
            more = machine.plus(counts, inside is not None)
            if inside is None:
                fixed = max(fixed, more)
            elif inside in self._slots:
                terms.append(Term(self._slots[inside], -1, machine.spans.ways[inside], more))
            else:
                fixed = max(fixed, more + machine.spans.least[inside])
        rest = sum(count * each for count, each in zip(counts, self._robot.rest, strict=True))
        waiting, latest = sum(counts[place] for place in self._merged.starts), 0
        if waiting and cell.arrivals is not None:
            after = self._after_arrival[-waiting]
            if self._merged.one_by_one:
                terms.append(Term(len(self._slots), 0, ((0, after),), 0))
            else:
                latest = after
        return Least(rest, self._robot.here, fixed, tuple(terms), latest)


def _passed(cell: Cell, station: int) -> bool:
    """Whether a part can still be brought to a station, and on from there."""
    return any(station in cell.positions[way.option.to].holds for way in ways_of(cell) if way.option.target == station)


class _Spans:
    """The least time of one part alone from each position on, until it leaves a station (None: until its end).

    ways: (stay, after) as in `Term`, of a part that is still processed. least: of one that is ready. entered: from the
    drop on, processing and all.
    """

    def __init__(self, cell: Cell, station: int | None) -> None:
        self._cell, self._station, self._distance = cell, station, distances(cell)
        self._own: list[list[Way]] = [[] for _ in cell.positions]
        for way in ways_of(cell):
            self._own[way.place].append(way)
        self.ways = from_the_ends(cell.positions, self._spans)
        self.entered = [self._after_drop(place, 0, ways) for place, ways in enumerate(self.ways)]
        self.least = [min(stay for stay, _ in ways) for ways in self.ways]

    def _spans(self, place: int, ahead: list[Spans]) -> Spans:
        """All spans from a position on, by those of the positions ahead."""
        own = zip(self._own[place], ahead, strict=True)
        return tuple(dict.fromkeys(span for way, then in own for span in self._through(way, then))) or ((0, 0),)

    def _through(self, way: Way, then: Spans) -> Iterator[tuple[int, int]]:
        """The spans that begin with a way; then: those from where it leads."""
        option, work = way.option, way.work
        here, there = self._cell.positions[way.place], self._cell.positions[option.to]
        if self._station in here.holds and self._station not in there.holds:
            yield work, work if option.waits else NEVER
            return
        approach = self._distance[option.target][there.station] if there.options else 0
        if there.processing_s is None and not option.waits:
            for stay, after in then:
                yield work + approach + stay, after
        else:
            all_of_it = work + self._after_drop(option.to, approach, then)
            yield all_of_it, all_of_it if option.waits else NEVER

    def _after_drop(self, place: int, approach: int, ways: Spans) -> int:
        process = round((self._cell.positions[place].processing_s or 0.0) * TICKS_PER_S)
        return min(max(approach + stay, process + after) for stay, after in ways)


class _MachineWork:
    """What a station with room for one part still has to hold at least, one part after the other, in ticks."""

    def __init__(self, cell: Cell, station: int, to_end: _Spans) -> None:
        self.station, self.spans = station, _Spans(cell, station)
        ways, distance = ways_of(cell), distances(cell)
        holds = [station in place.holds for place in cell.positions]
        into = [way for way in ways if holds[way.option.to] and not holds[way.place]]
        out = [way for way in ways if holds[way.place] and not holds[way.option.to]]
        bring = min(way.work for way in into)
        change = min(distance[left.option.target][way.option.origin] + way.work for left in out for way in into)
        self._first = change - bring  # the first part saves it, when the station is empty
        self._last = min(to_end.entered[way.option.to] for way in out)
        entering = set(into)
        each = {
            number: change + self.spans.entered[way.option.to] if way in entering else 0
            for number, way in enumerate(ways)
        }
        self._rest = least_rest(cell, ways, each)

    def plus(self, counts: Sequence[int], inside: bool) -> int:
        """Ticks for those to come, and after the last one; the part inside comes on top of it."""
        rest = sum(count * each for count, each in zip(counts, self._rest, strict=True))
        if inside:
            return rest + self._last
        return max(0, rest - self._first + self._last) if rest else 0


def _after_arrival(cell: Cell, to_end: _Spans) -> list[int]:
    """By parts fetched: ticks from the next arrival to the last end, at least; with a clock: the moment of that end."""
    if cell.arrivals is None or not cell.coming:
        return []
    intervals = ticks([cell.arrivals.interval_s[part - 1] for part in cell.coming])
    alone = [min(after for _, after in to_end.ways[cell.starts[part - 1]]) for part in cell.coming]
    after, found = 0, list[int]()
    for interval, least in zip([*intervals[1:], 0][::-1], alone[::-1], strict=True):
        after = max(least, interval + after)
        found.insert(0, after)
    if cell.arrivals.after == "clock":
        return [come + least for come, least in zip(accumulate(intervals), found, strict=True)]
    return found
