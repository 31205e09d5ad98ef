"""The simulation of a cell, compiled with numba; held equal to `run`, `chance` and `objectives`. Sessions learn in it."""

from typing import Any

import numpy as np

from lab.learning import splitmix
from lab.learning.compiled import inner, lean
from lab.sequencing.cell import chance
from lab.sequencing.cell.routes import SERVER
from lab.sequencing.simulate.cell_arrays import ARRIVAL_CODES, LAW_CODES, NO_ARRIVALS, OBJECTIVE_CODES, WIDTH
from lab.sequencing.simulate.run import SLACK_S

CLOCK, PICK = ARRIVAL_CODES["clock"], ARRIVAL_CODES["pick"]
CONSTANT, NORMAL = LAW_CODES["constant"], LAW_CODES["normal"]
MAKESPAN, TARDINESS, ROBOT_IDLE, MACHINE_IDLE = (
    OBJECTIVE_CODES[name] for name in ("makespan", "mean-tardiness", "robot-idle", "machine-idle")
)

mixed: Any = inner(splitmix.mixed, inline="always")
fraction: Any = inner(splitmix.fraction, inline="always")
_state_at: Any = inner(splitmix.state_at, inline="always")
_normal, _exponential = inner(chance.normal), inner(chance.exponential)


@lean
def uniform(seed: Any, number: int) -> float:
    """`splitmix.uniform`."""
    return float(fraction(mixed(_state_at(seed, np.uint64(number)))))


@inner
def _drawn(law: int, spread: float, mean_s: float, seed: Any, number: int) -> float:
    """`chance.Episode`: one time [s]."""
    if law == CONSTANT or mean_s == 0.0:
        return mean_s
    u, v = uniform(seed, 2 * number), uniform(seed, 2 * number + 1)
    if law == NORMAL:
        return _normal(mean_s, spread, u, v)
    return _exponential(mean_s, spread, u, v)


@inner
def _apart(cell: Any, parts: int) -> int:
    """`chance.Episode._apart`."""
    return 2 * (parts + 1) * len(cell.begins)


@inner
def _worked(cell: Any, seed: Any, part: int, there: int, parts: int) -> float:
    """`chance.Episode.processing_s` of a part (from 0)."""
    number = (part + 1) * len(cell.begins) + there
    work_s = _drawn(cell.processing_law, cell.spread, cell.processing_s[there], seed, number)
    if cell.breaks_every_s == 0.0 or work_s == 0.0:
        return work_s
    first, worked_s, repaired_s = _apart(cell, parts) + parts + 2 * chance.MOST_BREAKS * number, 0.0, 0.0
    for n in range(chance.MOST_BREAKS):
        worked_s -= cell.breaks_every_s * np.log(1.0 - uniform(seed, first + 2 * n))
        if worked_s >= work_s:
            break
        repaired_s -= cell.repair_s * np.log(1.0 - uniform(seed, first + 2 * n + 1))
    return work_s + repaired_s


@inner
def _interval(cell: Any, seed: Any, part: int) -> float:
    """`chance.Episode.interval_s` of a part (from 0)."""
    number = (part + 1) * len(cell.begins) + cell.starts[part]
    return _drawn(cell.arrivals_law, cell.spread, cell.interval_s[part], seed, number)


@lean
def reset(cell: Any, run: Any, seed: Any) -> None:
    """`Run.__init__`, with the times of an episode's seed (uint64)."""
    unfinished, came_s = 0, 0.0
    for station in range(len(cell.rooms)):
        run.room[station] = cell.rooms[station]
    for part in range(len(run.locations)):
        place = cell.begin_at[part]
        run.locations[part], run.ready_s[part], run.finished_s[part] = place, cell.begin_s[part], 0.0
        if cell.late_s > 0.0 and place == cell.starts[part]:
            late = _apart(cell, len(run.locations)) + part
            run.ready_s[part] -= cell.late_s * np.log(1.0 - uniform(seed, late))
        run.room[cell.holds[place, 0]] -= 1
        run.room[cell.holds[place, 1]] -= 1
        if cell.first_option[place] < cell.first_option[place + 1]:
            unfinished += 1
    for i in range(len(cell.coming)):
        if cell.arrivals == CLOCK or (cell.arrivals == PICK and i == 0):
            came_s += _interval(cell, seed, cell.coming[i])
            run.ready_s[cell.coming[i]] = came_s
    run.clock[:] = 0.0
    run.whole[0], run.whole[1] = 0, unfinished
    for robot in range(len(cell.robot_starts)):
        run.robots_at[robot], run.robots_s[robot] = cell.robot_starts[robot], 0.0
    if not cell.serial:
        run.rooms_s[:], run.servers_s[:], run.worked[:] = 0.0, 0.0, -1
        run.track_s[:] = 0.0


