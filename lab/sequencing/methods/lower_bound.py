"""Lower bounds of the time that a cell still needs, and the highest of them: the robot's work, each machine, each part alone,
and parts that still arrive."""

from collections.abc import Iterator, Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import from_the_ends
from lab.sequencing.cell.ways import FAR, TICKS_PER_S, Way, distances, empty_ticks, follows, ticks, ways_of
from lab.sequencing.simulate.merged import MergedCell, MergedState

SMALL = 1e-3  # the weight of other states beside the start in the linear program's objective


class RobotWork:
    """A lower bound of the robot's remaining work without waiting [ticks]: the sum of rest[p] over parts in position p, + here.

    rest: by position. here: by the robot's station. The bound is never below 0.
    Every pick has a price and every drop a credit, such that no drive from a drop to a pick takes less than price - credit. So
    the prices of all picks minus the credits of all drops but the last bound the empty travel. The best credits for the cell's
    start come from a linear program; the prices then follow exactly, in whole ticks.
    Source: duality of the assignment of picks to drops, as the bound of the travelling salesman's problem.
    """

    def __init__(self, cell: Cell) -> None:
        ways = ways_of(cell)
        gaps = _gaps(cell, ways)
        credits = _credits(cell, ways, gaps)
        prices: dict[int, int] = {}
        for (station, number), gap in gaps.items():
            price = gap + credits[station]
            prices[number] = min(price, prices.get(number, price))
        carried = {
            number: prices[number] + way.work - credits[way.option.target]
            for number, way in enumerate(ways)
            if number in prices
        }
        ends = [place.station for place in cell.positions if not place.options]
        last = min(credits[station] for station in ends)
        used = {station for station, _ in gaps}
        self.rest = least_rest(cell, ways, carried)
        self.here = [last - credit if station in used else 0 for station, credit in enumerate(credits)]


def least_rest(cell: Cell, ways: Sequence[Way], carried: dict[int, int]) -> list[int]:
    """The least sum of `carried` along any path from each position to an end; options that it does not name are never taken.

    Where no end can be reached it is 0.
    """
    own: list[list[int]] = [[] for _ in cell.positions]
    for number, way in enumerate(ways):
        own[way.place].append(number)

    def least(place: int, ahead: list[int | None]) -> int | None:
        known = [(carried[n], after) for n, after in zip(own[place], ahead, strict=True) if n in carried]
        return min([here + after for here, after in known if after is not None], default=None) if own[place] else 0

    return [value or 0 for value in from_the_ends(cell.positions, least)]


def _gaps(cell: Cell, ways: Sequence[Way]) -> dict[tuple[int, int], int]:
    """By station and option number, the least ticks from a drop there to the pick of the option; missing: it never follows."""
    empty, begin = empty_ticks(cell), cell.index(cell.robot_start)
    gaps: dict[tuple[int, int], int] = {}
    for number, way in enumerate(ways):
        follow = [(begin, 0)] if way.place in cell.begin_at else []
        follow += [(done.option.target, wait) for done in ways for wait in _waits(cell, done, way)]
        for station, wait in follow:
            gap = max(wait, empty[station][way.option.origin])
            gaps[station, number] = min(gap, gaps.get((station, number), gap))
    return gaps


def _waits(cell: Cell, done: Way, way: Way) -> Iterator[int]:
    """The robot's least waits when `way` follows `done`, with the same part and with another; empty: it never follows."""
    if follows(cell, done, way, same=True):
        process_s = cell.positions[way.place].processing_s or 0.0
        yield round(process_s * TICKS_PER_S) if way.option.waits else 0
    if len(cell.unfinished) > 1 and follows(cell, done, way, same=False):
        yield 0


