"""The shortest period of a given cyclic order, and the cycle of shortest period over all orders and all paths of the parts."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import floor, inf
from typing import Any, NamedTuple

from lab.errors import BadInput, WorkFailed, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cyclic.line import CycleMove, Line, at_speed, away_s, lines
from lab.sequencing.methods import deferred
from lab.sequencing.simulate.follow import Arc, earliest
from lab.sequencing.simulate.run import SLACK_S

NEAR_S = 1e-3  # the most by which slack may shorten a period that is also feasible without slack


class TimedCycle(NamedTuple):
    """The shortest period [s], and the earliest begin of each move in it, counted from the first move.

    recurs: the number of cycles that the critical circuit of constraints spans. When all moves are made as early as possible,
    their intervals repeat after this many cycles, not always after one: with two identical places, every other cycle.
    """

    period_s: float
    begin_s: tuple[float, ...]
    recurs: int = 1


def arcs_of(line: Line, order: Sequence[int], wraps: Sequence[int], slack_s: float = 0.0) -> Iterator[Arc]:
    """The constraints of a cyclic order. order: the line's moves, the first of the cycle first.

    wraps: by stay, how many cycles begin between the move that brings a part and the one that takes it on, counted from the
    first move's begin. slack_s: tolerance of the latest picks.
    """
    for one, then in zip(order, [*order[1:], order[0]], strict=True):
        last = one == order[-1]
        yield Arc(one, then, line.moves[one].work_s + line.after_s(one, then), int(last))
    over = 0
    passed = [0]  # cycles begun before each move, along its part's path
    stays = {stay.pick: wraps[number] for number, stay in enumerate(line.stays)}
    for number in range(1, len(line.moves)):
        over = over + stays[number] if number in stays else 0
        passed.append(over)
    for span in (*line.stays, *line.needs):
        work_s, periods = line.moves[span.drop].work_s, passed[span.pick] - passed[span.drop]
        yield Arc(span.drop, span.pick, work_s + span.least_s, periods)
        if span.most_s < inf:
            yield Arc(span.pick, span.drop, -work_s - span.most_s - slack_s, -periods)


def shortest_period(line: Line, order: Sequence[int], wraps: Sequence[int]) -> TimedCycle | None:
    """The shortest period in which the order can be repeated; None when it cannot be repeated in any.

    Latest picks have the same tolerance as in the simulation (`SLACK_S`).
    """
    exact, slack = (_shortest(list(arcs_of(line, order, wraps, slack_s)), order[0]) for slack_s in (0.0, SLACK_S))
    if exact is not None and slack is not None and exact.period_s - slack.period_s > NEAR_S:
        return slack
    return exact or slack


def _shortest(arcs: Sequence[Arc], first: int) -> TimedCycle | None:
    """The shortest period in which all constraints hold; None: there is none.

    It begins with too short a period and increases it to the ratio of a violated circuit of constraints (Newton's method on the
    parametric longest path; Cochet-Terrasson et al. 1998 prove that it ends).
    """
    moves = 1 + max(arc.then for arc in arcs)
    if any(arc.least_s != arc.least_s for arc in arcs):
        return None  # the order contains an empty move that is never made
    period_s, recurs = 0.0, 1
    while True:
        begin_s, broken = earliest(arcs, moves, first, period_s)
        if not broken:
            return TimedCycle(period_s, tuple(begin_s), recurs)
        least_s, periods = sum(arc.least_s for arc in broken), sum(arc.periods for arc in broken)
        if periods <= 0 or least_s / periods <= period_s:
            return None
        period_s, recurs = least_s / periods, periods


# ---- The best cycle ---------------------------------------------------------------------------------------------------


TIME_LIMIT_S = 60.0


@dataclass(frozen=True)
class Cycle:
    """A cycle: the order of the line's moves, the first at time 0, and the period [s].

    begin_s: by move, when the robot begins it (with its service) in the period. wraps: by stay, how many cycles begin while a
    part stays. recurs: see `TimedCycle`. bound_s: a lower bound of the period of all cycles with as many parts; proven: whether
    no period is shorter than this one, within some microseconds.
    """

    line: Line
    period_s: float
    begin_s: tuple[float, ...]
    order: tuple[int, ...]
    wraps: tuple[int, ...]
    recurs: int = 1
    bound_s: float = 0.0
    proven: bool = False

    @property
    def parts(self) -> int:
        """The number of parts that enter, and leave, in a cycle."""
        return len(self.line.paths)

    @cached_property
    def passed(self) -> tuple[int, ...]:
        """By move, how many cycles have begun since its part entered."""
        over, passes, stays = 0, list[int](), {stay.pick: n for n, stay in enumerate(self.line.stays)}
        for number in range(len(self.line.moves)):
            over = over + self.wraps[stays[number]] if number in stays else 0
            passes.append(over)
        return tuple(passes)

    def at_s(self, move: int, cycle: int = 0) -> float:
        """When a move begins for the part that enters in a given cycle, which begins at cycle * period [s]."""
        return self.begin_s[move] + (self.passed[move] + cycle) * self.period_s

    @cached_property
    def most_in_work(self) -> int:
        """The largest number of parts that are between their first pick and their last drop at once."""
        ends = [(own[0], own[-1]) for own in self._of_slots()]
        spans = [(self.at_s(first), self.at_s(last) + self.line.moves[last].work_s) for first, last in ends]
        period_s = self.period_s

        def there(at_s: float) -> int:
            return sum(floor((at_s - a) / period_s + 1e-9) - floor((at_s - b) / period_s + 1e-9) for a, b in spans)

        return max(there(at_s) for at_s, _ in spans)

    def to_json(self) -> list[dict[str, Any]]:
        """The moves in order: the part's product, origin, target, begin in the period, and periods since the part entered."""
        names, moves = self.line.cell.names, self.line.moves

        def row(number: int) -> dict[str, Any]:
            move, begin_s = moves[number], self.begin_s[number]
            return {
                "part": move.slot + 1,
                "product": self.product(move),
                "origin": names[move.option.origin],
                "target": names[move.option.target],
                "carries": move.option.carries,
                "pick_s": begin_s + move.option.service_s,
                "drop_s": begin_s + move.work_s,
                "periods": self.passed[number],
            }

        return [row(number) for number in self.order]

    def product(self, move: CycleMove) -> str:
        """The name of the product of a move's part."""
        cell = self.line.cell
        return cell.products[cell.positions[move.place].product].name

    def _of_slots(self) -> list[list[int]]:
        by_slot: list[list[int]] = [[] for _ in self.line.paths]
        for number, move in enumerate(self.line.moves):
            by_slot[move.slot].append(number)
        return by_slot