@inner
def _clear_s(cell: Any, run: Any, robot: int, origin: int, target: int, at_s: float) -> float:
    """`Run._clear_s`."""
    if cell.tracked:
        way = origin * (len(cell.rooms) - 2) + target
        for i in range(cell.first_held[way], cell.first_held[way + 1]):
            at_s = max(at_s, run.track_s[cell.held[i]] - cell.held_from_s[robot, i])
    return at_s


@inner
def _hold(cell: Any, run: Any, robot: int, origin: int, target: int, leave_s: float) -> None:
    """`Run._hold`."""
    way = origin * (len(cell.rooms) - 2) + target
    for i in range(cell.first_held[way], cell.first_held[way + 1]):
        run.track_s[cell.held[i]] = leave_s + cell.held_until_s[robot, i]


@inner
def _leaves_s(cell: Any, run: Any, o: int) -> float:
    """When the robot of a way sets out for where it picks."""
    robot = cell.robot[o]
    return float(_clear_s(cell, run, robot, run.robots_at[robot], cell.origin[o], run.robots_s[robot]))


@inner
def reached_s(cell: Any, run: Any, o: int) -> float:
    """`Run.reach_s`."""
    robot = cell.robot[o]
    return float(_leaves_s(cell, run, o) + cell.empty_s[robot, run.robots_at[robot], cell.origin[o]])


@inner
def pick_times(cell: Any, run: Any, part: int, o: int) -> Any:
    """When a robot, if it goes there now, begins the service that ends with the pick of a part (from 0), and when it picks."""
    robot, begin_s = cell.robot[o], reached_s(cell, run, o)
    if cell.waits[o]:
        begin_s = max(begin_s, run.ready_s[part])
    pick_s = begin_s + cell.service_s[o]
    if cell.tracked:
        pick_s = _clear_s(cell, run, robot, cell.origin[o], cell.target[o], pick_s)
        begin_s = pick_s - cell.service_s[o]
    return begin_s, pick_s


@inner
def _too_late(cell: Any, run: Any, part: int, o: int) -> bool:
    """`Run.too_late`."""
    at_most_s = cell.at_most_s[run.locations[part]]
    if at_most_s == np.inf or not cell.waits[o]:
        return False
    if cell.robot[o] == SERVER:
        pick_s = max(server_for(cell, run, part, o)[0], run.ready_s[part]) + cell.service_s[o]
    else:
        pick_s = pick_times(cell, run, part, o)[1]
    return bool(pick_s > run.ready_s[part] + at_most_s + SLACK_S)


@inner
def _waits_for(cell: Any, run: Any, part: int, o: int) -> bool:
    """`Run._waits_for`: whether a precedence lets a part (from 0) wait."""
    here, there = run.locations[part], cell.to[o]
    for r in range(len(cell.made)):
        if cell.made[r, there] and not cell.made[r, here]:
            made, ended = 0, 0
            for place in run.locations:
                made += cell.made[r, place]
                ended += cell.ended[r, place]
            if made < cell.counts.shape[1] and ended < cell.counts[r, made]:
                return True
    return False


@inner
def server_for(cell: Any, run: Any, part: int, o: int) -> Any:
    """`Run._server`."""
    station, best_s, best = cell.target[o], np.inf, -1
    for server in range(cell.first_server[station], cell.first_server[station + 1]):
        free_s = run.servers_s[server]
        if run.worked[server] >= 0:
            free_s += cell.setup_s[station, run.worked[server], cell.product[part]]
        begin_s = max(run.ready_s[part], free_s)
        if begin_s < best_s:
            best_s, best = begin_s, server
    return best_s, best


