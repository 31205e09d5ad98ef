"""Task files: tasks/*.toml -> validated frozen models. The only place where raw text is checked."""

import tomllib
from dataclasses import asdict
from itertools import combinations
from math import hypot
from pathlib import Path
from typing import Annotated, Any, Literal, Self, cast

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    ValidationError,
    field_validator,
    model_validator,
)
from pydantic_core import CoreSchema

from lab.data import tasks_folder
from lab.errors import BadInput, unknown
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import Rewards

MAX_TOASTS = 50
MAX_REWARD = 1_000_000  # sums of larger ones lose the small ones, and of much larger ones overflow
RESERVED = ("robot", "table", "insert", "the slice", "carried slice")  # names of other things in the cell
RESERVED_STARTS = ("slice ", "toast ", "toasted ", "butter ", "robot ")
RESERVED_ENDS = (" marker", " column", " head")
SUBTASKS = ("transfer", "grasp", "insert", "butter", "place")
NEAREST_STATIONS_M = 0.16  # two stations nearer than this overlap: a slice is 0.12 m wide


def _tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


Size = Annotated[float, Field(ge=0.001, le=10)]  # the bounds keep a slip of the pen from taking all memory or all day
Time = Annotated[float, Field(ge=0, le=86_400)]
Number = Annotated[float, Field(ge=-10, le=10)]
Off = Annotated[float, Field(ge=0, le=10)]
Count = Annotated[int, Field(ge=1, le=100)]
XY = Annotated[tuple[Number, Number], BeforeValidator(_tuple)]
XYZ = Annotated[tuple[Number, Number, Number], BeforeValidator(_tuple)]
Above = Annotated[tuple[Number, Number, Size], BeforeValidator(_tuple)]
Sizes = Annotated[tuple[Size, Size, Size], BeforeValidator(_tuple)]
Area = Annotated[tuple[Off, Off], BeforeValidator(_tuple)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _-]{0,39}$")]


class Record(BaseModel):
    """A frozen record that knows its fields and takes no others."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class _FromTable:
    """Lets a dataclass in a strict record be written as a table; its own fields stay strict."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        schema = handler(source)
        cast(dict[str, Any], handler.resolve_ref_schema(schema))["strict"] = False
        return schema


FROM_TABLE = _FromTable()


class RobotSettings(Record):
    """Where the arm starts, and how fast and firm it works [m/s], [m/s2], [N]."""

    start: Name
    speed_m_s: Annotated[float, Field(ge=0.01, le=1.5)] = 0.5
    acceleration_m_s2: Annotated[float, Field(ge=0.01, le=10)] = 2.0
    grip_force_n: Annotated[float, Field(gt=0, le=100)] = 25.0  # from about 150 N on it squeezes slices out


class Slices(Record):
    """The bread: mass [kg], friction; `area` is how far a slice may stand off its spot: x, y [m], yaw [rad]."""

    mass_kg: Annotated[float, Field(ge=0.001, le=6)] = 0.04
    friction: Annotated[float, Field(ge=0, le=5)] = 0.8
    area: Annotated[tuple[Off, Off, Off], BeforeValidator(_tuple)] = (0.0, 0.0, 0.0)


class Workspace(Record):
    """The grid of the transfer sub-task: lower corner [m], cell [m], cells along x, y, z."""

    lower_m: XYZ
    cell_m: Sizes
    shape: Annotated[tuple[Count, Count, Count], BeforeValidator(_tuple)]


class CameraSettings(Record):
    """The overhead camera: position above the table [m], field of view [rad], picture width and height [pixels]."""

    position_m: Above
    field_of_view_rad: Annotated[float, Field(gt=0.01, lt=2.5)]
    pixels: Annotated[int, Field(ge=64, le=4096)] = 640


class InsertGrid(Record):
    """The camera's grid around the toaster (ch. 8): origin, cell, start [m], and the finger tips' height on the way [m]."""

    origin_m: XY
    cell_m: Size
    shape: Annotated[tuple[Count, Count], BeforeValidator(_tuple)] = (12, 12)
    start_m: XY
    height_m: Size


