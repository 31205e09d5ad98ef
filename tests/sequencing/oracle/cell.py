"""A cell as plain data, and a timed plan for it: what the oracle is asked, and what it answers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import lcm
from typing import Literal

Pair = tuple[str, str]
Objective = Literal["makespan", "mean-tardiness", "tardy-parts", "robot-idle", "machine-idle"]


@dataclass(frozen=True)
class Station:
    """A place for parts. capacity None: never full. machine: it works on parts; storage and buffers do not.

    servers None: each part is worked on from when it is put down. Else so many servers take parts out of the room one at a
    time, in any order; a part that is done waits in the room. setup_s: (product before, product) to what a server needs
    between the two [s]; a pair that is not there needs none, and neither does the first product.
    """

    name: str
    capacity: int | None = None
    machine: bool = False
    servers: int | None = None
    setup_s: Mapping[Pair, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Stage:
    """A stop on a route. buffer: where a part may wait before it. service_s: what a robot does there before it picks [s].

    pallet: the part leaves its pallet at the stop before; once the part is put down the empty pallet is carried to the stop
    after, and only then may the part be picked. at_most_s: how long after the processing it may be picked [s].
    """

    station: str
    processing_s: float = 0.0
    buffer: str | None = None
    service_s: float = 0.0
    pallet: bool = False
    at_most_s: float | None = None


@dataclass(frozen=True)
class Robot:
    """Who carries, one part at a time. serves: where it may pick and drop; None: everywhere."""

    name: str
    start: str
    speed: float = 1.0
    serves: frozenset[str] | None = None


@dataclass(frozen=True)
class Cell:
    """What is to be planned. Times in seconds; parts are numbered from 1, in the order of `order`.

    routes: by product, the routes that a part may take, of which it takes one. empty_s, loaded_s: how long a robot of speed 1
    takes from station to station; a pair that is missing is no way. No robots: parts go on by themselves, at once, and take
    no room. only_when_full: a buffer may be used only while the station behind it is full. due_s, release_s: one a part.
    interval_s: before each part that comes; they come, and are taken, in their order; after "clock", counted from the one that
    came before; "pick", from when that was taken. track: stretches between two stations, each of which one robot at a time
    drives on; a robot stands beside it at stations, takes the shortest way, and does not stop between.
    """

    stations: tuple[Station, ...]
    routes: Mapping[str, tuple[tuple[Stage, ...], ...]]
    order: tuple[str, ...]
    empty_s: Mapping[Pair, float]
    loaded_s: Mapping[Pair, float]
    robots: tuple[Robot, ...]
    only_when_full: bool = True
    due_s: tuple[float, ...] | None = None
    release_s: tuple[float, ...] | None = None
    interval_s: tuple[float, ...] | None = None
    after: Literal["clock", "pick"] = "clock"
    track: tuple[tuple[str, str, float], ...] = ()

    def station(self, name: str) -> Station:
        """The station of a name."""
        return next(one for one in self.stations if one.name == name)


@dataclass(frozen=True)
class Carried:
    """A robot leaves where it was for `origin` at leave_s, is ready to take at pick_s what it has served for service_s until
    then, sets out at out_s, and puts it down at `target` at drop_s."""

    part: int
    robot: str
    origin: str
    target: str
    leave_s: float
    pick_s: float
    out_s: float
    drop_s: float
    service_s: float = 0.0
    what: Literal["part", "pallet"] = "part"


@dataclass(frozen=True)
class Worked:
    """A server of a machine works on a part."""

    part: int
    station: str
    begin_s: float
    end_s: float


@dataclass(frozen=True)
class Plan:
    """Everything that happens; what a machine without servers works on follows from when parts are put down."""

    carried: tuple[Carried, ...]
    worked: tuple[Worked, ...] = ()


def ticks_per_s(cell: Cell) -> int:
    """The fewest ticks in a second in which all times of a cell are whole. ValueError where a million are not enough."""
    times = [stage.processing_s for ways in cell.routes.values() for way in ways for stage in way]
    for ways in cell.routes.values():
        for way in ways:
            for stage in way:
                times += [stage.service_s] + ([] if stage.at_most_s is None else [stage.at_most_s])
    for one in cell.stations:
        times += one.setup_s.values()
    for given in (cell.due_s, cell.release_s, cell.interval_s):
        times += given or ()
    for speed in {robot.speed for robot in cell.robots}:
        times += [seconds / speed for table in (cell.empty_s, cell.loaded_s) for seconds in table.values()]
        times += [seconds / speed for *_, seconds in cell.track]
    found = 1
    for seconds in times:
        found = lcm(found, Fraction(seconds).limit_denominator(10_000).denominator)
        if found > 1_000_000 or abs(round(seconds * found) - seconds * found) > 1e-4:
            raise ValueError(f"no common unit of time: {seconds} s is not whole in {found} ticks a second")
    return found
