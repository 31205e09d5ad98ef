"""The task: a cell in physics, the kinds of parts made in it, and the settings with which its sub-tasks are learned."""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, PrivateAttr, model_validator

from lab.errors import BadInput, counted, unknown
from lab.files import assets_folder
from lab.tasks.fault_fields import FaultFields
from lab.tasks.record import Name, Record, as_tuple
from lab.tasks.robot_fields import RobotSettings
from lab.tasks.sequencing import Sequencing
from lab.tasks.task_faults import refusal
from lab.tasks.task_fields import (
    MAX_PARTS,
    MOST_THINGS,
    After,
    CameraSettings,
    Obstacle,
    Part,
    Process,
    Stage,
    Station,
    Subtask,
    Workspace,
)
from lab.tasks.toml_text import TomlText

RESERVED = ("robot", "table", "insert", "the part", "carried part")  # names that other things in the cell have
RESERVED_ENDS = (" marker", " column", " head")
TAUGHT_WITH = 2  # parts of the first kind in the scene of a lesson, if there is room
_COUNT = re.compile(r"\s*([^=,]+?)\s*=\s*(\d{1,6})\s*")

Order = tuple[str, ...]  # the kind of each part, part 1 first


class Task(Record):
    """A whole task file, checked: a cell in physics, the parts that are made in it, and the settings of learning."""

    name: Name
    """The task's name, such as `"bakery"`: 1 to 40 letters, digits, spaces, - and _."""
    title: str = ""
    """A title in one line, such as `"Two buns through one oven"`."""
    perception: Literal["truth", "camera"] = "truth"
    """The source of the parts' poses for the robot: the simulator ("truth"), or the camera in the hand ("camera")."""
    robot: RobotSettings
    """The arm."""
    parts: Annotated[tuple[Part, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=MAX_PARTS)]
    """The kinds of parts."""
    workspace: Workspace
    """The grid of cells in which the tool moves between stations."""
    camera: CameraSettings | None = None
    """The overhead camera; needed by a station with approach = "camera"."""
    stations: Annotated[tuple[Station, ...], BeforeValidator(as_tuple), Field(min_length=2, max_length=MOST_THINGS)]
    """The stations at which parts stand and are worked on."""
    processes: dict[Name, Process] = Field(default={})
    """The processes that cover a surface cell by cell, as with butter or glue, by the names that stations and stages use."""
    after: Annotated[tuple[After, ...], BeforeValidator(as_tuple), Field(max_length=MOST_THINGS)] = ()
    """The precedences between transfers, as tables `[[after]]`."""
    obstacles: Annotated[tuple[Obstacle, ...], BeforeValidator(as_tuple), Field(max_length=MOST_THINGS)] = ()
    """The obstacles, which the arm must avoid."""
    faults: Annotated[tuple[FaultFields, ...], BeforeValidator(as_tuple), Field(max_length=MOST_THINGS)] = ()
    """The faults that strike in every run."""
    subtasks: dict[str, Subtask] = Field(default={})
    """The settings of learning by kind of sub-task: grasp, transfer, place, insert or cover; left out: the
    defaults.
    """
    sequencing: Sequencing = Sequencing()
    """The settings of the search for the order of the robot's transfers."""
    _folder: Path | None = PrivateAttr(default=None)
    _toml: TomlText | None = PrivateAttr(default=None)

    @property
    def folder(self) -> Path:
        """The folder of the meshes and URDFs that the file names and that are not among the lab's assets."""
        return self._folder or assets_folder()

    @contextmanager
    def in_its_file(self) -> Iterator[None]:
        """Adds to a BadInput from within the file that the task was read from, and the line that it is about."""
        try:
            yield
        except BadInput as error:
            if self._toml is None or str(error).startswith(f"{self._toml.path}: "):
                raise
            raise refusal(self._toml, str(error)) from None

    def changed(self, **fields: object) -> Self:
        """A copy with other fields, checked again. Raises ValueError or BadInput."""
        other = type(self).model_validate({**dict(self), **fields})
        other._folder = self._folder
        return other

    def station(self, name: str) -> Station:
        """The station called `name`; raises BadInput, which lists the known ones."""
        for station in self.stations:
            if station.name == name:
                return station
        raise unknown("station", name, [s.name for s in self.stations], f"task '{self.name}'")

    def part(self, kind: str) -> Part:
        """The kind of part with this name; raises BadInput, which lists the known ones."""
        for part in self.parts:
            if part.name == kind:
                return part
        raise unknown("part", kind, [part.name for part in self.parts], f"task '{self.name}'")

    def subtask(self, name: str) -> Subtask:
        """The learning settings of a sub-task, or the defaults when the file has none."""
        return self.subtasks.get(name, Subtask())

    @property
    def made(self) -> tuple[Part, ...]:
        """The kinds with routes, without those that serve as pallets."""
        return tuple(part for part in self.parts if part.routes)

    def called(self, kind: str) -> str:
        """The suffix of a sub-task's name that tells its kind; empty when the task has only one kind."""
        return f" {kind}" if len(self.parts) > 1 else ""

    def made_as(self, kind: str) -> Part:
        """The kind with routes that a name stands for: the kind alone, on its pallet, or its pallet."""
        return next(part for part in self.made if kind in (part.name, part.pallet, f"{part.name} on {part.pallet}"))

    def starts(self, kind: str) -> str:
        """The station where parts of a kind stand at the start."""
        return self.part(kind).routes[0][0].station

    def kinds_at(self, station: str) -> tuple[Part, ...]:
        """The kinds of parts whose routes lead to a station."""
        return tuple(part for part in self.made if station in part.places)

    # ---- Orders --------------------------------------------------------------------------------------------------

    def order(self, first: int | None = None, counts: Mapping[str, int] | None = None) -> Order:
        """The kind of each part: the file's counts, or `first` parts of the first kind, or `counts` by kind.

        Raises BadInput for an unknown kind, for no part or more than 50, and when more parts begin or end at a station than it
        holds.
        """
        wanted = {part.name: part.count for part in self.made}
        if first is not None:
            check_number(first)
            wanted[self.made[0].name] = first
        if counts is not None:
            wanted = dict.fromkeys(wanted, 0)
            for kind, count in counts.items():
                if kind not in wanted:
                    raise unknown("part", kind, wanted, "--parts")
                wanted[kind] = count
        kinds = tuple(kind for kind, count in wanted.items() for _ in range(count))
        if first is None and counts is None:
            with self.in_its_file():
                self._check_room(kinds, "the sum of their counts", f"part '{self.made[0].name}': count: ")
        else:
            self._check_room(kinds, "--toasts, --parts", "")
        return kinds

    def ordered(self, toasts: int | None = None, parts: str | None = None) -> Order:
        """The order of --toasts (parts of the first kind) or of --parts (parts of each kind); raises BadInput for both."""
        if toasts is not None and parts is not None:
            raise BadInput(f"--toasts {toasts} and --parts {parts}: an order is one or the other")
        return self.order(toasts, None if parts is None else counts_from_word(parts))

    def fitting(self, first: int) -> Order:
        """An order with `first` parts of the first kind, or with as many as there is room for."""
        own, *others = self.made
        room = [
            self.station(end).room_for(own.name)
            - sum(p.count for p in others if end in p.ends and self.share_places(end, own.name, p.name))
            for end in own.ends
        ]
        return self.order(max(1, min(first, *room)))

    def share_places(self, station: str, one: str, other: str) -> bool:
        """Whether two kinds use the same places of a station."""
        place = self.station(station)
        return place.nests(one) == place.nests(other)

    def _check_room(self, order: Order, asked: str, where: str) -> None:
        if not 1 <= len(order) <= MAX_PARTS:
            raise BadInput(f"{where}{len(order)} parts ({asked}) for task '{self.name}': allowed are 1 to {MAX_PARTS}")
        ends = dict.fromkeys((end, self.station(end).nests(part.name)) for part in self.made for end in part.ends)
        for end, nest in ends:
            own = [part.name for part in self.made if end in part.ends]
            ending = [kind for kind in own if self.station(end).nests(kind) == nest]
            most, room = sum(kind in ending for kind in order), self.station(end).room_for(ending[0])
            if most > room:
                words = in_words(kind for kind in order if kind in ending)
                room_word = "capacity" if self.station(end).places is None else "places for them"
                raise BadInput(
                    f"{words} ({asked}) do not fit on '{end}': its {room_word} in the task file is {room}"
                    if not where
                    else f"station '{end}': {room_word} = {room}: {words} ({asked}) begin or end there, wanted at least {most}"
                )

    # ---- Checks between the fields of a file ---------------------------------------------------------------------

    @model_validator(mode="after")
    def _names_apart(self) -> Self:
        stations, kinds = [s.name for s in self.stations], [p.name for p in self.parts]
        patches = [f"{process} on" for process in self.processes]  # what is left on a part: "butter on slice 1 00"
        for label, names in (("part", kinds), ("station", stations), ("obstacle", [o.name for o in self.obstacles])):
            twice = {n for n in names if names.count(n) > 1}
            if twice:
                raise ValueError(f"{label} '{min(twice)}' stands twice in the file")
            words = ["robot", "done", *patches, *(kinds if label != "part" else ())]
            starts = tuple(f"{word} " for word in words)
            for name in names:
                reserved = name in RESERVED or name.startswith(starts) or name.endswith(RESERVED_ENDS)
                if reserved or (label != "station" and name in stations) or (label == "obstacle" and name in kinds):
                    raise ValueError(f"{label} '{name}' has the name of something else in the cell: choose another")
        if self.robot.start not in stations:
            raise unknown("station", self.robot.start, stations, "robot.start")
        return self

    @model_validator(mode="after")
    def _tool_is_level(self) -> Self:
        """Fills in how the tool is held where the file does not say it: level if a station is approached from the side."""
        sides = any(station.approach == "side" for station in self.stations)
        if self.robot.tool is None and sides:
            object.__setattr__(self, "robot", self.robot.model_copy(update={"tool": "level"}))
        return self

    @model_validator(mode="after")
    def _routes_known(self) -> Self:
        stations = [s.name for s in self.stations]
        carriers = {part.pallet for part in self.parts}
        for part in self.parts:
            if not part.routes and part.name not in carriers:
                raise ValueError(f"part '{part.name}' has no routes, and no other part comes on it: it needs routes")
            known = [other.name for other in self.parts if not other.routes]
            if part.pallet is not None and part.pallet not in known:
                raise unknown("pallet", part.pallet, known, f"part '{part.name}'")
            for stage in stages_of(part):
                for name in filter(None, (stage.station, stage.buffer)):
                    if name not in stations:
                        raise unknown("station", name, stations, f"route of part '{part.name}'")
                if stage.pallet and part.pallet is None:
                    raise ValueError(f"part '{part.name}' has no pallet to be lifted off at '{stage.station}'")
        return self

    @model_validator(mode="after")
    def _places_known(self) -> Self:
        for station in self.stations:
            coming = [part.name for part in self.kinds_at(station.name)]
            routes = [route for part in self.made for route in part.routes]
            inside = any(station.name in (*(s.station for s in r[1:-1]), *(s.buffer for s in r)) for r in routes)
            begin, end = (any(route[at].station == station.name for route in routes) for at in (0, -1))
            if station.is_layered and (inside or (begin and end)):
                what = "routes lead on through it" if inside else "routes begin and end there"
                raise ValueError(
                    f"station '{station.name}': places: height_m: {what}, and which part lies on which is not planned: layers "
                    "are for stations where routes only begin or only end"
                )
            if station.is_layered and self.perception == "camera":
                raise BadInput(
                    f"station '{station.name}': places: height_m: with perception = 'camera' the outline of a part is not told "
                    "from that of the part below it: wanted perception = 'truth', or one layer"
                )
            for place in station.places or ():
                if place.kind is None:
                    continue
                if place.kind not in coming:
                    raise unknown("kind", place.kind, coming, f"station '{station.name}': places: kind")
                if inside:
                    raise ValueError(
                        f"station '{station.name}': places: kind = '{place.kind}': routes lead on through it, and which kinds "
                        "wait there is not planned: nests are for stations where routes begin or end"
                    )
        return self

    @model_validator(mode="after")
    def _after_known(self) -> Self:
        made = [part.name for part in self.made]
        for number, precedence in enumerate(self.after, start=1):
            if precedence.part == precedence.of:
                raise ValueError(
                    f"after {number}: of = '{precedence.of}': a kind cannot wait for itself, wanted another one"
                )
            for kind, step, station in (
                (precedence.part, precedence.step, precedence.station),
                (precedence.of, precedence.of_step, precedence.of_station or precedence.station),
            ):
                if kind not in made:
                    raise unknown("part", kind, made, f"after {number}")
                own = [[stage.station for stage in route] for route in self.part(kind).routes]
                routes_of = [names[1:] if step == "comes" else names[:-1] for names in own]
                always = [place for place in routes_of[0] if all(place in other for other in routes_of)]
                if station not in always:
                    where = (
                        f"after {number}: what every route of '{kind}' {'comes to' if step == 'comes' else 'leaves'}"
                    )
                    raise unknown("station", station, always, where)
        return self

    @model_validator(mode="after")
    def _processes_known(self) -> Self:
        heads = [name for name, process in self.processes.items() if process.by == "head"]
        for station in self.stations:
            if station.process in self.processes and station.process not in heads:
                raise BadInput(
                    f"station '{station.name}': process = '{station.process}': the robot carries it out (by = 'robot'), "
                    "as the service of a stage of a route; wanted one by = 'head', the machine's own"
                )
            if station.process is not None and station.process not in heads:
                raise unknown("process", station.process, heads, f"station '{station.name}'")
            if station.process is not None and station.capacity > 1:
                raise BadInput(
                    f"station '{station.name}': capacity = {station.capacity}: its head carries '{station.process}' out on one "
                    "part at a time: wanted 1, and a buffer before it"
                )
            if station.approach == "camera" and self.camera is None:
                raise BadInput(
                    f"station '{station.name}': approach = 'camera': the table [camera] is missing, which says where it is"
                )
        for part in self.made:
            for stage in stages_of(part):
                self._check_work(part, stage)
        return self

    def _check_work(self, part: Part, stage: Stage) -> None:
        robots = [name for name, process in self.processes.items() if process.by == "robot"]
        place, where = self.station(stage.station), f"part '{part.name}' at '{stage.station}'"
        if stage.service in self.processes and stage.service not in robots:
            raise BadInput(
                f"{where}: service = '{stage.service}': a machine's head carries it out; wanted a process by = 'robot'"
            )
        if stage.service is not None and stage.service not in robots:
            raise unknown("service", stage.service, robots, f"processes for {where}")
        if place.kind != "machine":
            for field in ("processing_s", "at_most_s"):
                if getattr(stage, field) is not None:
                    raise ValueError(f"{where}: only a machine has {field}, it is a {place.kind}")
        elif place.process is not None and stage.processing_s is not None:
            raise ValueError(
                f"{where}: processing_s = {stage.processing_s:g}, but its process '{place.process}' is learned"
            )
        elif place.process is None and place.processing_s is None and stage.processing_s is None:
            raise ValueError(f"machine '{place.name}' needs either processing_s or process, a sub-task to learn")

    @model_validator(mode="after")
    def _faults_known(self) -> Self:
        machines = [place.name for place in self.stations if place.kind == "machine"]
        for number, fault in enumerate(self.faults, start=1):
            where = f"fault {number}"
            stations = machines if fault.what.startswith("machine") else [place.name for place in self.stations]
            if fault.station is not None and fault.station not in stations:
                raise unknown("station", fault.station, stations, where)
            if fault.obstacle is not None and fault.obstacle not in [obstacle.name for obstacle in self.obstacles]:
                raise unknown("obstacle", fault.obstacle, [obstacle.name for obstacle in self.obstacles], where)
            if fault.part is not None and fault.part.rpartition(" ")[0] not in [part.name for part in self.made]:
                raise unknown("part", fault.part, [f"{part.name} 1" for part in self.made], where)
            if fault.what == "camera blind" and self.camera is None:
                raise ValueError(f"{where}: what = 'camera blind': the task has no [camera]")
        return self

    @model_validator(mode="after")
    def _members_known(self) -> Self:
        for name, subtask in self.subtasks.items():
            subtask.check_members(f"subtasks.{name}.")
        for _, error in self.sequencing.faults(due=False):
            raise error
        return self


