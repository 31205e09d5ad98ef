"""Difference constraints: what has to begin how much later than what, and the earliest times that keep to all of them."""

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

TINY_S = 1e-9  # sums of times that differ by less are equal


class Arc(NamedTuple):
    """begin[then] >= begin[one] + least_s - periods * period."""

    one: int
    then: int
    least_s: float
    periods: int


def earliest(arcs: Sequence[Arc], moves: int, first: int, period_s: float) -> tuple[list[float], list[Arc]]:
    """The earliest begins after the first move's, or a circle of arcs that cannot be kept (Bellman and Ford)."""
    begin_s, by = [-inf] * moves, dict[int, Arc]()
    begin_s[first], late = 0.0, -1
    for _ in range(moves + 1):
        late = -1
        for arc in arcs:
            at_s = begin_s[arc.one] + arc.least_s - arc.periods * period_s
            if at_s > begin_s[arc.then] + TINY_S:
                begin_s[arc.then], by[arc.then], late = at_s, arc, arc.then
        if late < 0:
            return begin_s, []
    for _ in range(moves):  # then it is on the circle, whatever led there
        late = by[late].one
    broken = [by[late]]
    while broken[-1].one != late:
        broken.append(by[broken[-1].one])
    return begin_s, broken
