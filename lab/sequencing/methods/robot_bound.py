"""A lower bound of the time that a cell still needs: what the robot has to do, if it never waited for long.

It is one sum over the parts, so a state costs little: the prices of the moves are found once, by a linear program.
"""

from collections.abc import Iterator, Sequence
from graphlib import TopologicalSorter
from math import isnan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.sparse import coo_array

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option, Position

# Times are compared as whole nanoseconds: equal states then compare equal, whatever the order of additions was.
TICKS_PER_S = 1e9
FAR = 1 << 61  # two of it still fit an int64
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


def backwards(positions: Sequence[Position]) -> list[int]:
    """The positions, each after all that its options lead to."""
    ahead = {number: [option.to for option in place.options] for number, place in enumerate(positions)}
    return list(TopologicalSorter(ahead).static_order())


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


def distances(cell: Cell, per_s: float = TICKS_PER_S) -> list[list[int]]:
    """The least time in which the robot gets from a station (row) to another, empty or loaded, by any way.

    In units, of which a second has `per_s`; FAR where it never gets.
    """
    seconds = np.fmin(cell.empty_s, cell.loaded_s)
    table = np.where(np.isnan(seconds), FAR, np.rint(seconds * per_s)).astype(np.int64)
    np.fill_diagonal(table, 0)
    for via in range(len(table)):
        table = np.minimum(table, np.minimum(table[:, via : via + 1] + table[via], FAR))
    found: list[list[int]] = table.tolist()
    return found