def stages_of(part: Part) -> Iterator[Stage]:
    """Every stage of every route of a kind."""
    return (stage for route in part.routes for stage in route)


def in_words(order: Iterable[str]) -> str:
    """An order in words, such as "2 slices and 1 cup"."""
    kinds = list(order)
    return " and ".join(counted(kinds.count(kind), kind) for kind in dict.fromkeys(kinds))


def part_name(order: Order, number: int) -> str:
    """The name of part `number`, from 1, in physics and in schedules (see `Cell.part_name`)."""
    return f"{order[number - 1]} {number}"


def counts_from_word(word: str) -> dict[str, int]:
    """The counts by kind in a word such as "slice=2,cup=1"; raises BadInput for anything else."""
    counts: dict[str, int] = {}
    for piece in word.split(","):
        match = _COUNT.fullmatch(piece)
        if match is None or match[1] in counts:
            raise BadInput(f"'{word[:80]}' (--parts): wanted kind=number once each, such as slice=2,cup=1")
        counts[match[1]] = int(match[2])
    return counts


def check_number(parts: int) -> None:
    """Raises BadInput unless 1 <= parts <= 50."""
    if not 1 <= parts <= MAX_PARTS:
        raise BadInput(f"{parts} toasts (--toasts): allowed are 1 to {MAX_PARTS}")
