"""The cycle of least time per part when a mix of products enters once in a cycle, twice, and so on; and a bound for all."""

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import scipy

from lab.errors import BadInput, WorkFailed, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import reached_from
from lab.sequencing.cell.ways import TICKS_PER_S, Way, follows, ways_of
from lab.sequencing.cyclic.cycle import TIME_LIMIT_S, Cycle, check_cyclic, shortest
from lab.sequencing.cyclic.line import at_speed, away_s, lines

SOLVER_TOLERANCE_S = 1e-6  # error of the linear program's solver
Column = dict[tuple[Any, ...], float]  # a column of the linear program: its coefficient in each row, by the row's name
BUSY = "busy"  # begins the names of the rows of busy times, each at most the time of a mix; other rows are equalities


def least_s(cell: Cell, mix: Sequence[str], away_s: Sequence[Sequence[float]]) -> float:
    """A lower bound of the time per mix of every cyclic order, however many mixes enter in a cycle [s].

    It is a linear program over the shares of parts that take each option. Each room of a station is busy with these parts and
    until the next one arrives; the robot is busy with the moves and the empty drives between them, and each move has one
    predecessor and one successor. cell: must have the times of its one robot (`at_speed`). away_s: see `Line.bound_s`.
    """
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
    table = scipy.sparse.coo_array((values, (rows, at)), shape=(len(names), len(columns))).tocsr()
    given = [starts.get(name[1], 0) if name[0] == "parts" else 0 for name in names]
    costs = [*[0.0] * (len(columns) - 1), 1.0]
    solution = scipy.optimize.linprog(costs, table[:busy], given[:busy], table[busy:], given[busy:], method="highs")
    return max(0.0, float(solution.fun) - SOLVER_TOLERANCE_S) if solution.status == 0 else 0.0


def _moves(cell: Cell, ways: Sequence[Way]) -> Iterator[Column]:
    """A column for each option by which a part leaves a position: the time of the robot and of the rooms that it leaves."""
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
    """A column for each pair of consecutive moves: the robot's empty drive, or its wait where both are of the same part."""
    for one, done in enumerate(ways):
        for then, way in enumerate(ways):
            same, other = (follows(cell, done, way, same=alike) for alike in (True, False))
            left, begun = done.option.target, way.option.origin
            empty_s = 0.0 if left == begun else float(cell.empty_s[left, begun])
            if (same or other) and empty_s < inf:
                waits_s = cell.positions[way.place].processing_s if way.option.waits and not other else None
                yield {(BUSY,): max(empty_s, waits_s or 0.0), ("after", one): -1.0, ("before", then): -1.0}


def _between_parts(cell: Cell, ways: Sequence[Way], away_s: Sequence[Sequence[float]]) -> Iterator[Column]:
    """A column for each pair of a move that leaves a room and one that brings the next part: the time that it is empty."""
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


# ---- Cycles with more and more parts ----------------------------------------------------------------------------------


MOST_PARTS, MOST_MOVES, MOST_LINES = 4, 30, 100  # default limits of a cycle, where the number of parts is not given
WORTH = 0.01  # more parts are not tried by default when less than this share of the time could be gained
NEAR_S = 3e-6  # tolerance within which the time of a mix equals the bound, which is lowered by its solver's error
EVERY_CYCLE = "all cycles"


@dataclass(frozen=True)
class Tried:
    """The result for one number of parts per cycle. period_s: None: no cycle needs less time per part than one with fewer parts.

    bound_s: a lower bound of the periods that need less. proven: whether no period is shorter than this one, or whether none
    needs less time per part than one with fewer parts.
    """

    parts: int
    period_s: float | None
    bound_s: float
    proven: bool


@dataclass(frozen=True)
class Rhythm:
    """The cycle of least time per part among those tried, with a mix of products entering once, twice, and so on.

    least_part_s: a lower bound of the time per part of every cycle. why_no_more: why no more parts per cycle were tried; "": all
    that were asked for were tried, or none can need less.
    """

    cycle: Cycle
    mix: tuple[str, ...]
    tried: tuple[Tried, ...]
    least_part_s: float
    why_no_more: str
    wall_s: float

    @property
    def per_part_s(self) -> float:
        """The time per part [s]."""
        return self.cycle.period_s / self.cycle.parts

    @property
    def most_parts(self) -> int:
        """The largest number of parts per cycle that was tried."""
        return self.tried[-1].parts

    @property
    def bound_part_s(self) -> float:
        """A lower bound of the time per part of the cycles in `proven_of` [s]."""
        if self._is_least:
            return self.per_part_s
        return min(self.per_part_s, max(self.least_part_s, min(trial.bound_s / trial.parts for trial in self.tried)))

    @property
    def proven(self) -> bool:
        """Whether no cycle of those in `proven_of` needs less time per part, within some microseconds."""
        return self.bound_part_s == self.per_part_s

    @property
    def proven_of(self) -> str:
        """The set of cycles that the proof is about, in words: all cycles, or those that were tried."""
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
    """The cycle of least time per part, tried with one mix (products) per cycle, then two, up to `most_parts` parts.

    most_parts: None: `usual_parts`, or fewer once less than `WORTH` could be gained. The search ends when it is proven that no
    cycle needs less. Raises BadInput and WorkFailed as `best_cycle` does.
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
            searched = shortest(cell, mix * times, left_s, seed, times * least_mix_s, times * mix_s)
        except BadInput as error:
            if not tried:
                raise
            why = str(error)
            break
        bound_s = times * mix_s if searched.proven and searched.cycle is None else searched.above_s
        tried.append(
            Tried(
                len(mix) * times, None if searched.cycle is None else searched.cycle.period_s, bound_s, searched.proven
            )
        )
        if searched.cycle is not None:
            best, mix_s = searched.cycle, searched.cycle.period_s / times
    if best is None:
        none = all(trial.bound_s == inf for trial in tried)
        parts = counted(tried[-1].parts, "part") if len(tried) == 1 else f"up to {tried[-1].parts} parts"
        why = "it is proven that there is none" if none else f"none was found in {time_limit_s:g} s"
        raise WorkFailed(f"no order of {parts} a cycle can be repeated for ever: {why}")
    return Rhythm(best, mix, tuple(tried), least_mix_s / len(mix), why, time.perf_counter() - began)


def usual_parts(cell: Cell, mix: Sequence[str]) -> int:
    """The default largest number of parts per cycle: at least one mix, no more parts than the cell has, and within the limits
    MOST_PARTS, MOST_MOVES and MOST_LINES."""
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
    """A mix in words, such as "2 slices, 1 cup"."""
    return ", ".join(counted(count, name) for name, count in Counter(mix).items())
