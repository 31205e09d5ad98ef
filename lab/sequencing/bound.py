"""A lower bound of the time that a cell still needs: what the robot has to do, if it never waited."""

import math
from collections.abc import Sequence

from lab.sequencing.cell import Cell

# Times are compared as whole nanoseconds: equal states then compare equal, whatever the order of additions was.
TICKS_PER_S = 1e9


def ticks(row: Sequence[float]) -> list[int]:
    """Seconds to ticks; -1 for NaN, a move that is never made."""
    return [-1 if math.isnan(seconds) else round(seconds * TICKS_PER_S) for seconds in row]


class RobotWork:
    """What the robot still has to do at least, from the toasts that stand at each station; in ticks."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._empty = [ticks(row) for row in cell.empty_s.tolist()]
        self._loaded = [ticks(row) for row in cell.loaded_s.tolist()]
        for place in range(len(cell.stations)):
            self._empty[place][place] = 0
        self._approach = [0] * len(cell.stations)
        self._rest = [0] * len(cell.stations)
        self._measure_rest()

    def left(self, counts: Sequence[int], robot: int) -> int:
        """Ticks that the robot still needs at least, if it never waited and always came from nearby; counts (n,)."""
        ahead = sum(count * rest for count, rest in zip(counts, self._rest, strict=True))
        return ahead - (self._approach[robot] if counts[robot] else 0)

    def _measure_rest(self) -> None:
        """`_rest`: least robot ticks to bring a toast from a station to the end; `_approach`: of these, to get to it.

        The robot gets to a toast from another station, or it stayed there, having dropped one. With room for only one
        that is the toast itself, which has to be processed first; and a toast dropped in a buffer cannot go on at once.
        """
        cell = self._cell
        processing = [round(station.processing_s * TICKS_PER_S) for station in cell.stations]
        origins = [place for place, ahead in enumerate(cell.ahead) if ahead is not None]
        choices = {origin: _targets(cell, origin) for origin in origins}
        drops = {target for targets in choices.values() for target in targets}
        for origin in sorted(origins, key=lambda place: -_stage_number(cell, place)):
            ways = [self._empty[drop][origin] for drop in drops if drop != origin]
            if origin in drops and cell.stations[origin].kind != "buffer":
                ways.append(processing[origin] if cell.capacities[origin] == 1 else 0)
            # None is a trip that no sequence needs.
            self._approach[origin] = min((way for way in ways if way >= 0), default=0)
            carries = [self._loaded[origin][target] + self._rest[target] for target in choices[origin]]
            self._rest[origin] = self._approach[origin] + min(carries)


def _targets(cell: Cell, origin: int) -> list[int]:
    return [target for target in (cell.ahead[origin], cell.fallback[origin]) if target is not None]


def _stage_number(cell: Cell, place: int) -> float:
    """Position on the route; a buffer lies half a stage before its station."""
    name = cell.names[place]
    stages = [stage.station for stage in cell.route]
    buffers = [stage.buffer for stage in cell.route]
    return stages.index(name) if name in stages else buffers.index(name) - 0.5
