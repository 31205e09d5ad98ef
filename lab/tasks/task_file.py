"""Task files: tasks/*.toml -> validated frozen models. The only place where raw text is checked."""

import re
from itertools import combinations
from math import hypot
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar, cast, get_args

from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError, model_validator

from lab.errors import BadInput, unknown
from lab.files import tasks_folder
from lab.tasks.cell_file import CellFile
from lab.tasks.grid_world import RANDOM, GridWorld, from_text, from_words
from lab.tasks.record import MAX_SHORT_BYTES, Count, Learned, Name, Record, as_tuple, read_text
from lab.tasks.robot_fields import RobotSettings
from lab.tasks.sequencing import Sequencing
from lab.tasks.toml_text import TomlText, explain

MAX_TOASTS = 50
RESERVED = ("robot", "table", "insert", "the slice", "carried slice")  # names of other things in the cell
RESERVED_STARTS = ("slice ", "toast ", "toasted ", "robot ")
RESERVED_ENDS = (" marker", " column", " head")
MOST_THINGS = 200  # stations, stages or obstacles: on one table is no room for more
_SAYS_WORLD = re.compile(r"""^[ \t]*kind[ \t]*=[ \t]*["']world["']""", re.MULTILINE)
NEAREST_STATIONS_M = 0.16  # two stations nearer than this overlap: a slice is 0.12 m wide

FileKind = Literal["task", "cell", "world"]  # of what a file holds
Checked = TypeVar("Checked", bound=Record)
Size = Annotated[float, Field(ge=0.001, le=10)]  # the bounds keep a slip of the pen from taking all memory or all day
Time = Annotated[float, Field(ge=0, le=86_400)]
Number = Annotated[float, Field(ge=-10, le=10)]
Off = Annotated[float, Field(ge=0, le=10)]
XY = Annotated[tuple[Number, Number], BeforeValidator(as_tuple)]
XYZ = Annotated[tuple[Number, Number, Number], BeforeValidator(as_tuple)]
Above = Annotated[tuple[Number, Number, Size], BeforeValidator(as_tuple)]
Sizes = Annotated[tuple[Size, Size, Size], BeforeValidator(as_tuple)]
Area = Annotated[tuple[Off, Off], BeforeValidator(as_tuple)]


class Slices(Record):
    """The bread: mass [kg], friction; `area` is how far a slice may stand off its spot: x, y [m], yaw [rad]."""

    mass_kg: Annotated[float, Field(ge=0.001, le=6)] = 0.04
    friction: Annotated[float, Field(ge=0, le=5)] = 0.8
    area: Annotated[tuple[Off, Off, Off], BeforeValidator(as_tuple)] = (0.0, 0.0, 0.0)


class Workspace(Record):
    """The grid of the transfer sub-task: lower corner [m], cell [m], cells along x, y, z."""

    lower_m: XYZ
    cell_m: Sizes
    shape: Annotated[tuple[Count, Count, Count], BeforeValidator(as_tuple)]


class CameraSettings(Record):
    """The overhead camera: position above the table [m], field of view [rad], picture width and height [pixels]."""

    position_m: Above
    field_of_view_rad: Annotated[float, Field(gt=0.01, lt=2.5)]
    pixels: Annotated[int, Field(ge=64, le=4096)] = 640


class InsertGrid(Record):
    """The camera's grid around the toaster (ch. 8): origin, cell, start [m], and the finger tips' height on the way [m]."""

    origin_m: XY
    cell_m: Size
    shape: Annotated[tuple[Count, Count], BeforeValidator(as_tuple)] = (12, 12)
    start_m: XY
    height_m: Size


