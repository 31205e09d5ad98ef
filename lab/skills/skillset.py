"""A task's skills: which it needs, where each of them is used, and the policies that they follow."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from lab.errors import BadInput, unknown
from lab.sequencing.cell.cell import needed_moves
from lab.sequencing.cell.routes import NeededMoves
from lab.sequencing.cell.stations import Product, Route, Stage, Station
from lab.skills import SKILLS, Skill
from lab.tasks.task_file import Task
from lab.toolbox.policy import Policy

Pair = tuple[str, str]  # origin and target, by name
Skills = tuple[Skill, ...]


@dataclass
class SkillSet:
    """All skills that a task needs, by name, in the order in which they are learned; one for each place and way.

    legs: what brings a slice from one station to another, in order. travels: what takes the empty gripper there. picks:
    what takes a slice up from a station. processes: what a machine does with its slice, once it is learned.
    """

    task: Task
    moves: NeededMoves
    skills: dict[str, Skill] = field(default_factory=dict)
    legs: dict[Pair, Skills] = field(default_factory=dict)
    travels: dict[Pair, Skills] = field(default_factory=dict)
    picks: dict[str, Skills] = field(default_factory=dict)
    processes: dict[str, Skills] = field(default_factory=dict)
    policies: dict[str, Policy] = field(default_factory=dict)

    @classmethod
    def of(cls, task: Task, toasts: int) -> "SkillSet":
        """What a run with so many toasts may need; BadInput when the task names an unknown sub-task.

        What is set down at the last station may have to be taken up again there, when setting it down failed.
        """
        check_names(task)
        made = cls(
            task, needed_moves(stations(task, {}), (Product("toast", (route(task),)),), task.robot.start, toasts)
        )
        kinds, last = SKILLS.values(), task.route[-1].station
        for origin, target in made.moves.loaded:
            made.picks[origin] = made._own(kind.at_pick(task, origin) for kind in kinds)
            rest = made._own(kind.on_carry(task, origin, target) for kind in kinds)
            made.legs[origin, target] = made.picks[origin] + rest
        for origin, target in made.moves.empty:
            made.travels[origin, target] = made._own(kind.on_travel(task, origin, target) for kind in kinds)
        made.picks[last] = made._own(kind.at_pick(task, last) for kind in kinds)
        for station in task.stations:
            made.processes[station.name] = made._own(kind.at_machine(task, station.name) for kind in kinds)
        return made

    def _own(self, found: Iterable[Skill | None]) -> Skills:
        """The skills found, each the one of its name."""
        return tuple(self.skills.setdefault(skill.name, skill) for skill in found if skill is not None)


def check_names(task: Task) -> None:
    """BadInput unless all sub-tasks and processes that a task names are skills, and nothing is called as what they make."""
    for name in task.subtasks:
        if name not in SKILLS:
            raise unknown("sub-task", name, SKILLS, f"task '{task.name}': subtasks")
    processes = [name for name, kind in SKILLS.items() if not kind.moves_arm]
    for station in task.stations:
        if station.process is not None and station.process not in processes:
            raise unknown("process", station.process, processes, f"task '{task.name}': station '{station.name}'")
    makers = tuple(f"{name} " for name, kind in SKILLS.items() if kind.on_slice(1))
    for name in (*(station.name for station in task.stations), *(obstacle.name for obstacle in task.obstacles)):
        if name.startswith(makers):
            raise BadInput(f"task '{task.name}': '{name}' is the name of what a skill makes: choose another")


def stations(task: Task, process_s: Mapping[str, float]) -> tuple[Station, ...]:
    """The task's stations as the sequencer knows them, with the machines' times [s] (0 where not measured yet)."""
    times = {
        s.name: s.processing_s if s.processing_s is not None else process_s.get(s.name, 0.0) for s in task.stations
    }
    return tuple(Station(s.name, s.kind, s.capacity, times[s.name] or 0.0) for s in task.stations)


def route(task: Task) -> Route:
    """The task's route as the sequencer knows it."""
    return tuple(Stage(stage.station, stage.buffer) for stage in task.route)
