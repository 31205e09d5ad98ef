"""Lower bounds of the time that a cell still needs: what the robot has to do, what each machine has, what still arrives.

Each is one sum over the parts, so a state costs little: the prices of the moves are found once, by a linear program.
"""

from collections.abc import Iterator, Mapping, Sequence
from graphlib import TopologicalSorter
from itertools import accumulate
from math import isnan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.sparse import coo_array

from lab.sequencing.cell import Cell
from lab.sequencing.positions import Option, Position

# Times are compared as whole nanoseconds: equal states then compare equal, whatever the order of additions was.
TICKS_PER_S = 1e9
NEVER = -(1 << 61)
SMALL = 1e-3  # a gain beside that of the start


def ticks(row: Sequence[float]) -> list[int]:
    """Seconds to ticks; -1 for NaN, a move that is never made."""
    return [-1 if isnan(seconds) else round(seconds * TICKS_PER_S) for seconds in row]


class Way(NamedTuple):
    """An option and the position (index) that it leaves; `work`: the robot's service and carrying [ticks]."""

    place: int
    option: Option
    work: int


def ways_of(cell: Cell) -> list[Way]:
    """Every option of every position, in their order."""
    loaded = [ticks(row) for row in cell.loaded_s.tolist()]
    return [
        Way(place, option, round(option.service_s * TICKS_PER_S) + loaded[option.origin][option.target])
        for place, at in enumerate(cell.positions)
        for option in at.options
    ]


class RobotWork:
    """What the robot still has to do at least, from the parts that stand in each position; in ticks.

    Every pick has a price, every drop a credit, such that no way from a drop to a pick takes less than price - credit:
    added up, the credits of all drops but the last and the prices of all picks bound the empty travel. The best
    credits for the cell's start come from a linear program; the prices then follow exactly, in whole ticks.
    Source: duality of the assignment of picks to drops, as the bound of the travelling salesman's problem.
    """

    def __init__(self, cell: Cell) -> None:
        ways = ways_of(cell)
        gaps = _gaps(cell, ways)
        credits = _credits(cell, ways, gaps)
        prices: dict[int, int] = {}
        for (station, number), gap in gaps.items():
            prices[number] = min(prices.get(number, gap + credits[station]), gap + credits[station])
        carried = {
            number: prices[number] + way.work - credits[way.option.target]
            for number, way in enumerate(ways)
            if number in prices
        }
        ends = [place.station for place in cell.positions if not place.options]
        last = min(credits[station] for station in ends)
        self.rest = least_rest(cell, ways, carried)
        self.here = [last - credit for credit in credits]

    def left(self, counts: Sequence[int], robot: int) -> int:
        """Ticks that the robot still needs at least, if it never waited; counts of parts by position, robot's station."""
        return max(0, self.here[robot] + sum(count * rest for count, rest in zip(counts, self.rest, strict=True)))

    def least_s(self, counts: Sequence[int], robot: int) -> float:
        """The same in seconds."""
        return self.left(counts, robot) / TICKS_PER_S


def least_rest(cell: Cell, ways: Sequence[Way], carried: dict[int, int]) -> list[int]:
    """The least sum of `carried` from each position to an end; ways that it does not name are never taken.

    Where no end can be reached it is 0: such a state has no time still to come.
    """
    rest: list[int | None] = [None] * len(cell.positions)
    own: list[list[int]] = [[] for _ in cell.positions]
    for number, way in enumerate(ways):
        own[way.place].append(number)
    for place in backwards(cell.positions):
        if not own[place]:
            rest[place] = 0
        known = ((carried[number], rest[ways[number].option.to]) for number in own[place] if number in carried)
        sums = [here + after for here, after in known if after is not None]
        rest[place] = min(sums, default=rest[place])
    return [value or 0 for value in rest]


def backwards(positions: Sequence[Position]) -> Iterator[int]:
    """The positions, each after all that its options lead to."""
    return TopologicalSorter({n: [o.to for o in place.options] for n, place in enumerate(positions)}).static_order()


def _gaps(cell: Cell, ways: Sequence[Way]) -> dict[tuple[int, int], int]:
    """Least ticks from a drop at a station to where the pick of a way (by number) can begin; none: it never follows."""
    empty = [ticks(row) for row in cell.empty_s.tolist()]
    for place in range(len(empty)):
        empty[place][place] = 0
    begin = cell.index(cell.robot_start)
    gaps: dict[tuple[int, int], int] = {}
    for number, way in enumerate(ways):
        follow = [(begin, 0)] if way.place in cell.starts else []
        follow += [(done.option.target, wait) for done in ways for wait in _waits(cell, done, way)]
        for station, wait in follow:
            gap = max(wait, empty[station][way.option.origin])
            gaps[station, number] = min(gap, gaps.get((station, number), gap))
    return gaps


