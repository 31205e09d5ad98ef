"""What gates decide by: plain functions of numbers and arrays, which numba compiles for the kernel as well."""

from collections.abc import Sequence
from typing import NamedTuple

from lab.learning.session_events import Improvement

Steps = Sequence[float]  # whole numbers, unless the high level compares makespans

OPENS_NEVER, OPENS_ALWAYS, OPENS_FROM_X, OPENS_WHILE_SLOW, OPENS_WHILE_LONG = range(5)
WEIGHS_NOTHING, WEIGHS_NOVELTY, WEIGHS_FADING, WEIGHS_SHAPING, WEIGHS_RELIABILITY, WEIGHS_WORTH, WEIGHS_TRUST = range(7)
ASKS_ALWAYS, ASKS_WHERE_ALIKE, ASKS_WHERE_APART, ASKS_BY_CHANCE, ASKS_WHERE_TABLES_DIFFER = range(5)


class CompiledGate(NamedTuple):
    """A gate by the rules that the kernel knows: which episodes it opens (OPENS_...), which steps of these it asks about
    (ASKS_...), whether it judges episodes as CCRL does, and how it weighs what it is told (WEIGHS_...).
    """

    opens: int
    asks: int
    judges: bool = False
    weighs: int = WEIGHS_NOTHING


def window_mean(steps: Steps, end: int, window: int) -> float:
    """The mean of the `window` step counts before index `end`."""
    total: float = 0
    for i in range(end - window, end):
        total += steps[i]
    return total / window


def too_slow(current_mean: float, previous_mean: float, threshold: float) -> bool:
    """Whether the improvement rate is below Lambda. Source: thesis eqs. 6.1 and 6.2 and the listing's ratio."""
    return current_mean / previous_mean > 1.0 - threshold


def misled(result: float, mean_before: float) -> bool:
    """Whether an episode was not better than the mean of the K before it. Source: thesis eq. 6.3 and listing."""
    return result >= mean_before


def unsure(width: float, psi: float) -> bool:
    """Whether the values of a state span at most Psi. Source: Clouse 1996; thesis eq. 9.3 (<), listing (<=)."""
    return width <= psi


def improvement(steps: Steps, window: int) -> Improvement | None:
    """The improvement of the step counts so far; None while fewer than two windows have ended."""
    n = len(steps)
    if n < 2 * window:
        return None
    current, previous = window_mean(steps, n, window), window_mean(steps, n - window, window)
    return Improvement(1.0 - current / previous, current, previous)
