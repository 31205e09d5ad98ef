"""A task's skills: which it needs, where each of them is used, and the policies that they follow."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from lab.errors import unknown
from lab.sequencing.cell.cell import needed_moves
from lab.sequencing.cell.routes import NeededMoves
from lab.sequencing.cell.stations import Product, Route, Stage, Station, one_robot
from lab.sim.parts.kinds import comes_as
from lab.skills import SKILLS, Skill
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import Part
from lab.tasks.task_fields import Stage as TaskStage
from lab.toolbox.policy import Policy

Pair = tuple[str, str]  # origin and target, by name
Skills = tuple[Skill, ...]
WINDOW_MARGIN_S = 1.0  # that is left free of a window when it is planned with
NO_SERVICE: Mapping[tuple[str, str], float] = {}


class Carried(NamedTuple):
    """A way on which the robot carries something: from one station to another, and as what (see `Scene.kinds`)."""

    origin: str
    target: str
    kind: str


@dataclass
class SkillSet:
    """All skills that a task needs, by name, in the order in which they are learned; one for each place and way.

    legs: what brings a part from one station to another, in order. travels: what takes the empty gripper there. picks:
    what takes a part up, by kind and station. processes: what a machine does with its part, once it is learned.
    services: what the robot does before it takes a part out, by the part's kind and the station. blocked: why skills cannot
    be carried out in a scene that has changed, by name.
    """

    task: Task
    moves: NeededMoves
    skills: dict[str, Skill] = field(default_factory=dict)
    legs: dict[Carried, Skills] = field(default_factory=dict)
    travels: dict[Pair, Skills] = field(default_factory=dict)
    picks: dict[Pair, Skills] = field(default_factory=dict)
    processes: dict[str, Skills] = field(default_factory=dict)
    services: dict[Pair, Skills] = field(default_factory=dict)
    policies: dict[str, Policy] = field(default_factory=dict)
    blocked: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, task: Task, order: Order) -> "SkillSet":
        """What a run with such an order may need; BadInput when the task names an unknown sub-task.

        What is set down at the last station may have to be taken up again there, when setting it down failed.
        """
        check_names(task)
        wanted = [part for part in task.made if part.name in order]
        moves = needed_moves(stations(task, {}), products(wanted), one_robot(task.robot.start), len(order))
        made = cls(task, moves)
        kinds = SKILLS.values()
        for part in wanted:
            for way in ways_of(part):
                if way not in made.legs:
                    made._add_leg(way)
        for origin, target in moves.empty:
            made.travels[origin, target] = made._own(kind.on_travel(task, origin, target) for kind in kinds)
        for part in wanted:
            for last in dict.fromkeys(route[-1].station for route in part.routes):
                made._pick(comes_as(part), last)
        for station in task.stations:
            made.processes[station.name] = made._own(kind.at_machine(task, station.name) for kind in kinds)
        for part in wanted:
            for stage in (stage for route in part.routes for stage in route):
                found = made._own(kind.at_service(task, stage) for kind in kinds)
                made.services[part.name, stage.station] = found
        return made

    def _add_leg(self, way: Carried) -> None:
        rest = self._pick(way.kind, way.origin)
        self.legs[way] = rest + self._own(
            kind.on_carry(self.task, way.kind, way.origin, way.target) for kind in SKILLS.values()
        )

    def _pick(self, carried: str, station: str) -> Skills:
        found = self._own(kind.at_pick(self.task, carried, station) for kind in SKILLS.values())
        self.picks[carried, station] = found
        return found

    def _own(self, found: Iterable[Skill | None]) -> Skills:
        """The skills found, each the one of its name."""
        return tuple(self.skills.setdefault(skill.name, skill) for skill in found if skill is not None)


def check_names(task: Task) -> None:
    """BadInput unless all sub-tasks that a task names are skills."""
    for name in task.subtasks:
        if name not in SKILLS:
            raise unknown("sub-task", name, SKILLS, f"task '{task.name}': subtasks")


def ways_of(part: Part) -> dict[Carried, None]:
    """Every way on which a part of a kind, or its pallet, is carried along its routes, through buffers, too; in their order."""
    found: dict[Carried, None] = {}
    for route in part.routes:
        for before, stage, after in zip(route, route[1:], [*route[2:], None], strict=False):
            kind = part.name if stage.pallet or before.pallet else comes_as(part)
            for origin, target in _legs(before, stage):
                found[Carried(origin, target, kind)] = None
            if stage.pallet and after is not None:
                found[Carried(before.station, after.station, str(part.pallet))] = None
    return found


def _legs(before: TaskStage, stage: TaskStage) -> list[Pair]:
    """From a stage to the next, directly and through the next one's buffer."""
    if stage.buffer is None:
        return [(before.station, stage.station)]
    return [(before.station, stage.station), (before.station, stage.buffer), (stage.buffer, stage.station)]


def planned(at_most_s: float | None) -> float | None:
    """The window that is planned with, where a part may stay in its machine for so long [s]: moves are not timed to the last."""
    return None if at_most_s is None else at_most_s - min(WINDOW_MARGIN_S, at_most_s / 2)


def stations(task: Task, process_s: Mapping[str, float]) -> tuple[Station, ...]:
    """The task's stations as the sequencer knows them, with the machines' times [s] (0 where not measured yet)."""
    times = {
        s.name: s.processing_s if s.processing_s is not None else process_s.get(s.name, 0.0) for s in task.stations
    }
    return tuple(
        Station(s.name, s.kind, s.capacity, times[s.name] or 0.0, planned(s.at_most_s), batch=s.batch)
        for s in task.stations
    )


def products(parts: Iterable[Part], service_s: Mapping[Pair, float] = NO_SERVICE) -> tuple[Product, ...]:
    """The kinds of parts and their routes as the sequencer knows them; service_s: by kind and station [s]."""

    def route(part: Part, stages: Iterable[TaskStage]) -> Route:
        return tuple(
            Stage(
                s.station,
                s.buffer,
                s.processing_s,
                service_s.get((part.name, s.station), 0.0),
                s.pallet,
                planned(s.at_most_s),
            )
            for s in stages
        )

    return tuple(Product(part.name, tuple(route(part, own) for own in part.routes)) for part in parts)
