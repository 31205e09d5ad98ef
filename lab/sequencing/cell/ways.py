"""The moves of a cell of one robot in integer ticks: their durations, which may follow which, and distances of stations.

Times are those of the first robot, at its speed.
"""

from collections.abc import Sequence
from math import isnan
from typing import NamedTuple

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option

# Times are compared as integer nanoseconds, so that equal states are equal whatever the order of additions was.
TICKS_PER_S = 1e9
FAR = 1 << 61  # stands for infinity; the sum of two still fits an int64


class Way(NamedTuple):
    """An option and the position (index) that it leaves; `work`: the robot's service and carrying [ticks]."""

    place: int
    option: Option
    work: int


def ticks(row: Sequence[float]) -> list[int]:
    """Seconds as ticks; -1 for NaN, a move that is never made."""
    return [-1 if isnan(seconds) else round(seconds * TICKS_PER_S) for seconds in row]


def ways_of(cell: Cell) -> list[Way]:
    """Every option of every position, in their order."""
    loaded = loaded_ticks(cell)
    return [
        Way(place, option, round(option.service_s * TICKS_PER_S) + loaded[option.origin][option.target])
        for place, at in enumerate(cell.positions)
        for option in at.options
    ]


def loaded_ticks(cell: Cell) -> list[list[int]]:
    """Ticks of a loaded move from a station (row) to another (column); -1 for a move that is never made."""
    return [ticks(row) for row in (cell.loaded_s / _speed(cell)).tolist()]


def empty_ticks(cell: Cell) -> list[list[int]]:
    """Ticks of an empty move from a station (row) to another (column); 0 to itself, -1 for a move that is never made."""
    empty = [ticks(row) for row in (cell.empty_s / _speed(cell)).tolist()]
    for place in range(len(empty)):
        empty[place][place] = 0
    return empty


def follows(cell: Cell, done: Way, way: Way, same: bool) -> bool:
    """Whether `way` may be the next move after `done`: of the same part, or of another one."""
    if done.option.if_full is not None and done.option.if_full in way.option.needs:
        return False  # the station is still full
    if same:
        return done.option.to == way.place
    left, there = cell.positions[done.place], cell.positions[done.option.to]
    full = {station for station in there.holds if cell.capacities[station] == 1}
    gone = {station for station in left.holds if cell.capacities[station] == 1 and station not in there.holds}
    standing = set(cell.positions[way.place].holds)
    return not (full & (standing | set(way.option.needs)) or gone & standing or way.option.if_full in gone)


def distances(cell: Cell, per_s: float = TICKS_PER_S) -> list[list[int]]:
    """The least time in which the robot gets from a station (row) to another (column), empty or loaded, by any stations.

    Times are in units of 1 / `per_s` seconds; FAR where it cannot get.
    """
    seconds = np.fmin(cell.empty_s, cell.loaded_s) / _speed(cell)
    table = np.where(np.isnan(seconds), FAR, np.rint(seconds * per_s)).astype(np.int64)
    np.fill_diagonal(table, 0)
    for via in range(len(table)):
        table = np.minimum(table, np.minimum(table[:, via : via + 1] + table[via], FAR))
    table_ticks: list[list[int]] = table.tolist()
    return table_ticks


def _speed(cell: Cell) -> float:
    return cell.robots[0].speed if cell.robots else 1.0