def best_cycle(cell: Cell, mix: Sequence[str], time_limit_s: float = TIME_LIMIT_S, seed: int = 0) -> Cycle:
    """The cycle of shortest period that one robot can repeat for ever with `mix` (products) entering in each cycle.

    Of the cell's order only the products count; all parts wait at the start of their routes, and the robot may wait deliberately.
    Every combination of the parts' paths is a line with a model of its own; lines that cannot beat the incumbent are skipped.
    Raises BadInput for a cell that has no such cycle (`check_cyclic`) or too large a one, WorkFailed when none was found.
    Source: Phillips and Unger 1976, AIIE Transactions 8(2) (one hoist, time windows).
    """
    check_cyclic(cell, mix)
    searched = shortest(at_speed(cell), mix, time_limit_s, seed)
    if searched.cycle is None:
        why = "it is proven that there is none" if searched.above_s == inf else f"none was found in {time_limit_s:g} s"
        raise WorkFailed(f"no order of {counted(len(mix), 'part')} a cycle can be repeated for ever: {why}")
    return searched.cycle


class ShortestCycle(NamedTuple):
    """The result of a search for cycles. cycle: the shortest one found; None: none.

    above_s: a lower bound of the periods searched [s]; inf: no cycle exists. proven: whether no cycle is shorter than the one
    found, or none exists.
    """

    cycle: Cycle | None
    above_s: float
    proven: bool


