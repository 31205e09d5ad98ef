"""A cell, the problem of sequencing: stations, products with their routes, an order of parts, and transfer robots."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput, unknown
from lab.sequencing.cell.precedence import Precedence, RouteStep, Rule, check_precedences, made_in, signatures
from lab.sequencing.cell.routes import (
    NeededMoves,
    Position,
    is_serial,
    moves_between,
    open_ways,
    positions_of,
    reached_from,
)
from lab.sequencing.cell.stations import (
    MAX_S,
    Arrivals,
    Begins,
    Product,
    Robot,
    Route,
    Stage,
    Station,
    check_layout,
    check_robots,
    check_seconds,
    is_count,
    one_robot,
)
from lab.sequencing.cell.track import Stretch, Way, check_track, travel_s, ways_on

MAX_PARTS = 200
TRACK_SLACK_S = 1e-9  # tolerance between sums of times
BUFFER_USES = ("busy", "free")
ARRIVALS_AFTER = ("clock", "pick")

EVERY_PLAN = "every plan"  # the set that a proof is about; cycles name theirs, see `Rhythm.proven_of`


@dataclass(frozen=True, eq=False)
class Cell:
    """The problem of sequencing: the parts of an order take the routes of their products, moved by one robot, several, or none.

    order: a product's name for each part; parts are numbered from 1. empty_s, loaded_s: (n, n) seconds from station row to
    station column, in the order of `stations`, for a robot of speed 1; NaN: no such move; staying takes 0 s. robots: they hinder
    each other only on a `track`, which then carries all drives (see `Run`) and must agree with the tables; without robots, parts
    move on by themselves, at once, and wait wherever they are. arrivals: None: all parts wait at their first station and may be
    taken in any order; else they arrive, and are taken, in their order. buffers: "busy", a buffer is used only when the station
    ahead is full; "free", the robot chooses. due_s: each part's due time [s]. begins: where each part is at time 0; None: all at
    their first stations; the makespan counts the parts that are not finished then. closed: stations to which nothing may be
    brought, such as a machine that is out of order. precedences: transfers that wait for others, in cells of one robot and
    machines without servers. `lab.sequencing.simulate.rest.rest_of` makes the cell of the remaining work of a run.
    Raises BadInput for an inconsistent cell, and for a missing time that a route needs (see `needed_moves`).
    Source: thesis ch. 7 (rules), tables 7.1 and 7.2 (times); App. III (pallets, arrivals, vacuuming).

        >>> import lab, numpy
        >>> from lab.sequencing.cell.stations import Product, Robot, Stage, Station
        >>> stations = Station("in", "storage", 2), Station("oven", "machine", 1, 30.0), Station("out", "storage", 2)
        >>> route = Stage("in"), Stage("oven"), Stage("out")
        >>> drive_s = 10.0 * (1 - numpy.eye(3))
        >>> cell = lab.Cell(stations, (Product("bun", (route,)),), ("bun",) * 2, drive_s, drive_s, (Robot("arm", "in"),))
        >>> lab.sequence(cell).cost
        110.0
    """

    stations: tuple[Station, ...]
    products: tuple[Product, ...]
    order: tuple[str, ...]
    empty_s: NDArray[np.float64]
    loaded_s: NDArray[np.float64]
    robots: tuple[Robot, ...]
    arrivals: Arrivals | None = None
    buffers: Literal["busy", "free"] = "busy"
    due_s: tuple[float, ...] | None = None
    begins: tuple[Begins, ...] | None = None
    closed: tuple[str, ...] = ()
    track: tuple[Stretch, ...] = ()
    precedences: tuple[Precedence, ...] = ()

    def __post_init__(self) -> None:
        check_layout(self.stations, self.products)
        check_robots(self.robots, self.stations)
        self._check_batches()
        if self.buffers not in BUFFER_USES:
            raise unknown("use of buffers", self.buffers, BUFFER_USES, "cell")
        self._check_order()
        for name in self.closed:
            self.index(name)
        if self.precedences:
            self._check_precedences()
        self._check_begins()
        self._check_times()
        for field, needed in (("empty_s", self.needed.empty), ("loaded_s", self.needed.loaded)):
            object.__setattr__(self, field, _checked_table(field, getattr(self, field), self.names, needed))
        check_track(self.track, self.names)
        for table, needed in ((self.empty_s, self.needed.empty), (self.loaded_s, self.needed.loaded)):
            for origin, target in needed if self.track else ():
                at = self.index(origin), self.index(target)
                if at not in self.ways or abs(travel_s(self.ways[at]) - table[at]) > TRACK_SLACK_S:
                    raise BadInput(f"track: no path of {table[at]:g} s leads from '{origin}' to '{target}' on it")

    @classmethod
    def alike(
        cls,
        stations: tuple[Station, ...],
        route: Route,
        empty_s: NDArray[np.float64],
        loaded_s: NDArray[np.float64],
        robot_start: str,
        parts: int,
    ) -> "Cell":
        """A cell of identical parts, called toast, along one route, all there at the start; raises BadInput as any cell."""
        check_parts(parts)
        return cls(
            stations, (Product("toast", (route,)),), ("toast",) * parts, empty_s, loaded_s, one_robot(robot_start)
        )

    @property
    def parts(self) -> int:
        """The number of parts in the order."""
        return len(self.order)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the stations, by index."""
        return tuple(station.name for station in self.stations)

    @cached_property
    def capacities(self) -> tuple[int, ...]:
        """The capacity of each station, by index."""
        return tuple(station.capacity for station in self.stations)

    @cached_property
    def batches(self) -> frozenset[int]:
        """The indices of the machines that work on all parts in them together."""
        return frozenset(index for index, station in enumerate(self.stations) if station.batch)

    @property
    def robot_start(self) -> str:
        """Where the first robot stands at time 0."""
        return self.robots[0].start

    @cached_property
    def serial(self) -> bool:
        """Whether one robot does all the work, so that what is decided later also happens later."""
        return is_serial(self.positions, self.robots)

    @cached_property
    def takers(self) -> tuple[frozenset[int], ...]:
        """By station, the robots (by index) and servers (`SERVER`) that may free room there; empty with fewer than two robots."""
        by_station = [set[int]() for _ in self.stations]
        for place in self.positions if len(self.robots) > 1 else ():
            for way in place.options:
                for station in set(place.holds) - set(self.positions[way.to].holds):
                    by_station[station].add(way.robot)
        return tuple(map(frozenset, by_station))

    @cached_property
    def without_windows(self) -> "Cell":
        """The same cell without time windows: parts may stay in a machine as long as they are left there."""
        stations = tuple(replace(station, at_most_s=None) for station in self.stations)
        products = tuple(
            replace(product, routes=tuple(tuple(stage.each(_no_window) for stage in route) for route in product.routes))
            for product in self.products
        )
        return replace(self, stations=stations, products=products)

    @cached_property
    def ways(self) -> Mapping[tuple[int, int], Way]:
        """The path on the track between two stations, by their indices; empty without a track."""
        return ways_on(self.track, self.names)

    @cached_property
    def setups(self) -> tuple[dict[tuple[str, str], float], ...]:
        """How long a server of each station takes to change over, by product before and product [s]."""
        return tuple({(a, b): seconds for a, b, seconds in station.setups} for station in self.stations)

    @cached_property
    def positions(self) -> tuple[Position, ...]:
        """Every position on a route where a part of the order may stand between two moves, with the options still open."""
        shut = {self.index(name) for name in self.closed}
        taken = [station for at in self._stay for station in at.holds]
        shut |= self.batches.intersection(taken)  # a machine that is never empty takes no new batch
        shut |= {station for station in taken if taken.count(station) >= self.capacities[station]}
        return (*open_ways(self.laid_out, shut), *self._stay)

    @cached_property
    def laid_out(self) -> tuple[Position, ...]:
        """The positions with all their options, ignoring closed stations, without those of parts that stay where they are."""
        return positions_of(self.stations, [self.products[n] for n, _ in self._classes], self.buffers, self.robots)

    @cached_property
    def rules(self) -> tuple[Rule, ...]:
        """The precedences in terms of positions."""
        own = [
            [n for n, at in enumerate(self.laid_out) if at.product == number] for number in range(len(self._classes))
        ]
        known_rules = []
        for number, precedence in enumerate(self.precedences):
            sides = []
            for side, step in enumerate((precedence.step, precedence.of_step)):
                members = [n for n, (_, sign) in enumerate(self._classes) if sign[number][side]]
                made = frozenset().union(*(made_in(self.laid_out, own[n], step, self.names) for n in members))
                added = enumerate(self._stays_at, len(self.laid_out))
                standing = {
                    place
                    for place, (at, product) in added
                    if product in members and (step.leaves if at is None else at in made)
                }
                sides.append(made | standing)
            known_rules.append(Rule(sides[0], sides[1], precedence.counts))
        return tuple(known_rules)

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """The first position of each part's routes, part 1 first."""
        first = {place.product: index for index, place in reversed([*enumerate(self.laid_out)])}
        return tuple(first[product] for product in self._products)

    @cached_property
    def begin_at(self) -> tuple[int, ...]:
        """The position in which each part begins, part 1 first; it has no options for a part that makes no move."""
        if self.begins is None:
            return self.starts
        stay = iter(range(len(self.laid_out), len(self.laid_out) + len(self._stay)))
        end = {place.product: index for index, place in enumerate(self.laid_out) if not place.options}
        return tuple(
            next(stay) if self._is_apart(begin) else end[product] if begin.position is None else begin.position
            for product, begin in zip(self._products, self.begins, strict=True)
        )

    @cached_property
    def begin_s(self) -> tuple[float, ...]:
        """When each part may be picked where it begins [s]; arrivals are not included."""
        return tuple(begin.ready_s for begin in self.begins) if self.begins is not None else (0.0,) * self.parts

    @cached_property
    def coming(self) -> tuple[int, ...]:
        """The parts that begin at the start of their routes, in the order of their arrivals."""
        return tuple(n for n, (at, start) in enumerate(zip(self.begin_at, self.starts, strict=True), 1) if at == start)

    @cached_property
    def unfinished(self) -> tuple[int, ...]:
        """The parts that still have moves to make."""
        return tuple(n for n, at in enumerate(self.begin_at, 1) if self.positions[at].options)

    @cached_property
    def needed(self) -> NeededMoves:
        """The moves that some allowed sequence may contain (see `needed_moves`)."""
        begins = sorted({self.begin_at[part - 1] for part in self.unfinished})
        first = [way for at in begins for way in self.positions[at].options]
        if self.begins is not None:
            taken = [station for at in self.begin_at for station in self.positions[at].holds]
            full = [taken.count(station) >= room for station, room in enumerate(self.capacities)]
            first = [way for way in first if way.possible(full)]
        return moves_between(self.stations, self.positions, begins, first, self.robots, len(self.unfinished))

    @cached_property
    def possible_moves(self) -> int:
        """The number of different moves that all parts may make, along all their routes."""
        ahead = {at: reached_from(self.positions, {at}) for at in set(self.begin_at)}
        return sum(len(self.positions[place].options) for at in self.begin_at for place in ahead[at])

    @cached_property
    def most_choices(self) -> int:
        """The largest number of choices of a part in one position."""
        return 1 + max(option.choice for place in self.positions for option in place.options)

    @cached_property
    def has_windows(self) -> bool:
        """Whether some part has a latest pick, after which it is spoilt."""
        return any(place.at_most_s is not None for place in self.positions)

    def at_most_s(self, part: int, station: str) -> float | None:
        """How long after its processing at a station a part may be picked [s]; None: at any time."""
        product, at = self._products[part - 1], self.index(station)
        limits = [
            p.at_most_s for p in self.laid_out if p.product == product and at in p.holds and p.at_most_s is not None
        ]
        return min(limits, default=None)

    @cached_property
    def longest_s(self) -> float:
        """An upper bound of every makespan [s]: all steps at their slowest, one after the other."""
        slowest_s = sum(float(np.nanmax(table, initial=0.0)) for table in (self.empty_s, self.loaded_s))
        service_s = max((option.service_s for place in self.positions for option in place.options), default=0.0)
        slowest_s /= min([robot.speed for robot in self.robots], default=1.0)
        process_s = sum(place.processing_s or 0.0 for place in self.positions)
        change_s = [max([seconds for *_, seconds in station.setups], default=0.0) for station in self.stations]
        process_s += sum(change_s[place.station] for place in self.positions)
        come_s = (sum(self.arrivals.interval_s) if self.arrivals else 0.0) + max(0.0, *self.begin_s)
        return self.parts * (len(self.positions) * (slowest_s + service_s) + process_s) + come_s

    def index(self, name: str) -> int:
        """The index of a station by its name; raises BadInput when it is unknown."""
        try:
            return self.names.index(name)
        except ValueError:
            raise unknown("station", name, self.names, "cell") from None

    def part_name(self, part: int) -> str:
        """The name of a part in pictures and schedules: its product and its number."""
        return f"{self.order[part - 1]} {part}"

    @cached_property
    def _products(self) -> tuple[int, ...]:
        """The index of each part's class in `_classes`, which is the `product` of its positions."""
        names = [product.name for product in self.products]
        signs = signatures(self.precedences, self.parts)
        return tuple(
            self._classes.index((names.index(name), sign)) for name, sign in zip(self.order, signs, strict=True)
        )

    @cached_property
    def _classes(self) -> list[tuple[int, tuple[tuple[bool, bool], ...]]]:
        """The classes of identical parts: a product (by index) and the sides of the precedences on which they stand."""
        signs = signatures(self.precedences, self.parts)
        classes = []
        for number, product in enumerate(self.products):
            own = dict.fromkeys(sign for name, sign in zip(self.order, signs, strict=True) if name == product.name)
            classes += [(number, sign) for sign in own or {((False, False),) * len(self.precedences): None}]
        return classes

    def _is_apart(self, begin: Begins) -> bool:
        """Whether a part needs a position of its own: it stays where it is, or it is nowhere and precedences count it."""
        return (begin.stays and begin.position is not None) or (begin.position is None and bool(self.precedences))

    @cached_property
    def _stays_at(self) -> tuple[tuple[int | None, int], ...]:
        """For each part with a position of its own, where it stands (None: nowhere) and its class."""
        begins = zip(self.begins or (), self._products, strict=False)
        return tuple((begin.position, product) for begin, product in begins if self._is_apart(begin))

    @cached_property
    def _stay(self) -> tuple[Position, ...]:
        """A position without options for each part that stays where it is; the part takes room there."""
        starts = {place.product: place for place in reversed(self.laid_out)}
        return tuple(
            replace(starts[product] if place is None else self.laid_out[place], processing_s=0.0, options=())
            for place, product in self._stays_at
        )

    def _check_precedences(self) -> None:
        if not is_serial(self.laid_out, self.robots):
            raise BadInput("precedences: they are for cells of one robot, and machines without servers")
        steps = [RouteStep(name, leaves) for name in self.names for leaves in (False, True)]
        does = dict[str, list[RouteStep]]()
        for part, start in enumerate(self.starts, 1):
            own = sorted(reached_from(self.laid_out, {start}))
            ends = {place for place in own if not self.laid_out[place].options}
            does[self.part_name(part)] = [s for s in steps if ends <= made_in(self.laid_out, own, s, self.names)]
        names = [self.part_name(part) for part in range(1, self.parts + 1)]
        check_precedences(self.precedences, self.names, names, does)

    def _check_batches(self) -> None:
        if self.batches and not is_serial(self.laid_out, self.robots):
            name = self.names[min(self.batches)]
            raise BadInput(f"station '{name}': batch = true is for cells of one robot, and machines without servers")

    def _check_begins(self) -> None:
        begins = self.begins if self.begins is not None else [Begins(start) for start in self.starts]
        if len(begins) != self.parts:
            raise BadInput(f"begins has {len(begins)} parts; the order has {self.parts}")
        for part, (begin, product) in enumerate(zip(begins, self._products, strict=True), 1):
            where = f"begin of {self.part_name(part)}"
            own = [n for n, place in enumerate(self.laid_out) if place.product == product]
            if begin.position is not None and begin.position not in own:
                raise BadInput(f"{where}: position {begin.position}: its routes have {own[0]} to {own[-1]}")
            check_seconds(f"{where}: ready_s", abs(begin.ready_s))
            if self.arrivals is not None and begin.position == own[0] and begin.ready_s > 0:
                raise BadInput(f"{where}: ready_s = {begin.ready_s:g}, but when it comes, the arrivals say")
        for part, at in enumerate(self.begin_at, 1):
            if at < len(self.laid_out) and self.laid_out[at].options and not self.positions[at].options:
                where = f"begin of {self.part_name(part)} at '{self.names[self.positions[at].station]}'"
                raise BadInput(f"{where}: no open path leads to an end of its routes: mark it as one that stays")
        for station, room in zip(self.stations, self.capacities, strict=True):
            held = sum(self.index(station.name) in self.positions[at].holds for at in self.begin_at)
            if held > room:
                raise BadInput(f"begins: station '{station.name}' holds {held} parts; its capacity is {room}")
        if not self.unfinished:
            raise BadInput("begins: no part has anything left to do")

    def _check_order(self) -> None:
        check_parts(len(self.order))
        known = [product.name for product in self.products]
        for number, name in enumerate(self.order, 1):
            if name not in known:
                raise unknown("product", name, known, f"part {number} of the order")
        for name in self.names:
            if any(name == self.part_name(part) for part in range(1, self.parts + 1)):
                raise BadInput(f"station '{name}': a part has that name; call the station something else")
        for end in self._ends() if self.arrivals is None else ():
            if self.stations[self.index(end)].servers is not None:
                continue
            room = self.stations[self.index(end)].capacity
            most = sum(self.order.count(product.name) for product in self.products if end in _ends_of(product))
            if room < most:
                raise BadInput(f"station '{end}': capacity {room} cannot hold all {most} parts")

    def _ends(self) -> list[str]:
        return sorted({end for product in self.products for end in _ends_of(product)})

    def _check_times(self) -> None:
        if self.arrivals is not None:
            if self.arrivals.after not in ARRIVALS_AFTER:
                raise unknown("arrivals after", self.arrivals.after, ARRIVALS_AFTER, "cell")
            _check_one_each("arrivals", self.arrivals.interval_s, self.parts)
        if self.due_s is None:
            return
        _check_one_each("due_s", self.due_s, self.parts)
        came_s = 0.0
        for part, due_s in enumerate(self.due_s, 1):
            came_s += self.arrivals.interval_s[part - 1] if self.arrivals else 0.0
            if due_s < came_s:
                raise BadInput(f"due_s of part {part} = {due_s:g} s, but it only arrives at {came_s:g} s")


