"""The records of a task file: parts with their routes, stations, camera, workspace, processes, obstacles."""

from math import prod
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from lab.tasks.part_fields import PartFields
from lab.tasks.record import Count, Learned, Name, Record, as_tuple

Size = Annotated[float, Field(ge=0.001, le=10)]  # bounded, so that a typing error does not take all memory or hours
Time = Annotated[float, Field(ge=0, le=86_400)]
Number = Annotated[float, Field(ge=-10, le=10)]
Off = Annotated[float, Field(ge=0, le=10)]
XY = Annotated[tuple[Number, Number], BeforeValidator(as_tuple)]
XYZ = Annotated[tuple[Number, Number, Number], BeforeValidator(as_tuple)]
Above = Annotated[tuple[Number, Number, Size], BeforeValidator(as_tuple)]
Sizes = Annotated[tuple[Size, Size, Size], BeforeValidator(as_tuple)]
Area = Annotated[tuple[Off, Off], BeforeValidator(as_tuple)]
Shade = Annotated[float, Field(ge=0, le=1)]
Color = Annotated[tuple[Shade, Shade, Shade], BeforeValidator(as_tuple)]

MAX_PARTS = 50  # parts of a run in physics
MOST_CELLS = (
    100_000  # of the workspace: each is surveyed for every transfer, which takes seconds and a quarter of a gigabyte
)
MOST_THINGS = 200  # stations, stages or obstacles; a table has no room for more


class Workspace(Record):
    """The grid of the transfer sub-task: the cells in which the finger tips may move between stations."""

    lower_m: XYZ
    """The grid's lower corner: x, y and z [m], such as `[-0.24, -1.08, 0.15]`."""
    cell_m: Sizes
    """The edges of a cell along x, y and z [m], such as `[0.12, 0.12, 0.12]`."""
    shape: Annotated[tuple[Count, Count, Count], BeforeValidator(as_tuple)]
    """The number of cells along x, y and z, such as `[9, 18, 3]`; at most 100,000 in all."""

    @field_validator("shape")
    @classmethod
    def _can_be_surveyed(cls, shape: tuple[int, int, int]) -> tuple[int, int, int]:
        if prod(shape) > MOST_CELLS:
            raise ValueError(f"{prod(shape)} cells: up to {MOST_CELLS} can be surveyed: wanted larger cells, or fewer")
        return shape


class CameraSettings(Record):
    """The overhead camera."""

    position_m: Above
    """The position of the camera: x, y and z above the table [m], such as `[0.7, 0.0, 1.6]`; it looks straight down."""
    field_of_view_rad: Annotated[float, Field(gt=0.01, lt=2.5)]
    """The field of view across its picture [rad], such as `0.9`."""
    pixels: Annotated[int, Field(ge=64, le=4096)] = 640
    """The width and the height of its picture [pixels]."""
    calibration: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """A file that `lab see --calibrate` wrote, from which the camera's position and lens are taken, such as
    `"camera.json"`.
    """


class CameraGrid(Record):
    """The grid before a station that is approached by camera (thesis, chapter 8)."""

    origin_m: XY
    """The grid's lower corner: x and y [m], such as `[0.64, 0.1]`."""
    cell_m: Size
    """The edge of a cell [m], such as `0.02`."""
    shape: Annotated[tuple[Count, Count], BeforeValidator(as_tuple)] = (12, 12)
    """The number of cells along x and y."""
    start_m: XY
    """The point at which the path through the grid begins: x and y [m], such as `[0.65, 0.2]`."""
    height_m: Size
    """The height of the finger tips on that path [m], such as `0.3`."""
    marker_m: XYZ
    """The place of the station's cyan marker: offset from its pose along its axes, and height above the table [m], such as
    `[0.0, 0.038, 0.1]`.
    """