def shortest(
    cell: Cell, mix: Sequence[str], time_limit_s: float, seed: int, least_s: float = 0.0, below_s: float = inf
) -> ShortestCycle:
    """The shortest cycle of a mix with a period below `below_s`; least_s: a known lower bound of the period.

    cell: must have the times of its one robot (`at_speed`).
    """
    began = time.perf_counter()
    away = away_s(cell)
    # Of equal periods that with the fewest moves is found first, and stays.
    ahead = [(len(line.moves), max(line.bound_s(away), least_s), n, line) for n, line in enumerate(lines(cell, mix))]
    ahead.sort(key=lambda entry: entry[:3])
    best: Cycle | None = None
    above_s, resolution_s = inf, 0.0
    for _, bound_s, _, line in ahead:
        units = deferred.Units.of(line)
        resolution_s = max(resolution_s, units.resolution_s)
        # A quick solve for a good cycle, one for a bound, and one to close the gap between the two.
        steps = (units.coarse, False), (units.coarse, True), (units.fine, units.rounded)
        for step, (unit, loose) in enumerate(steps):
            best_s = below_s if best is None else best.period_s
            left_s = time_limit_s - (time.perf_counter() - began)
            if bound_s >= best_s - units.resolution_s or left_s <= 0:
                break
            answer = deferred.CycleModel(line, away, bound_s, best_s, unit, loose).solve(left_s, seed)
            bound_s = max(bound_s, answer.above_s) if step else bound_s
            timed = shortest_period(line, answer.order, answer.wraps) if answer.order else None
            if timed is not None and timed.period_s < best_s:
                best = Cycle(line, timed.period_s, timed.begin_s, answer.order, answer.wraps, timed.recurs)
        above_s = min(above_s, bound_s)
    if best is None:
        return ShortestCycle(None, above_s, above_s >= below_s - resolution_s)
    proven = best.period_s - above_s <= resolution_s
    bound_s = best.period_s if proven else above_s
    return ShortestCycle(replace(best, bound_s=bound_s, proven=proven), bound_s, proven)


def check_cyclic(cell: Cell, mix: Sequence[str]) -> None:
    """Raises BadInput for a cell that cyclic orders do not support, and for a mix with products that it does not make."""
    if cell.arrivals is not None:
        raise BadInput(
            "--cyclic: parts arrive one by one in this cell; in a cycle all wait at the start: remove [arrivals]"
        )
    if len(cell.robots) != 1:
        raise BadInput(f"--cyclic: the cell has {counted(len(cell.robots), 'robot')}; only cells with 1 are supported")
    for station in cell.stations:
        if station.servers is not None:
            raise BadInput(
                f"--cyclic: station '{station.name}' has servers and a queue; in a cycle each part is worked on where and "
                "when it is put down: remove servers"
            )
        if station.batch:
            raise BadInput(
                f"--cyclic: station '{station.name}' has batch = true, which a cycle does not support: remove it"
            )
    if cell.precedences:
        raise BadInput(
            "--cyclic: the cell has precedences between parts, which a cycle does not support: remove --cyclic"
        )
    if cell.begins is not None or cell.closed:
        raise BadInput("--cyclic: the work is in its middle, or a station is closed; a cycle needs the whole cell")
    for name in mix:
        if name not in cell.order:
            raise BadInput(f"--cyclic: the cell's order has no '{name}'; it has {', '.join(dict.fromkeys(cell.order))}")
    if not mix:
        raise BadInput("--cyclic: no part enters in a cycle; allowed is 1 or more")
