"""The faults of a cell file, each with its place in the file."""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from lab.errors import BadInput, unknown
from lab.sequencing.cell.cell import MAX_PARTS, needed_moves
from lab.sequencing.cell.chance import check_robot_breaks
from lab.sequencing.cell.stations import check_layout
from lab.sequencing.cell.track import check_track
from lab.tasks.cell_fields import CellFields, CellRobot
from lab.tasks.toml_text import Loc

MAX_STAGES = 400  # stages of all routes together: the time to find one robot's moves grows with their square
MAX_SERVED = 5000  # the same limit in cells with servers or several robots
SHOWN = 3  # missing moves that one message names


class FileFault(NamedTuple):
    """A fault: the path to the value in the file, and the message."""

    loc: Loc
    message: str


def file_faults(cell: CellFields) -> Iterator[FileFault]:
    """The faults of everything except stations, routes and times: order, robots' starts, due times, names of methods."""
    yield from _order_faults(cell)
    yield from _robot_faults(cell)
    yield from _track_faults(cell)
    yield from _chance_faults(cell)
    if cell.due_s is not None and cell.due_factor is not None:
        yield FileFault(("due_factor",), "due_s and due_factor: give one of them, a time for each part or a factor")
    for field, error in cell.sequencing.faults(due=cell.due_s is not None or cell.due_factor is not None):
        yield FileFault(("sequencing", field), str(error))


def _robot_faults(cell: CellFields) -> Iterator[FileFault]:
    if (cell.robot is None) == (cell.robots is None):
        yield FileFault(("robot",), "robot and robots: give one of them, the only robot or a list, [] for none")
    single: list[tuple[Loc, CellRobot]] = [] if cell.robot is None else [(("robot",), cell.robot)]
    for loc, robot in [*single, *((("robots", n), robot) for n, robot in enumerate(cell.robots or ()))]:
        for field, name in (("start", robot.start), *(("serves", name) for name in robot.serves or ())):
            if name not in cell.station_names:
                where = ".".join(str(word) for word in (*loc, field))
                yield FileFault((*loc, field), str(unknown("station", name, cell.station_names, where)))
        if [other.name for other in cell.robots or ()].count(robot.name) > 1:
            yield FileFault((*loc, "name"), f"robot '{robot.name}': the name is used twice; every robot needs its own")


def _track_faults(cell: CellFields) -> Iterator[FileFault]:
    if cell.track is None:
        return
    for table in ("travel", "loaded"):
        if getattr(cell, table):
            yield FileFault(
                (table,), f"track and {table}: with a track, its stretches give the times: remove one of them"
            )
    if len(cell.built_robots) < 2:
        yield FileFault(("track",), "track: it is for several robots (robots): remove it")
    try:
        check_track(cell.track.built(), cell.station_names)
    except BadInput as error:
        yield FileFault(("track", "stretches"), str(error))


def _chance_faults(cell: CellFields) -> Iterator[FileFault]:
    try:
        check_robot_breaks(len(cell.built_robots), cell.track is not None, cell.stochastic.built())
    except BadInput as error:
        yield FileFault(("stochastic", "robot_breaks_every_s"), str(error))


def _order_faults(cell: CellFields) -> Iterator[FileFault]:
    if (cell.order is None) == (cell.parts is None):
        yield FileFault(("parts",), "order and parts: give one of them, a product for each part or a number")
    if cell.parts is not None and len(cell.products) > 1:
        yield FileFault(
            ("parts",), f"parts = {cell.parts}: with several products an order is wanted, one for each part"
        )
    count, field = (len(cell.order), "order") if cell.order is not None else (cell.parts or 0, "parts")
    if not 1 <= count <= MAX_PARTS:
        yield FileFault((field,), f"an order of {count} parts: allowed are 1 to {MAX_PARTS}")
    for number, name in enumerate(cell.order or ()):
        if name not in cell.names:
            where = f"part {number + 1} of the order"
            yield FileFault(("order", number), str(unknown("product", name, cell.names, where)))


