"""A lower bound of the time that a cell still needs: what the robot has to do, if it never waited for long.

It is one sum over the parts, so a state costs little: the prices of the moves are found once, by a linear program.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import from_the_ends
from lab.sequencing.cell.ways import TICKS_PER_S, Way, empty_ticks, follows, ways_of

SMALL = 1e-3  # a gain beside that of the start


class RobotWork:
    """What the robot still has to do at least, if it never waited, in ticks: rest[p] for each part in position p, + here.

    here: by the robot's station. Never below 0.
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


def least_rest(cell: Cell, ways: Sequence[Way], carried: dict[int, int]) -> list[int]:
    """The least sum of `carried` from each position to an end; ways that it does not name are never taken.

    Where no end can be reached it is 0: such a state has no time still to come.
    """
    own: list[list[int]] = [[] for _ in cell.positions]
    for number, way in enumerate(ways):
        own[way.place].append(number)

    def least(place: int, ahead: list[int | None]) -> int | None:
        known = [(carried[n], after) for n, after in zip(own[place], ahead, strict=True) if n in carried]
        return min([here + after for here, after in known if after is not None], default=None) if own[place] else 0

    return [value or 0 for value in from_the_ends(cell.positions, least)]


def _gaps(cell: Cell, ways: Sequence[Way]) -> dict[tuple[int, int], int]:
    """Least ticks from a drop at a station to where the pick of a way (by number) can begin; none: it never follows."""
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
    """How long the robot waits at least when `way` follows `done`, with the same part and with another; none: never."""
    if follows(cell, done, way, same=True):
        process_s = cell.positions[way.place].processing_s or 0.0
        yield round(process_s * TICKS_PER_S) if way.option.waits else 0
    if len(cell.unfinished) > 1 and follows(cell, done, way, same=False):
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
    np.add.at(gain, [rest + start for start in cell.begin_at if cell.positions[start].options], 1.0)
    gain[last], gain[begin] = 1.0, -1.0
    limit_s = cell.longest_s + 1.0
    fixed = {begin, *(rest + end for end in ends)}
    bounds = [(0.0, 0.0) if number in fixed else (-limit_s, limit_s) for number in range(last + 1)]
    entries = [(number, column, sign) for number, (row, _) in enumerate(rows) for column, sign in row.items()]
    at = tuple(np.array(part) for part in zip(*entries, strict=True))
    from scipy.optimize import linprog  # it takes a while to load, and few cells need it
    from scipy.sparse import coo_array

    table = coo_array((at[2].astype(float), (at[0], at[1])), shape=(len(rows), last + 1)).tocsr()
    found = linprog(-gain, A_ub=table, b_ub=[most for _, most in rows], bounds=bounds, method="highs")
    if found.x is None:
        return [0] * size
    return [round(float(credit) * TICKS_PER_S) for credit in found.x[:size]]
