"""Drawn times, and rooms that are free or come free when decisions are not carried out in their order; compiled with numba.

Tests hold these functions equal to `chance`, `run` and `refusals`.
"""

from typing import Any

import numpy as np

from lab.learning import splitmix
from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.cell import chance
from lab.sequencing.cell.routes import SERVER
from lab.sequencing.simulate.cell_arrays import LAW_CODES, WIDTH

CONSTANT, NORMAL = LAW_CODES["constant"], LAW_CODES["normal"]

mixed: Any = inner(splitmix.mixed, inline="always")
fraction: Any = inner(splitmix.fraction, inline="always")
_state_at: Any = inner(splitmix.state_at, inline="always")
_normal, _exponential = inner(chance.normal), inner(chance.exponential)


@without_refcounts
def uniform(seed: Any, number: int) -> float:
    """`splitmix.uniform`."""
    return float(fraction(mixed(_state_at(seed, np.uint64(number)))))


@inner
def drawn(law: int, spread: float, mean_s: float, seed: Any, number: int) -> float:
    """`chance.Episode._drawn`: one time [s]."""
    if law == CONSTANT or mean_s == 0.0:
        return mean_s
    u, v = uniform(seed, 2 * number), uniform(seed, 2 * number + 1)
    if law == NORMAL:
        return _normal(mean_s, spread, u, v)
    return _exponential(mean_s, spread, u, v)


@inner
def apart(cell: Any, parts: int) -> int:
    """`chance.Episode._apart`."""
    return 2 * (parts + 1) * len(cell.begins)


@inner
def worked(cell: Any, seed: Any, part: int, there: int, parts: int) -> float:
    """`chance.Episode.processing_s` of a part (from 0)."""
    number = (part + 1) * len(cell.begins) + there
    work_s = drawn(cell.processing_law, cell.spread, cell.processing_s[there], seed, number)
    if cell.breaks_every_s == 0.0 or work_s == 0.0:
        return work_s
    first, worked_s, repaired_s = apart(cell, parts) + parts + 2 * chance.MOST_BREAKS * number, 0.0, 0.0
    for n in range(chance.MOST_BREAKS):
        worked_s -= cell.breaks_every_s * np.log(1.0 - uniform(seed, first + 2 * n))
        if worked_s >= work_s:
            break
        repaired_s -= cell.repair_s * np.log(1.0 - uniform(seed, first + 2 * n + 1))
    return work_s + repaired_s


@inner
def until(cell: Any, seed: Any, parts: int, robot: int, start_s: float, work_s: float) -> float:
    """`chance.Episode.until_s`, and `chance.through`."""
    if cell.robot_breaks_every_s == 0.0:
        return start_s + work_s
    first, until_s, n = apart(cell, parts) * (1 + chance.MOST_BREAKS) + parts, 0.0, robot
    while True:
        from_s = until_s - cell.robot_breaks_every_s * np.log(1.0 - uniform(seed, first + 2 * n))
        until_s = from_s - cell.robot_repair_s * np.log(1.0 - uniform(seed, first + 2 * n + 1))
        if from_s > start_s and from_s >= start_s + work_s:
            return start_s + work_s
        if until_s > start_s:
            work_s -= max(0.0, from_s - start_s)
            start_s = until_s
        n += len(cell.robot_starts)


@inner
def interval(cell: Any, seed: Any, part: int) -> float:
    """`chance.Episode.interval_s` of a part (from 0)."""
    number = (part + 1) * len(cell.begins) + cell.starts[part]
    return drawn(cell.arrivals_law, cell.spread, cell.interval_s[part], seed, number)


# ---- Rooms of stations ------------------------------------------------------------------------------------------------


@inner
def may_go_s(cell: Any, run: Any, part: int, o: int) -> float:
    """`Run._may_go_s`."""
    here, there, at_s = run.locations[part], cell.to[o], run.put_s[part]
    for h in range(WIDTH):
        station = cell.holds[here, h]
        if station != cell.holds[there, 0] and station != cell.holds[there, 1]:
            at_s = max(at_s, run.kept_s[station])
    if cell.if_full[o] < len(cell.rooms) - 2:
        for other in range(len(run.locations)):
            place = run.locations[other]
            if cell.holds[place, 0] == cell.if_full[o] or cell.holds[place, 1] == cell.if_full[o]:
                at_s = max(at_s, run.fetched_s[other])
    return float(at_s)


