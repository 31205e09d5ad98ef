"""The simulation of a cell, compiled with numba, in which sessions learn; tests hold it equal to `run`, `chance` and
`objectives`."""

from typing import Any

import numpy as np

from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.cell.routes import SERVER
from lab.sequencing.simulate.cell_arrays import ARRIVAL_CODES, NO_ARRIVALS, OBJECTIVE_CODES, WIDTH
from lab.sequencing.simulate.room_kernels import (
    apart,
    free,
    grant,
    hold_part,
    in_order,
    interval,
    may_go_s,
    possible,
    room_s,
    uniform,
    until,
    worked,
)
from lab.sequencing.simulate.run import SLACK_S

CLOCK, PICK = ARRIVAL_CODES["clock"], ARRIVAL_CODES["pick"]
MAKESPAN, TARDINESS, ROBOT_IDLE, MACHINE_IDLE = (
    OBJECTIVE_CODES[name] for name in ("makespan", "mean-tardiness", "robot-idle", "machine-idle")
)


@inner
def _close(cell: Any, run: Any, station: int) -> None:
    """`Run._close`."""
    run.room[station] = cell.rooms[station]
    for place in run.locations:
        if cell.holds[place, 0] == station:
            run.room[station] = 0


@inner
def _batch(cell: Any, run: Any, station: int, at_s: float, seed: Any) -> None:
    """`Run._batch`."""
    longest_s = 0.0
    for part in range(len(run.locations)):
        if cell.holds[run.locations[part], 0] == station:
            longest_s = max(longest_s, worked(cell, seed, part, run.locations[part], len(run.locations)))
    for part in range(len(run.locations)):
        if cell.holds[run.locations[part], 0] == station:
            run.ready_s[part] = at_s + longest_s


@without_refcounts
def reset(cell: Any, run: Any, seed: Any) -> None:
    """`Run.__init__`, with the times of an episode's seed (uint64)."""
    unfinished, came_s = 0, 0.0
    run.seed[0] = seed
    for station in range(len(cell.rooms)):
        run.room[station] = cell.rooms[station]
    for part in range(len(run.locations)):
        place = cell.begin_at[part]
        run.locations[part], run.ready_s[part], run.finished_s[part] = place, cell.begin_s[part], 0.0
        if cell.late_s > 0.0 and place == cell.starts[part]:
            late = apart(cell, len(run.locations)) + part
            run.ready_s[part] -= cell.late_s * np.log(1.0 - uniform(seed, late))
        run.room[cell.holds[place, 0]] -= 1
        run.room[cell.holds[place, 1]] -= 1
        if cell.first_option[place] < cell.first_option[place + 1]:
            unfinished += 1
    if cell.batched:
        for station in range(len(cell.rooms)):
            if cell.batch[station]:
                _close(cell, run, station)
    for i in range(len(cell.coming)):
        if cell.arrivals == CLOCK or (cell.arrivals == PICK and i == 0):
            came_s += interval(cell, seed, cell.coming[i])
            run.ready_s[cell.coming[i]] = came_s
    run.clock[:] = 0.0
    run.whole[0], run.whole[1] = 0, unfinished
    for robot in range(len(cell.robot_starts)):
        run.robots_at[robot], run.robots_s[robot] = cell.robot_starts[robot], 0.0
    if not cell.serial:
        run.rooms_s[:], run.servers_s[:], run.worked[:] = 0.0, 0.0, -1
        run.track_s[:] = 0.0
        run.held[:] = -1
        run.fetched_s[:], run.put_s[:], run.kept_s[:] = 0.0, 0.0, 0.0


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
    """When the robot of an option sets out for its pick."""
    robot, at = cell.robot[o], run.robots_at[cell.robot[o]]
    if at == cell.origin[o]:
        return float(run.robots_s[robot])
    return float(_clear_s(cell, run, robot, at, cell.origin[o], in_order(cell, run, robot, run.robots_s[robot])))