def _credits(cell: Cell, ways: Sequence[Way], gaps: dict[tuple[int, int], int]) -> list[int]:
    """The credit of a drop at each station [ticks]. Any credits give a valid bound; these give the best one at the start.

    Variables [s]: a credit per station, a price per option, the rest per position, and the least credit of an end. Small weights
    for the other states choose, among equally good credits, those that bound these states best.
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
    np.add.at(gain, [rest + start for start in cell.begin_at if cell.positions[start].options], 1.0)
    gain[last], gain[begin] = 1.0, -1.0
    limit_s = cell.longest_s + 1.0
    fixed = {begin, *(rest + end for end in ends)}
    bounds = [(0.0, 0.0) if number in fixed else (-limit_s, limit_s) for number in range(last + 1)]
    entries = [(number, column, sign) for number, (row, _) in enumerate(rows) for column, sign in row.items()]
    at = tuple(np.array(part) for part in zip(*entries, strict=True))
    table = scipy.sparse.coo_array((at[2].astype(float), (at[0], at[1])), shape=(len(rows), last + 1)).tocsr()
    solution = scipy.optimize.linprog(-gain, A_ub=table, b_ub=[most for _, most in rows], bounds=bounds, method="highs")
    if solution.x is None:
        return [0] * size
    return [round(float(credit) * TICKS_PER_S) for credit in solution.x[:size]]


# ---- The highest of all bounds ----------------------------------------------------------------------------------------


NEVER = -(1 << 61)
Spans = tuple[tuple[int, int], ...]


class Term(NamedTuple):
    """A bound that shrinks as time passes: `plus` + the minimum over `ways` for one of the waits in a slot.

    ways: pairs (stay, after) in ticks: the path takes at least `stay` from now, and at least `after` from the end of the wait.
    """

    slot: int
    which: int  # the index of the wait: 0 the first that ends, -1 the last
    ways: Spans
    plus: int


class Least(NamedTuple):
    """The bounds of all states with the same counts, in ticks; latest: a moment before which no such state can end."""

    rest: int
    here: Sequence[int]
    fixed: int
    terms: tuple[Term, ...]
    latest: int

    def left(self, now: int, robot: int, waits: Sequence[Sequence[int]]) -> int:
        """The least ticks until the end; waits: as in `merged.MergedState`."""
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
        """The least ticks until the end of a state; FAR when a part can no longer be picked in time."""
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
    """Whether some path brings parts to a station and takes room there."""
    return any(station in cell.positions[way.option.to].holds for way in ways_of(cell) if way.option.target == station)


class _Spans:
    """The least time [ticks] of one part alone from each position until it leaves a station (None: until its end).

    ways: by position, pairs (stay, after) as in `Term` for a part that is still processed. least: for a part that is ready.
    entered: from its drop in the position, processing included.
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
        """The pairs (stay, after) of a position, from those of the positions ahead."""
        own = zip(self._own[place], ahead, strict=True)
        return tuple(dict.fromkeys(span for way, then in own for span in self._through(way, then))) or ((0, 0),)

    def _through(self, way: Way, then: Spans) -> Iterator[tuple[int, int]]:
        """The pairs (stay, after) of paths that begin with an option; then: the pairs of the position that it leads to."""
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
    """The least time that a station of capacity 1 still needs for the parts to come, one after the other, in ticks."""

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
        """The least ticks for the parts to come and for what follows the last one; a part inside is not counted."""
        rest = sum(count * each for count, each in zip(counts, self._rest, strict=True))
        if inside:
            return rest + self._last
        return max(0, rest - self._first + self._last) if rest else 0


def _after_arrival(cell: Cell, to_end: _Spans) -> list[int]:
    """By number of parts fetched, the least ticks from the next arrival to the last end; where parts arrive by the clock, the
    earliest moment of that end."""
    if cell.arrivals is None or not cell.coming:
        return []
    intervals = ticks([cell.arrivals.interval_s[part - 1] for part in cell.coming])
    alone = [min(after for _, after in to_end.ways[cell.starts[part - 1]]) for part in cell.coming]
    after, times = 0, list[int]()
    for interval, least in zip([*intervals[1:], 0][::-1], alone[::-1], strict=True):
        after = max(least, interval + after)
        times.insert(0, after)
    if cell.arrivals.after == "clock":
        return [come + least for come, least in zip(accumulate(intervals), times, strict=True)]
    return times