def follows(cell: Cell, done: Way, way: Way, same: bool) -> bool:
    """Whether `way` may be the next move after `done`: of the same part, or of another one."""
    if done.option.if_full is not None and done.option.if_full in way.option.needs:
        return False  # it is full still
    if same:
        return done.option.to == way.place
    left, there = cell.positions[done.place], cell.positions[done.option.to]
    full = {station for station in there.holds if cell.capacities[station] == 1}
    gone = {station for station in left.holds if cell.capacities[station] == 1 and station not in there.holds}
    standing = set(cell.positions[way.place].holds)
    return not (full & (standing | set(way.option.needs)) or gone & standing or way.option.if_full in gone)


def _waits(cell: Cell, done: Way, way: Way) -> Iterator[int]:
    """How long the robot waits at least when `way` follows `done`, with the same part and with another; none: never."""
    if follows(cell, done, way, same=True):
        process_s = cell.positions[way.place].processing_s or 0.0
        yield round(process_s * TICKS_PER_S) if way.option.waits else 0
    if cell.parts > 1 and follows(cell, done, way, same=False):
        yield 0


def _credits(cell: Cell, ways: Sequence[Way], gaps: dict[tuple[int, int], int]) -> list[int]:
    """The credit of a drop at each station [ticks]. Any are right; these are the best for the cell's start.

    Variables [s]: a credit per station, a price per way, the rest per position, and the least credit of an end. Of
    equally good ones those are taken that bound other states best: hence the small gains.
    """
    size, begin = len(cell.stations), cell.index(cell.robot_start)
    price, rest = size, size + len(ways)
    last = rest + len(cell.positions)
    rows: list[tuple[dict[int, int], float]] = [
        ({price + number: 1, station: -1}, gap / TICKS_PER_S) for (station, number), gap in gaps.items()
    ]
    for number, way in enumerate(ways):
        row = {rest + way.place: 1, price + number: -1, way.option.target: 1, rest + way.option.to: -1}
        rows.append((row, way.work / TICKS_PER_S))
    ends = [number for number, place in enumerate(cell.positions) if not place.options]
    rows += [({last: 1, cell.positions[end].station: -1}, 0.0) for end in ends]
    gain: NDArray[np.float64] = np.zeros(last + 1)
    gain[:size], gain[rest:last] = -SMALL, SMALL
    np.add.at(gain, [rest + start for start in cell.starts], 1.0)
    gain[last], gain[begin] = 1.0, -1.0
    limit_s = cell.longest_s + 1.0
    fixed = {begin, *(rest + end for end in ends)}
    bounds = [(0.0, 0.0) if number in fixed else (-limit_s, limit_s) for number in range(last + 1)]
    entries = [(number, column, sign) for number, (row, _) in enumerate(rows) for column, sign in row.items()]
    at = tuple(np.array(part) for part in zip(*entries, strict=True))
    table = coo_array((at[2].astype(float), (at[0], at[1])), shape=(len(rows), last + 1)).tocsr()
    found = linprog(-gain, A_ub=table, b_ub=[most for _, most in rows], bounds=bounds, method="highs")
    if found.x is None:
        return [0] * size
    return [round(float(credit) * TICKS_PER_S) for credit in found.x[:size]]


class Term(NamedTuple):
    """A bound that shrinks as time passes: `plus`, + the least of `ways` for what is waited for longest in a slot.

    ways: (stay, after) ticks: all takes `stay` at least, and `after` from when the waiting ends.
    """

    slot: int
    which: int  # 0 the first that is waited for, -1 the last
    ways: tuple[tuple[int, int], ...]
    plus: int


class Least(NamedTuple):
    """What bounds the time left while the counts stay as they are, in ticks; `latest`: no end before that moment."""

    rest: int
    here: Sequence[int]
    fixed: int
    terms: tuple[Term, ...]
    latest: int

    def left(self, now: int, robot: int, waits: Sequence[Sequence[int]]) -> int:
        """Ticks still needed at least; waits: by slot, until when (see `exact.State`)."""
        most = max(self.fixed, self.rest + self.here[robot], self.latest - now)
        for slot, which, ways, plus in self.terms:
            wait = waits[slot][which] - now
            most = max(most, plus + min([max(stay, wait + after) for stay, after in ways]))
        return most


