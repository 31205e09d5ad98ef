"""A cell and a run of it as plain arrays, for the compiled simulation."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.sequencing.cell.cell import ARRIVALS_AFTER, Cell
from lab.sequencing.cell.chance import LAWS, NO_CHANCE, Chance, check_chance
from lab.sequencing.cell.objectives import BUILT_IN, MAKESPAN, check_built_in, machine_places, stuck_cost
from lab.sequencing.cell.routes import SERVER, from_the_ends
from lab.sequencing.cell.stations import UNLIMITED, Robot

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

WIDTH = 2  # the most stations that a position holds, or an option needs: a machine and the place of its pallet
ENDLESS = 2**40  # the capacity of a station that is never full
NO_ARRIVALS = 0
ARRIVAL_CODES = {name: code for code, name in enumerate(ARRIVALS_AFTER, 1)}
LAW_CODES = {name: code for code, name in enumerate(LAWS)}
OBJECTIVE_CODES = {name: code for code, name in enumerate(BUILT_IN)}


class CellArrays(NamedTuple):
    """A cell of K parts, S stations and P positions with O options, its objective, and its chance.

    first_option (P + 1,): where the options of each position begin. holds (P, 2), needs (O, 2) and if_full (O,):
    stations; unused entries hold S, a station that is never full, in holds and needs, and S + 1, one that is always full, in
    if_full. begins (P,): whether a processing begins there. at_most_s (P,): how long after it a part may be picked; inf: at any
    time; windows: whether there is such a limit. rooms (S + 2,): capacities. empty_s, loaded_s (S, S) [s].
    starts, begin_at (K,): the first position of a part's routes, and the one in which it begins; begin_s (K,): when it may be
    picked there [s]; coming (C,): the parts, from 0, that begin at a start.
    tracked: whether there is a track; first_held (S * S + 1,): where the stretches of each path on it begin in held (H,);
    held_from_s, held_until_s (R, H): from when until when a robot on that path is on each stretch [s].
    takers (S + 2, R + 1): whether a robot, or a server, may free room in a station; shared: whether one may do so for another.
    ruled: whether there are precedences, R of them; made, ended (R, P): as in `Rule`; counts (R, K): its counts, then 0.
    batched: whether there are machines with batches; batch (S + 2,): which.
    interval_s, due_s (K,) [s]. many: whether a part may have several choices. The codes are those of this module.
    """

    first_option: Ints
    holds: Ints
    begins: Flags
    processing_s: Floats
    at_most_s: Floats
    choice: Ints
    to: Ints
    origin: Ints
    target: Ints
    needs: Ints
    if_full: Ints
    service_s: Floats
    waits: Flags
    rooms: Ints
    empty_s: Floats
    loaded_s: Floats
    robot: Ints
    setup_s: Floats
    product: Ints
    serial: bool
    first_room: Ints
    first_server: Ints
    takers: Flags
    shared: bool
    starts: Ints
    begin_at: Ints
    begin_s: Floats
    coming: Ints
    interval_s: Floats
    due_s: Floats
    robot_starts: Ints
    many: bool
    windows: bool
    arrivals: int
    machines: int
    objective: int
    stuck_cost: float
    processing_law: int
    arrivals_law: int
    spread: float
    breaks_every_s: float
    repair_s: float
    late_s: float
    robot_breaks_every_s: float
    robot_repair_s: float
    tracked: bool
    first_held: Ints
    held: Ints
    held_from_s: Floats
    held_until_s: Floats
    ruled: bool
    made: Flags
    ended: Flags
    counts: Ints
    batched: bool
    batch: Flags


class RunArrays(NamedTuple):
    """The state of a run, as in `lab.sequencing.simulate.run.Run`, and the decisions allowed now.

    locations, ready_s, finished_s (K,). room (S + 2,): the free room. clock (4,): when the first robot is free, total waits,
    total processing, and the end of all decided moves [s]. whole (2,): parts fetched, parts not yet finished. robots_at,
    robots_s (R,): where and when each robot is free. track_s: since when each stretch is free. rooms_s, servers_s: since when
    each room and server is free, those of a station that are free in ascending order; worked: the last product of each server,
    -1: none. held (R, 4): the part (from 0) that a robot holds while it waits for room, how many robots wait longer, and the
    stations where it waits; -1: none. fetched_s, put_s (K,), kept_s (S + 2,): as in `Run`. seed (1,): of the episode, by which
    robots break down. allowed: the decisions, ascending; options: the option of each.
    """

    locations: Ints
    ready_s: Floats
    finished_s: Floats
    room: Ints
    clock: Floats
    whole: Ints
    robots_at: Ints
    robots_s: Floats
    track_s: Floats
    rooms_s: Floats
    servers_s: Floats
    worked: Ints
    held: Ints
    fetched_s: Floats
    put_s: Floats
    kept_s: Floats
    seed: NDArray[np.uint64]
    allowed: Ints
    options: Ints


def cell_arrays(cell: Cell, objective: str = MAKESPAN, chance: Chance = NO_CHANCE) -> CellArrays:
    """The cell as arrays; the objective must have passed `check_objective`.

    Raises BadInput for an objective that the kernels do not know.
    """
    check_built_in(objective, "the compiled simulation")
    check_chance(cell, chance)
    size, places, robots = len(cell.stations), cell.positions, len(cell.robots)
    options = [option for place in places for option in place.options]
    return CellArrays(
        first_option=np.cumsum([0, *(len(place.options) for place in places)]),
        holds=_padded([place.holds for place in places], size),
        begins=np.array([place.processing_s is not None for place in places]),
        processing_s=np.array([place.processing_s or 0.0 for place in places]),
        at_most_s=np.array([np.inf if place.at_most_s is None else place.at_most_s for place in places]),
        choice=np.array([option.choice for option in options]),
        to=np.array([option.to for option in options]),
        origin=np.array([option.origin for option in options]),
        target=np.array([option.target for option in options]),
        needs=_padded([option.needs for option in options], size),
        if_full=np.array([size + 1 if option.if_full is None else option.if_full for option in options]),
        service_s=np.array([float(option.service_s) for option in options]),
        waits=np.array([option.waits for option in options]),
        rooms=np.array([*cell.capacities, ENDLESS, 0]),
        empty_s=_with_stays(cell.empty_s, cell.robots),
        loaded_s=_with_stays(cell.loaded_s, cell.robots),
        robot=np.array([option.robot for option in options]),
        setup_s=_setups(cell),
        product=np.array([_product_names(cell).index(name) for name in cell.order]),
        serial=cell.serial,
        first_room=np.cumsum([0, *_rooms(cell), 0, 0]),
        first_server=np.cumsum([0, *_servers(cell)]),
        takers=np.array([[n in own for n in (*range(robots), SERVER)] for own in (*cell.takers, (), ())], np.bool_),
        shared=any(cell.takers),
        starts=np.array(cell.starts),
        begin_at=np.array(cell.begin_at),
        begin_s=np.array(cell.begin_s, np.float64),
        coming=np.array(cell.coming, np.int64) - 1,
        interval_s=np.array(cell.arrivals.interval_s if cell.arrivals else (0.0,) * cell.parts, np.float64),
        due_s=np.array(cell.due_s or (0.0,) * cell.parts, np.float64),
        robot_starts=np.array([cell.index(robot.start) for robot in cell.robots], np.int64),
        many=cell.most_choices > 1,
        windows=cell.has_windows,
        arrivals=ARRIVAL_CODES[cell.arrivals.after] if cell.arrivals else NO_ARRIVALS,
        machines=machine_places(cell),
        objective=OBJECTIVE_CODES[objective],
        stuck_cost=float(stuck_cost(cell, objective)),
        processing_law=LAW_CODES[chance.processing],
        arrivals_law=LAW_CODES[chance.arrivals],
        spread=float(chance.spread),
        breaks_every_s=float(chance.breaks_every_s),
        repair_s=float(chance.repair_s),
        late_s=float(chance.late_s),
        robot_breaks_every_s=float(chance.robot_breaks_every_s),
        robot_repair_s=float(chance.robot_repair_s),
        tracked=bool(cell.track),
        **_held(cell),
        **_ruled(cell),
        batched=bool(cell.batches),
        batch=np.array([*(station.batch for station in cell.stations), False, False]),
    )


def run_arrays(cell: Cell) -> RunArrays:
    """Empty arrays for a run of the cell; `kernels.reset` fills them."""
    decisions = cell.parts * cell.most_choices
    return RunArrays(
        locations=np.zeros(cell.parts, np.int64),
        ready_s=np.zeros(cell.parts),
        finished_s=np.zeros(cell.parts),
        room=np.zeros(len(cell.stations) + 2, np.int64),
        clock=np.zeros(4),
        whole=np.zeros(2, np.int64),
        robots_at=np.zeros(len(cell.robots), np.int64),
        robots_s=np.zeros(len(cell.robots)),
        track_s=np.zeros(len(cell.track)),
        rooms_s=np.zeros(sum(_rooms(cell))),
        servers_s=np.zeros(sum(_servers(cell))),
        worked=np.zeros(sum(_servers(cell)), np.int64),
        held=np.full((len(cell.robots), 2 + WIDTH), -1),
        fetched_s=np.zeros(cell.parts),
        put_s=np.zeros(cell.parts),
        kept_s=np.zeros(len(cell.stations) + 2),
        seed=np.zeros(1, np.uint64),
        allowed=np.zeros(decisions, np.int64),
        options=np.zeros(decisions, np.int64),
    )


def most_moves(cell: Cell) -> int:
    """The number of moves in the longest sequence."""
    return sum(moves_each(cell))


def moves_each(cell: Cell) -> list[int]:
    """The largest number of moves of each part, part 1 first."""
    longest = from_the_ends(cell.positions, lambda _, ahead: max((1 + moves for moves in ahead), default=0))
    return [longest[start] for start in cell.begin_at]


def _padded(stations: Sequence[Sequence[int]], spare: int) -> Ints:
    """The lists of stations as rows, filled up to WIDTH with `spare`."""
    return np.array([[*given, *(spare,) * (WIDTH - len(given))] for given in stations], np.int64)


def _with_stays(table: Floats, robots: Sequence[Robot]) -> Floats:
    """The table for each robot at its speed, with 0 s for staying."""
    table = table.copy()
    np.fill_diagonal(table, 0.0)
    return np.array([table / robot.speed for robot in robots]).reshape(len(robots), *table.shape)


def _held(cell: Cell) -> dict[str, Any]:
    """The fields for the stretches of every path on the track."""
    pairs = [(a, b) for a in range(len(cell.stations)) for b in range(len(cell.stations))]
    ways = [cell.ways.get(pair, ()) for pair in pairs] if cell.track else []
    held, speeds = [stretch for way in ways for stretch in way], np.array([robot.speed for robot in cell.robots])
    return {
        "first_held": np.cumsum([0, *map(len, ways)]),
        "held": np.array([held_stretch.stretch for held_stretch in held], np.int64),
        "held_from_s": np.array([held_stretch.from_s for held_stretch in held]) / speeds[:, None],
        "held_until_s": np.array([held_stretch.until_s for held_stretch in held]) / speeds[:, None],
    }


def _ruled(cell: Cell) -> dict[str, Any]:
    """The fields for the precedences."""
    places, rules = range(len(cell.positions)), cell.rules
    shape = len(rules), len(places)
    return {
        "ruled": bool(rules),
        "made": np.array([[n in rule.made for n in places] for rule in rules], np.bool_).reshape(shape),
        "ended": np.array([[n in rule.ended for n in places] for rule in rules], np.bool_).reshape(shape),
        "counts": np.array(
            [[*rule.counts, *(0,) * (cell.parts - len(rule.counts))] for rule in rules], np.int64
        ).reshape(len(rules), cell.parts),
    }


def _rooms(cell: Cell) -> list[int]:
    """The number of rooms of each station that are tracked one by one; 0 in a serial cell."""
    return [0 if cell.serial or room >= UNLIMITED else room for room in cell.capacities]


def _servers(cell: Cell) -> list[int]:
    return [station.servers or 0 for station in cell.stations]


def _product_names(cell: Cell) -> list[str]:
    return [product.name for product in cell.products]


def _setups(cell: Cell) -> Floats:
    names = _product_names(cell)
    seconds = np.zeros((len(cell.stations), len(names), len(names)))
    for station, setups in enumerate(cell.setups):
        for (before, after), setup_s in setups.items():
            seconds[station, names.index(before), names.index(after)] = setup_s
    return seconds
