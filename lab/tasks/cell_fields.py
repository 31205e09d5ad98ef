"""The records of a cell file: robots, stations, products, arrivals, chance, and the search for a sequence."""

from collections.abc import Callable, Collection, Iterator
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, WrapValidator

from lab.errors import unknown
from lab.sequencing.cell.cell import MAX_PARTS
from lab.sequencing.cell.chance import LAWS, Chance
from lab.sequencing.cell.stations import ROBOT, STATION_KINDS, UNLIMITED, Product, Robot, Stage, Station
from lab.sequencing.cell.track import Stretch, travel_s, ways_on
from lab.tasks.record import Name, Record, as_tuple
from lab.tasks.sequencing import Sequencing
from lab.tasks.toml_text import Loc

Seconds = Annotated[float, Field(ge=0, le=1e6)]  # 1e6 s: eleven days
Room = Annotated[int, Field(ge=1, le=1000)]
Times = dict[str, dict[str, Seconds]]  # from -> to -> seconds


def _known(label: str, names: Collection[str], where: str) -> BeforeValidator:
    """A validator that refuses a name that is not among `names`, and suggests a similar one."""

    def check(value: object) -> object:
        if isinstance(value, str) and value not in names:
            raise ValueError(str(unknown(label, value, names, where)))
        return value

    return BeforeValidator(check)


def _as_stage(value: object) -> object:
    """The raw stage as a table; a stage without other fields may be written as its station's name."""
    return {"station": value} if isinstance(value, str) else value


def _unlimited(value: object, checked: Callable[[object], int]) -> int:
    """A checked capacity; the word "unlimited" means one that is never reached."""
    return UNLIMITED if value == "unlimited" else checked(value)


class CellRobot(Record):
    """A transfer robot, or a vehicle."""

    start: Name
    """The station where the robot stands at time 0, such as `"in"`."""
    name: Name = ROBOT
    """The robot's name; required in a cell with several robots."""
    speed: Annotated[float, Field(ge=1e-3, le=1e3)] = 1.0
    """The factor by which the robot is faster than the travel times [-]."""
    serves: Annotated[tuple[Name, ...], BeforeValidator(as_tuple)] | None = None
    """The stations where the robot may pick and drop, such as `["in", "oven"]`; left out: all."""

    def built(self) -> Robot:
        """The robot as a record of the cell."""
        return Robot(self.name, self.start, self.speed, self.serves)


class CellStation(Record):
    """A place for parts: storage, a buffer, or a machine."""

    name: Name
    """The station's name, which routes and travel times use, such as `"oven"`."""
    kind: Annotated[Literal["storage", "buffer", "machine"], _known("kind", STATION_KINDS, "station")]
    """The station's kind: parts begin and end in storage, wait in a buffer, and are worked on in a machine."""
    capacity: Annotated[Room, WrapValidator(_unlimited, json_schema_input_type=Room | Literal["unlimited"])]
    """The number of parts that the station holds at once, such as `1`, or `"unlimited"`."""
    processing_s: Seconds | None = None
    """The processing time of each part [s], such as `60.0`; a stage of a route may have its own."""
    at_most_s: Seconds | None = None
    """The longest stay in the machine after processing, before the part is spoilt [s], such as `4.0`; left out: no limit."""
    servers: Room | None = None
    """The number of parts that the machine works on at once, such as `1`; others, and finished ones, wait inside. Left out:
    all parts in the machine, each from its arrival.
    """
    batch: bool = False
    """Whether the machine works on all parts that stand in it together, such as `true`: the batch begins with the last
    part that is brought before one is taken out, takes the longest of their times, and no part enters until all are
    out. A batch needs a capacity of 2 or more, and one robot.
    """
    setup_s: Times = Field(default={})
    """The time of a server's changeover from product to product [s], such as `{ bun = { loaf = 20.0 } }`."""

    def built(self) -> Station:
        """The station as a record of the cell."""
        setups = tuple((a, b, seconds) for a, row in self.setup_s.items() for b, seconds in row.items())
        return Station(
            self.name,
            self.kind,
            self.capacity,
            self.processing_s or 0.0,
            self.at_most_s,
            self.servers,
            setups,
            self.batch,
        )


