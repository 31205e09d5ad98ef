"""A task's crew: every skill that it needs, what the sequencer is told of it, and the durations measured of its moves."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from lab.policy import Policy
from lab.sequencing.cell.cell import Cell, needed_moves
from lab.sequencing.cell.routes import NeededMoves
from lab.sequencing.cell.stations import Product, Route, Stage, Station
from lab.skills import Butter, Grasp, Insert, Place, Skill, Transfer
from lab.skills.surveys import INSERT_START
from lab.taskfile import Task


@dataclass(frozen=True)
class Durations:
    """Measured times [s]: the robot's moves by (origin, target), empty and loaded; what each machine takes."""

    empty_s: Mapping[tuple[str, str], float]
    loaded_s: Mapping[tuple[str, str], float]
    process_s: Mapping[str, float]
    sim_s: float = 0.0

    def to_json(self) -> dict[str, object]:
        """Plain dicts: 'origin > target' -> seconds."""
        tables = {"empty_s": self.empty_s, "loaded_s": self.loaded_s}
        flat: dict[str, object] = {name: {" > ".join(k): v for k, v in t.items()} for name, t in tables.items()}
        return flat | {"process_s": dict(self.process_s)}

    @classmethod
    def from_json(cls, record: Mapping[str, Mapping[str, float]]) -> "Durations":
        """What `to_json` wrote."""

        def pairs(name: str) -> dict[tuple[str, str], float]:
            return {
                (a, b): float(v)
                for a, _, b in (k.partition(" > ") for k in record[name])
                for v in [record[name][f"{a} > {b}"]]
            }

        return cls(pairs("empty_s"), pairs("loaded_s"), {k: float(v) for k, v in record["process_s"].items()})


@dataclass
class Crew:
    """All skills that a task needs, by name, and the policies they carry out."""

    task: Task
    moves: NeededMoves
    skills: dict[str, Skill]
    policies: dict[str, Policy] = field(default_factory=dict)

    @classmethod
    def of(cls, task: Task, toasts: int) -> "Crew":
        """One skill instance for each place and way that a run with so many toasts may need.

        What is set down at the last station may have to be taken up again there, when setting it down failed.
        """
        moves = needed_moves(stations(task, {}), (Product("toast", (route(task),)),), task.robot.start, toasts)
        skills: list[Skill] = []
        for origin, target in moves.loaded:
            skills += [Grasp(origin), Transfer(origin, _entry(task, target), loaded=True), _arrival(task, target)]
        skills += [Transfer(origin, target, loaded=False) for origin, target in moves.empty]
        skills += [Grasp(task.route[-1].station)]
        skills += [Butter(station.name) for station in task.stations if station.process == "butter"]
        return cls(task, moves, {skill.name: skill for skill in skills})

    def leg(self, origin: str, target: str) -> list[Skill]:
        """The skills that carry a slice from one station to another, in order."""
        ways = [Grasp(origin), Transfer(origin, _entry(self.task, target), loaded=True), _arrival(self.task, target)]
        return [self.skills[skill.name] for skill in ways]

    def empty(self, origin: str, target: str) -> Skill:
        """The skill that takes the empty gripper from one station to another."""
        return self.skills[Transfer(origin, target, loaded=False).name]


def is_toaster(task: Task, station: str) -> bool:
    """Whether slices reach this station through the camera's grid: a machine without a process to learn."""
    place = task.station(station)
    return place.kind == "machine" and place.process is None


def _entry(task: Task, target: str) -> str:
    return INSERT_START if is_toaster(task, target) else target


def _arrival(task: Task, target: str) -> Skill:
    return Insert(target) if is_toaster(task, target) else Place(target)


def stations(task: Task, process_s: Mapping[str, float]) -> tuple[Station, ...]:
    """The task's stations as the sequencer knows them, with the machines' times [s] (0 where not measured yet)."""
    times = {
        s.name: s.processing_s if s.processing_s is not None else process_s.get(s.name, 0.0) for s in task.stations
    }
    return tuple(Station(s.name, s.kind, s.capacity, times[s.name] or 0.0) for s in task.stations)


def route(task: Task) -> Route:
    """The task's route as the sequencer knows it."""
    return tuple(Stage(stage.station, stage.buffer) for stage in task.route)


def cell_of(task: Task, durations: Durations, toasts: int) -> Cell:
    """The sequencing problem that the measured durations make."""
    places = stations(task, durations.process_s)
    names = [place.name for place in places]
    tables = []
    for times in (durations.empty_s, durations.loaded_s):
        table = np.full((len(names), len(names)), np.nan)
        for (origin, target), seconds in times.items():
            table[names.index(origin), names.index(target)] = seconds
        tables.append(table)
    return Cell.alike(places, route(task), tables[0], tables[1], task.robot.start, toasts)