@inner
def _room(cell: Any, run: Any, station: int) -> float:
    """Since when the room of a station that is free first is free; it is taken: the row's last place is then left."""
    first, left = cell.first_room[station], run.room[station]
    if cell.first_room[station + 1] == first:
        return 0.0
    at_s = run.rooms_s[first]
    for i in range(first, first + left - 1):
        run.rooms_s[i] = run.rooms_s[i + 1]
    return float(at_s)


@inner
def _free(cell: Any, run: Any, station: int, at_s: float) -> None:
    """A room of a station is free from then on; those that are free stand ascending."""
    first, i = cell.first_room[station], cell.first_room[station] + run.room[station]
    if cell.first_room[station + 1] == first:
        return
    while i > first and run.rooms_s[i - 1] > at_s:
        run.rooms_s[i] = run.rooms_s[i - 1]
        i -= 1
    run.rooms_s[i] = at_s


@lean
def list_allowed(cell: Any, run: Any) -> int:
    """`Run.allowed`: how many decisions may be taken now; they stand in run.allowed, what they mean in run.options."""
    parts, count = len(run.locations), 0
    for part in range(parts):
        place = run.locations[part]
        if cell.arrivals != NO_ARRIVALS and place == cell.starts[part] and part != cell.coming[run.whole[0]]:
            continue
        for o in range(cell.first_option[place], cell.first_option[place + 1]):
            room = run.room[cell.needs[o, 0]] > 0 and run.room[cell.needs[o, 1]] > 0
            if cell.ruled and _waits_for(cell, run, part, o):
                continue
            if room and run.room[cell.if_full[o]] <= 0 and not (cell.windows and _too_late(cell, run, part, o)):
                run.allowed[count], run.options[count] = part + 1 + cell.choice[o] * parts, o
                count += 1
    if cell.many:
        _sort(run, count)
    return count


@inner
def _sort(run: Any, count: int) -> None:
    """The allowed decisions into ascending order; with one choice a part they are listed so."""
    for j in range(1, count):
        i, decision, o = j, run.allowed[j], run.options[j]
        while i > 0 and run.allowed[i - 1] > decision:
            run.allowed[i], run.options[i] = run.allowed[i - 1], run.options[i - 1]
            i -= 1
        run.allowed[i], run.options[i] = decision, o


@lean
def move(cell: Any, run: Any, i: int, seed: Any) -> None:
    """`Run.move`: carries out the i-th of the allowed decisions, with the times of an episode's seed."""
    take(cell, run, (run.allowed[i] - 1) % len(run.locations), run.options[i], seed)


@lean
def may(cell: Any, run: Any, part: int, o: int) -> bool:
    """Whether a part (from 0) may take a way of its position now."""
    place = run.locations[part]
    if cell.arrivals != NO_ARRIVALS and place == cell.starts[part] and part != cell.coming[run.whole[0]]:
        return False
    if cell.ruled and _waits_for(cell, run, part, o):
        return False
    room = run.room[cell.needs[o, 0]] > 0 and run.room[cell.needs[o, 1]] > 0
    return bool(room and run.room[cell.if_full[o]] <= 0 and not (cell.windows and _too_late(cell, run, part, o)))


