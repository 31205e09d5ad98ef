"""What cell files are made of: robot, stations, products, arrivals, chance, and how a sequence is looked for."""

from collections.abc import Collection, Iterator
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from lab.errors import unknown
from lab.sequencing.cell.chance import LAWS, Chance
from lab.sequencing.cell.stations import STATION_KINDS, Product, Stage, Station
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


class CellRobot(Record):
    """The transfer robot: the station where it stands at time 0."""

    start: Name


class CellStation(Record):
    """A place for parts: `capacity` in parts; a machine may have one processing time for all products [s].

    at_most_s: how long after it a part may stay in the machine, else it is spoilt [s].
    """

    name: Name
    kind: Annotated[Literal["storage", "buffer", "machine"], _known("kind", STATION_KINDS, "station")]
    capacity: Room
    processing_s: Seconds | None = None
    at_most_s: Seconds | None = None

    def built(self) -> Station:
        """As the sequencer has it."""
        return Station(self.name, self.kind, self.capacity, self.processing_s or 0.0, self.at_most_s)


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

    def built(self) -> Chance:
        """As the sequencer has it."""
        return Chance(self.processing, self.arrivals, self.spread)


class CellFields(Record):
    """All that a cell file may hold.

    Either `order`, a product for each part, or, for one product, `parts`. travel: seconds from a station (the row) to
    another; a pair that is left out is no allowed move. loaded: those that differ when the robot carries something.
    in_physics: the name of the task, or its file in the same folder, in which lab run carries such a cell out.
    due_s: one a part; due_factor: a part is due so many times its own work after it arrives (see `CellFile.work_s`).
    """

    kind: Literal["cell"] = "cell"
    name: Name
    title: str = ""
    in_physics: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,80}$")] | None = None
    order: Annotated[tuple[Name, ...], BeforeValidator(as_tuple)] | None = None
    parts: int | None = None
    buffers: Literal["busy", "free"] = "busy"
    due_s: Annotated[tuple[Seconds, ...], BeforeValidator(as_tuple)] | None = None
    due_factor: Annotated[float, Field(gt=0, le=1000)] | None = None
    robot: CellRobot
    stations: Annotated[tuple[CellStation, ...], BeforeValidator(as_tuple), Field(min_length=2, max_length=100)]
    products: Annotated[tuple[CellProduct, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=50)]
    travel: Times
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
    def built_stations(self) -> tuple[Station, ...]:
        """The stations as the sequencer has them."""
        return tuple(station.built() for station in self.stations)

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