def _no_window(stage: Stage) -> Stage:
    return replace(stage, at_most_s=None)


def _ends_of(product: Product) -> set[str]:
    return {way.station for route in product.routes for stage in (route[0], route[-1]) for way in stage.ways}


def needed_moves(
    stations: Sequence[Station],
    products: Sequence[Product],
    robots: Sequence[Robot],
    parts: int,
    buffers: Literal["busy", "free"] = "busy",
) -> NeededMoves:
    """Every move that some allowed sequence may contain; a Cell can be built only when the times of all of them are known.

    Loaded moves run along the routes, directly and through buffers. Empty moves run from the robot's start to the first stations,
    and from each drop to each pick that may follow. Staying is not listed. For few parts the list may be longer than strictly
    needed. Raises BadInput as Cell does for stations and routes.
    """
    check_layout(stations, products)
    positions = positions_of(stations, products, buffers, robots)
    starts = {place.product: index for index, place in reversed([*enumerate(positions)])}.values()
    first = [way for at in starts for way in positions[at].options]
    return moves_between(stations, positions, starts, first, robots, parts)


def check_parts(parts: object) -> None:
    """Raises BadInput unless `parts` is an integer from 1 to MAX_PARTS."""
    if not is_count(parts) or int(parts) > MAX_PARTS:  # type: ignore[call-overload]
        raise BadInput(f"an order of {parts!r} parts: allowed are 1 to {MAX_PARTS}")


