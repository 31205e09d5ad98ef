"""The routes of a cell as a graph: positions where a part may stand between two moves, and the options to leave them.

The rules of a route (a buffer when the machine is busy, a pallet that has to follow) become positions and options. The
simulations, the bound and the searches use nothing else.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from graphlib import TopologicalSorter
from typing import Literal, TypeVar

from lab.errors import BadInput
from lab.sequencing.cell.stations import Product, Robot, Route, Stage, Station

Value = TypeVar("Value")
SERVER = -1  # in place of a robot's index: a server carries out the option


@dataclass(frozen=True)
class Option:
    """One option to leave a position: a robot picks at station `origin` and drops at `target`; the part is in `to` then.

    robot: its index; SERVER: a server of the station `target` takes the part and works on it instead. choice: the number of the
    option among a position's, see `entry`. needs: the stations (by index) that must have room. if_full: allowed only when this
    station is full. service_s: the robot's work before the pick [s]. waits: allowed only after the processing. carries: "part" or
    "pallet".
    """

    choice: int
    to: int
    origin: int
    target: int
    needs: tuple[int, ...]
    if_full: int | None = None
    service_s: float = 0.0
    waits: bool = True
    carries: Literal["part", "pallet"] = "part"
    robot: int = 0

    def possible(self, full: Sequence[bool]) -> bool:
        """Whether the stations in `needs` have room and `if_full` is full; full: by station."""
        for station in self.needs:  # a plain loop, since this is called often
            if full[station]:
                return False
        return self.if_full is None or full[self.if_full]


@dataclass(frozen=True)
class Position:
    """A part at `station` (index) on a route of `product` (index); holds: the stations where it, or its pallet, takes room.

    processing_s: the processing that begins with its arrival [s]; None: no processing begins, and one that has begun goes on.
    Without options the part is finished; ends of routes take no room. at_most_s: how long after the processing it may be picked
    [s]; None: at any time.
    """

    product: int
    station: int
    holds: tuple[int, ...]
    processing_s: float | None
    options: tuple[Option, ...]
    at_most_s: float | None = None


@dataclass(frozen=True)
class NeededMoves:
    """The pairs (origin, target) of station names between which the robot may have to drive empty, and to carry something."""

    empty: tuple[tuple[str, str], ...]
    loaded: tuple[tuple[str, str], ...]


def entry(part: int, choice: int, parts: int) -> int:
    """The number of a decision in a sequence: the part's number, + `parts` for its second choice, and so on."""
    return part + choice * parts


def part_of(entry: int, parts: int) -> int:
    """The part's number in a sequence's entry."""
    return (entry - 1) % parts + 1


def choice_of(entry: int, parts: int) -> int:
    """The choice in a sequence's entry, from 0."""
    return (entry - 1) // parts


def positions_of(
    stations: Sequence[Station], products: Sequence[Product], buffers: Literal["busy", "free"], robots: Sequence[Robot]
) -> tuple[Position, ...]:
    """The positions of all products, each product's start first; the routes must have been checked.

    Raises BadInput where no robot serves both ends of a move.
    """
    layout = _Positions(stations, buffers, robots)
    for number, product in enumerate(products):
        layout.add(number, product)
    return tuple(layout.positions)


def from_the_ends(positions: Sequence[Position], value: Callable[[int, list[Value]], Value]) -> list[Value]:
    """The value of each position, computed backwards from the ends: value(position, values that its options lead to)."""
    ahead = {number: [option.to for option in place.options] for number, place in enumerate(positions)}
    values = dict[int, Value]()
    for number in TopologicalSorter(ahead).static_order():
        values[number] = value(number, [values[to] for to in ahead[number]])
    return [values[number] for number in range(len(positions))]


def open_ways(positions: Sequence[Position], shut: Collection[int]) -> list[Position]:
    """The positions without the options that lead into the stations `shut` (by index), or only into dead ends.

    A part in a position that is left without options can go nowhere.
    """
    kept = [replace(at, options=tuple(way for way in at.options if way.target not in shut)) for at in positions]
    ends = [not at.options for at in positions]
    leads = from_the_ends(kept, lambda place, ahead: ends[place] or any(ahead))
    return [replace(at, options=tuple(way for way in at.options if leads[way.to])) for at in kept]