@inner
def reached_s(cell: Any, run: Any, o: int) -> float:
    """`Run.reach_s`."""
    robot, at = cell.robot[o], run.robots_at[cell.robot[o]]
    if at == cell.origin[o]:
        return float(run.robots_s[robot])
    empty_s = cell.empty_s[robot, at, cell.origin[o]]
    return float(until(cell, run.seed[0], len(run.locations), robot, _leaves_s(cell, run, o), empty_s))


@inner
def pick_times(cell: Any, run: Any, part: int, o: int) -> Any:
    """When the robot of an option, if it goes now, begins the service before the pick of a part (from 0), picks, and leaves."""
    robot, begin_s = cell.robot[o], reached_s(cell, run, o)
    if cell.waits[o]:
        begin_s = max(begin_s, run.ready_s[part])
    if not cell.serial:
        begin_s = max(begin_s, may_go_s(cell, run, part, o) - cell.service_s[o])
    pick_s = until(cell, run.seed[0], len(run.locations), robot, begin_s, cell.service_s[o])
    return begin_s, pick_s, _clear_s(cell, run, robot, cell.origin[o], cell.target[o], pick_s)


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
    """`Run.waits_for`: whether a precedence makes a part (from 0) wait."""
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
    station, there, best_s, best = cell.target[o], cell.to[o], np.inf, -1
    ready_s = max(run.ready_s[part], run.put_s[part])
    if cell.holds[there, 0] != station and run.kept_s[station] > 0.0:
        ready_s = max(ready_s, run.kept_s[station] - cell.processing_s[there])
    for server in range(cell.first_server[station], cell.first_server[station + 1]):
        free_s = run.servers_s[server]
        if run.worked[server] >= 0:
            free_s += cell.setup_s[station, run.worked[server], cell.product[part]]
        begin_s = max(ready_s, free_s)
        if begin_s < best_s:
            best_s, best = begin_s, server
    return best_s, best


@without_refcounts
def list_allowed(cell: Any, run: Any) -> int:
    """`Run.allowed`: the number of allowed decisions; they are written into run.allowed, and their options into run.options."""
    parts, count = len(run.locations), 0
    for part in range(parts):
        place = run.locations[part]
        if cell.arrivals != NO_ARRIVALS and place == cell.starts[part] and part != cell.coming[run.whole[0]]:
            continue
        for o in range(cell.first_option[place], cell.first_option[place + 1]):
            if cell.ruled and _waits_for(cell, run, part, o):
                continue
            if possible(cell, run, part, o) and not (cell.windows and _too_late(cell, run, part, o)):
                run.allowed[count], run.options[count] = part + 1 + cell.choice[o] * parts, o
                count += 1
    if cell.many:
        _sort(run, count)
    return count


@inner
def _sort(run: Any, count: int) -> None:
    """Sorts the allowed decisions; with one choice per part they are already sorted."""
    for j in range(1, count):
        i, decision, o = j, run.allowed[j], run.options[j]
        while i > 0 and run.allowed[i - 1] > decision:
            run.allowed[i], run.options[i] = run.allowed[i - 1], run.options[i - 1]
            i -= 1
        run.allowed[i], run.options[i] = decision, o


@without_refcounts
def move(cell: Any, run: Any, i: int, seed: Any) -> None:
    """`Run.move` for the i-th allowed decision, with the times of an episode's seed."""
    take(cell, run, (run.allowed[i] - 1) % len(run.locations), run.options[i], seed)


@without_refcounts
def may(cell: Any, run: Any, part: int, o: int) -> bool:
    """Whether a part (from 0) may take an option of its position now."""
    place = run.locations[part]
    if cell.arrivals != NO_ARRIVALS and place == cell.starts[part] and part != cell.coming[run.whole[0]]:
        return False
    if cell.ruled and _waits_for(cell, run, part, o):
        return False
    return bool(possible(cell, run, part, o) and not (cell.windows and _too_late(cell, run, part, o)))


