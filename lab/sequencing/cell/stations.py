"""The records of a cell's layout: stations, robots, stages, routes, products and arrivals; and the checks of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Literal

import numpy as np

from lab.errors import BadInput, unknown

MAX_S = 1e9  # the largest time: far above any cell, and small enough for sums to keep their nanoseconds
ROBOT = "robot"
UNLIMITED = 10**6  # a capacity that is never reached
STATION_KINDS = ("storage", "buffer", "machine")


@dataclass(frozen=True)
class Station:
    """A place for parts. capacity: in parts. processing_s: above 0 only for machines [s].

    at_most_s: how long after its processing a part may stay in a machine before it is spoilt [s]; None: without limit. servers:
    how many parts a machine works on at once; None: all parts in it, each from its arrival. With servers, a part waits in the
    machine's room until a server takes it, in any order, and after its processing it waits there until it is fetched. setups:
    triples (product before, product, seconds) of a server's changeovers; the first product needs none. batch: the machine works
    on all parts in it together, from the arrival of the last of them, for the longest of their times; once a part was taken out,
    none is brought in until the machine is empty.
    """

    name: str
    kind: Literal["storage", "buffer", "machine"]
    capacity: int
    processing_s: float = 0.0
    at_most_s: float | None = None
    servers: int | None = None
    setups: tuple[tuple[str, str, float], ...] = ()
    batch: bool = False


@dataclass(frozen=True)
class Robot:
    """A transfer robot or vehicle. start: its station at time 0. speed: a factor on the cell's tables of times.

    serves: the stations where it may pick and drop; None: all.
    """

    name: str
    start: str
    speed: float = 1.0
    serves: tuple[str, ...] | None = None


def one_robot(start: str) -> tuple[Robot, ...]:
    """The robots of a cell with a single one, which starts at a station."""
    return (Robot(ROBOT, start),)


@dataclass(frozen=True)
class Stage:
    """A stage of a route: the station, and the buffer before it that is used when it is full (None: no buffer).

    processing_s, at_most_s: this product's values there (None: the station's). service_s: the robot's work before it can take the
    part out, such as vacuuming a mill [s]. pallet: the part is lifted off its pallet for this machine; the pallet stays at the
    station before, and must be brought to the station after before the part can leave. alternatives: stages that may be taken
    instead of this one.
    """

    station: str
    buffer: str | None = None
    processing_s: float | None = None
    service_s: float = 0.0
    pallet: bool = False
    at_most_s: float | None = None
    alternatives: tuple["Stage", ...] = ()

    @property
    def ways(self) -> tuple["Stage", ...]:
        """This stage and its alternatives."""
        return (self, *self.alternatives)

    def each(self, change: Callable[["Stage"], "Stage"]) -> "Stage":
        """The stage after `change` was applied to it and to each of its alternatives, in this order."""
        return replace(change(self), alternatives=tuple(map(change, self.alternatives)))


Route = tuple[Stage, ...]


@dataclass(frozen=True)
class Product:
    """A type of part: its name and the routes that its parts may take.

    All routes begin at the same station and may also end there. A route may end at a machine with servers: the part is finished
    after its processing there and then takes no room.
    """

    name: str
    routes: tuple[Route, ...]


@dataclass(frozen=True)
class Arrivals:
    """The arrivals of parts at the first station, in the order of the order; interval_s: before each part, mean or constant [s].

    after: "clock", from the arrival before; "pick", from when the part before was taken away, as when a vehicle brings
    one at a time (thesis App. III's listing).
    """

    interval_s: tuple[float, ...]
    after: Literal["clock", "pick"] = "clock"


@dataclass(frozen=True)
class Begins:
    """The state of a part at time 0, for work that begins in the middle.

    position: an index of `Cell.positions`; None: the part is finished or lost, takes no room and makes no move. ready_s: when it
    may be picked [s]; below 0: it has been ready for that long, which counts towards its time window. stays: it cannot be
    finished, stays there and takes room.
    """

    position: int | None
    ready_s: float = 0.0
    stays: bool = False


def check_layout(stations: Sequence[Station], products: Sequence[Product]) -> None:
    """Raises BadInput for inconsistent stations and routes."""
    _check_stations(stations)
    names: set[str] = set()
    for station in stations:
        for before, after, _ in station.setups:
            for name in (before, after):
                if name not in {product.name for product in products}:
                    raise unknown(
                        "product", name, [product.name for product in products], f"setups of '{station.name}'"
                    )
    for product in products:
        if product.name in names:
            raise BadInput(f"product '{product.name}': the name is used twice; every product needs its own")
        names.add(product.name)
        if not product.routes:
            raise BadInput(f"product '{product.name}': it has no route; it needs at least one")
        for number, route in enumerate(product.routes, 1):
            one_of = f"route {number}" if len(product.routes) > 1 else "the route"
            _check_route(stations, route, one_of if len(products) == 1 else f"{one_of} of '{product.name}'")
            if route[0].station != product.routes[0][0].station:
                starts = f"'{product.routes[0][0].station}' and '{route[0].station}'"
                raise BadInput(
                    f"product '{product.name}': its routes begin at {starts}; all must begin at the same station"
                )
    if not products:
        raise BadInput("a cell needs at least one product")
    served = {station.name for station in stations if station.servers is not None}
    routes = [route for product in products for route in product.routes]
    ends = {way.station for route in routes for stage in (route[0], route[-1]) for way in stage.ways} - served
    inner = {way.station for route in routes for stage in route[1:-1] for way in stage.ways}
    inner |= {way.buffer for route in routes for stage in route for way in stage.ways if way.buffer}
    if ends & inner:
        raise BadInput(
            f"station '{min(ends & inner)}' is an end of one route and inside another; give each a station of its own"
        )


def _check_stations(stations: Sequence[Station]) -> None:
    seen: set[str] = set()
    for station in stations:
        where = f"station '{station.name}'"
        if station.name in seen:
            raise BadInput(f"{where}: the name is used twice; every station needs its own")
        seen.add(station.name)
        if station.name == ROBOT:
            raise BadInput(f"{where}: 'robot' names another row of a schedule; call it something else")
        if station.kind not in STATION_KINDS:
            raise unknown("kind", station.kind, STATION_KINDS, where)
        if not is_count(station.capacity):
            raise BadInput(f"{where}: capacity = {station.capacity!r}; allowed are whole numbers from 1")
        check_seconds(f"{where}: processing_s", station.processing_s)
        if station.kind != "machine" and station.processing_s > 0:
            raise BadInput(f"{where}: processing_s = {station.processing_s}, but only a machine processes")
        if station.at_most_s is not None:
            check_seconds(f"{where}: at_most_s", station.at_most_s)
            if station.kind != "machine":
                raise BadInput(
                    f"{where}: at_most_s = {station.at_most_s:g}, but it is a {station.kind}; only a machine has it"
                )
        _check_servers(station, where)
        _check_batch(station, where)


def _check_batch(station: Station, where: str) -> None:
    if not station.batch:
        return
    if station.kind != "machine":
        raise BadInput(f"{where}: batch = true, but it is a {station.kind}; only a machine has batches")
    if not 1 < station.capacity < UNLIMITED:
        room = "unlimited" if station.capacity >= UNLIMITED else station.capacity
        raise BadInput(
            f"{where}: batch = true with capacity = {room}; a batch needs room for 2 parts or more, with a limit"
        )
    for name, given in (("servers", station.servers), ("at_most_s", station.at_most_s)):
        if given is not None:
            raise BadInput(f"{where}: batch = true and {name} = {given:g}; only one of them is possible: remove {name}")


def _check_servers(station: Station, where: str) -> None:
    if station.servers is None:
        if station.setups:
            raise BadInput(
                f"{where}: setups need servers, such as servers = 1: each begins when the one before is done"
            )
        return
    if station.kind != "machine":
        raise BadInput(f"{where}: servers = {station.servers}, but it is a {station.kind}; only a machine has them")
    if not is_count(station.servers) or station.servers > station.capacity:
        room = "any number" if station.capacity >= UNLIMITED else f"1 to its capacity, {station.capacity}"
        raise BadInput(f"{where}: servers = {station.servers!r}; allowed are {room}")
    for before, after, seconds in station.setups:
        check_seconds(f"{where}: setup from '{before}' to '{after}'", seconds)


def check_robots(robots: Sequence[Robot], stations: Sequence[Station]) -> None:
    """Raises BadInput for inconsistent robots."""
    names = [station.name for station in stations]
    for number, robot in enumerate(robots):
        if robot.start not in names:
            raise unknown("station", robot.start, names, "start of the robot")
        if robot.name in names or robot.name in [other.name for other in robots[:number]]:
            raise BadInput(f"robot '{robot.name}': a station or another robot has that name; call it something else")
        if not (isfinite(robot.speed) and 1e-3 <= robot.speed <= 1e3):
            raise BadInput(f"robot '{robot.name}': speed = {robot.speed}; allowed are 0.001 to 1000 times the cell's")
        for name in robot.serves or ():
            if name not in names:
                raise unknown("station", name, names, f"stations that robot '{robot.name}' serves")
    if not robots and any(station.kind == "machine" and station.servers is None for station in stations):
        raise BadInput(
            "no robots: then every machine needs servers, such as servers = 1, and parts go on by themselves"
        )


def _check_route(stations: Sequence[Station], route: Route, one_of: str) -> None:
    known = {station.name: station for station in stations}
    kinds = {station.name: station.kind for station in stations}
    if len(route) < 2:
        raise BadInput(f"{one_of} has {len(route)} stages; it needs at least 2, a start and an end")
    if route[0].buffer is not None:
        raise BadInput(f"stage 1 of {one_of} ('{route[0].station}'): buffer '{route[0].buffer}' before the start")
    if route[0].alternatives:
        raise BadInput(f"stage 1 of {one_of} ('{route[0].station}'): alternatives of the start; a route has one")
    visited, here = set[str](), set[str]()
    for number, stage in ((number, way) for number, step in enumerate(route, 1) for way in step.ways):
        where = f"stage {number} of {one_of}"
        if stage is route[number - 1]:
            visited |= here
            here.clear()
        for name, is_buffer in ((stage.station, False), (stage.buffer, True)):
            if name is None:
                continue
            if name not in kinds:
                raise unknown("station", name, kinds, where)
            if name in here and not is_buffer:
                raise BadInput(
                    f"{where}: '{name}' stands there twice; each of the alternatives has a station of its own"
                )
            back = number == len(route) > 2 and name == route[0].station
            again = known[name].servers is not None
            if name in visited and not (back or again):
                raise BadInput(
                    f"{where}: station '{name}' is on the route twice, a cycle; once is allowed: give the second visit a "
                    "station of its own, or the machine servers in a cell file"
                )
            here.add(name)
            if is_buffer and kinds[name] != "buffer":
                raise BadInput(f"{where}: '{name}' is a {kinds[name]}; a buffer fits")
        ends_here = number == len(route) and known[stage.station].servers is not None
        if number in (1, len(route)) and kinds[stage.station] != "storage" and not ends_here:
            raise BadInput(
                f"{where}: '{stage.station}' is a {kinds[stage.station]}; a route starts and ends in storage"
            )
        if stage.pallet and known[stage.station].servers is not None:
            raise BadInput(f"{where}: pallet = true, but '{stage.station}' has servers; only one of them is possible")
        if stage.alternatives and any(way.alternatives for way in stage.alternatives):
            raise BadInput(f"{where}: alternatives of an alternative; name all of them beside one another")
        _check_stage(stage, known[stage.station], where)
    for number, stage in enumerate(route, 1):
        if any(way.pallet for way in stage.ways) and any(
            neighbour.alternatives for neighbour in route[number - 2 : number + 1]
        ):
            raise BadInput(f"stage {number} of {one_of}: pallet = true, but it or a stage beside it has alternatives")
        if stage.pallet and not _takes_pallet(route, number - 1, kinds):
            raise BadInput(
                f"stage {number} of {one_of}: pallet = true needs a buffer or storage before and after it, which are no "
                "ends of the route, and no 'buffer' of its own or of the stage after"
            )


def _takes_pallet(route: Route, number: int, kinds: Mapping[str, str]) -> bool:
    before, stage, after = route[number - 1], route[number], route[number + 1]
    inside = 2 <= number <= len(route) - 3
    return (
        inside and not (stage.buffer or after.buffer) and "machine" not in (kinds[before.station], kinds[after.station])
    )


def _check_stage(stage: Stage, station: Station, where: str) -> None:
    kind, at_most_s = station.kind, station.at_most_s if stage.at_most_s is None else stage.at_most_s
    for name, seconds in (("processing_s", stage.processing_s), ("at_most_s", stage.at_most_s)):
        if seconds is not None:
            check_seconds(f"{where}: {name}", seconds)
    check_seconds(f"{where}: service_s", stage.service_s)
    for name, given in (("processing_s", stage.processing_s), ("pallet", stage.pallet), ("service_s", stage.service_s)):
        if given and kind != "machine":
            raise BadInput(f"{where}: {name} = {given}, but '{stage.station}' is a {kind}; only a machine has it")
    if station.batch:
        for name, wrong in (("at_most_s", stage.at_most_s is not None), ("pallet", stage.pallet)):
            if wrong:
                raise BadInput(f"{where}: {name}, but '{stage.station}' has batches; only one of them is possible")
    if stage.at_most_s is not None and kind != "machine":
        raise BadInput(
            f"{where}: at_most_s = {stage.at_most_s:g}, but '{stage.station}' is a {kind}; only a machine has it"
        )
    if at_most_s is not None and at_most_s < stage.service_s:
        raise BadInput(
            f"{where}: at_most_s = {at_most_s:g}, but the service before the pick takes {stage.service_s:g} s: it can never be "
            "picked in time"
        )


def check_seconds(what: str, seconds: float) -> None:
    """Raises BadInput unless `seconds` is a time from 0 to MAX_S."""
    if not (isfinite(seconds) and 0 <= seconds <= MAX_S):
        raise BadInput(f"{what} = {seconds}; allowed are 0 to {MAX_S:g} s")


def is_count(value: object) -> bool:
    """Whether a value is an integer from 1."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool) and int(value) >= 1