def reached_from(positions: Sequence[Position], places: Collection[int]) -> set[int]:
    """The positions that a part may reach from these, these included."""
    ahead = from_the_ends(positions, lambda place, after: {place}.union(*after))
    return set[int]().union(*(ahead[place] for place in places))


def moves_between(
    stations: Sequence[Station],
    positions: Sequence[Position],
    begins: Collection[int],
    first: Collection[Option],
    robots: Sequence[Robot],
    parts: int,
) -> NeededMoves:
    """The empty moves between consecutive transfers, and the loaded moves; staying is left out.

    begins: the positions in which parts begin. first: the options that may be taken first. parts: how many still move. With more
    than one robot, any transfer of a robot may follow any other one of it.
    """
    names = [station.name for station in stations]
    if not is_serial(positions, robots):
        return _moves_of_robots(names, positions, begins, robots)
    options = [(positions[at], way) for at in sorted(reached_from(positions, begins)) for way in positions[at].options]
    loaded = dict.fromkeys((option.origin, option.target) for _, option in options)
    begin = names.index(robots[0].start)
    empty = dict.fromkeys((begin, option.origin) for option in first)
    for left, done in options:
        there = positions[done.to]
        empty |= dict.fromkeys((done.target, own.origin) for own in there.options)
        full = {place for place in there.holds if stations[place].capacity == 1}
        gone = {place for place in left.holds if stations[place].capacity == 1 and place not in there.holds}
        for _, other in options if parts > 1 else ():
            if other.origin not in gone and not full.intersection(other.needs):
                empty[done.target, other.origin] = None
    return _named(names, empty, loaded)


def is_serial(positions: Sequence[Position], robots: Sequence[Robot]) -> bool:
    """Whether one robot does all the work, so that decisions are carried out in their order."""
    return len(robots) == 1 and all(way.robot != SERVER for place in positions for way in place.options)


def _moves_of_robots(
    names: Sequence[str], positions: Sequence[Position], begins: Collection[int], robots: Sequence[Robot]
) -> NeededMoves:
    ways = [way for at in sorted(reached_from(positions, begins)) for way in positions[at].options]
    empty = dict[tuple[int, int], None]()
    for number, robot in enumerate(robots):
        own = [way for way in ways if way.robot == number]
        left = [names.index(robot.start), *dict.fromkeys(way.target for way in own)]
        empty |= dict.fromkeys((a, way.origin) for a in left for way in own)
    return _named(names, empty, dict.fromkeys((way.origin, way.target) for way in ways if way.robot != SERVER))


def _named(
    names: Sequence[str], empty: Collection[tuple[int, int]], loaded: Collection[tuple[int, int]]
) -> NeededMoves:
    named = [tuple((names[a], names[b]) for a, b in pairs if a != b) for pairs in (empty, loaded)]
    return NeededMoves(named[0], named[1])


