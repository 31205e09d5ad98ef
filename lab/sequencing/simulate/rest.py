"""The remaining work of a run as a cell of its own, so that it can be replanned from the state reached."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, unknown
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import open_ways, reached_from
from lab.sequencing.cell.stations import Begins
from lab.sequencing.simulate.run import Run


@dataclass(frozen=True)
class Mishaps:
    """Differences between the real state and a run's. Parts are numbered from 1.

    lost: the parts that no longer exist. closed: the stations to which nothing may be brought from now on; None: as before.
    ready_s: when a part may be picked, counted from now [s]. moved: the station where a part really stands, or its position if
    the station has several; its processing there begins now. robot: the station where the robot is.
    """

    lost: frozenset[int] = frozenset()
    closed: tuple[str, ...] | None = None
    ready_s: Mapping[int, float] = field(default_factory=dict)
    moved: Mapping[int, str | int] = field(default_factory=dict)
    robot: str | None = None


@dataclass(frozen=True)
class Rest:
    """The remaining work. cell: None: there is none; its decisions are numbered as before.

    stuck: the parts that cannot be finished, each with the reason; they stay where they are and take room.
    """

    cell: Cell | None
    stuck: Mapping[int, str] = field(default_factory=dict)


NOTHING = Mishaps()


def rest_of(run: Run, mishaps: Mishaps = NOTHING, fallback_s: float | None = None) -> Rest:
    """The remaining work of a run, as a cell whose time 0 is the run's `now_s`.

    A part in a closed machine can be finished only if its processing there is done. Tardiness before now does not count (a due
    time that has passed becomes 0). fallback_s: the time of an empty move for which the run's cell has none, which may be needed
    when robot or parts are at unexpected stations; None: such a move is an error.
    Raises BadInput for unknown parts, stations and positions, and as Cell does.
    """
    cell = run.cell
    for part in (*mishaps.lost, *mishaps.ready_s, *mishaps.moved):
        if not 1 <= part <= cell.parts:
            raise BadInput(f"rest of a run: there is no part {part}, only 1 to {cell.parts}")
    robot = cell.names[run.robot] if mishaps.robot is None else mishaps.robot
    cell.index(robot)
    closed = cell.closed if mishaps.closed is None else mishaps.closed
    begins = [_begin(run, part, mishaps) for part in range(1, cell.parts + 1)]
    stuck = _stuck(cell, begins, {cell.index(name) for name in closed})
    begins = [replace(begin, stays=n in stuck) for n, begin in enumerate(begins, 1)]
    if all(begin.stays or begin.position is None or not cell.laid_out[begin.position].options for begin in begins):
        return Rest(None, stuck)
    arrivals, due_s = cell.arrivals, cell.due_s
    if arrivals is not None:
        arrivals = replace(arrivals, interval_s=_intervals_s(run, begins))
    if due_s is not None:
        due_s = tuple(max(0.0, due - run.now_s) for due in due_s)
    rest = replace(
        cell,
        robots=(replace(cell.robots[0], start=robot),),
        begins=tuple(begins),
        closed=closed,
        arrivals=arrivals,
        due_s=due_s,
        empty_s=cell.empty_s if fallback_s is None else _filled(cell, fallback_s),
    )
    return Rest(rest, stuck)


def _begin(run: Run, part: int, mishaps: Mishaps) -> Begins:
    """The present state of a part, ignoring closed stations."""
    cell, place = run.cell, run.locations[part - 1]
    known = cell.begins[part - 1] if cell.begins is not None else None
    if part in mishaps.lost:
        return Begins(None)
    if part in mishaps.moved:
        place = _position(cell, part, place, mishaps.moved[part])
        return Begins(place, mishaps.ready_s.get(part, cell.laid_out[place].processing_s or 0.0))
    if known is not None and (known.stays or known.position is None):  # the part was not moved
        return replace(known, stays=False, ready_s=mishaps.ready_s.get(part, known.ready_s))
    if not cell.laid_out[place].options:
        return Begins(place)
    comes = cell.arrivals is not None and place == cell.starts[part - 1]
    ready_s = run.ready_s[part - 1] - run.now_s
    if comes or cell.laid_out[place].at_most_s is None:
        ready_s = 0.0 if comes else max(0.0, ready_s)
    return Begins(place, mishaps.ready_s.get(part, ready_s))


def _position(cell: Cell, part: int, place: int, wanted: str | int) -> int:
    """The position of a part at a station: of several the nearest ahead of the run's position, else the nearest behind it."""
    product = cell.laid_out[cell.starts[part - 1]].product
    own = [n for n, at in enumerate(cell.laid_out) if at.product == product]
    if isinstance(wanted, int):
        if wanted not in own:
            raise BadInput(f"{cell.part_name(part)} moved to position {wanted}: its routes have {own[0]} to {own[-1]}")
        return wanted
    there = [n for n in own if cell.names[cell.laid_out[n].station] == wanted]
    if not there:
        names = dict.fromkeys(cell.names[cell.laid_out[n].station] for n in own)
        raise unknown("station", wanted, names, f"where {cell.part_name(part)} stands")
    here = place if place < len(cell.laid_out) else cell.starts[part - 1]
    ahead = [n for n in there if n in reached_from(cell.laid_out, {here})]
    behind = [n for n in there if here in reached_from(cell.laid_out, {n})]
    return ahead[0] if ahead else behind[-1] if behind else there[0]


