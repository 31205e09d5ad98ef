"""What no cycle, of however many parts, is shorter than: the parts flow along their ways in shares, as a linear program."""

from collections import Counter
from collections.abc import Iterator, Sequence
from math import inf
from typing import Any

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import reached_from
from lab.sequencing.cell.ways import TICKS_PER_S, Way, follows, ways_of

NEAR_S = 1e-6  # what the program's solver may be wrong by
Column = dict[tuple[Any, ...], float]  # what one of a kind adds to each row, by the row's name
BUSY = (
    "busy"  # rows of what is busy for some time of a mix, at the most for all of it; other rows add up to what is given
)


def least_s(cell: Cell, mix: Sequence[str], away_s: Sequence[Sequence[float]]) -> float:
    """No order that repeats for ever needs less time for each mix, however many of them enter in a cycle [s].

    Over all cycles each way on from a position has a share of the parts. Each room of a station needs its time for these: to
    work, and until the next part is there. The robot needs its moves and the empty ways between them; each move has one after
    it and one before it. cell: with the times of its one robot (`at_speed`). away_s: see `Line.bound_s`.
    """
    from scipy.optimize import linprog
    from scipy.sparse import coo_array

    starts = Counter(cell.starts[cell.order.index(name)] for name in mix)
    within = reached_from(cell.positions, starts)
    ways = [way for way in ways_of(cell) if way.place in within]
    columns = [*_moves(cell, ways), *_between_moves(cell, ways), *_between_parts(cell, ways, away_s)]
    names = sorted({name for column in columns for name in column}, key=lambda name: (name[0] != BUSY, *map(str, name)))
    busy = sum(name[0] == BUSY for name in names)
    columns.append(dict.fromkeys(names[:busy], -1.0))  # the time of a mix
    number = {name: row for row, name in enumerate(names)}
    entries = [(value, number[name], n) for n, column in enumerate(columns) for name, value in column.items()]
    values, rows, at = zip(*entries, strict=True)
    table = coo_array((values, (rows, at)), shape=(len(names), len(columns))).tocsr()
    given = [starts.get(name[1], 0) if name[0] == "parts" else 0 for name in names]
    costs = [*[0.0] * (len(columns) - 1), 1.0]
    found = linprog(costs, table[:busy], given[:busy], table[busy:], given[busy:], method="highs")
    return max(0.0, float(found.fun) - NEAR_S) if found.status == 0 else 0.0


def _moves(cell: Cell, ways: Sequence[Way]) -> Iterator[Column]:
    """A part that leaves a position by each way: what the robot and the rooms that it leaves need for it."""
    for n, way in enumerate(ways):
        left, to, work_s = cell.positions[way.place], cell.positions[way.option.to], way.work / TICKS_PER_S
        column: Column = {(BUSY,): work_s, ("after", n): 1.0, ("before", n): 1.0, ("parts", way.place): 1.0}
        if to.options:
            column["parts", way.option.to] = -1.0
        for station in left.holds:
            kept_s = (left.processing_s or 0.0) if way.option.waits else 0.0
            if station not in to.holds:
                kept_s += work_s
                column["out", station, n] = 1.0
            column[BUSY, station] = kept_s / cell.capacities[station]
        yield column | {("in", station, n): 1.0 for station in way.option.needs}


def _between_moves(cell: Cell, ways: Sequence[Way]) -> Iterator[Column]:
    """The robot's empty way from each move to each that may come next; where that can only be one of the same part, the robot
    waits for it."""
    for one, done in enumerate(ways):
        for then, way in enumerate(ways):
            same, other = (follows(cell, done, way, same=alike) for alike in (True, False))
            left, begun = done.option.target, way.option.origin
            empty_s = 0.0 if left == begun else float(cell.empty_s[left, begun])
            if (same or other) and empty_s < inf:
                waits_s = cell.positions[way.place].processing_s if way.option.waits and not other else None
                yield {(BUSY,): max(empty_s, waits_s or 0.0), ("after", one): -1.0, ("before", then): -1.0}


def _between_parts(cell: Cell, ways: Sequence[Way], away_s: Sequence[Sequence[float]]) -> Iterator[Column]:
    """How long a room stays empty, from each move that leaves it to each that may bring the next part."""
    for station, room in enumerate(cell.capacities):
        picks = [
            (n, way)
            for n, way in enumerate(ways)
            if station in cell.positions[way.place].holds and station not in cell.positions[way.option.to].holds
        ]
        drops = [(n, way) for n, way in enumerate(ways) if station in way.option.needs]
        for one, left in picks:
            for then, brought in drops:
                time_s = away_s[left.option.target][brought.option.origin] + brought.work / TICKS_PER_S
                yield {(BUSY, station): time_s / room, ("out", station, one): -1.0, ("in", station, then): -1.0}