@lean
def take(cell: Any, run: Any, part: int, o: int, seed: Any) -> None:
    """A part (from 0) takes a way that it may take, with the times of an episode's seed."""
    robot = cell.robot[o]
    here, there, server, reach_s = run.locations[part], cell.to[o], 0, 0.0
    if robot == SERVER:
        pick_s, server = server_for(cell, run, part, o)
        drop_s = pick_s
    else:
        reach_s = reached_s(cell, run, o)
        begin_s, pick_s = pick_times(cell, run, part, o)
        drop_s = pick_s + cell.loaded_s[robot, cell.origin[o], cell.target[o]]
        if cell.tracked:
            leave_s = _leaves_s(cell, run, o)
            run.clock[1] += leave_s - run.robots_s[robot]
            _hold(cell, run, robot, run.robots_at[robot], cell.origin[o], leave_s)
            _hold(cell, run, robot, cell.origin[o], cell.target[o], pick_s)
        run.clock[1] += begin_s - reach_s
    if here == cell.starts[part]:
        run.whole[0] += 1
        if cell.arrivals == PICK and run.whole[0] < len(cell.coming):
            following = cell.coming[run.whole[0]]
            run.ready_s[following] = pick_s + _interval(cell, seed, following)
    if robot != SERVER and not cell.serial:
        carried_s = drop_s
        drop_s = max(drop_s, _room(cell, run, cell.needs[o, 0]), _room(cell, run, cell.needs[o, 1]))
        run.clock[1] += drop_s - carried_s
    process_s = 0.0
    if cell.begins[there]:
        process_s = _worked(cell, seed, part, there, len(run.locations))
        run.ready_s[part] = drop_s + process_s
        run.clock[2] += process_s
    end_s = drop_s + process_s if robot == SERVER else drop_s
    if not cell.serial:
        left_s = end_s if robot == SERVER else pick_s
        for h in range(WIDTH):
            station = cell.holds[here, h]
            if station != cell.holds[there, 0] and station != cell.holds[there, 1]:
                _free(cell, run, station, left_s)
    run.room[cell.holds[here, 0]] += 1  # WIDTH stations, written out: a loop takes twice the time of the whole move
    run.room[cell.holds[here, 1]] += 1
    run.room[cell.holds[there, 0]] -= 1
    run.room[cell.holds[there, 1]] -= 1
    run.locations[part] = there
    if robot == SERVER:
        run.servers_s[server], run.worked[server] = end_s, cell.product[part]
    else:
        run.robots_at[robot], run.robots_s[robot] = cell.target[o], drop_s
    run.clock[3] = max(run.clock[3], end_s)
    now_s = np.inf
    for free_s in run.robots_s:
        now_s = min(now_s, free_s)
    run.clock[0] = now_s if len(run.robots_s) > 0 else run.clock[3]
    if cell.first_option[there] == cell.first_option[there + 1]:
        run.finished_s[part] = end_s
        run.whole[1] -= 1


@lean
def cost(cell: Any, run: Any) -> float:
    """`objectives.cost`."""
    if run.whole[1] > 0:
        return float(cell.stuck_cost)
    if cell.objective == MAKESPAN:
        return float(run.clock[3])
    if cell.objective == ROBOT_IDLE:
        return float(run.clock[1])
    if cell.objective == MACHINE_IDLE:
        return float(cell.machines * run.clock[3] - run.clock[2])
    total = 0.0
    for part in range(len(run.locations)):
        late_s = max(0.0, run.finished_s[part] - cell.due_s[part])
        total += late_s if cell.objective == TARDINESS else (1.0 if late_s > 0 else 0.0)
    return total / len(run.locations) if cell.objective == TARDINESS else total


@lean
def follow(cell: Any, run: Any, sequence: Any, seed: Any) -> float:
    """The cost of a sequence of decisions with the times of an episode's seed; NaN when one of them may not be taken.

    What the sequence leaves undone counts as a deadlock; where parts may be picked too late, so does what may not be taken.
    """
    reset(cell, run, seed)
    for decision in sequence:
        count, i = list_allowed(cell, run), 0
        while i < count and run.allowed[i] != decision:
            i += 1
        if i == count:
            return float(cell.stuck_cost) if cell.windows else float(np.nan)
        move(cell, run, i, seed)
    return cost(cell, run)


@lean
def follow_all(cell: Any, run: Any, sequences: Any, lengths: Any, seeds: Any, costs: Any) -> None:
    """`follow` of each row of sequences (N, L), as many decisions as lengths (N,) says, with M seeds; costs (N, M)."""
    for n in range(len(sequences)):
        for m in range(len(seeds)):
            costs[n, m] = follow(cell, run, sequences[n, : lengths[n]], seeds[m])