@without_refcounts
def take(cell: Any, run: Any, part: int, o: int, seed: Any) -> None:
    """Carries out an allowed option of a part (from 0), with the times of an episode's seed."""
    robot = cell.robot[o]
    here, there, server, reach_s = run.locations[part], cell.to[o], 0, 0.0
    if robot == SERVER:
        pick_s, server = server_for(cell, run, part, o)
        drop_s = pick_s
    else:
        reach_s = reached_s(cell, run, o)
        begin_s, pick_s, out_s = pick_times(cell, run, part, o)
        loaded_s = cell.loaded_s[robot, cell.origin[o], cell.target[o]]
        drop_s = until(cell, seed, len(run.locations), robot, out_s, loaded_s)
        leave_s = _leaves_s(cell, run, o)
        run.clock[1] += leave_s - run.robots_s[robot]
        if cell.tracked:
            _hold(cell, run, robot, run.robots_at[robot], cell.origin[o], leave_s)
            _hold(cell, run, robot, cell.origin[o], cell.target[o], out_s)
        run.clock[1] += begin_s - reach_s + out_s - pick_s
    if here == cell.starts[part]:
        run.whole[0] += 1
        if cell.arrivals != NO_ARRIVALS and run.whole[0] < len(cell.coming):
            following = cell.coming[run.whole[0]]
            run.put_s[following] = pick_s
            if cell.arrivals == PICK:
                run.ready_s[following] = pick_s + interval(cell, seed, following)
    if robot != SERVER and not cell.serial:
        carried_s = drop_s
        drop_s = max(drop_s, room_s(cell, run, cell.needs[o, 0]), room_s(cell, run, cell.needs[o, 1]))
        if drop_s > carried_s:
            drop_s = in_order(cell, run, robot, drop_s)
        run.clock[1] += drop_s - carried_s
        if cell.shared:
            hold_part(cell, run, part, o)
        if cell.if_full[o] < len(cell.rooms) - 2:
            run.kept_s[cell.if_full[o]] = max(run.kept_s[cell.if_full[o]], pick_s)
        if cell.waits[o]:
            run.fetched_s[part] = pick_s
        run.put_s[part] = drop_s
    process_s = 0.0
    if cell.begins[there]:
        process_s = worked(cell, seed, part, there, len(run.locations))
        run.ready_s[part] = drop_s + process_s
        run.clock[2] += process_s
    end_s = drop_s + process_s if robot == SERVER else drop_s
    if not cell.serial:
        left_s = end_s if robot == SERVER else pick_s
        for h in range(WIDTH):
            station = cell.holds[here, h]
            if station != cell.holds[there, 0] and station != cell.holds[there, 1]:
                if run.room[station] < 0:
                    grant(cell, run, station, left_s, seed)
                else:
                    free(cell, run, station, left_s)
    run.room[cell.holds[here, 0]] += 1  # WIDTH stations, unrolled, since a loop would double the time of the whole move
    run.room[cell.holds[here, 1]] += 1
    run.room[cell.holds[there, 0]] -= 1
    run.room[cell.holds[there, 1]] -= 1
    run.locations[part] = there
    if cell.batched:
        if cell.batch[cell.holds[here, 0]]:
            _close(cell, run, cell.holds[here, 0])
        if cell.batch[cell.holds[there, 0]] and cell.begins[there]:
            _batch(cell, run, cell.holds[there, 0], drop_s, seed)
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


@without_refcounts
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


@without_refcounts
def follow(cell: Any, run: Any, sequence: Any, seed: Any) -> float:
    """The cost of a sequence of decisions with the times of an episode's seed; NaN when one of them is not allowed.

    An incomplete sequence costs what a deadlock does; in a cell with time windows, so does a decision that is not allowed.
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


@without_refcounts
def follow_all(cell: Any, run: Any, sequences: Any, lengths: Any, seeds: Any, costs: Any) -> None:
    """Writes `follow` of each row of sequences (N, L), up to its length in lengths (N,), for M seeds into costs (N, M)."""
    for n in range(len(sequences)):
        for m in range(len(seeds)):
            costs[n, m] = follow(cell, run, sequences[n, : lengths[n]], seeds[m])
