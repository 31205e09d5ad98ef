"""The shortest period of a given cyclic order: difference constraints whose right sides grow with the period."""

from collections.abc import Iterator, Sequence
from math import inf
from typing import NamedTuple

from lab.sequencing.cyclic.line import Line
from lab.sequencing.simulate.constraints import Arc, earliest
from lab.sequencing.simulate.run import SLACK_S

NEAR_S = 1e-3  # as much as slack may shorten a period that can be kept without


class Timed(NamedTuple):
    """The shortest period [s], and when each move of the line begins, in that period, as early as can be after the first.

    recurs: through how many cycles the demands go round that keep it from being shorter. Carried out as early as can be, the
    moves come in the same intervals after so many cycles, not always after one: with two places alike, every other one.
    """

    period_s: float
    begin_s: tuple[float, ...]
    recurs: int = 1


def arcs_of(line: Line, order: Sequence[int], wraps: Sequence[int], slack_s: float = 0.0) -> Iterator[Arc]:
    """What a cyclic order demands. order: the line's moves, the first of the cycle first; wraps: by stay, how many
    cycles begin between the move that brings a part and the one that takes it on, as seen from the first move's begin.
    slack_s: so much too late is not too late."""
    for one, then in zip(order, [*order[1:], order[0]], strict=True):
        last = one == order[-1]
        yield Arc(one, then, line.moves[one].work_s + line.after_s(one, then), int(last))
    over = 0
    passed = [0]  # cycles passed until each move, along its part's way
    stays = {stay.pick: wraps[number] for number, stay in enumerate(line.stays)}
    for number in range(1, len(line.moves)):
        over = over + stays[number] if number in stays else 0
        passed.append(over)
    for span in (*line.stays, *line.needs):
        work_s, periods = line.moves[span.drop].work_s, passed[span.pick] - passed[span.drop]
        yield Arc(span.drop, span.pick, work_s + span.least_s, periods)
        if span.most_s < inf:
            yield Arc(span.pick, span.drop, -work_s - span.most_s - slack_s, -periods)


def shortest_period(line: Line, order: Sequence[int], wraps: Sequence[int]) -> Timed | None:
    """The shortest period in which the order can be repeated; None: in none.

    What can only just not be done in time is in time, as in the simulation (`SLACK_S`).
    """
    exact, slack = (_shortest(list(arcs_of(line, order, wraps, slack_s)), order[0]) for slack_s in (0.0, SLACK_S))
    if exact is not None and slack is not None and exact.period_s - slack.period_s > NEAR_S:
        return slack
    return exact or slack


def _shortest(arcs: Sequence[Arc], first: int) -> Timed | None:
    """The shortest period in which these can be kept.

    From too short a period upwards, each time to the ratio of a cycle of demands that it breaks (Newton's method on
    the parametric longest path; Cochet-Terrasson et al. 1998 prove that it ends).
    """
    moves = 1 + max(arc.then for arc in arcs)
    if any(arc.least_s != arc.least_s for arc in arcs):
        return None  # an empty way that is never made
    period_s, recurs = 0.0, 1
    while True:
        begin_s, broken = earliest(arcs, moves, first, period_s)
        if not broken:
            return Timed(period_s, tuple(begin_s), recurs)
        least_s, periods = sum(arc.least_s for arc in broken), sum(arc.periods for arc in broken)
        if periods <= 0 or least_s / periods <= period_s:
            return None
        period_s, recurs = least_s / periods, periods
