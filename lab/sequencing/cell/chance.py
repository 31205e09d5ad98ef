"""What chance does to a cell: processing times and arrivals drawn around their means. Laws are compiled as they are.

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


@dataclass(frozen=True)
class Chance:
    """The laws of processing times and of intervals between arrivals; `spread` of a normal one as a share of its mean.

    Raises BadInput for unknown laws and for spreads that are not 0 to 1. Source: thesis 7.6 (normal, 10 %), App. III.
    """

    processing: str = "normal"
    arrivals: str = "constant"
    spread: float = 0.1

    def __post_init__(self) -> None:
        for field in ("processing", "arrivals"):
            if getattr(self, field) not in LAWS:
                raise unknown("law", getattr(self, field), LAWS, f"chance, {field}")
        if not (isfinite(self.spread) and 0 <= self.spread <= 1):
            raise BadInput(f"chance, spread = {self.spread}: allowed are 0 to 1")


NO_CHANCE = Chance("constant", "constant")


@dataclass(frozen=True)
class Episode:
    """The times that one episode meets: those of the cell when there is no chance, else drawn by the seed, 0 to 2**64 - 1."""

    cell: Cell
    chance: Chance = NO_CHANCE
    seed: int = 0

    def processing_s(self, part: int, position: int) -> float:
        """How long the part (from 1) is processed in that position [s]."""
        mean_s = self.cell.positions[position].processing_s or 0.0
        return self._drawn(self.chance.processing, mean_s, part * len(self.cell.positions) + position)

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
