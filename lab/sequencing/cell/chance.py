"""Chance in a cell: times drawn around their means, machines and robots that break down, parts that come late.

A draw depends on the episode's seed, the part and the position only, not on the order of events: two policies in the same
episode meet the same times. numba compiles the functions of the laws as they stand here.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import cos, isfinite, log, pi, sqrt
from types import MappingProxyType

import numpy as np

from lab.errors import BadInput, unknown
from lab.learning.splitmix import uniform
from lab.sequencing.cell.cell import Cell


def constant(mean_s: float, spread: float, u: float, v: float) -> float:
    """The mean itself."""
    return mean_s


def normal(mean_s: float, spread: float, u: float, v: float) -> float:
    """A normal time [s] with standard deviation `spread` times the mean, never below 0. Source: Box and Muller 1958."""
    return max(0.0, mean_s * (1.0 + spread * sqrt(-2.0 * log(1.0 - u)) * cos(2.0 * pi * v)))


def exponential(mean_s: float, spread: float, u: float, v: float) -> float:
    """An exponential time [s] with the mean `mean_s`, from the uniform number u."""
    return -mean_s * log(1.0 - u)


# name -> function(mean [s], spread, two uniform numbers in [0, 1)) -> seconds
LAWS: Mapping[str, Callable[[float, float, float, float], float]] = MappingProxyType(
    {"constant": constant, "normal": normal, "exponential": exponential}
)


MOST_BREAKS = 8  # breakdowns of a machine while it works on one part
SHORTEST_S = 1.0  # the least mean time between a robot's breakdowns


def repairs(work_s: float, breaks_every_s: float, repair_s: float, draw: Callable[[int], float]) -> float:
    """The total repair time [s] of a machine during `work_s` of work; draw: returns the n-th uniform number.

    The work between breakdowns and the times of repairs are exponentially distributed.
    Source: operation-dependent failures, Buzacott and Hanifin 1978.
    """
    worked_s, found_s = 0.0, 0.0
    for n in range(MOST_BREAKS):
        worked_s -= breaks_every_s * log(1.0 - draw(2 * n))
        if worked_s >= work_s:
            break
        found_s -= repair_s * log(1.0 - draw(2 * n + 1))
    return found_s


def through(outages: Iterable[tuple[float, float]], start_s: float, work_s: float) -> float:
    """When a robot has done `work_s` of work that begins at `start_s`, or when it is repaired, and pauses during outages [s].

    outages: begin and end of each outage, ascending [s].
    """
    for from_s, until_s in outages:
        if from_s > start_s and from_s >= start_s + work_s:
            break
        if until_s > start_s:
            work_s -= max(0.0, from_s - start_s)
            start_s = until_s
    return start_s + work_s


@dataclass(frozen=True)
class Chance:
    """The laws of processing times and of intervals between arrivals; spread: of a normal law, as a share of the mean.

    breaks_every_s: mean working time of a machine between breakdowns (0: it never breaks down), repair_s: mean time of its
    repair. late_s: mean delay of a part that should be there at the start. robot_breaks_every_s: mean time, at work or not,
    between a robot's breakdowns (0: it never breaks down), robot_repair_s: mean time that it then stops where it is, with what it
    holds. All of these are exponentially distributed, in seconds.
    Raises BadInput for unknown laws, spreads outside 0 to 1, times that are not finite and 0 or more, and robots that break down
    more often than once in SHORTEST_S.
    Source: thesis 7.6 (normal, 10 %), App. III; time-dependent failures, Buzacott and Hanifin 1978.
    """

    processing: str = "normal"
    arrivals: str = "constant"
    spread: float = 0.1
    breaks_every_s: float = 0.0
    repair_s: float = 0.0
    late_s: float = 0.0
    robot_breaks_every_s: float = 0.0
    robot_repair_s: float = 0.0

    def __post_init__(self) -> None:
        for field in ("processing", "arrivals"):
            if getattr(self, field) not in LAWS:
                raise unknown("law", getattr(self, field), LAWS, f"chance, {field}")
        if not (isfinite(self.spread) and 0 <= self.spread <= 1):
            raise BadInput(f"chance, spread = {self.spread}: allowed are 0 to 1")
        for field in ("breaks_every_s", "repair_s", "late_s", "robot_breaks_every_s", "robot_repair_s"):
            if not (isfinite(getattr(self, field)) and getattr(self, field) >= 0):
                raise BadInput(f"chance, {field} = {getattr(self, field)}: allowed are finite times from 0")
        if 0 < self.robot_breaks_every_s < SHORTEST_S:
            raise BadInput(
                f"chance, robot_breaks_every_s = {self.robot_breaks_every_s}: allowed are 0 and times from {SHORTEST_S:g}"
            )


NO_CHANCE = Chance("constant", "constant")


def check_robot_breaks(robots: int, track: bool, chance: Chance) -> None:
    """Raises BadInput for robots that break down in a cell without robots, and on a track."""
    if not chance.robot_breaks_every_s:
        return
    every = f"robot_breaks_every_s = {chance.robot_breaks_every_s:g}"
    if not robots:
        raise BadInput(f"{every}, but the cell has no robots; breaks_every_s is for machines")
    if track:
        raise BadInput(
            f"{every} and a track: a robot that stops there blocks it, and a path is taken only where it is free"
        )


def check_chance(cell: Cell, chance: Chance) -> None:
    """Raises BadInput for chance in a cell with batches, and for breakdowns of robots as `check_robot_breaks` does.

    A batch is closed by the order's next transfer at its machine, so a policy that decides step by step would decide afterwards
    that a batch had already begun.
    """
    check_robot_breaks(len(cell.robots), bool(cell.track), chance)
    if cell.batches and chance != NO_CHANCE:
        name = cell.names[min(cell.batches)]
        raise BadInput(f"station '{name}': batch = true, which drawn times do not support: remove one of them")


@dataclass(frozen=True)
class Episode:
    """The times of one episode: the cell's own without chance, else drawn from the seed, 0 to 2**64 - 1."""

    cell: Cell
    chance: Chance = NO_CHANCE
    seed: int = 0

    def __post_init__(self) -> None:
        check_chance(self.cell, self.chance)

    def processing_s(self, part: int, position: int) -> float:
        """The processing time of a part (from 1) in a position [s]."""
        mean_s, number = self.cell.positions[position].processing_s or 0.0, part * len(self.cell.positions) + position
        work_s, every_s = self._drawn(self.chance.processing, mean_s, number), self.chance.breaks_every_s
        if not (every_s and work_s):
            return work_s
        first = self._apart + self.cell.parts + 2 * MOST_BREAKS * number
        return work_s + repairs(work_s, every_s, self.chance.repair_s, lambda n: uniform(self.seed, first + n))

    def lasts_s(self, part: int, position: int, begin_s: float) -> float:
        """The processing time of a part (from 1) in a position when it begins at `begin_s` [s]."""
        return self.processing_s(part, position)

    def comes_s(self, part: int, since_s: float) -> float:
        """When the part (from 1) arrives if the arrival (or pick) before it was at `since_s` [s]."""
        return since_s + self.interval_s(part)

    def until_s(self, robot: int, start_s: float, work_s: float) -> float:
        """When a robot (from 0) has done `work_s` of driving or service that begins at `start_s` (see `through`) [s]."""
        return through(self.outages(robot), start_s, work_s)

    def outages(self, robot: int) -> Iterator[tuple[float, float]]:
        """Begin and end of each outage of a robot (from 0), ascending, without end; empty where robots never break down [s]."""
        every_s, repair_s = self.chance.robot_breaks_every_s, self.chance.robot_repair_s
        if not every_s:
            return
        first, until_s, n = self._apart * (1 + MOST_BREAKS) + self.cell.parts, 0.0, robot
        while True:
            from_s = until_s - every_s * log(1.0 - uniform(self.seed, first + 2 * n))
            until_s = from_s - repair_s * log(1.0 - uniform(self.seed, first + 2 * n + 1))
            yield from_s, until_s
            n += len(self.cell.robots)

    def late_s(self, part: int) -> float:
        """The delay of a part (from 1) [s]."""
        if not self.chance.late_s:
            return 0.0
        return -self.chance.late_s * log(1.0 - uniform(self.seed, self._apart + part - 1))

    @property
    def _apart(self) -> int:
        """The first number of a draw beyond those of times; delays are numbered from there, then breakdowns of machines and
        robots."""
        return 2 * (self.cell.parts + 1) * len(self.cell.positions)

    def interval_s(self, part: int) -> float:
        """The interval from the arrival (or pick) before it to the arrival of a part (from 1) [s]."""
        mean_s = self.cell.arrivals.interval_s[part - 1] if self.cell.arrivals else 0.0
        number = part * len(self.cell.positions) + self.cell.starts[part - 1]  # no start has a process of its own
        return self._drawn(self.chance.arrivals, mean_s, number)

    def _drawn(self, law: str, mean_s: float, number: int) -> float:
        if law == "constant" or mean_s == 0.0:
            return mean_s
        u, v = uniform(self.seed, 2 * number), uniform(self.seed, 2 * number + 1)
        return LAWS[law](mean_s, self.chance.spread, u, v)


def drawn_seed(rng: np.random.Generator) -> int:
    """A seed for an episode's times, or a session's uniform numbers, drawn from a generator."""
    return int(rng.integers(2**63))