def layout_faults(cell: CellFields) -> Iterator[FileFault]:
    """The faults of stations and routes: inconsistent ones, machines without a time, stations on no route."""
    stages = list(cell.stages())
    served = len(cell.built_robots) != 1 or any(station.servers is not None for station in cell.stations)
    most = MAX_SERVED if served else MAX_STAGES
    if len(stages) > most:
        yield FileFault(("products",), f"{len(stages)} stages on all routes together: allowed are up to {most}")
    try:
        check_layout(cell.built_stations, cell.built_products)
    except BadInput as error:
        yield FileFault(loc_of(cell, str(error)) or _bad_stage(cell), str(error))
    reached = {robot.start for robot in cell.built_robots} | {
        name for _, stage in stages for name in (stage.station, stage.buffer)
    }
    timeless = {machine.name for machine in cell.stations if machine.kind == "machine" and machine.processing_s is None}
    for loc, stage in stages:
        if stage.station in timeless and stage.processing_s is None:
            yield FileFault(
                loc, f"machine '{stage.station}' has no processing_s, and neither has this stage of a route"
            )
    for number, station in enumerate(cell.stations):
        if station.name not in reached:
            yield FileFault(
                ("stations", number, "name"), f"station '{station.name}' cannot be reached: it is on no route"
            )


def travel_faults(cell: CellFields) -> Iterator[FileFault]:
    """The faults of the tables of times: unknown stations, and times for staying."""
    names = cell.station_names
    for field, table in (("travel", cell.travel), ("loaded", cell.loaded)):
        for origin, row in table.items():
            if origin not in names:
                yield FileFault((field, origin), str(unknown("station", origin, names, field)))
            for target, time_s in row.items():
                loc = (field, origin, target)
                if target not in names:
                    yield FileFault(loc, str(unknown("station", target, names, f"{field} from '{origin}'")))
                if target == origin and time_s > 0:
                    yield FileFault(loc, f"{field} '{origin}' -> '{target}' = {time_s:g}: staying takes 0 s")


def missing_times(cell: CellFields, parts: int) -> Iterator[FileFault]:
    """The moves without a time that a sequence of `parts` parts may need, or a station that no time leads to.

    The cell must be free of the faults above.
    """
    needed = needed_moves(cell.built_stations, cell.built_products, cell.built_robots, parts, cell.buffers)
    given = {(origin, target) for origin, row in cell.times.items() for target in row}
    carried = given | {(origin, target) for origin, row in cell.loaded.items() for target in row}
    lacking = {pair: "go there empty" for pair in needed.empty if pair not in given}
    lacking |= {pair: "carry a part there" for pair in needed.loaded if pair not in carried}
    if not lacking:
        return
    ways = list(dict.fromkeys((*needed.empty, *needed.loaded)))
    for number, name in enumerate(cell.station_names):
        into = [pair for pair in ways if pair[1] == name]
        if len(into) > 1 and all(pair in lacking for pair in into):
            some = ", ".join(f"'{origin}' -> '{target}'" for origin, target in into[:SHOWN])
            more = f" and {len(into) - SHOWN} more" if len(into) > SHOWN else ""
            unreached = f"station '{name}' cannot be reached: there is no travel time {some}{more}"
            yield FileFault(("stations", number, "name"), unreached)
    (origin, target), why = next(iter(lacking.items()))
    only = f"; no other time leads to '{target}'" if sum(pair[1] == target for pair in ways) == 1 else ""
    more = f" (and {len(lacking) - 1} more are missing)" if len(lacking) > 1 else ""
    missing = f"travel time '{origin}' -> '{target}' is missing: the robot may have to {why}{only}{more}"
    yield FileFault(("travel", origin) if cell.track is None else ("track", "stretches"), missing)


def loc_of(cell: CellFields, message: str) -> Loc:
    """The path in the file to the station, product or due time that a sequencer's message is about; () when unknown."""
    for field, members in (("stations", cell.stations), ("products", cell.products)):
        for number in reversed(range(len(members))):  # of two with the same name, the second one is at fault
            if message.startswith(f"{field[:-1]} '{members[number].name}'"):
                return (field, number, "name")
    if match := re.match(r"due_s of part (\d+) ", message):
        return ("due_s", int(match[1]) - 1)
    return next(((field,) for field in ("due_s", "release_s") if message.startswith(field)), ())


def _bad_stage(cell: CellFields) -> Loc:
    """The path to the first route that is invalid by itself, and to the stage that the message names."""
    for i, product in enumerate(cell.built_products):
        for j, route in enumerate(product.routes):
            try:
                check_layout(cell.built_stations, (replace(product, routes=(route,)),))
            except BadInput as error:
                match = re.match(r".*stage (\d+) of ", str(error))
                stage = () if match is None else (int(match[1]) - 1,)
                return ("products", i, "routes", j, *stage)
    return ()
