"""A cycle as it repeats, a few periods of it: what the robot and the stations do, for a Gantt chart."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf

from lab.errors import BadInput
from lab.sequencing.cell.schedule import Activity, Move, Schedule, robot_activities
from lab.sequencing.cyclic.cycle import Cycle

MOST_PERIODS = 20


@dataclass(frozen=True)
class Steady:
    """So many periods of a cycle, from 0 on: its schedule without rows for parts, and what the parts in it are called."""

    cycle: Cycle
    periods: int
    schedule: Schedule
    names: dict[int, str]


def steady(cycle: Cycle, periods: int) -> Steady:
    """What happens in these periods. Parts are numbered from the first that is seen. BadInput for too many or no periods."""
    if not 1 <= periods <= MOST_PERIODS:
        raise BadInput(f"periods = {periods}: allowed are 1 to {MOST_PERIODS}")
    end_s, first = periods * cycle.period_s, -max(cycle.passed) - 1
    cycles = range(first, periods)
    robot = list(_robot(cycle, range(first, periods + 1)))
    robot.sort(key=lambda one: one.start_s)
    stays = [one for number in cycles for one in _stays(cycle, number, first)]
    stays.sort(key=lambda one: (cycle.line.cell.index(one.resource), one.start_s))
    rows = [[cut for one in row if (cut := _within(one, end_s))] for row in (robot, stays)]
    seen = sorted({one.part for row in rows for one in row if one.part is not None})
    number = {part: n for n, part in enumerate(seen, 1)}
    shown = [tuple(replace(one, part=number.get(one.part or 0)) for one in row) for row in rows]
    moves = {move.slot: cycle.product(move) for move in cycle.line.moves}
    names = {number[part]: f"{moves[(part - 1) % cycle.parts]} {number[part]}" for part in seen}
    return Steady(cycle, periods, Schedule(shown[0], shown[1], (), end_s, ()), names)


def _robot(cycle: Cycle, cycles: range) -> Iterator[Activity]:
    """The robot's row, move by move in the periods that these cycles begin in."""
    line, period_s = cycle.line, cycle.period_s
    names = line.cell.names
    at, left_s, before = "", -inf, 0
    for number in cycles:
        for n in cycle.order:
            move = line.moves[n]
            option, begin_s = move.option, cycle.begin_s[n] + number * period_s
            origin, target = names[option.origin], names[option.target]
            if at:
                reach_s = left_s + line.after_s(before, n)
                pick_s, drop_s = begin_s + option.service_s, begin_s + move.work_s
                part = (number - cycle.passed[n] - cycles[0]) * cycle.parts + move.slot + 1
                made = Move(part, at, origin, target, left_s, min(reach_s, begin_s), pick_s, drop_s)
                yield from robot_activities(replace(made, service_s=option.service_s, carries=option.carries))
            at, left_s, before = target, begin_s + move.work_s, n


def _stays(cycle: Cycle, number: int, first: int) -> Iterator[Activity]:
    """Where the parts that enter in a cycle stay between two moves of their own; their pallets take room, and no row."""
    line, cell = cycle.line, cycle.line.cell
    carried = [n for n, move in enumerate(line.moves) if move.option.carries == "part"]
    for drop, pick in pairwise(carried):
        brought, taken = line.moves[drop], line.moves[pick]
        if brought.slot != taken.slot:
            continue
        name, part = cell.names[brought.option.target], (number - first) * cycle.parts + brought.slot + 1
        come_s, gone_s = cycle.at_s(drop, number) + brought.work_s, cycle.at_s(pick, number) + taken.option.service_s
        if cell.stations[brought.option.target].kind == "machine":
            ready_s = min(come_s + (cell.positions[brought.option.to].processing_s or 0.0), gone_s)
            yield Activity(name, "process", part, name, name, come_s, ready_s)
            yield Activity(name, "blocked", part, name, name, ready_s, gone_s)
        else:
            yield Activity(name, "store", part, name, name, come_s, gone_s)


def _within(activity: Activity, end_s: float) -> Activity | None:
    """What of it lies between 0 and the end; None: nothing."""
    start_s, until_s = max(0.0, activity.start_s), min(end_s, activity.end_s)
    return replace(activity, start_s=start_s, end_s=until_s) if until_s > start_s + 1e-9 else None
