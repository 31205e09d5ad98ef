"""The set of skills that a task needs, where each of them is used, and the policies that they follow."""

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
WINDOW_MARGIN_S = 1.0  # by which a planned window is shorter than the task's
NO_SERVICE: Mapping[tuple[str, str], float] = {}


class CarriedPath(NamedTuple):
    """A transport by the robot: from one station to another, and the kind that it carries (see `Scene.kinds`)."""

    origin: str
    target: str
    kind: str


@dataclass
class SkillSet:
    """All skills that a task needs, by name, in the order in which they are learned; one for each place and transport.

    legs: the skills that carry a part from one station to another, in order. travels: those that move the empty gripper.
    picks: those that take a part, by kind and station. processes: those of machines, once learned. services: those of the
    robot before it takes a part out, by kind and station. blocked: why a skill cannot be carried out in a changed scene,
    by name.
    """

    task: Task
    moves: NeededMoves
    skills: dict[str, Skill] = field(default_factory=dict)
    legs: dict[CarriedPath, Skills] = field(default_factory=dict)
    travels: dict[Pair, Skills] = field(default_factory=dict)
    picks: dict[Pair, Skills] = field(default_factory=dict)
    processes: dict[str, Skills] = field(default_factory=dict)
    services: dict[Pair, Skills] = field(default_factory=dict)
    policies: dict[str, Policy] = field(default_factory=dict)
    blocked: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, task: Task, order: Order) -> "SkillSet":
        """The skills that a run with such an order may need. BadInput when the task names an unknown sub-task.

        Parts are also grasped at the last station, because a part that was set down badly there has to be taken again.
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
                own_services = made._own(kind.at_service(task, stage) for kind in kinds)
                made.services[part.name, stage.station] = own_services
        return made

    def _add_leg(self, way: CarriedPath) -> None:
        rest = self._pick(way.kind, way.origin)
        self.legs[way] = rest + self._own(
            kind.on_carry(self.task, way.kind, way.origin, way.target) for kind in SKILLS.values()
        )

    def _pick(self, carried: str, station: str) -> Skills:
        picking = self._own(kind.at_pick(self.task, carried, station) for kind in SKILLS.values())
        self.picks[carried, station] = picking
        return picking

    def _own(self, needed: Iterable[Skill | None]) -> Skills:
        """The needed skills; a skill whose name is known already is replaced by the known one."""
        return tuple(self.skills.setdefault(skill.name, skill) for skill in needed if skill is not None)


def check_names(task: Task) -> None:
    """Raise BadInput unless every sub-task that a task names is a skill."""
    for name in task.subtasks:
        if name not in SKILLS:
            raise unknown("sub-task", name, SKILLS, f"task '{task.name}': subtasks")


def ways_of(part: Part) -> dict[CarriedPath, None]:
    """Every transport of a part of a kind, or of its pallet, along its routes and through buffers, in that order."""
    transports: dict[CarriedPath, None] = {}
    for route in part.routes:
        for before, stage, after in zip(route, route[1:], [*route[2:], None], strict=False):
            kind = part.name if stage.pallet or before.pallet else comes_as(part)
            for origin, target in _legs(before, stage):
                transports[CarriedPath(origin, target, kind)] = None
            if stage.pallet and after is not None:
                transports[CarriedPath(before.station, after.station, str(part.pallet))] = None
    return transports


def _legs(before: TaskStage, stage: TaskStage) -> list[Pair]:
    """The transports from a stage to the next: directly, and by way of the next one's buffer."""
    if stage.buffer is None:
        return [(before.station, stage.station)]
    return [(before.station, stage.station), (before.station, stage.buffer), (stage.buffer, stage.station)]


def planned(at_most_s: float | None) -> float | None:
    """The window used in planning for a part that may stay in its machine for `at_most_s` [s]: shorter, since moves vary."""
    return None if at_most_s is None else at_most_s - min(WINDOW_MARGIN_S, at_most_s / 2)


def stations(task: Task, process_s: Mapping[str, float]) -> tuple[Station, ...]:
    """The task's stations as records of the sequencer, with the machines' times [s] (0 if not measured yet)."""
    times = {
        s.name: s.processing_s if s.processing_s is not None else process_s.get(s.name, 0.0) for s in task.stations
    }
    return tuple(
        Station(s.name, s.kind, s.capacity, times[s.name] or 0.0, planned(s.at_most_s), batch=s.batch)
        for s in task.stations
    )


def products(parts: Iterable[Part], service_s: Mapping[Pair, float] = NO_SERVICE) -> tuple[Product, ...]:
    """The kinds of parts and their routes as records of the sequencer; service_s: times [s] by kind and station."""

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