def _stuck(cell: Cell, begins: Sequence[Begins], closed: set[int]) -> dict[int, str]:
    """The parts without an open path to an end of their routes, each with the reason; their room may shut out other parts."""
    stuck: dict[int, str] = {}
    shut = dict.fromkeys(closed, "out of use")
    while True:
        taken = [station for part in stuck for station in cell.laid_out[begins[part - 1].position or 0].holds]
        for station in taken:
            if station in cell.batches or taken.count(station) >= cell.capacities[station]:
                inside = next(part for part in stuck if station in cell.laid_out[begins[part - 1].position or 0].holds)
                shut.setdefault(station, f"taken by {cell.part_name(inside)}")
        positions = open_ways(cell.laid_out, shut)
        reasons = dict[int, str]()
        for part, begin in enumerate(begins, 1):
            if part in stuck or begin.position is None or not cell.laid_out[begin.position].options:
                continue
            at, name = cell.laid_out[begin.position], cell.names[cell.laid_out[begin.position].station]
            broken = [station for station in at.holds if station in closed]
            if broken and begin.ready_s > 0:
                reasons[part] = f"{cell.part_name(part)} is not done in '{cell.names[broken[0]]}', which is out of use"
            elif not positions[begin.position].options:
                way = ", ".join(
                    f"'{cell.names[n]}' is {why}" for n, why in shut.items() if n in _ahead(cell, begin.position)
                )
                reasons[part] = f"{cell.part_name(part)} at '{name}' cannot continue: {way}"
        reasons = reasons or _waiting(cell, begins, stuck)
        if not reasons:
            return stuck
        stuck |= reasons


def _waiting(cell: Cell, begins: Sequence[Begins], stuck: Collection[int]) -> dict[int, str]:
    """The parts that can never move because a precedence waits for parts which cannot make their step, with the reason."""
    reasons = dict[int, str]()
    for rule, precedence in zip(cell.rules, cell.precedences, strict=True):
        at = {part: begins[part - 1].position for part in (*precedence.parts, *precedence.of)}
        never = [
            part
            for part in precedence.of
            if (at[part] is None and not precedence.of_step.leaves) or (part in stuck and at[part] not in rule.ended)
        ]
        waiting = [n for n in precedence.parts if at[n] is not None and at[n] not in rule.made and n not in stuck]
        made = sum(at[part] in rule.made for part in precedence.parts)
        free = sum(count <= len(precedence.of) - len(never) for count in rule.counts)
        for part in waiting[max(0, free - made) :]:
            names = " and ".join(cell.part_name(other) for other in never)
            reasons[part] = (
                f"{cell.part_name(part)} may not {precedence.step}: {names} cannot {precedence.of_step} before"
            )
    return reasons


def _ahead(cell: Cell, place: int) -> set[int]:
    """The stations on all paths from a position."""
    return {way.target for at in reached_from(cell.laid_out, {place}) for way in cell.laid_out[at].options}


def _intervals_s(run: Run, begins: Sequence[Begins]) -> tuple[float, ...]:
    """The intervals of arrivals of the parts not fetched yet, counted from now [s]."""
    cell, came_s, intervals = run.cell, 0.0, list[float]()
    first = True
    for part, (begin, start) in enumerate(zip(begins, cell.starts, strict=True), 1):
        interval_s = cell.arrivals.interval_s[part - 1] if cell.arrivals else 0.0
        if begin.position != start:
            intervals.append(0.0)
            continue
        left_s = max(0.0, run.ready_s[part - 1] - run.now_s)
        if cell.arrivals is not None and cell.arrivals.after == "clock":
            interval_s, came_s = left_s - came_s, left_s
        elif first:
            interval_s = left_s
        intervals.append(interval_s)
        first = False
    return tuple(intervals)


def _filled(cell: Cell, fallback_s: float) -> NDArray[np.float64]:
    """The table of empty moves, with `fallback_s` for those without a time."""
    table = np.where(np.isnan(cell.empty_s), fallback_s, cell.empty_s)
    np.fill_diagonal(table, 0.0)
    return table