class Process(Record):
    """A surface that is covered cell by cell, as with butter, glue or paint, or by vacuuming."""

    grid: Annotated[
        tuple[Annotated[int, Field(ge=1, le=4)], Annotated[int, Field(ge=1, le=4)]], BeforeValidator(as_tuple)
    ]
    """The number of cells of the surface along and across, such as `[3, 3]`: each 1 to 4, 2 to 12 in all."""
    dwell_s: Time = 3.0
    """The time for which the head rests at each cell [s]."""
    speed_m_s: Annotated[float, Field(ge=0.001, le=2)] = 0.02
    """The speed of the head from cell to cell [m/s]."""
    color: Color = (1.0, 0.87, 0.25)
    """The colour of the covered cells: red, green and blue [-]."""
    by: Literal["head", "robot"] = "head"
    """The mover of the process: the machine's own head, over the side of the part in the machine ("head"), or the empty
    gripper ("robot").
    """
    area_m: Annotated[tuple[Size, Size], BeforeValidator(as_tuple)] | None = None
    """Length and width of the surface that the robot covers [m], such as `[0.1, 0.08]`; required with by = "robot", not
    allowed otherwise.
    """
    off_m: XYZ = (0.0, 0.0, 0.0)
    """The offset of that surface's middle from the station's pose along its axes; z: the height of the finger tips [m],
    such as `[0.0, 0.0, 0.2]`.
    """

    @model_validator(mode="after")
    def _area_for_the_robot(self) -> Self:
        if (self.by == "robot") == (self.area_m is None):
            raise ValueError(
                "by = 'robot': area_m is missing: the surface that the robot covers, such as area_m = [0.1, 0.08] [m]"
                if self.area_m is None
                else f"by = 'head': area_m = {list(self.area_m)} is only for by = 'robot': remove it, or set by = 'robot'"
            )
        if not 2 <= self.grid[0] * self.grid[1] <= 12:
            raise ValueError(
                f"grid = {list(self.grid)}: allowed are 2 to 12 cells in all; one has no order that could be learned (a time of "
                "its own, processing_s, serves), and each more doubles what is learned"
            )
        return self


class Place(Record):
    """The place of one part at a station: on its floor, on a part below, or in a nest for one kind."""

    at: XYZ
    """The place's offset from the station's pose, along its axes: x, y and turn [m, m, rad], such as `[0.0, 0.05, 0.0]`."""
    height_m: Off = 0.0
    """The height of the part's foot above the station's floor [m], such as `0.04`: the height of the part below it."""
    kind: Name | None = None
    """The kind of part that stands there, such as `"pin"`; left out: every kind without places of its own at the station."""


class After(Record):
    """A precedence: parts of a kind wait for parts of another kind. Layers need none, because their places imply it."""

    part: Name
    """The kind that waits, such as `"label"`."""
    station: Name
    """The station on the routes of that kind whose transfer waits, such as `"tray"`."""
    step: Literal["comes", "leaves"] = "comes"
    """The transfer that waits: the one that brings the part to that station ("comes") or takes it away ("leaves")."""
    of: Name
    """The kind that is waited for, such as `"box"`."""
    of_station: Name | None = None
    """The station that parts of that kind must have reached or left, such as `"sealer"`; left out: the same station."""
    of_step: Literal["comes", "leaves"] = "comes"
    """The awaited event: those parts stand there ("comes"), or were taken away and set down elsewhere ("leaves")."""
    count: Literal["each", "all"] = "each"
    """The awaited number: one for each waiting part up to and including this one ("each"), or all of the order ("all")."""


