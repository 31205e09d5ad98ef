"""Cells to test with: the thesis's three cases, a one-machine cell to redo by hand, and random small ones."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from lab.sequencing.cell.cell import Cell, needed_moves
from lab.sequencing.cell.stations import UNLIMITED, Arrivals, Product, Robot, Route, Stage, Station, one_robot
from lab.sequencing.cell.track import Stretch, travel_s, ways_on
from lab.sequencing.simulate.run import Run, branch

X = math.nan
# Thesis table 7.2, robot times [s], row from, column to, stations 1 to 6.
# Case III 1 -> 2 is unreadable in print; 50 s is what reproduces both printed optima.
ROBOT_S = {
    "I": [
        [X, 24, 36, X, X, X],
        [21, X, 24, 26, 15, X],
        [22, X, X, 22, 28, X],
        [24, 26, 19, X, 19, X],
        [26, 24, 20, X, X, 12],
        [25, 23, 19, 21, X, X],
    ],
    "II": [
        [X, 20, 30, X, X, X],
        [30, X, 30, 20, 30, X],
        [30, X, X, 30, 50, X],
        [30, 20, 30, X, 40, X],
        [30, 20, 30, X, X, 20],
        [30, 20, 20, 30, X, X],
    ],
    "III": [
        [X, 50, 70, X, X, X],
        [40, X, 40, 40, 50, X],
        [45, X, X, 30, 45, X],
        [50, 40, 30, X, 35, X],
        [55, 50, 45, X, X, 30],
        [60, 55, 50, 45, X, X],
    ],
}
# Thesis App. VIII, robot times [s], stations numbered as in the listing: two lathes, the mill, incoming, outgoing.
FMS_S = [
    [X, 65, 15, 45, 45, 45, 25, 25, 25, 40, X],
    [25, X, 20, 45, 45, 45, 25, 25, 25, 40, X],
    [25, 45, X, 45, 45, 45, 25, 25, 25, 40, 40],
    [45, 45, 45, X, 65, 15, 50, 50, 50, 60, X],
    [45, 45, 45, 25, X, 20, 50, 50, 50, 60, X],
    [45, 45, 45, 25, 45, X, 50, 50, 50, 60, 60],
    [25, 25, 25, 50, 50, 50, X, 50, 15, 30, X],
    [25, 25, 25, 50, 50, 50, 25, X, 25, 30, X],
    [25, 25, 25, 50, 50, 50, 25, 25, X, 30, 30],
    [40, X, X, 60, X, X, 30, X, X, X, X],
    [40, 40, 40, 60, 60, 60, 30, 30, 30, 20, X],
]
MACHINE_S = {"I": 60, "II": 90, "III": 120}  # thesis table 7.1
TOAST_ROUTE = (Stage("plate"), Stage("toaster", "toaster buffer"), Stage("butter", "butter buffer"), Stage("done"))


def build_toast_cell(case: str, parts: int, buffer_room: int = 50, room: int = 200) -> Cell:
    stations = (
        Station("plate", "storage", room),
        Station("toaster buffer", "buffer", buffer_room),
        Station("toaster", "machine", 1, MACHINE_S[case]),
        Station("butter buffer", "buffer", buffer_room),
        Station("butter", "machine", 1, MACHINE_S[case]),
        Station("done", "storage", room),
    )
    table = np.array(ROBOT_S[case])
    return Cell.alike(stations, TOAST_ROUTE, table, table, "toaster buffer", parts)


def build_oven_cell(parts: int = 2, **change: object) -> Cell:
    """in (0) -> oven (1), 10 s, one toast -> out (2), no buffer; empty moves 1 s, loaded moves 2 s."""
    described: dict[str, object] = {
        "stations": (Station("in", "storage", 9), Station("oven", "machine", 1, 10.0), Station("out", "storage", 9)),
        "products": (Product("toast", ((Stage("in"), Stage("oven"), Stage("out")),)),),
        "order": ("toast",) * parts,
        "empty_s": np.ones((3, 3)) - np.eye(3),
        "loaded_s": 2 * (np.ones((3, 3)) - np.eye(3)),
        "robots": one_robot("in"),
    }
    return Cell(**(described | change))  # type: ignore[arg-type]


def build_fms_cell(order: str, interval_s: float = 200.0) -> Cell:
    """The flexible manufacturing system of thesis App. III: "R" a rook, "S" a sign; arrivals after each pick."""
    machines = ("lathe 1", "lathe 2", "mill")
    stations = [
        station
        for machine in machines
        for station in (
            Station(f"{machine} in", "buffer", 1),
            Station(machine, "machine", 1, 600.0 if machine == "mill" else 185.0),
            Station(f"{machine} out", "buffer", 1),
        )
    ]
    stations += [Station("incoming", "storage", 1), Station("outgoing", "storage", 1)]
    lathes = tuple(_fms_route(machine, 0.0) for machine in machines[:2])
    products = (Product("rook", lathes), Product("sign", (_fms_route("mill", 240.0),)))
    names = tuple({"R": "rook", "S": "sign"}[letter] for letter in order)
    table = np.array(FMS_S)
    arrivals = Arrivals((interval_s,) * len(names), "pick")
    return Cell(tuple(stations), products, names, table, table, one_robot("incoming"), arrivals)


def _fms_route(machine: str, service_s: float) -> Route:
    stages = (Stage(f"{machine} in"), Stage(machine, service_s=service_s, pallet=True), Stage(f"{machine} out"))
    return (Stage("incoming"), *stages, Stage("outgoing"))


def build_crossing_cell() -> Cell:
    """Two machines, passed from left to right by one part, from right to left by the other: with one in each, nothing moves."""
    stations = tuple(Station(name, "machine", 1, 5.0) for name in ("left", "right"))
    stations += (Station("in", "storage", 2), Station("out", "storage", 2))
    ways = (("left", "right"), ("right", "left"))
    routes = [tuple(Stage(name) for name in ("in", *middle, "out")) for middle in ways]
    products = (Product("there", (routes[0],)), Product("back", (routes[1],)))
    table = 1.0 - np.eye(4)
    return Cell(stations, products, ("there", "back"), table, table, one_robot("in"))


def all_ends(run: Run) -> Iterator[Run]:
    """Every run that a run can become, to the end; without those that end in a deadlock."""
    if run.done:
        yield run
    for decision in run.allowed():
        ahead = branch(run)
        ahead.move(decision)
        yield from all_ends(ahead)


@st.composite
def random_cells(
    draw: st.DrawFn, max_machines: int = 2, max_parts: int = 3, many: bool = False, windows: bool = False
) -> Cell:
    """A small cell whose tables hold the needed moves and nothing else; `many`: products, routes, pallets, arrivals.

    windows: parts in some machines are to be fetched in time; there may be no sequence then.
    """
    parts = draw(st.integers(1, max_parts))
    seconds = st.one_of(st.integers(0, 20).map(float), st.floats(0, 20, allow_subnormal=False))
    stations = [Station("in", "storage", parts), Station("out", "storage", parts)]
    products = []
    for product in range(draw(st.integers(1, 2 if many else 1))):
        routes = []
        for number in range(draw(st.integers(1, 2 if many else 1))):
            name = f"{product}.{number}" if many else ""
            routes.append(_random_route(draw, stations, name, max_machines, seconds, many))
        products.append(Product(f"type {product}" if product else "toast", tuple(routes)))
    if windows:
        stations = [_with_window(draw, station, products) for station in stations]
    stations = draw(st.permutations(stations))
    buffers = draw(st.sampled_from(["busy", "free"])) if many else "busy"
    start = draw(st.sampled_from(stations)).name
    order = tuple(draw(st.sampled_from(products)).name for _ in range(parts))
    moves = needed_moves(stations, products, one_robot(start), parts, buffers)  # type: ignore[arg-type]
    names = [station.name for station in stations]
    tables = []
    for pairs in (moves.empty, moves.loaded):
        table = np.full((len(names), len(names)), np.nan)
        for origin, target in pairs:
            # Above 0, so that 1 / T exists.
            table[names.index(origin), names.index(target)] = 0.5 + draw(seconds)
        tables.append(table)
    arrivals = None
    if many and draw(st.booleans()):
        arrivals = Arrivals(tuple(draw(seconds) for _ in order), draw(st.sampled_from(["clock", "pick"])))
    due_s = tuple(1000.0 * draw(seconds) + 4000.0 for _ in order) if many else None
    tables_s = tables[0], tables[1]
    return Cell(tuple(stations), tuple(products), order, *tables_s, one_robot(start), arrivals, buffers, due_s)  # type: ignore[arg-type]


def _with_window(draw: st.DrawFn, station: Station, products: list[Product]) -> Station:
    """A machine whose parts are to be fetched soon, or any station as it is."""
    if station.kind != "machine" or draw(st.booleans()):
        return station
    stages = [stage for product in products for route in product.routes for stage in route]
    service_s = max((stage.service_s for stage in stages if stage.station == station.name), default=0.0)
    return replace(station, at_most_s=service_s + draw(st.sampled_from([0.0, 1.25, 3.75, 10.0, 40.0])))


def _random_route(
    draw: st.DrawFn,
    stations: list[Station],
    name: str,
    max_machines: int,
    seconds: SearchStrategy[float],
    many: bool,
) -> Route:
    """A route from "in" to "out" through stations of its own, which are added; with `many` also with pallets, or back to "in"."""
    route = [Stage("in")]
    for number in range(draw(st.integers(1, max_machines))):
        label = f"{name}{number}"
        time_s = draw(seconds)
        if many and draw(st.booleans()):
            stations += [Station(f"pallet {label}", "buffer", draw(st.integers(1, 2)))]
            stations += [Station(f"machine {label}", "machine", draw(st.integers(1, 2)), time_s)]
            stations += [Station(f"after {label}", "buffer", draw(st.integers(1, 2)))]
            machine = Stage(f"machine {label}", None, None, draw(seconds), True)
            route += [Stage(f"pallet {label}"), machine, Stage(f"after {label}")]
            continue
        buffer = f"buffer {label}" if draw(st.booleans()) else None
        if buffer:
            stations.append(Station(buffer, "buffer", draw(st.integers(1, 2))))
        kind = draw(st.sampled_from(["machine", "machine", "storage"]))
        room = draw(st.integers(1, 2))
        stations.append(Station(f"stage {label}", kind, room, time_s if kind == "machine" else 0.0))  # type: ignore[arg-type]
        route.append(Stage(f"stage {label}", buffer))
    return (*route, Stage(draw(st.sampled_from(["out", "in"])) if many else "out"))


@st.composite
def random_shops(draw: st.DrawFn, max_parts: int = 3) -> Cell:
    """A small cell with robots, several or none, machines with queues, and changeovers; some rooms are limited.

    Several robots may share a track: a tree of stretches that joins all stations.
    """
    seconds = st.integers(0, 12).map(float)
    machines = [f"m{n}" for n in range(draw(st.integers(1, 3)))]
    robots = [f"robot {n}" for n in range(draw(st.integers(0, 3)))]
    names = [f"job {n}" for n in range(draw(st.integers(1, max_parts)))]
    stations = [Station("in", "storage", UNLIMITED), Station("out", "storage", UNLIMITED)]
    for name in machines:
        room = draw(st.sampled_from([UNLIMITED, UNLIMITED, 1, 2])) if robots else UNLIMITED
        served = not robots or draw(st.booleans())
        servers = draw(st.integers(1, min(room, 2))) if served else None
        setups = tuple((a, b, draw(seconds)) for a in names for b in names) if served and draw(st.booleans()) else ()
        stations.append(Station(name, "machine", room, 0.0, None, servers, setups))
    with_servers = [one.name for one in stations if one.servers is not None]
    products = []
    for name in names:
        visited = draw(st.permutations(machines))[: draw(st.integers(1, len(machines)))]
        stages = [Stage(machine, processing_s=draw(seconds)) for machine in visited]
        last = [Stage("out")] if visited[-1] not in with_servers or (robots and draw(st.booleans())) else []
        products.append(Product(name, ((Stage("in"), *stages, *last),)))
    size = len(stations)
    table = np.array([[draw(seconds) if a != b else 0.0 for b in range(size)] for a in range(size)])
    own = tuple(Robot(name, draw(st.sampled_from(stations)).name, draw(st.sampled_from([1.0, 2.0]))) for name in robots)
    order = tuple(draw(st.sampled_from(names)) for _ in range(draw(st.integers(1, max_parts))))
    if len(own) < 2 or not draw(st.booleans()):
        return Cell(tuple(stations), tuple(products), order, table, 2.0 * table, own)
    called = [station.name for station in stations]
    track = tuple(
        Stretch(called[n], called[draw(st.integers(0, n - 1))], float(draw(st.integers(1, 12)))) for n in range(1, size)
    )
    for (a, b), way in ways_on(track, called).items():
        table[a, b] = travel_s(way)
    return Cell(tuple(stations), tuple(products), order, table, table, own, track=track)


@pytest.fixture(scope="session")
def shops() -> Callable[..., SearchStrategy[Cell]]:
    return random_shops


@pytest.fixture(scope="session")
def toast_cell() -> Callable[..., Cell]:
    return build_toast_cell


@pytest.fixture(scope="session")
def oven_cell() -> Callable[..., Cell]:
    return build_oven_cell


@pytest.fixture(scope="session")
def fms_cell() -> Callable[..., Cell]:
    return build_fms_cell


@pytest.fixture(scope="session")
def cells() -> Callable[..., SearchStrategy[Cell]]:
    return random_cells


@pytest.fixture(scope="session")
def crossing_cell() -> Callable[[], Cell]:
    return build_crossing_cell


@pytest.fixture(scope="session")
def ends() -> Callable[[Run], Iterator[Run]]:
    return all_ends