class LeastLeft:
    """The highest of all bounds: the robot's work, each part alone, each machine with room for one, and what arrives.

    slots: by position, where its waiting times are; `arriving`: the slot of the next arrival (None: not waited for so).
    """

    def __init__(self, cell: Cell, slots: Mapping[int, int], arriving: int | None) -> None:
        self._cell, self._slots, self._arriving = cell, slots, arriving
        self._robot = RobotWork(cell)
        self._to_end = _Spans(cell, None)
        used = sorted({station for place in cell.positions for station in place.holds})
        single = [s for s in used if cell.capacities[s] == 1 and cell.stations[s].kind == "machine"]
        self._machines = [_MachineWork(cell, station, self._to_end) for station in single]
        self._after_arrival = _after_arrival(cell, self._to_end)

    def of(self, counts: Sequence[int]) -> Least:
        """The bounds for counts of parts by position."""
        cell = self._cell
        there = [place for place, count in enumerate(counts) if count]
        fixed = max(self._to_end.least[place] for place in there)
        terms = [
            Term(self._slots[place], -1, self._to_end.ways[place], 0)
            for place in there
            if place in self._slots and cell.capacities[cell.positions[place].holds[0]] > 1
        ]
        for machine in self._machines:
            inside = next((place for place in there if machine.station in cell.positions[place].holds), None)
            more = machine.plus(counts, inside is not None)
            if inside is None:
                fixed = max(fixed, more)
            elif inside in self._slots:
                terms.append(Term(self._slots[inside], -1, machine.spans.ways[inside], more))
            else:
                fixed = max(fixed, more + machine.spans.least[inside])
        rest = sum(count * each for count, each in zip(counts, self._robot.rest, strict=True))
        waiting, latest = sum(counts[place] for place in set(cell.starts)), 0
        if waiting and cell.arrivals is not None:
            after = self._after_arrival[cell.parts - waiting]
            if self._arriving is None:
                latest = after
            else:
                terms.append(Term(self._arriving, 0, ((0, after),), 0))
        return Least(rest, self._robot.here, fixed, tuple(terms), latest)


class _Spans:
    """The least time of one part alone from each position on, until it leaves a station (None: until its end).

    ways: (stay, after) as in `Term`, of a part that is still processed. least: of one that is ready.
    """

    def __init__(self, cell: Cell, station: int | None) -> None:
        self.ways: list[tuple[tuple[int, int], ...]] = [((0, 0),)] * len(cell.positions)
        self.entered = [0] * len(cell.positions)  # the least from the drop on, processing and all
        self._cell, self._station, self._ways = cell, station, ways_of(cell)
        self._own: list[list[Way]] = [[] for _ in cell.positions]
        for way in self._ways:
            self._own[way.place].append(way)
        self._distance = distances(cell)
        for place in backwards(cell.positions):
            found = [span for way in self._own[place] for span in self._through(way)]
            self.ways[place] = tuple(dict.fromkeys(found)) or ((0, 0),)
            self.entered[place] = self._after_drop(place, 0)
        self.least = [min(stay for stay, _ in ways) for ways in self.ways]

    def _through(self, way: Way) -> Iterator[tuple[int, int]]:
        """The spans that begin with a way."""
        option, work = way.option, way.work
        here, there = self._cell.positions[way.place], self._cell.positions[option.to]
        if self._station in here.holds and self._station not in there.holds:
            yield work, work if option.waits else NEVER
            return
        approach = self._distance[option.target][there.station] if there.options else 0
        if there.processing_s is None and not option.waits:
            for stay, after in self.ways[option.to]:
                yield work + approach + stay, after
        else:
            all_of_it = work + self._after_drop(option.to, approach)
            yield all_of_it, all_of_it if option.waits else NEVER

    def _after_drop(self, place: int, approach: int) -> int:
        process = round((self._cell.positions[place].processing_s or 0.0) * TICKS_PER_S)
        return min(max(approach + stay, process + after) for stay, after in self.ways[place])


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
        entering = {way for way in into}
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
    if cell.arrivals is None:
        return []
    intervals = ticks(cell.arrivals.interval_s)
    alone = [min(after for _, after in to_end.ways[start]) for start in cell.starts]
    after, found = 0, list[int]()
    for interval, least in zip([*intervals[1:], 0][::-1], alone[::-1], strict=True):
        after = max(least, interval + after)
        found.insert(0, after)
    if cell.arrivals.after == "clock":
        return [come + least for come, least in zip(accumulate(intervals), found, strict=True)]
    return found


def distances(cell: Cell, unit_s: float = 1.0 / TICKS_PER_S) -> list[list[int]]:
    """The least time in which the robot may get from a station (row) to another, empty or loaded, by any way, in units."""
    seconds = np.fmin(cell.empty_s, cell.loaded_s)
    table = np.where(np.isnan(seconds), -NEVER, np.rint(seconds / unit_s)).astype(np.int64)
    np.fill_diagonal(table, 0)
    for via in range(len(table)):
        table = np.minimum(table, np.minimum(table[:, via : via + 1] + table[via], -NEVER))
    found: list[list[int]] = table.tolist()
    return found