class Station(Record):
    """A place where parts stand: storage, a buffer, or a machine with a processing time or a process to learn."""

    name: Name
    """The station's name, which routes use, such as `"oven"`."""
    kind: Literal["storage", "buffer", "machine"]
    """The station's kind: parts begin and end in storage, wait in a buffer, and are worked on in a machine."""
    pose: XYZ
    """The station's pose: x, y and turn about the vertical [m, m, rad], such as `[0.6, -0.2, 0.0]`; the arm stands at
    0, 0.
    """
    capacity: Count
    """The number of parts that the station holds at once, such as `1`. A machine works on each from its arrival, a machine
    with a process on one at a time, and a machine with batches on all together.
    """
    batch: bool = False
    """Whether the machine works on all parts that stand in it together, such as `true`: the batch begins with the last part
    that the order brings before one is taken out, takes the longest of their times, and no part enters until all are
    out. A batch needs a capacity of 2 or more.
    """
    processing_s: Time | None = None
    """The processing time of each part [s], such as `60.0`; a stage of a route may have its own."""
    process: Name | None = None
    """The process that the machine carries out, which is learned; in place of processing_s, such as `"butter"`."""
    at_most_s: Time | None = None
    """The longest stay in the machine after processing, before the part is spoilt [s], such as `4.0`; left out: no limit.
    In physics the stay ends when the gripper moves to the part to take it up, which takes up to 4 s more.
    """
    body: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """The station's body: "slab", "box", or a URDF, OBJ or STL file beside the task file, such as `"toaster.urdf"`.
    Left out: a box for a machine, else a slab.
    """
    size_m: Sizes | None = None
    """Length, width and height of a slab or box [m], such as `[0.12, 0.1, 0.05]`; required for a box; by default a slab
    is fitted to its parts.
    """
    floor_m: Off | None = None
    """The height above the table at which parts stand [m], such as `0.015`; left out: the top of a slab or box."""
    spots: Annotated[tuple[XYZ, ...], BeforeValidator(as_tuple), Field(max_length=100)] | None = None
    """The spots for parts, as many as its capacity: x, y and turn as offsets from the pose along its axes [m, m, rad],
    such as `[[0.0, -0.05, 0.0], [0.0, 0.05, 0.0]]`; left out: in rows.
    """
    places: Annotated[tuple[Place, ...], BeforeValidator(as_tuple), Field(max_length=100)] | None = None
    """The spots for parts as tables `[[stations.places]]`, in place of spots, with a height for a layer and a kind for a
    nest. They are filled from the lowest on.
    """
    approach: Literal["above", "camera", "side"] = "above"
    """The gripper's approach: straight down ("above"), through the grid that the overhead camera looks at ("camera"), or
    horizontally along the yaw of the pose ("side"), with a level tool unless `robot.tool` is "hanging".
    """
    grid: CameraGrid | None = None
    """The camera's grid before the station; required with approach = "camera", not allowed otherwise."""
    finish: Color | None = None
    """The colour of parts that the machine has done: red, green and blue [-], such as `[0.7, 0.42, 0.16]`."""
    color: Color | None = None
    """The colour of a slab, box or mesh: red, green and blue [-], such as `[0.3, 0.3, 0.35]`."""

    @model_validator(mode="after")
    def _one_time(self) -> Self:
        for field in ("processing_s", "process", "at_most_s", "finish"):
            if self.kind != "machine" and getattr(self, field) is not None:
                raise ValueError(f"station '{self.name}' is a {self.kind}: only a machine has {field}")
        if self.processing_s is not None and self.process is not None:
            raise ValueError(
                f"machine '{self.name}' needs either processing_s or process, a sub-task to learn, not both"
            )
        return self

    @model_validator(mode="after")
    def _batch_possible(self) -> Self:
        if not self.batch:
            return self
        if self.kind != "machine":
            raise ValueError(f"station '{self.name}' is a {self.kind}: only a machine has batch")
        if self.capacity < 2:
            raise ValueError(
                f"machine '{self.name}' has batch = true and the capacity {self.capacity}: a batch needs room for 2 or more"
            )
        for field in ("process", "at_most_s"):
            if getattr(self, field) is not None:
                raise ValueError(f"machine '{self.name}' has batch = true and {field}: remove one of them")
        return self

    @model_validator(mode="after")
    def _body_and_spots(self) -> Self:
        if self.approach == "camera" and self.grid is None:
            raise ValueError(f"station '{self.name}': approach = 'camera' needs a grid, through which the camera leads")
        if self.approach != "camera" and self.grid is not None:
            raise ValueError(f"station '{self.name}': grid is for approach = 'camera', not '{self.approach}'")
        if self.places is not None and self.spots is not None:
            raise ValueError(f"station '{self.name}': spots and places: wanted one of them, spots are the short form")
        if self.spots is not None and len(self.spots) != self.capacity:
            raise ValueError(
                f"station '{self.name}' has {len(self.spots)} spots and the capacity {self.capacity}: wanted as many"
            )
        if self.places is not None and len(self.places) != self.capacity:
            raise ValueError(
                f"station '{self.name}' has {len(self.places)} places and the capacity {self.capacity}: wanted as many"
            )
        if self.size_m is not None and self.stands_on not in ("slab", "box"):
            raise ValueError(f"station '{self.name}': size_m is for a 'slab' or 'box', its body is '{self.stands_on}'")
        if self.stands_on == "box" and self.size_m is None:
            raise ValueError(f"station '{self.name}': a 'box' needs size_m, length, width and height")
        return self

    @property
    def stands_on(self) -> str:
        """The body, with the default where the file gives none."""
        return self.body or ("box" if self.kind == "machine" else "slab")

    @property
    def own_places(self) -> tuple[Place, ...]:
        """The places in the file, given as places or as spots, the lowest first; empty where parts stand in default rows."""
        given = self.places or tuple(Place(at=spot) for spot in self.spots or ())
        return tuple(sorted(given, key=lambda place: place.height_m))

    @property
    def is_layered(self) -> bool:
        """Whether parts may stand on other parts."""
        return any(place.height_m for place in self.places or ())

    def nests(self, kind: str) -> str | None:
        """The kind in whose places a part stands: its own kind if that has places here, else None: places of any kind."""
        return kind if any(place.kind == kind for place in self.places or ()) else None

    def room_for(self, kind: str) -> int:
        """The number of parts of a kind that it holds if no other kind takes their places."""
        if self.places is None:
            return self.capacity
        return sum(place.kind == self.nests(kind) for place in self.places)


