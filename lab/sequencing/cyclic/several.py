"""The least time a part of cycles with more and more parts: a mix of products enters once in a cycle, twice, and so on."""

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

from lab.errors import BadInput, WorkFailed, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import reached_from
from lab.sequencing.cell.ways import TICKS_PER_S, Way, follows, ways_of
from lab.sequencing.cyclic.cycle import TIME_LIMIT_S, Cycle, check_cyclic, shortest
from lab.sequencing.cyclic.line import at_speed, away_s, lines

SOLVER_TOLERANCE_S = 1e-6  # what the program's solver may be wrong by
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
    return max(0.0, float(found.fun) - SOLVER_TOLERANCE_S) if found.status == 0 else 0.0


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


# ---- several ----------------------------------------------------------------------------------------------------------


MOST_PARTS, MOST_MOVES, MOST_LINES = 4, 30, 100  # of a cycle, where nobody says how many parts may enter in it
WORTH = 0.01  # and more are not tried where so small a share of the time is all that could be gained
NEAR_S = 3e-6  # longer than the bound, a mix takes as long: the bound is less by what its solver may be wrong by
EVERY_CYCLE = "all cycles"


@dataclass(frozen=True)
class Tried:
    """What was found with so many parts a cycle: its period; None: none that needs less time a part than fewer parts do.

    bound_s: no period that needs less is shorter. proven: there is none that needs less than the period, or than fewer parts.
    """

    parts: int
    period_s: float | None
    bound_s: float
    proven: bool


@dataclass(frozen=True)
class Rhythm:
    """The cycle that needs the least time a part, of those that were tried: with a mix of products once, twice, and so on.

    least_part_s: no cycle needs less time a part, however many parts enter in it. why_no_more: why more parts a cycle were not
    tried; "": those that were wanted were, or none can need less.
    """

    cycle: Cycle
    mix: tuple[str, ...]
    tried: tuple[Tried, ...]
    least_part_s: float
    why_no_more: str
    wall_s: float

    @property
    def per_part_s(self) -> float:
        """How long a part takes [s]."""
        return self.cycle.period_s / self.cycle.parts

    @property
    def most_parts(self) -> int:
        """The most parts a cycle that were tried."""
        return self.tried[-1].parts

    @property
    def bound_part_s(self) -> float:
        """No cycle of those in `proven_of` needs less time a part [s]."""
        if self._is_least:
            return self.per_part_s
        return min(self.per_part_s, max(self.least_part_s, min(one.bound_s / one.parts for one in self.tried)))

    @property
    def proven(self) -> bool:
        """Whether no cycle of those in `proven_of` needs less time a part, to some microseconds."""
        return self.bound_part_s == self.per_part_s

    @property
    def proven_of(self) -> str:
        """Of which cycles something is proven: all that there are, or those that were tried."""
        if self._is_least:
            return EVERY_CYCLE
        if self.most_parts > len(self.mix):
            return f"cycles of up to {self.most_parts} parts"
        return f"cycles of {mix_in_words(self.mix)}"

    @property
    def _is_least(self) -> bool:
        return (self.per_part_s - self.least_part_s) * len(self.mix) <= NEAR_S


def best_rhythm(
    cell: Cell, mix: Sequence[str], most_parts: int | None = None, seed: int = 0, time_limit_s: float = TIME_LIMIT_S
) -> Rhythm:
    """The cycle of a mix (products) that needs the least time a part: with one mix, then two, up to so many parts a cycle.

    most_parts: None: `usual_parts`, and no more once less than `WORTH` could be gained. More are never tried once it is proven
    that no cycle needs less. Raises BadInput and WorkFailed as `best_cycle` does.
    """
    began, mix = time.perf_counter(), tuple(mix)
    check_cyclic(cell, mix)
    cell = at_speed(cell)
    worth, most_parts = (WORTH, usual_parts(cell, mix)) if most_parts is None else (0.0, most_parts)
    least_mix_s = least_s(cell, mix, away_s(cell))
    best: Cycle | None = None
    tried, why, mix_s = list[Tried](), "", inf
    for times in range(1, max(1, most_parts // len(mix)) + 1):
        left_s = time_limit_s - (time.perf_counter() - began)
        if mix_s - least_mix_s <= NEAR_S:
            break
        if 1.0 - least_mix_s / mix_s < worth:
            why = f"less than {worth:.0%} of the time could be gained"
            break
        if tried and left_s <= 0:
            why = f"the {time_limit_s:g} s were over"
            break
        try:
            found = shortest(cell, mix * times, left_s, seed, times * least_mix_s, times * mix_s)
        except BadInput as error:
            if not tried:
                raise
            why = str(error)
            break
        bound_s = times * mix_s if found.proven and found.cycle is None else found.above_s
        tried.append(
            Tried(len(mix) * times, None if found.cycle is None else found.cycle.period_s, bound_s, found.proven)
        )
        if found.cycle is not None:
            best, mix_s = found.cycle, found.cycle.period_s / times
    if best is None:
        none = all(one.bound_s == inf for one in tried)
        parts = counted(tried[-1].parts, "part") if len(tried) == 1 else f"up to {tried[-1].parts} parts"
        why = "it is proven that there is none" if none else f"none was found in {time_limit_s:g} s"
        raise WorkFailed(f"no order of {parts} a cycle can be repeated for ever: {why}")
    return Rhythm(best, mix, tuple(tried), least_mix_s / len(mix), why, time.perf_counter() - began)


def usual_parts(cell: Cell, mix: Sequence[str]) -> int:
    """How many parts a cycle has at the most where nobody says: few, of few moves and choices of ways, and no more than the cell
    has; a mix at the least."""
    most = len(mix)
    while most + len(mix) <= min(MOST_PARTS, cell.parts):
        try:
            ahead = [*lines(cell, [*mix] * (most // len(mix) + 1))]
        except BadInput:
            break
        if len(ahead) > MOST_LINES or max(len(line.moves) for line in ahead) > MOST_MOVES:
            break
        most += len(mix)
    return most


def mix_in_words(mix: Sequence[str]) -> str:
    """What enters, such as "2 slices, 1 cup"."""
    return ", ".join(counted(count, name) for name, count in Counter(mix).items())