def _check_one_each(field: str, given: Sequence[float], parts: int) -> None:
    if len(given) != parts:
        raise BadInput(f"{field} has {len(given)} times; {parts} parts need {parts}")
    for part, seconds in enumerate(given, 1):
        check_seconds(f"{field} of part {part}", seconds)


def _checked_table(
    field: str, given: ArrayLike, names: tuple[str, ...], needed: tuple[tuple[str, str], ...]
) -> NDArray[np.float64]:
    """The table as a read-only copy (n, n); raises BadInput unless all values are times or NaN and no needed one is NaN."""
    table = np.array(given, dtype=np.float64)
    size = len(names)
    if table.shape != (size, size):
        raise BadInput(f"{field} has shape {table.shape}; {size} stations need ({size}, {size})")
    for row, column in np.argwhere((table > MAX_S) | (table < 0)):
        pair = f"'{names[row]}' -> '{names[column]}'"
        raise BadInput(f"{field} {pair} = {table[row, column]}; allowed are 0 to {MAX_S:g} s")
    for name, stay in zip(names, np.diag(table), strict=True):
        if not (np.isnan(stay) or stay == 0):
            raise BadInput(f"{field} '{name}' -> '{name}' = {stay}; staying takes 0 s")
    missing = [pair for pair in needed if np.isnan(table[names.index(pair[0]), names.index(pair[1])])]
    for origin, target in missing:
        ways = [pair for pair in needed if pair[1] == target]
        never = "; no move leads there, so it cannot be reached" if len(ways) > 1 and set(ways) <= set(missing) else ""
        raise BadInput(f"{field} '{origin}' -> '{target}' is missing, but the route needs it{never}")
    table.setflags(write=False)
    return table