class Station(Record):
    """A place where toasts stand: pose x, y [m], yaw [rad]; a machine has a processing time [s] or a process to learn."""

    name: Name
    kind: Literal["storage", "buffer", "machine"]
    pose: XYZ
    capacity: Count
    processing_s: Time | None = None
    process: Literal["butter"] | None = None
    head_speed_m_s: Annotated[float, Field(ge=0.001, le=2)] = 0.02
    dwell_s: Time = 3.0

    @model_validator(mode="after")
    def _one_time(self) -> Self:
        for field in ("processing_s", "process"):
            if self.kind != "machine" and getattr(self, field) is not None:
                raise ValueError(f"station '{self.name}' is a {self.kind}: only a machine has {field}")
        if self.kind == "machine" and (self.processing_s is None) == (self.process is None):
            raise ValueError(
                f"machine '{self.name}' needs either processing_s or process = 'butter', not both or neither"
            )
        return self


class Stage(Record):
    """One stage of the route: a station, and the buffer that a toast waits in when the station is busy."""

    station: Name
    buffer: Name | None = None


class Obstacle(Record):
    """A stack of wooden cubes at `position_m` [m], within +- `area` [m] of it."""

    name: Name
    position_m: XY
    cubes: Annotated[int, Field(ge=1, le=15)] = 3
    edge_m: Annotated[float, Field(gt=0.005, le=0.3)] = 0.06
    area: Area = (0.0, 0.0)


class Subtask(Record):
    """How a sub-task is learned: rewards, learner and gate."""

    rewards: Annotated[Rewards, FROM_TABLE] = Rewards()
    learner: Annotated[LearnerSettings, FROM_TABLE] = LearnerSettings()
    gate: Annotated[GateSettings, FROM_TABLE] = GateSettings()

    @field_validator("rewards")
    @classmethod
    def _sums_are_finite(cls, rewards: Rewards) -> Rewards:
        for field, value in asdict(rewards).items():
            if abs(value) > MAX_REWARD:
                raise ValueError(f"{field} = {value}: allowed are -{MAX_REWARD} to {MAX_REWARD}")
        return rewards


class Sequencing(Record):
    """How the order of the robot's transfers is found."""

    method: str = "srl"
    episodes: Annotated[int, Field(ge=1, le=1_000_000)] = 400
    alpha: Annotated[float, Field(gt=0, le=1)] = 0.05
    discount: Annotated[float, Field(gt=0, le=1)] = 0.9
    beta: Annotated[float, Field(ge=0, le=100)] = 1.0
    reward_factor: Literal["A", "B"] = "B"