class CellStage(Record):
    """One stage of a route; a stage that is only a station may be written as its name."""

    station: Name
    """The station to which the part goes, such as `"oven"`."""
    buffer: Name | None = None
    """Where the part waits when that station is full, such as `"oven_buffer"`."""
    processing_s: Seconds | None = None
    """The processing time of this product [s], such as `45.0`; left out: the station's time."""
    service_s: Seconds = 0.0
    """The robot's work at the station before it can take the part out [s], such as `20.0`."""
    pallet: bool = False
    """Whether the part is lifted off its pallet for this machine; the pallet stays at the station before, and is
    brought to the one after.
    """
    at_most_s: Seconds | None = None
    """The longest stay of this product in the machine after processing [s], such as `4.0`; left out: the station's
    limit.
    """
    alternatives: Annotated[
        tuple[Annotated["CellStage", BeforeValidator(_as_stage)], ...], BeforeValidator(as_tuple), Field(max_length=98)
    ] = ()
    """Other stages, any of which may be taken in place of this one, such as `["oven2"]`."""

    def built(self) -> Stage:
        """The stage as a record of the cell, with its alternatives."""
        return Stage(**dict(self) | {"alternatives": tuple(way.built() for way in self.alternatives)})


Route = Annotated[
    tuple[Annotated[CellStage, BeforeValidator(_as_stage)], ...],
    BeforeValidator(as_tuple),
    Field(max_length=100),
]


class CellProduct(Record):
    """A type of part, and its routes."""

    name: Name
    """The product's name, such as `"bun"`."""
    routes: Annotated[tuple[Route, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=50)]
    """The routes that a part may take, each a list of stages, such as `[["in", "oven", "out"]]`."""

    def built(self) -> Product:
        """The product as a record of the cell."""
        return Product(self.name, tuple(tuple(stage.built() for stage in route) for route in self.routes))


class CellArrivals(Record):
    """Parts that arrive at the first station one after the other."""

    interval_s: Seconds
    """The time before each part [s], such as `90.0`."""
    after: Literal["clock", "pick"] = "clock"
    """The start of the interval: the previous arrival ("clock"), or the removal of the previous part ("pick")."""


Law = Annotated[str, _known("law", LAWS, "stochastic")]


class Stochastic(Record):
    """The distributions from which --stochastic draws the times of an episode."""

    processing: Law = "normal"
    """The distribution of processing times."""
    arrivals: Law = "constant"
    """The distribution of the times between arrivals."""
    spread: Annotated[float, Field(ge=0, le=1)] = 0.1
    """The standard deviation of a normal time, as a share of its mean [-]."""
    breaks_every_s: Seconds = 0.0
    """The mean working time between two breakdowns of a machine [s], such as `3600.0`; 0: none."""
    repair_s: Seconds = 0.0
    """The mean time of a repair [s], such as `120.0`."""
    late_s: Seconds = 0.0
    """The mean delay of a part after its release_s [s], such as `30.0`."""
    robot_breaks_every_s: Seconds = 0.0
    """The mean time between a robot's repair and its next breakdown, at work or not [s], such as `600.0`; 0: none. A broken
    robot stops where it is, with the part that it holds. At least 1 s; not allowed in a cell with a track.
    """
    robot_repair_s: Seconds = 0.0
    """The mean time of a robot's repair [s], such as `60.0`."""

    def built(self) -> Chance:
        """The distributions of the times, as the search draws from them."""
        return Chance(**self.model_dump())


class CellTrack(Record):
    """The track of several robots: stretches between two stations, each of which holds one robot at a time."""

    stretches: Annotated[
        tuple[Annotated[tuple[Name, Name, Seconds], BeforeValidator(as_tuple)], ...],
        BeforeValidator(as_tuple),
        Field(min_length=1, max_length=200),
    ]
    """The stretches, each with the two stations that it joins and a robot's driving time along it [s], such as
    `[["in", "oven", 5.0]]`.
    """

    def built(self) -> tuple[Stretch, ...]:
        """The stretches of the track, each as a record of the cell."""
        return tuple(Stretch(*stretch) for stretch in self.stretches)


