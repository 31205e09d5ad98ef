"""What cell files are made of: robot, stations, products, arrivals, chance, and how a sequence is looked for."""

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
    """Refuses a name that is none of these, and says which one it may have been meant for."""

    def check(value: object) -> object:
        if isinstance(value, str) and value not in names:
            raise ValueError(str(unknown(label, value, names, where)))
        return value

    return BeforeValidator(check)


def _as_stage(value: object) -> object:
    """A stage that is a station's name and nothing else may be written as the name."""
    return {"station": value} if isinstance(value, str) else value


def _unlimited(value: object, checked: Callable[[object], int]) -> int:
    """A capacity, or the word for one that is never reached."""
    return UNLIMITED if value == "unlimited" else checked(value)


class CellRobot(Record):
    """A transfer robot, or a vehicle: the station where it stands at time 0.

    name: needed where there are several. speed: how many times faster it is than `travel` says. serves: the stations where it may
    pick and drop; left out: all.
    """

    start: Name
    name: Name = ROBOT
    speed: Annotated[float, Field(ge=1e-3, le=1e3)] = 1.0
    serves: Annotated[tuple[Name, ...], BeforeValidator(as_tuple)] | None = None

    def built(self) -> Robot:
        """As the sequencer has it."""
        return Robot(self.name, self.start, self.speed, self.serves)


class CellStation(Record):
    """A place for parts: `capacity` in parts, or "unlimited"; a machine may have one processing time for all products [s].

    at_most_s: how long after it a part may stay in the machine, else it is spoilt [s]. servers: how many parts it works on at
    once; the others wait in its room, and those that are done, too; left out: all that stand in it, and no waiting. setup_s: from
    product -> to product -> seconds that a server takes to change over.
    """

    name: Name
    kind: Annotated[Literal["storage", "buffer", "machine"], _known("kind", STATION_KINDS, "station")]
    capacity: Annotated[Room, WrapValidator(_unlimited)]
    processing_s: Seconds | None = None
    at_most_s: Seconds | None = None
    servers: Room | None = None
    setup_s: Times = Field(default={})

    def built(self) -> Station:
        """As the sequencer has it."""
        setups = tuple((a, b, seconds) for a, row in self.setup_s.items() for b, seconds in row.items())
        return Station(
            self.name, self.kind, self.capacity, self.processing_s or 0.0, self.at_most_s, self.servers, setups
        )


class CellStage(Record):
    """A step of a route (see `lab.sequencing.cell.cell.Stage`); with only a station it may be written as its name."""

    station: Name
    buffer: Name | None = None
    processing_s: Seconds | None = None
    service_s: Seconds = 0.0
    pallet: bool = False
    at_most_s: Seconds | None = None


Route = Annotated[
    tuple[Annotated[CellStage, BeforeValidator(_as_stage)], ...], BeforeValidator(as_tuple), Field(max_length=100)
]


class CellProduct(Record):
    """A type of part, and the routes that the robot may take one of them along."""

    name: Name
    routes: Annotated[tuple[Route, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=50)]

    def built(self) -> Product:
        """As the sequencer has it."""
        return Product(self.name, tuple(tuple(Stage(**dict(stage)) for stage in route) for route in self.routes))


class CellArrivals(Record):
    """Parts that come one after the other: the time before each [s], counted from the arrival or the pick before it."""

    interval_s: Seconds
    after: Literal["clock", "pick"] = "clock"


Law = Annotated[str, _known("law", LAWS, "stochastic")]


class Stochastic(Record):
    """What --stochastic draws the times of an episode from (see `lab.sequencing.cell.chance.Chance`)."""

    processing: Law = "normal"
    arrivals: Law = "constant"
    spread: Annotated[float, Field(ge=0, le=1)] = 0.1
    breaks_every_s: Seconds = 0.0
    repair_s: Seconds = 0.0
    late_s: Seconds = 0.0

    def built(self) -> Chance:
        """As the sequencer has it."""
        return Chance(**self.model_dump())


class CellTrack(Record):
    """What several robots drive on: stretches of so many seconds between two stations, each of which holds one at a time."""

    stretches: Annotated[
        tuple[Annotated[tuple[Name, Name, Seconds], BeforeValidator(as_tuple)], ...],
        BeforeValidator(as_tuple),
        Field(min_length=1, max_length=200),
    ]

    def built(self) -> tuple[Stretch, ...]:
        """As the sequencer has it."""
        return tuple(Stretch(*one) for one in self.stretches)


class CellFields(Record):
    """All that a cell file may hold.

    Either `order`, a product for each part, or, for one product, `parts`. travel: seconds from a station (the row) to
    another; a pair that is left out is no allowed move; with a track, the times are those of its ways.
    loaded: those that differ when the robot carries something.
    Either `robot`, the only one, or `robots`: several, or [] where parts go on by themselves. in_physics: the name of the task,
    or its file in the same folder, in which lab run carries such a cell out. due_s, release_s: one a part, when it is wanted, and
    when it is there at first; due_factor: a part is due so many times its own work after it arrives (see `CellFile.work_s`).
    """

    kind: Literal["cell"] = "cell"
    name: Name
    title: str = ""
    in_physics: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,80}$")] | None = None
    order: Annotated[tuple[Name, ...], BeforeValidator(as_tuple)] | None = None
    parts: int | None = None
    buffers: Literal["busy", "free"] = "busy"
    due_s: Annotated[tuple[Seconds, ...], BeforeValidator(as_tuple)] | None = None
    release_s: Annotated[tuple[Seconds, ...], BeforeValidator(as_tuple)] | None = None
    due_factor: Annotated[float, Field(gt=0, le=1000)] | None = None
    robot: CellRobot | None = None
    robots: Annotated[tuple[CellRobot, ...], BeforeValidator(as_tuple), Field(max_length=50)] | None = None
    stations: Annotated[tuple[CellStation, ...], BeforeValidator(as_tuple), Field(min_length=2, max_length=100)]
    products: Annotated[tuple[CellProduct, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=MAX_PARTS)]
    travel: Times = Field(default={})
    track: CellTrack | None = None
    loaded: Times = Field(default={})
    arrivals: CellArrivals | None = None
    stochastic: Stochastic = Stochastic()
    sequencing: Sequencing = Sequencing()

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
        """Seconds from a station to another: as given, or those of the ways on the track."""
        if self.track is None:
            return self.travel
        names, found = self.station_names, Times()
        for (origin, target), way in ways_on(self.track.built(), names).items():
            found.setdefault(names[origin], {})[names[target]] = travel_s(way)
        return found

    @property
    def built_stations(self) -> tuple[Station, ...]:
        """The stations as the sequencer has them."""
        return tuple(station.built() for station in self.stations)

    @property
    def built_robots(self) -> tuple[Robot, ...]:
        """The robots as the sequencer has them."""
        given = self.robots if self.robots is not None else (self.robot,) if self.robot is not None else ()
        return tuple(robot.built() for robot in given)

    @property
    def built_products(self) -> tuple[Product, ...]:
        """The products as the sequencer has them."""
        return tuple(product.built() for product in self.products)

    def stages(self) -> Iterator[tuple[Loc, CellStage]]:
        """Every stage of every route, after the way to it in the file."""
        for i, product in enumerate(self.products):
            for j, route in enumerate(product.routes):
                for k, stage in enumerate(route):
                    yield ("products", i, "routes", j, k), stage