class Station(Record):
    """A place where toasts stand: pose x, y [m], yaw [rad]; a machine has a processing time [s] or a process to learn."""

    name: Name
    kind: Literal["storage", "buffer", "machine"]
    pose: XYZ
    capacity: Count
    processing_s: Time | None = None
    process: Name | None = None
    head_speed_m_s: Annotated[float, Field(ge=0.001, le=2)] = 0.02
    dwell_s: Time = 3.0

    @model_validator(mode="after")
    def _one_time(self) -> Self:
        for field in ("processing_s", "process"):
            if self.kind != "machine" and getattr(self, field) is not None:
                raise ValueError(f"station '{self.name}' is a {self.kind}: only a machine has {field}")
        if self.kind == "machine" and (self.processing_s is None) == (self.process is None):
            raise ValueError(
                f"machine '{self.name}' needs either processing_s or process, a sub-task to learn, not both or neither"
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


class Subtask(Learned):
    """How a sub-task is learned: rewards, learner and gate."""


class Task(Record):
    """A whole task file, checked."""

    name: Name
    title: str = ""
    robot: RobotSettings
    slices: Slices = Slices()
    workspace: Workspace
    camera: CameraSettings
    insert: InsertGrid
    stations: Annotated[tuple[Station, ...], BeforeValidator(as_tuple), Field(min_length=2, max_length=MOST_THINGS)]
    route: Annotated[tuple[Stage, ...], BeforeValidator(as_tuple), Field(min_length=2, max_length=MOST_THINGS)]
    obstacles: Annotated[tuple[Obstacle, ...], BeforeValidator(as_tuple), Field(max_length=MOST_THINGS)] = ()
    subtasks: dict[str, Subtask] = Field(default={})
    sequencing: Sequencing = Sequencing()
    _folder: Path = PrivateAttr(default=Path())

    @property
    def folder(self) -> Path:
        """The task file's own, in which what it names is looked for."""
        return self._folder

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
                reserved = name in RESERVED or name.startswith(RESERVED_STARTS) or name.endswith(RESERVED_ENDS)
                if reserved or (label == "obstacle" and name in stations):
                    raise ValueError(f"{label} '{name}' has the name of something else in the cell: choose another")
        for stage in self.route:
            for name in filter(None, (stage.station, stage.buffer)):
                if name not in stations:
                    raise unknown("station", name, stations, "route")
        if self.robot.start not in stations:
            raise unknown("station", self.robot.start, stations, "robot.start")
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
        for name, subtask in self.subtasks.items():
            subtask.check_members(f"subtasks.{name}.")
        for _, error in self.sequencing.faults(due=False):
            raise error
        return self


def shipped() -> dict[str, str]:
    """What ships, by name, and whether it is a "task", a "cell" or a "world"."""
    return {name: _kind(_toml(path)) for name, path in _files().items()}


def _files() -> dict[str, Path]:
    return {path.stem: path for path in sorted(tasks_folder().glob("*.toml"))}


def names_of(wanted: FileKind) -> list[str]:
    """What ships of a kind, by name."""
    return [name for name, kind in shipped().items() if kind == wanted]


def names_file(word: str) -> bool:
    """Whether a word means a world, a cell or a task, by path, by name or by chance, and no sub-task."""
    return word.startswith(RANDOM) or is_path(word) or word in _files()


def is_path(task: str) -> bool:
    """Whether a word for a task, a cell or a world is the path of a file, which may not be there."""
    return Path(task).suffix in (".toml", ".txt") or "/" in task


def find(task: str) -> Path:
    """The file of a task, cell or world given by name or path; BadInput when there is none."""
    if is_path(task):
        if Path(task).is_file():
            return Path(task)
        known = ", ".join(_files())
        raise BadInput(f"no task file '{task}': give a file that exists, .toml or a .txt grid, or what ships: {known}")
    files = _files()
    if task not in files:
        raise unknown("task", task, files, "TASK")
    return files[task]


def load(task: str) -> Task:
    """Read and check a task given by name or path; BadInput names the file, the line or field, the value and what is allowed."""
    return cast(Task, load_any(task, "task"))


def load_cell(cell: str) -> CellFile:
    """As `load`: a cell for the sequencer alone, by name or by file; BadInput names file and line."""
    return cast(CellFile, load_any(cell, "cell"))


def load_world(world: str) -> GridWorld:
    """As `load`: a world by name, by file (.toml, or .txt with a text grid) or by chance ("random:10x10x10:0.06:7")."""
    return cast(GridWorld, load_any(world, "world"))


def load_any(word: str, wanted: FileKind | None = None) -> Task | CellFile | GridWorld:
    """A task, a cell or a world, as `load`, `load_cell` and `load_world` read it; BadInput also when another is wanted."""
    drawn = word.startswith(RANDOM)
    path = Path(word) if drawn else find(word)
    if drawn or path.suffix == ".txt":
        _check_wanted(word, "world", wanted)
        return from_words(word) if drawn else from_text(path)
    toml = _toml(path)
    kind = _kind(toml)
    _check_wanted(word, kind, wanted)
    if kind == "cell":
        return CellFile.checked(toml)
    if kind == "world":
        return _checked(GridWorld, toml)
    task = _checked(Task, toml)
    task._folder = path.resolve().parent
    return task


def describe(word: str) -> tuple[str, dict[str, Any]]:
    """The text of a task, a cell or a world, and the document of `lab task show --json`; a drawn world has no "file"."""
    found = load_any(word)
    if isinstance(found, GridWorld) and word.startswith(RANDOM):
        return found.to_toml(), {"file": None, **found.model_dump(mode="json")}
    path = find(word)
    return read_text(path), {"file": str(path), **found.model_dump(mode="json")}


def _check_wanted(word: str, kind: FileKind, wanted: FileKind | None) -> None:
    if wanted is None or kind == wanted:
        return
    instead = {
        "task": f"lab run {word}, or lab teach SUBTASK --task {word}",
        "cell": f"sequence it with lab sequence {word}",
        "world": f"learn it with lab teach {word}",
    }
    raise BadInput(f"{word}: it is a {kind}, not a {wanted}: {instead[kind]}")


def _kind(toml: TomlText) -> FileKind:
    kind = toml.raw.get("kind", "task")
    if kind in get_args(FileKind):
        return cast(FileKind, kind)
    raise toml.refusal(("kind",), str(unknown("kind", kind, ("cell", "world"), "of task file")))


def _toml(path: Path) -> TomlText:
    text = read_text(path)
    if len(text) > MAX_SHORT_BYTES and not _SAYS_WORLD.search(text):  # before seconds are spent on its values
        raise BadInput(f"{path}: {len(text)} characters: a file that holds no world has up to {MAX_SHORT_BYTES}")
    return TomlText.parsed(path, text)


def _checked(model: type[Checked], toml: TomlText) -> Checked:
    try:
        return model.model_validate(toml.raw)
    except ValidationError as error:
        raise BadInput(f"{toml.path}: {explain(error)}") from None
    except BadInput as error:
        raise BadInput(f"{toml.path}: {error}") from None


def check_number(toasts: int) -> None:
    """BadInput unless 1 <= toasts <= 50."""
    if not 1 <= toasts <= MAX_TOASTS:
        raise BadInput(f"{toasts} toasts (--toasts): allowed are 1 to {MAX_TOASTS}")


def check_toasts(toasts: int, task: Task) -> None:
    """BadInput unless 1 <= toasts <= 50 and both ends of the route hold that many."""
    check_number(toasts)
    for stage in (task.route[0], task.route[-1]):
        capacity = task.station(stage.station).capacity
        if toasts > capacity:
            raise BadInput(
                f"{toasts} toasts (--toasts) do not fit on '{stage.station}': its capacity in the task file is {capacity}"
            )


def fitting(task: Task, wanted: int) -> int:
    """As many toasts as wanted, or as both ends of the route hold."""
    return min(wanted, *(task.station(stage.station).capacity for stage in (task.route[0], task.route[-1])))
