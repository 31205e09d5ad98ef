"""What task files are made of: parts and their routes, stations, camera, workspace, processes, obstacles."""

from math import prod
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from lab.tasks.part_fields import PartFields
from lab.tasks.record import Count, Learned, Name, Record, as_tuple

Size = Annotated[float, Field(ge=0.001, le=10)]  # the bounds keep a slip of the pen from taking all memory or all day
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

MAX_PARTS = 50  # of a run in physics
MOST_CELLS = (
    100_000  # of the workspace: each is surveyed for every way, which takes seconds and a quarter of a gigabyte
)
MOST_THINGS = 200  # stations, stages or obstacles: on one table is no room for more


class Workspace(Record):
    """The grid of the transfer sub-task: lower corner [m], cell [m], cells along x, y, z."""

    lower_m: XYZ
    cell_m: Sizes
    shape: Annotated[tuple[Count, Count, Count], BeforeValidator(as_tuple)]

    @field_validator("shape")
    @classmethod
    def _can_be_surveyed(cls, shape: tuple[int, int, int]) -> tuple[int, int, int]:
        if prod(shape) > MOST_CELLS:
            raise ValueError(f"{prod(shape)} cells: up to {MOST_CELLS} can be surveyed: wanted larger cells, or fewer")
        return shape


class CameraSettings(Record):
    """The overhead camera: position above the table [m], field of view [rad], picture width and height [pixels].

    calibration: a file that `lab see --calibrate` wrote, which then says where the camera is, and what lens it has.
    """

    position_m: Above
    field_of_view_rad: Annotated[float, Field(gt=0.01, lt=2.5)]
    pixels: Annotated[int, Field(ge=64, le=4096)] = 640
    calibration: Annotated[str, Field(min_length=1, max_length=200)] | None = None


class CameraGrid(Record):
    """The camera's grid before a station (ch. 8): origin, cell, start [m], and the finger tips' height on the way [m].

    marker_m: where the station's cyan marker lies, off its pose along and across its axes, and above the table.
    """

    origin_m: XY
    cell_m: Size
    shape: Annotated[tuple[Count, Count], BeforeValidator(as_tuple)] = (12, 12)
    start_m: XY
    height_m: Size
    marker_m: XYZ


class Process(Record):
    """A surface that is covered cell by cell, as with butter, glue or paint, or by vacuuming: cells, dwell [s], speed [m/s].

    by "head": the machine's own head covers the side of the part that stands in it. by "robot": the empty gripper covers
    `area_m` [m] around the station's pose, moved by `off_m` along its axes; z is the height of the finger tips.
    """

    grid: Annotated[
        tuple[Annotated[int, Field(ge=1, le=4)], Annotated[int, Field(ge=1, le=4)]], BeforeValidator(as_tuple)
    ]
    dwell_s: Time = 3.0
    speed_m_s: Annotated[float, Field(ge=0.001, le=2)] = 0.02
    color: Color = (1.0, 0.87, 0.25)
    by: Literal["head", "robot"] = "head"
    area_m: Annotated[tuple[Size, Size], BeforeValidator(as_tuple)] | None = None
    off_m: XYZ = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _area_for_the_robot(self) -> Self:
        if (self.by == "robot") == (self.area_m is None):
            raise ValueError(
                f"by = '{self.by}': area_m is the surface that the robot covers, and only the robot needs it"
            )
        if self.grid[0] * self.grid[1] > 12:
            raise ValueError(
                f"grid = {list(self.grid)}: at most 12 cells are covered, for each doubles what is learned"
            )
        return self