@inner
def in_order(cell: Any, run: Any, robot: int, at_s: float) -> float:
    """`Run.in_order_s`."""
    return float(until(cell, run.seed[0], len(run.locations), robot, at_s, 0.0))


@inner
def possible(cell: Any, run: Any, part: int, o: int) -> bool:
    """`Run._possible`."""
    first, second = cell.needs[o, 0], cell.needs[o, 1]
    if run.room[cell.if_full[o]] > 0:
        return False
    if not cell.shared:
        return bool(run.room[first] > 0 and run.room[second] > 0)
    for robot in range(len(run.held)):
        if run.held[robot, 0] == part or (run.held[robot, 0] >= 0 and cell.robot[o] == robot):
            return False
    return bool(
        (run.room[first] > 0 or _comes_free(cell, run, first, o))
        and (run.room[second] > 0 or _comes_free(cell, run, second, o))
    )


@inner
def _comes_free(cell: Any, run: Any, station: int, o: int) -> bool:
    """`Run._comes_free`; the room of a full station is minus the number of robots that wait for it."""
    if cell.takers[station, SERVER]:  # the last column
        return True
    for other in range(len(run.held)):
        freed = run.held[other, 2] == cell.origin[o] or run.held[other, 3] == cell.origin[o]
        if cell.takers[station, other] and other != cell.robot[o] and (run.held[other, 0] < 0 or freed):
            return True
    return False


@inner
def room_s(cell: Any, run: Any, station: int) -> float:
    """`Rooms.take` for one station: since when its first room is free [s]; the others move up in the row."""
    first, left = cell.first_room[station], run.room[station]
    if cell.first_room[station + 1] == first or left <= 0:
        return 0.0
    at_s = run.rooms_s[first]
    for i in range(first, first + left - 1):
        run.rooms_s[i] = run.rooms_s[i + 1]
    return float(at_s)


@inner
def free(cell: Any, run: Any, station: int, at_s: float) -> None:
    """`Rooms.free` without waiting robots: inserts a room that is free from `at_s` into the ascending row of a station."""
    first, i = cell.first_room[station], cell.first_room[station] + run.room[station]
    if cell.first_room[station + 1] == first:
        return
    while i > first and run.rooms_s[i - 1] > at_s:
        run.rooms_s[i] = run.rooms_s[i - 1]
        i -= 1
    run.rooms_s[i] = at_s


@inner
def grant(cell: Any, run: Any, station: int, at_s: float, seed: Any) -> None:
    """`Run._grant`."""
    robot = -1
    for other in range(len(run.held)):
        waits = run.held[other, 0] >= 0 and (run.held[other, 2] == station or run.held[other, 3] == station)
        if waits and (robot < 0 or run.held[other, 1] < run.held[robot, 1]):
            robot = other
    drop_s = run.robots_s[robot]
    if at_s > drop_s:
        drop_s = in_order(cell, run, robot, at_s)
    run.clock[1] += drop_s - run.robots_s[robot]
    run.robots_s[robot] = drop_s
    _put(cell, run, run.held[robot, 0], drop_s, seed)
    for w in range(WIDTH):
        if run.held[robot, 2 + w] == station:
            run.held[robot, 2 + w] = -1
    if run.held[robot, 2] < 0 and run.held[robot, 3] < 0:
        run.held[robot, 0] = -1


@inner
def _put(cell: Any, run: Any, part: int, at_s: float, seed: Any) -> None:
    """`Run._put`, except for the end of a part's routes, which takes no room."""
    there = run.locations[part]
    run.put_s[part] = at_s
    if cell.begins[there]:
        run.ready_s[part] = at_s + worked(cell, seed, part, there, len(run.locations))
    run.clock[3] = max(run.clock[3], at_s)


@inner
def hold_part(cell: Any, run: Any, part: int, o: int) -> None:
    """Lets a robot with a part wait for room in each station that has none."""
    number, robot = 0, cell.robot[o]
    for other in range(len(run.held)):
        if run.held[other, 0] >= 0:
            number = max(number, run.held[other, 1] + 1)
    run.held[robot, 1], run.held[robot, 2], run.held[robot, 3] = number, -1, -1
    for w in range(WIDTH):
        if run.room[cell.needs[o, w]] <= 0:
            run.held[robot, 0], run.held[robot, 2 + w] = part, cell.needs[o, w]