class Task(Record):
    """A whole task file, checked."""

    name: Name
    title: str = ""
    robot: RobotSettings
    slices: Slices = Slices()
    workspace: Workspace
    camera: CameraSettings
    insert: InsertGrid
    stations: Annotated[tuple[Station, ...], BeforeValidator(_tuple), Field(min_length=2)]
    route: Annotated[tuple[Stage, ...], BeforeValidator(_tuple), Field(min_length=2)]
    obstacles: Annotated[tuple[Obstacle, ...], BeforeValidator(_tuple)] = ()
    subtasks: dict[str, Subtask] = {}
    sequencing: Sequencing = Sequencing()

    def station(self, name: str) -> Station:
        """The station called `name`; BadInput lists the known ones."""
        for station in self.stations:
            if station.name == name:
                return station
        raise unknown("station", name, [s.name for s in self.stations], f"task '{self.name}'")

    def subtask(self, name: str) -> Subtask:
        """The learning settings of a sub-task (the defaults when the file has none)."""
        return self.subtasks.get(name, Subtask())

    @model_validator(mode="after")
    def _names_known(self) -> Self:
        stations = [s.name for s in self.stations]
        for label, names in (("station", stations), ("obstacle", [o.name for o in self.obstacles])):
            twice = {n for n in names if names.count(n) > 1}
            if twice:
                raise ValueError(f"{label} '{min(twice)}' stands twice in the file")
            for name in names:
                if _reserved(name) or (label == "obstacle" and name in stations):
                    raise ValueError(f"{label} '{name}' has the name of something else in the cell: choose another")
        for stage in self.route:
            for name in filter(None, (stage.station, stage.buffer)):
                if name not in stations:
                    raise unknown("station", name, stations, "route")
        if self.robot.start not in stations:
            raise unknown("station", self.robot.start, stations, "robot.start")
        for name in self.subtasks:
            if name not in SUBTASKS:
                raise unknown("sub-task", name, SUBTASKS, "subtasks")
        return self

    @model_validator(mode="after")
    def _stations_apart(self) -> Self:
        for one, other in combinations(self.stations, 2):
            apart = hypot(one.pose[0] - other.pose[0], one.pose[1] - other.pose[1])
            if apart < NEAREST_STATIONS_M:
                both = f"stations '{one.name}' and '{other.name}'"
                raise ValueError(f"{both} overlap: {apart:.3f} m apart, at least {NEAREST_STATIONS_M} m needed")
        return self

    @model_validator(mode="after")
    def _members_known(self) -> Self:
        from lab.advice.gates import GATES
        from lab.learning.updates import UPDATES
        from lab.sequencing import SEQUENCERS

        for name, subtask in self.subtasks.items():
            if subtask.learner.learner not in UPDATES:
                raise unknown("learner", subtask.learner.learner, UPDATES, f"subtasks.{name}.learner")
            if subtask.gate.gate not in GATES:
                raise unknown("gate", subtask.gate.gate, GATES, f"subtasks.{name}.gate")
        if self.sequencing.method not in SEQUENCERS:
            raise unknown("method", self.sequencing.method, SEQUENCERS, "sequencing.method")
        return self


def _reserved(name: str) -> bool:
    return name in RESERVED or name.startswith(RESERVED_STARTS) or name.endswith(RESERVED_ENDS)


def task_names() -> list[str]:
    """The tasks that ship, by name."""
    return sorted(path.stem for path in tasks_folder().glob("*.toml"))


def find(task: str) -> Path:
    """The file of a task given by name or path; BadInput when there is neither."""
    path = Path(task)
    if path.suffix == ".toml" or "/" in task:
        if path.is_file():
            return path
        raise BadInput(
            f"no task file '{task}': give a .toml file that exists or a task that ships: {', '.join(task_names())}"
        )
    if task not in task_names():
        raise unknown("task", task, task_names(), "TASK")
    return tasks_folder() / f"{task}.toml"


def load(task: str) -> Task:
    """Read and check a task given by name or path; BadInput names the file, the line or field, the value and what is allowed."""
    path = find(task)
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: cannot be read: {error}") from None
    except (ValueError, RecursionError) as error:  # beside TOMLDecodeError: numbers or nests beyond Python's limits
        raise BadInput(f"{path}: not valid TOML: {error}") from None
    try:
        return Task.model_validate(raw)
    except ValidationError as error:
        raise BadInput(f"{path}: {explain(error)}") from None
    except BadInput as error:
        raise BadInput(f"{path}: {error}") from None


def explain(error: ValidationError) -> str:
    """The first finding of a validation as one line: the field, the bad value, what is allowed; and how many more there are."""
    findings = error.errors()
    first = findings[0]
    where = ".".join(str(part) for part in first["loc"])
    message = first["msg"].removeprefix("Value error, ")
    shown = "" if isinstance(first["input"], dict) or not where else f" (got {first['input']!r})"
    more = f" (and {len(findings) - 1} more)" if len(findings) > 1 else ""
    return f"{where + ': ' if where else ''}{message}{shown}{more}"


def check_toasts(toasts: int, task: Task) -> None:
    """BadInput unless 1 <= toasts <= 50 and both ends of the route hold that many."""
    if not 1 <= toasts <= MAX_TOASTS:
        raise BadInput(f"{toasts} toasts (--toasts): allowed are 1 to {MAX_TOASTS}")
    for stage in (task.route[0], task.route[-1]):
        capacity = task.station(stage.station).capacity
        if toasts > capacity:
            raise BadInput(
                f"{toasts} toasts (--toasts) do not fit on '{stage.station}': its capacity in the task file is {capacity}"
            )