class Stage(Record):
    """One stage of a route; a stage that is only a station may be written as its name."""

    station: Name
    """The station to which the part goes, such as `"oven"`."""
    buffer: Name | None = None
    """Where the part waits when that station is full, such as `"oven_buffer"`."""
    processing_s: Time | None = None
    """The processing time of this kind [s], such as `45.0`; left out: the station's time."""
    service: Name | None = None
    """The name of a process with by = "robot" that the robot carries out before it takes the part out, such as `"vacuum"`."""
    pallet: bool = False
    """Whether the part is lifted off its pallet here."""
    at_most_s: Time | None = None
    """The longest stay of this kind in the machine after processing [s], such as `4.0`; left out: the station's
    limit.
    """


def _as_stage(value: object) -> object:
    return {"station": value} if isinstance(value, str) else value


Route = Annotated[
    tuple[Annotated[Stage, BeforeValidator(_as_stage)], ...],
    BeforeValidator(as_tuple),
    Field(min_length=2, max_length=MOST_THINGS),
]


class Part(PartFields):
    """A kind of part: its shape, the number of parts, and the routes that a part may take."""

    count: Annotated[int, Field(ge=0, le=MAX_PARTS)] = 1
    """The number of parts of this kind, unless `--parts` gives another."""
    pallet: Name | None = None
    """The kind of pallet on which the part arrives and leaves, which has no routes of its own, such as `"carrier"`."""
    routes: Annotated[tuple[Route, ...], BeforeValidator(as_tuple), Field(max_length=MOST_THINGS)] = ()
    """The routes that a part may take, each a list of stages, such as `[["input", "oven", "output"]]`; the order
    chooses one of them for each part.
    """

    @property
    def places(self) -> tuple[str, ...]:
        """Every station and buffer of its routes, each once, in order."""
        stages = (stage for route in self.routes for stage in route)
        return tuple(dict.fromkeys(name for stage in stages for name in (stage.buffer, stage.station) if name))

    @property
    def ends(self) -> tuple[str, ...]:
        """The stations where its routes begin and end, each once."""
        return tuple(dict.fromkeys(route[at].station for route in self.routes for at in (0, -1)))


class Obstacle(Record):
    """An obstacle: a stack of cubes, or a box."""

    name: Name
    """The obstacle's name, such as `"tower"`."""
    position_m: XY
    """The position of its middle: x and y [m], such as `[0.5, 0.3]`."""
    cubes: Annotated[int, Field(ge=1, le=15)] = 3
    """The number of stacked cubes."""
    edge_m: Annotated[float, Field(gt=0.005, le=0.3)] = 0.06
    """The edge of a cube [m]."""
    size_m: Sizes | None = None
    """Length, width and height of a box in place of cubes [m], such as `[0.4, 0.02, 0.2]`."""
    yaw: Number = 0.0
    """The obstacle's turn about the vertical [rad]."""
    color: Color = (0.72, 0.53, 0.33)
    """The obstacle's colour: red, green and blue [-]."""
    area: Area = (0.0, 0.0)
    """The largest offset from its position along x and y, drawn from the seed in both directions [m], such as
    `[0.04, 0.04]`.
    """

    @property
    def size(self) -> tuple[float, float, float]:
        """Length, width and height [m]."""
        return self.size_m or (self.edge_m, self.edge_m, self.edge_m * self.cubes)


class Subtask(Learned):
    """The settings of learning of a sub-task: rewards, learner and gate."""
