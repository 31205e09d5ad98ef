"""The times of a cell, and of a sequence of it, as integers, which CP-SAT requires."""

from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import SERVER, Option, from_the_ends, part_of
from lab.sequencing.cell.ways import Way
from lab.sequencing.simulate.follow import steps
from lab.sequencing.simulate.run import Run

UNITS_PER_S = (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6)
MOST_UNITS = 1e12  # the longest time in units, so that sums of many times stay exact
_SAME = 1e-12  # relative tolerance, of the longest time, within which two floats count as equal


class Times:
    """The cell's times in whole units: the largest unit in which all of them are integers, else the smallest unit.

    shortest: the least duration of a carried move, in units. rounded_s: the largest rounding error [s]; 0 when all times are
    integers.
    """

    def __init__(self, cell: Cell, shortest: int = 1) -> None:
        self._cell, self._shortest = cell, shortest
        ways = [way for place in cell.positions for way in place.options if way.robot != SERVER]
        carries = [self._carry_s(way) for way in ways]
        least_s = min(carries, default=1.0) if shortest else 1.0
        both = np.concatenate([cell.empty_s.ravel(), cell.loaded_s.ravel()])
        tables = np.concatenate([both, *(both / robot.speed for robot in cell.robots if robot.speed != 1.0)])
        given = np.array(
            [
                *tables[~np.isnan(tables)],
                *(place.processing_s or 0.0 for place in cell.positions),
                *(way.service_s for way in ways),
                *(seconds for station in cell.stations for *_, seconds in station.setups),
                *(cell.arrivals.interval_s if cell.arrivals else ()),
                *(cell.due_s or ()),
                *cell.begin_s,
                *(place.at_most_s or 0.0 for place in cell.positions),
            ]
        )
        longest_s = cell.longest_s + max(cell.due_s or (0.0,))
        fine = [per_s for per_s in UNITS_PER_S if longest_s * per_s <= MOST_UNITS] or [MOST_UNITS / longest_s]
        fit = [per_s for per_s in fine if _off_s(given, per_s) <= _SAME * longest_s and least_s * per_s > 0.5]
        self.per_s = fit[0] if fit else fine[-1]
        # A carried move that takes no time lasts one unit in the model, see `work`.
        added_s = 1.0 / self.per_s if least_s == 0 else 0.0
        self.rounded_s = 0.0 if fit else max(_off_s(given, self.per_s), added_s)

    def whole(self, seconds: float) -> int:
        """A time in units."""
        return round(seconds * self.per_s)

    def travel(self, origin: int, target: int, robot: int = 0) -> int:
        """A robot's empty way between two stations."""
        speed = self._cell.robots[robot].speed
        return 0 if origin == target else self.whole(float(self._cell.empty_s[origin, target]) / speed)

    def known(self, origin: int, target: int) -> bool:
        """Whether the cell has a time for the empty drive; it has one for every drive that may be needed."""
        return origin == target or not np.isnan(self._cell.empty_s[origin, target])

    def work(self, option: Option) -> int:
        """The duration of service and carrying, in units; the carrying takes at least `shortest`."""
        return self.whole(option.service_s) + max(self._shortest, self.whole(self._carry_s(option)))

    def _carry_s(self, option: Option) -> float:
        return float(self._cell.loaded_s[option.origin, option.target]) / self._cell.robots[option.robot].speed

    def processing(self, place: int) -> int:
        """The processing time that begins in a position, in units."""
        return self.whole(self._cell.positions[place].processing_s or 0.0)


class ScheduledMove(NamedTuple):
    """A move of a sequence: the part (from 0), its option, when it begins after any wait, and when it drops [units]."""

    part: int
    way: Way
    begin: int
    drop: int


def timed(cell: Cell, times: Times, ways: Sequence[Way], sequence: Sequence[int]) -> list[ScheduledMove]:
    """The moves of a sequence with the model's integer times."""
    run, moves, now = Run(cell), list[ScheduledMove](), 0
    ready, coming = [times.whole(seconds) for seconds in cell.begin_s], [part - 1 for part in cell.coming]
    intervals = [times.whole(seconds) for seconds in cell.arrivals.interval_s] if cell.arrivals else [0] * cell.parts
    clock = cell.arrivals is None or cell.arrivals.after == "clock"
    for index, come in zip(coming, accumulate(intervals[index] for index in coming), strict=True):
        if cell.arrivals is not None:
            ready[index] = come if clock else intervals[index]
    for run, decision, wait in steps(cell, sequence):
        part, option = part_of(decision, cell.parts) - 1, run.option(decision)
        place = run.locations[part]
        assert option is not None
        way = next(way for way in ways if way.place == place and way.option == option)
        begin = now + times.travel(run.robot, option.origin)
        begin = (max(begin, ready[part]) if option.waits else begin) + times.whole(wait.pick_s)
        if place in cell.starts and not clock and part != coming[-1]:
            ready[coming[coming.index(part) + 1]] += begin
        now = begin + times.work(way.option) + times.whole(wait.drop_s)
        if cell.positions[option.to].processing_s is not None:
            ready[part] = now + times.processing(option.to)
        run.move(decision, wait)
        moves.append(ScheduledMove(part, way, begin, now))
    return moves


def longest(cell: Cell, times: Times, ways: Sequence[Way]) -> int:
    """An upper bound of every makespan in units, if the robot never waits without need."""
    travel = max((times.travel(a, b) for a, b in np.argwhere(~np.isnan(cell.empty_s)).tolist()), default=0)

    def longest_from(place: int, ahead: list[int]) -> int:
        own = [travel + times.work(way.option) for way in ways if way.place == place]
        return times.processing(place) + max((here + then for here, then in zip(own, ahead, strict=True)), default=0)

    most = from_the_ends(cell.positions, longest_from)
    arrive = sum(times.whole(seconds) for seconds in cell.arrivals.interval_s) if cell.arrivals else 0
    ready = max(0, *(times.whole(seconds) for seconds in cell.begin_s))
    return arrive + ready + sum(most[start] for start in cell.begin_at)


def _off_s(given: NDArray[np.float64], per_s: float) -> float:
    return float(np.abs(given - np.round(given * per_s) / per_s).max(initial=0.0))
