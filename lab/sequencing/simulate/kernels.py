"""The simulation of a cell, compiled with numba; held equal to `run`, `chance` and `objectives`. Sessions learn in it."""

from typing import Any

import numpy as np

from lab.learning import splitmix
from lab.learning.compiled import inner, lean
from lab.sequencing.cell import chance
from lab.sequencing.simulate.cell_arrays import ARRIVAL_CODES, LAW_CODES, NO_ARRIVALS, OBJECTIVE_CODES
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
        run.room[cell.holds[place, 0]] -= 1
        run.room[cell.holds[place, 1]] -= 1
        if cell.first_option[place] < cell.first_option[place + 1]:
            unfinished += 1
    for i in range(len(cell.coming)):
        if cell.arrivals == CLOCK or (cell.arrivals == PICK and i == 0):
            came_s += _interval(cell, seed, cell.coming[i])
            run.ready_s[cell.coming[i]] = came_s
    run.clock[0], run.clock[1], run.clock[2] = 0.0, 0.0, 0.0
    run.whole[0], run.whole[1], run.whole[2] = cell.robot_start, 0, unfinished


@inner
def _too_late(cell: Any, run: Any, part: int, o: int) -> bool:
    """`Run.too_late`."""
    at_most_s = cell.at_most_s[run.locations[part]]
    if at_most_s == np.inf or not cell.waits[o]:
        return False
    reach_s = run.clock[0] + cell.empty_s[run.whole[0], cell.origin[o]]
    return bool(max(reach_s, run.ready_s[part]) + cell.service_s[o] > run.ready_s[part] + at_most_s + SLACK_S)


@lean
def list_allowed(cell: Any, run: Any) -> int:
    """`Run.allowed`: how many decisions may be taken now; they stand in run.allowed, what they mean in run.options."""
    parts, count = len(run.locations), 0
    for part in range(parts):
        place = run.locations[part]
        if cell.arrivals != NO_ARRIVALS and place == cell.starts[part] and part != cell.coming[run.whole[1]]:
            continue
        for o in range(cell.first_option[place], cell.first_option[place + 1]):
            room = run.room[cell.needs[o, 0]] > 0 and run.room[cell.needs[o, 1]] > 0
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
    parts, o = len(run.locations), run.options[i]
    part = (run.allowed[i] - 1) % parts
    here, there = run.locations[part], cell.to[o]
    reach_s = run.clock[0] + cell.empty_s[run.whole[0], cell.origin[o]]
    ready_s = max(reach_s, run.ready_s[part]) if cell.waits[o] else reach_s
    pick_s = ready_s + cell.service_s[o]
    drop_s = pick_s + cell.loaded_s[cell.origin[o], cell.target[o]]
    if here == cell.starts[part]:
        run.whole[1] += 1
        if cell.arrivals == PICK and run.whole[1] < len(cell.coming):
            following = cell.coming[run.whole[1]]
            run.ready_s[following] = pick_s + _interval(cell, seed, following)
    run.room[cell.holds[here, 0]] += 1  # WIDTH stations, written out: a loop takes twice the time of the whole move
    run.room[cell.holds[here, 1]] += 1
    run.room[cell.holds[there, 0]] -= 1
    run.room[cell.holds[there, 1]] -= 1
    run.locations[part], run.whole[0] = there, cell.target[o]
    run.clock[0] = drop_s
    run.clock[1] += ready_s - reach_s
    if cell.begins[there]:
        number = (part + 1) * len(cell.begins) + there
        process_s = _drawn(cell.processing_law, cell.spread, cell.processing_s[there], seed, number)
        run.ready_s[part] = drop_s + process_s
        run.clock[2] += process_s
    if cell.first_option[there] == cell.first_option[there + 1]:
        run.finished_s[part] = drop_s
        run.whole[2] -= 1


@lean
def cost(cell: Any, run: Any) -> float:
    """`objectives.cost`."""
    if run.whole[2] > 0:
        return float(cell.stuck_cost)
    if cell.objective == MAKESPAN:
        return float(run.clock[0])
    if cell.objective == ROBOT_IDLE:
        return float(run.clock[1])
    if cell.objective == MACHINE_IDLE:
        return float(cell.machines * run.clock[0] - run.clock[2])
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
