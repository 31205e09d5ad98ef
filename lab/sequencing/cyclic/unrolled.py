"""A cycle over time: its steady state for some periods, and the finite order that fills the line, repeats, and empties it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count, pairwise
from math import inf
from statistics import median
from typing import NamedTuple

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option, entry, reached_from
from lab.sequencing.cell.schedule import Activity, Move, Schedule, robot_activities
from lab.sequencing.cell.stations import Product
from lab.sequencing.cyclic.cycle import Cycle
from lab.sequencing.simulate.follow import simulate, waits_in
from lab.sequencing.simulate.run import Run


@dataclass(frozen=True)
class Steady:
    """Some periods of a cycle from time 0 on: the schedule, without rows for parts, and the names of the parts in it."""

    cycle: Cycle
    periods: int
    schedule: Schedule
    names: dict[int, str]


def steady(cycle: Cycle, periods: int) -> Steady:
    """The steady state of a cycle. Parts are numbered from the first one seen; raises BadInput for no periods."""
    if periods < 1:
        raise BadInput(f"periods = {periods}: allowed are whole numbers from 1")
    end_s, first = periods * cycle.period_s, -max(cycle.passed) - 1
    cycles = range(first, periods)
    robot = list(_robot(cycle, range(first, periods + 1)))
    robot.sort(key=lambda activity: activity.start_s)
    stays = [stay for number in cycles for stay in _stays(cycle, number, first)]
    stays.sort(key=lambda stay: (cycle.line.cell.index(stay.resource), stay.start_s))
    rows = [[cut for activity in row if (cut := _within(activity, end_s))] for row in (robot, stays)]
    seen = sorted({activity.part for row in rows for activity in row if activity.part is not None})
    number = {part: n for n, part in enumerate(seen, 1)}
    shown = [tuple(replace(activity, part=number.get(activity.part or 0)) for activity in row) for row in rows]
    moves = {move.slot: cycle.product(move) for move in cycle.line.moves}
    names = {number[part]: f"{moves[(part - 1) % cycle.parts]} {number[part]}" for part in seen}
    return Steady(cycle, periods, Schedule(shown[0], shown[1], (), end_s, ()), names)


def _robot(cycle: Cycle, cycles: range) -> Iterator[Activity]:
    """The robot's activities, move by move, in the given cycles."""
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
    """The activities of stations for the parts that enter in a cycle, between their moves; pallets get no activities."""
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
    """The part of an activity that lies between 0 and `end_s`; None: it lies outside."""
    start_s, until_s = max(0.0, activity.start_s), min(end_s, activity.end_s)
    return replace(activity, start_s=start_s, end_s=until_s) if until_s > start_s + 1e-9 else None


# ---- The finite order -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Unrolled:
    """A finite order that repeats a cycle: its cell, the decisions (see `Run`) and the schedule.

    waits: whether the robot waits deliberately so that no part is picked too late; else every move is made as early as possible,
    and `simulate` gives the same schedule.
    """

    cell: Cell
    sequence: tuple[int, ...]
    schedule: Schedule
    waits: bool


class _Turn(NamedTuple):
    """One move of the finite order: the part, the position that it leaves, and the option that it takes."""

    part: int
    place: int
    option: Option


def of_parts(cell: Cell, mix: Sequence[str], parts: int) -> Cell:
    """The cell with `parts` parts, their products in the order of the cycles; raises BadInput as any cell."""
    order = tuple(mix[number % len(mix)] for number in range(parts))
    return replace(cell, order=order, due_s=None)


def period_of(schedule: Schedule, cycle: Cycle) -> float | None:
    """The period of a schedule that repeats a cycle; None when there are too few parts.

    It is the median time per cycle between the ends of two parts that are `cycle.recurs` cycles apart. Parts that end while the
    line is filled or emptied are left out where enough others remain.
    """
    ends_s = sorted({a.part: a.end_s for a in schedule.parts if a.kind == "carry"}.values())
    apart_s = [
        (later - end) / cycle.recurs for end, later in zip(ends_s, ends_s[cycle.parts * cycle.recurs :], strict=False)
    ]
    inside = cycle.parts * max(1, *cycle.passed)  # as many parts are still there when the last ones have entered
    apart_s = apart_s[:-inside] or apart_s[:1]
    apart_s = apart_s[cycle.parts :] or apart_s[-1:]
    return median(apart_s) if apart_s else None


def unrolled(cycle: Cycle, cell: Cell) -> Unrolled:
    """The finite order of a cell's parts that makes the moves of a cycle, in the cycle's order.

    Moves of parts before the first and after the last are left out. The first parts skip buffers that are used only when the
    machine ahead is full. Raises WorkFailed when the line cannot be filled this way, which buffers may cause.
    """
    free = cell.without_windows  # only the order matters here
    run, sequence = Run(free), list[int]()
    for turn in _turns(cycle, cell):
        here = run.locations[turn.part - 1]
        if here != turn.place and here in reached_from(cell.positions, {turn.place}):
            continue  # the part skipped the buffer
        decision = entry(turn.part, turn.option.choice, cell.parts)
        way = run.option(decision) if here == turn.place else None
        if way is None:
            name, where = cell.part_name(turn.part), cell.names[cell.positions[here].station]
            raise WorkFailed(
                f"the cycle cannot be begun with an empty line: {name} at '{where}' cannot do what it does in the cycle"
            )
        sequence.append(decision)
        run.move(decision)
    try:
        return Unrolled(cell, tuple(sequence), simulate(cell, sequence), bool(waits_in(Run(cell), sequence)))
    except BadInput:
        if not cell.has_windows:
            raise
    raise WorkFailed("the line cannot be filled and emptied by this cycle: a part would be picked too late")


def _turns(cycle: Cycle, cell: Cell) -> Iterator[_Turn]:
    """The moves of all parts in the order of the cycles."""
    waiting = {product.name: iter(_numbers(cell, product)) for product in cell.products}
    moves, first = cycle.line.moves, {move.slot: number for number, move in reversed([*enumerate(cycle.line.moves)])}
    rank = {move: number for number, move in enumerate(cycle.order)}
    slots = sorted(first, key=lambda slot: rank[first[slot]])
    turns, left = list[tuple[int, int, _Turn]](), cell.parts
    for number in count():
        for slot in slots:
            part = next(waiting[cycle.product(moves[first[slot]])], None)
            if part is None:
                continue
            left -= 1
            for n, move in enumerate(moves):
                if move.slot == slot:
                    turns.append((number + cycle.passed[n], rank[n], _Turn(part, move.place, move.option)))
        if not left:
            break
    return (turn for _, _, turn in sorted(turns, key=lambda one: one[:2]))


def _numbers(cell: Cell, product: Product) -> list[int]:
    return [number for number, name in enumerate(cell.order, 1) if name == product.name]