class Station(Record):
    """A place where parts stand: pose x, y [m], yaw [rad]; a machine has a processing time [s] or a process to learn.

    capacity: for how many parts there are spots; a machine works on each of them from when it comes, one with a process on
    one at a time. at_most_s: how long a part may stay in a machine after that before the robot takes it out, else it is
    spoilt [s]. body: what stands there, "slab", "box" of `size_m`, or a URDF or mesh file; floor_m: how high parts stand on
    it; spots: where, off the pose along its axes and by yaw, instead of in rows. finish: the colour of parts done here;
    color: of a slab, box or mesh.
    """

    name: Name
    kind: Literal["storage", "buffer", "machine"]
    pose: XYZ
    capacity: Count
    processing_s: Time | None = None
    process: Name | None = None
    at_most_s: Time | None = None
    body: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    size_m: Sizes | None = None
    floor_m: Off | None = None
    spots: Annotated[tuple[XYZ, ...], BeforeValidator(as_tuple), Field(max_length=100)] | None = None
    approach: Literal["above", "camera", "side"] = "above"
    grid: CameraGrid | None = None
    finish: Color | None = None
    color: Color | None = None

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
    def _body_and_spots(self) -> Self:
        if self.approach == "camera" and self.grid is None:
            raise ValueError(f"station '{self.name}': approach = 'camera' needs a grid, through which the camera leads")
        if self.approach != "camera" and self.grid is not None:
            raise ValueError(f"station '{self.name}': grid is for approach = 'camera', not '{self.approach}'")
        if self.spots is not None and len(self.spots) != self.capacity:
            raise ValueError(
                f"station '{self.name}' has {len(self.spots)} spots and the capacity {self.capacity}: wanted as many"
            )
        if self.size_m is not None and self.stands_on not in ("slab", "box"):
            raise ValueError(f"station '{self.name}': size_m is for a 'slab' or 'box', its body is '{self.stands_on}'")
        if self.stands_on == "box" and self.size_m is None:
            raise ValueError(f"station '{self.name}': a 'box' needs size_m, length, width and height")
        return self

    @property
    def stands_on(self) -> str:
        """The body, also where the file says none."""
        return self.body or ("box" if self.kind == "machine" else "slab")


class Stage(Record):
    """One stage of a route; with only a station it may be written as its name.

    buffer: where the part waits when the station is full. processing_s, at_most_s: this kind's own in the machine [s].
    service: a process that the robot carries out before it takes the part out. pallet: the part is lifted off its pallet here.
    """

    station: Name
    buffer: Name | None = None
    processing_s: Time | None = None
    service: Name | None = None
    pallet: bool = False
    at_most_s: Time | None = None


def _as_stage(value: object) -> object:
    return {"station": value} if isinstance(value, str) else value


Route = Annotated[
    tuple[Annotated[Stage, BeforeValidator(_as_stage)], ...],
    BeforeValidator(as_tuple),
    Field(min_length=2, max_length=MOST_THINGS),
]


class Part(PartFields):
    """A kind of part: its shape, how many there are, and the routes that one of them may take.

    pallet: the kind, without routes of its own, that it comes and goes on.
    """

    count: Annotated[int, Field(ge=0, le=MAX_PARTS)] = 1
    pallet: Name | None = None
    routes: Annotated[tuple[Route, ...], BeforeValidator(as_tuple), Field(max_length=MOST_THINGS)] = ()

    @property
    def places(self) -> tuple[str, ...]:
        """Every station and buffer of its routes, each once, in their order."""
        stages = (stage for route in self.routes for stage in route)
        return tuple(dict.fromkeys(name for stage in stages for name in (stage.buffer, stage.station) if name))

    @property
    def ends(self) -> tuple[str, ...]:
        """The stations at which its routes begin and end, each once."""
        return tuple(dict.fromkeys(route[at].station for route in self.routes for at in (0, -1)))


class Obstacle(Record):
    """What stands in the way at `position_m` [m], within +- `area` [m] of it: a stack of cubes, or a box of `size_m`."""

    name: Name
    position_m: XY
    cubes: Annotated[int, Field(ge=1, le=15)] = 3
    edge_m: Annotated[float, Field(gt=0.005, le=0.3)] = 0.06
    size_m: Sizes | None = None
    yaw: Number = 0.0
    color: Color = (0.72, 0.53, 0.33)
    area: Area = (0.0, 0.0)

    @property
    def size(self) -> tuple[float, float, float]:
        """Length, width and height [m]."""
        return self.size_m or (self.edge_m, self.edge_m, self.edge_m * self.cubes)


class Subtask(Learned):
    """How a sub-task is learned: rewards, learner and gate."""