class _Positions:
    """A builder of positions, which are added route by route."""

    def __init__(self, stations: Sequence[Station], buffers: str, robots: Sequence[Robot]) -> None:
        self.positions: list[Position] = []
        self._stations, self._buffers, self._robots = stations, buffers, robots
        self._index = {station.name: index for index, station in enumerate(stations)}

    def add(self, product: int, described: Product) -> None:
        """Adds all positions of a product: its start, then route by route; routes share ends of the same name."""
        start = self._position(product, described.routes[0][0].station, ())
        ends: dict[str, int] = {}
        for route in described.routes:
            self._add_route(product, route, start, ends)

    def _add_route(self, product: int, route: Route, start: int, ends: dict[str, int]) -> None:
        leaves = {start: 0.0}  # the positions that the next stage is reached from, and the service there
        for before, stage, after in zip(route[:-1], route[1:], [*route[2:], None], strict=True):
            reached = dict[int, float]()
            for way in stage.ways:
                if self._stations[self._index[way.station]].servers is not None:
                    reach = self._add_served(leaves, way, after is None)
                elif after is None:
                    known = ends.get(way.station)
                    reach = self._position(product, way.station, ()) if known is None else known
                    ends[way.station] = reach
                    self._link(leaves, reach, way)
                else:
                    holds = (way.station, before.station) if way.pallet else (way.station,)
                    where = before.station if way.pallet else way.station
                    reach = self._position(product, where, holds, self._processing_s(way), self._at_most_s(way))
                    self._link(leaves, reach, way)
                if way.pallet and after is not None:
                    holds = (way.station, after.station)
                    left = self._position(product, way.station, holds, None, self._at_most_s(way))
                    self._carry(reach, left, replace(self._way(after.station), waits=False, carries="pallet"))
                    reach = left
                reached[reach] = way.service_s
            leaves = reached

    def _add_served(self, leaves: Mapping[int, float], stage: Stage, last: bool) -> int:
        """Adds the positions of a machine with servers, before and after the work; without robots only the latter.

        Finished parts take the machine's room, too. Returns the position after the work.
        """
        product, room = self.positions[next(iter(leaves))].product, (stage.station,) if self._robots else ()
        there = [leave for leave in leaves if self._names(leave) == stage.station or not self._robots]
        if come := {leave: service_s for leave, service_s in leaves.items() if leave not in there}:
            queue = self._position(product, stage.station, room)
            self._link(come, queue, stage)
            there.append(queue)
        at_most_s = None if last else self._at_most_s(stage)
        done = self._position(product, stage.station, () if last else room, self._processing_s(stage), at_most_s)
        for leave in there:
            self._join(leave, done, replace(self._way(stage.station), robot=SERVER))
        return done

    def _names(self, position: int) -> str:
        return self._stations[self.positions[position].station].name

    def _link(self, leaves: Mapping[int, float], reach: int, stage: Stage) -> None:
        """Adds the options from positions, with the service there, to a stage: directly, and through its buffer."""
        choices = {leave: self._carry(leave, reach, self._way(stage.station, s)) for leave, s in leaves.items()}
        if stage.buffer is None:
            return
        wait = self._position(self.positions[reach].product, stage.buffer, (stage.buffer,))
        for leave, service_s in leaves.items():
            way = self._way(stage.buffer, service_s)
            if self._buffers != "busy":
                self._carry(leave, wait, way)
                continue
            # With one robot the two options exclude each other: they share a decision, and the cell says where it leads.
            for robot, choice in choices[leave].items():
                choice = choice if len(self._robots) == 1 else -1
                full = replace(way, choice=choice, if_full=self._index[stage.station], robot=robot)
                if self._serves(robot, self.positions[leave].station, full.target):
                    self._join(leave, wait, full)
        self._carry(wait, reach, self._way(stage.station))

    def _carry(self, leave: int, to: int, way: Option) -> dict[int, int]:
        """Adds an option for each robot that serves both ends; returns the choices by robot. Raises BadInput if none does."""
        origin = self.positions[leave].station
        able = [robot for robot in range(len(self._robots)) if self._serves(robot, origin, way.target)]
        if not able:
            ends = f"'{self._stations[origin].name}' to '{self._stations[way.target].name}'"
            raise BadInput(f"no robot can carry from {ends}: none serves both")
        return {robot: self._join(leave, to, replace(way, robot=robot)) for robot in able}

    def _serves(self, robot: int, *stations: int) -> bool:
        serves = self._robots[robot].serves
        return serves is None or all(self._stations[station].name in serves for station in stations)

    def _way(self, target: str, service_s: float = 0.0) -> Option:
        """An option with only its target and service time filled in."""
        return Option(-1, -1, -1, self._index[target], (), service_s=service_s)

    def _position(
        self,
        product: int,
        station: str,
        holds: tuple[str, ...],
        processing_s: float | None = 0.0,
        at_most_s: float | None = None,
    ) -> int:
        held = tuple(self._index[name] for name in holds)
        self.positions.append(Position(product, self._index[station], held, processing_s, (), at_most_s))
        return len(self.positions) - 1

    def _join(self, leave: int, to: int, way: Option) -> int:
        """Adds an option from a position to another, completed from `way`; returns its choice, a new one if it has none yet."""
        place, there = self.positions[leave], self.positions[to]
        choice = way.choice if way.choice >= 0 else 1 + max((option.choice for option in place.options), default=-1)
        needs = tuple(station for station in there.holds if station not in place.holds)
        option = replace(way, choice=choice, to=to, origin=place.station, needs=needs)
        self.positions[leave] = replace(place, options=(*place.options, option))
        return choice

    def _processing_s(self, stage: Stage) -> float:
        station = self._stations[self._index[stage.station]]
        return station.processing_s if stage.processing_s is None else stage.processing_s

    def _at_most_s(self, stage: Stage) -> float | None:
        return self._stations[self._index[stage.station]].at_most_s if stage.at_most_s is None else stage.at_most_s