class CellFields(Record):
    """The keys of a cell file; `CellFile` makes a cell of them."""

    kind: Literal["cell"] = "cell"
    """The kind of the file; always "cell"."""
    name: Name
    """The cell's name, such as `"bakery"`: 1 to 40 letters, digits, spaces, - and _."""
    title: str = ""
    """A title in one line, such as `"Two products, one oven"`."""
    in_physics: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,80}$")] | None = None
    """The name or file (in the same folder) of the task in which `lab run` carries this cell out, such as `"fms"`."""
    order: Annotated[tuple[Name, ...], BeforeValidator(as_tuple)] | None = None
    """The product of each part, such as `["bun", "loaf", "bun"]`."""
    parts: int | None = None
    """The number of parts in a cell with one product, such as `4`; in place of order."""
    buffers: Literal["busy", "free"] = "busy"
    """Whether a part goes to a buffer only while its machine is full ("busy"), or whenever the order says so ("free")."""
    due_s: Annotated[tuple[Seconds, ...], BeforeValidator(as_tuple)] | None = None
    """The due time of each part [s], such as `[120.0, 300.0, 240.0]`."""
    release_s: Annotated[tuple[Seconds, ...], BeforeValidator(as_tuple)] | None = None
    """The arrival time of each part [s], such as `[0.0, 60.0, 60.0]`."""
    due_factor: Annotated[float, Field(gt=0, le=1000)] | None = None
    """The time from a part's arrival until it is due, as a multiple of its own work [-], such as `3.0`; in place of due_s."""
    robot: CellRobot | None = None
    """The only robot; in place of robots."""
    robots: Annotated[tuple[CellRobot, ...], BeforeValidator(as_tuple), Field(max_length=50)] | None = None
    """The robots, in place of robot; `[]` if parts move by themselves."""
    stations: Annotated[tuple[CellStation, ...], BeforeValidator(as_tuple), Field(min_length=2, max_length=100)]
    """The stations at which parts stand and are worked on."""
    products: Annotated[tuple[CellProduct, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=MAX_PARTS)]
    """The types of parts."""
    travel: Times = Field(default={})
    """The driving times from a station (the row) to another [s], such as `{ in = { oven = 10.0 } }`; a pair that is left
    out is a forbidden move.
    """
    track: CellTrack | None = None
    """The track of several robots; its stretches give the times, in place of travel."""
    loaded: Times = Field(default={})
    """The travel times that differ when the robot carries something [s], such as `{ in = { oven = 12.0 } }`."""
    arrivals: CellArrivals | None = None
    """The arrivals of parts; left out: all parts are there at time 0."""
    stochastic: Stochastic = Stochastic()
    """The distributions from which --stochastic draws times."""
    sequencing: Sequencing = Sequencing()
    """The settings of the search for the order of the robot's transfers."""

    @property
    def names(self) -> tuple[str, ...]:
        """The products' names."""
        return tuple(product.name for product in self.products)

    @property
    def station_names(self) -> tuple[str, ...]:
        """The stations' names."""
        return tuple(station.name for station in self.stations)

    @property
    def times(self) -> Times:
        """The seconds from each station to each other: the travel table, or the durations of the paths on the track."""
        if self.track is None:
            return self.travel
        names, table = self.station_names, Times()
        for (origin, target), way in ways_on(self.track.built(), names).items():
            table.setdefault(names[origin], {})[names[target]] = travel_s(way)
        return table

    @property
    def built_stations(self) -> tuple[Station, ...]:
        """The stations as records of the sequencer."""
        return tuple(station.built() for station in self.stations)

    @property
    def built_robots(self) -> tuple[Robot, ...]:
        """The robots as records of the sequencer."""
        given = self.robots if self.robots is not None else (self.robot,) if self.robot is not None else ()
        return tuple(robot.built() for robot in given)

    @property
    def built_products(self) -> tuple[Product, ...]:
        """The products as records of the sequencer."""
        return tuple(product.built() for product in self.products)

    def stages(self) -> Iterator[tuple[Loc, CellStage]]:
        """Every stage of every route, each with the path to it in the file."""
        for i, product in enumerate(self.products):
            for j, route in enumerate(product.routes):
                for k, stage in enumerate(route):
                    where: Loc = ("products", i, "routes", j, k)
                    yield where, stage
                    yield from (((*where, "alternatives", n), way) for n, way in enumerate(stage.alternatives))
