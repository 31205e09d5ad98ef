"""What chance does to a cell: times drawn around their means, machines that break down, parts that come late.

Laws are compiled as they are.

A draw depends on the episode's seed, the part and the position only, not on the order of events: two policies in the
same episode meet the same times.
"""

from collections.abc import Callable, Mapping
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
    """Standard deviation `spread` times the mean, never below 0. Source: Box and Muller 1958."""
    return max(0.0, mean_s * (1.0 + spread * sqrt(-2.0 * log(1.0 - u)) * cos(2.0 * pi * v)))


def exponential(mean_s: float, spread: float, u: float, v: float) -> float:
    """Of that mean."""
    return -mean_s * log(1.0 - u)


# name -> function(mean [s], spread, two uniform numbers in [0, 1)) -> seconds
LAWS: Mapping[str, Callable[[float, float, float, float], float]] = MappingProxyType(
    {"constant": constant, "normal": normal, "exponential": exponential}
)


MOST_BREAKS = 8  # of a machine while it works on one part


def repairs(work_s: float, breaks_every_s: float, repair_s: float, draw: Callable[[int], float]) -> float:
    """How long a machine that works for `work_s` is repaired meanwhile; draw: the n-th of its uniform numbers.

    It breaks down after so much work as is exponentially distributed, and so is the time of a repair.
    Source: operation-dependent failures, Buzacott and Hanifin 1978.
    """
    worked_s, found_s = 0.0, 0.0
    for n in range(MOST_BREAKS):
        worked_s -= breaks_every_s * log(1.0 - draw(2 * n))
        if worked_s >= work_s:
            break
        found_s -= repair_s * log(1.0 - draw(2 * n + 1))
    return found_s


@dataclass(frozen=True)
class Chance:
    """The laws of processing times and of intervals between arrivals; `spread` of a normal one as a share of its mean.

    breaks_every_s: how long a machine works between two breakdowns on average (0: it never breaks down), repair_s: how long it
    is then repaired. late_s: by how much a part that is there at first comes later than it should, exponentially distributed.
    Raises BadInput for unknown laws, for spreads that are not 0 to 1 and times that are not finite and 0 or more.
    Source: thesis 7.6 (normal, 10 %), App. III.
    """

    processing: str = "normal"
    arrivals: str = "constant"
    spread: float = 0.1
    breaks_every_s: float = 0.0
    repair_s: float = 0.0
    late_s: float = 0.0

    def __post_init__(self) -> None:
        for field in ("processing", "arrivals"):
            if getattr(self, field) not in LAWS:
                raise unknown("law", getattr(self, field), LAWS, f"chance, {field}")
        if not (isfinite(self.spread) and 0 <= self.spread <= 1):
            raise BadInput(f"chance, spread = {self.spread}: allowed are 0 to 1")
        for field in ("breaks_every_s", "repair_s", "late_s"):
            if not (isfinite(getattr(self, field)) and getattr(self, field) >= 0):
                raise BadInput(f"chance, {field} = {getattr(self, field)}: allowed are finite times from 0")


NO_CHANCE = Chance("constant", "constant")


def check_chance(cell: Cell, chance: Chance) -> None:
    """BadInput for chance in a cell with batches.

    An order tells with what is brought, or taken out, next whether a machine has begun: who decides on the way would decide
    afterwards that it had begun before.
    """
    if cell.batches and chance != NO_CHANCE:
        name = cell.names[min(cell.batches)]
        raise BadInput(
            f"station '{name}': batch = true, which times that are drawn do not know: leave one of them away"
        )


@dataclass(frozen=True)
class Episode:
    """The times that one episode meets: those of the cell when there is no chance, else drawn by the seed, 0 to 2**64 - 1."""

    cell: Cell
    chance: Chance = NO_CHANCE
    seed: int = 0

    def __post_init__(self) -> None:
        check_chance(self.cell, self.chance)

    def processing_s(self, part: int, position: int) -> float:
        """How long the part (from 1) is processed in that position [s]."""
        mean_s, number = self.cell.positions[position].processing_s or 0.0, part * len(self.cell.positions) + position
        work_s, every_s = self._drawn(self.chance.processing, mean_s, number), self.chance.breaks_every_s
        if not (every_s and work_s):
            return work_s
        first = self._apart + self.cell.parts + 2 * MOST_BREAKS * number
        return work_s + repairs(work_s, every_s, self.chance.repair_s, lambda n: uniform(self.seed, first + n))

    def late_s(self, part: int) -> float:
        """By how much the part (from 1) comes later than it should [s]."""
        if not self.chance.late_s:
            return 0.0
        return -self.chance.late_s * log(1.0 - uniform(self.seed, self._apart + part - 1))

    @property
    def _apart(self) -> int:
        """The first number that no law draws: there lateness begins, and after it breakdowns."""
        return 2 * (self.cell.parts + 1) * len(self.cell.positions)

    def interval_s(self, part: int) -> float:
        """How long after the arrival (or pick) before it the part (from 1) arrives [s]."""
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
