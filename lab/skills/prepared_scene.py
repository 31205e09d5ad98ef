"""A task ready for learning: `prepare` lays its scene out and surveys every problem; `check_task` checks a file that way.

`precedences` derives which parts must wait for which, from layers of parts and from the file's [[after]].
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from lab.errors import BadInput, LabError, counted
from lab.learning.problem import Problem
from lab.mdp import BoolArray
from lab.sequencing.cell.precedence import Precedence, RouteStep
from lab.sim.arms.arm_models import arm_of
from lab.sim.parts.kinds import Spot
from lab.sim.scene.places import Layout, Places
from lab.sim.scene.scene_check import check_apart, check_scene, places_of
from lab.skills.skillset import SkillSet
from lab.skills.surveys import Surveys
from lab.tasks.grid_world import RANDOM, GridWorld
from lab.tasks.task import Order, Task, check_number, in_words
from lab.tasks.task_fields import Station
from lab.tasks.task_file import find, load_any
from lab.workers import Workers


def precedences(task: Task, order: Order) -> tuple[Precedence, ...]:
    """The precedences of an order, parts by number: from spots on top of parts, and from the file's [[after]].

    BadInput, with file and line, when parts would wait for more parts than the order has.
    """
    with task.in_its_file():
        layered = [station for station in task.stations if station.is_layered]
        places = places_of(task) if layered else None
        derived = [
            precedence
            for station in layered
            if places
            for precedence in (*_put_on(places, station, order), *_taken_off(places, station, order))
        ]
        return (*derived, *_from_file(task, order))


def _put_on(places: Places, station: Station, order: Order) -> Iterator[Precedence]:
    """The precedences where routes end: a part waits until the parts that it stands on are there.

    The spots of a kind are filled in order, so the n-th part to arrive stands on the n-th spot.
    """
    task, groups = places.task, dict[tuple[Spot, ...], list[str]]()
    for part in task.made:
        if station.name in part.ends and station.name != task.starts(part.name):
            groups.setdefault(tuple(places.spots(station, part.name)), []).append(part.name)
    for spots, kinds in groups.items():
        parts = _numbers(order, kinds)
        for others, below in groups.items():
            carry = [[others.index(on) + 1 for on in places.carriers(station, spot) if on in others] for spot in spots]
            most, needs = 0, list[int]()
            for own in carry[: len(parts)]:
                most = max([most, *own])
                needs.append(most)
            if others == spots or not most:
                continue
            of = _numbers(order, below)
            if most > len(of):
                raise BadInput(
                    f"station '{station.name}': {counted(len(parts), kinds[0])} would stand on {counted(most, below[0])} there, "
                    f"and the order has {len(of)}: wanted more of '{below[0]}', or fewer of '{kinds[0]}'"
                )
            for kind in (*kinds, *below):
                if other := next((r[-1].station for r in task.part(kind).routes if r[-1].station != station.name), ""):
                    raise BadInput(
                        f"part '{kind}': routes: they end at '{station.name}', where parts stand on parts, or at '{other}': "
                        "which of its parts will be there is not planned: wanted one end, or no layers there"
                    )
            yield Precedence(parts, RouteStep(station.name), of, RouteStep(station.name), tuple(needs))


def _taken_off(places: Places, station: Station, order: Order) -> Iterator[Precedence]:
    """The precedences where routes begin: parts of a layer are taken before the parts of the layer below that carry them."""
    begins = enumerate(places.begins(order), 1)
    stand = {part: spot for part, spot in begins if places.task.starts(order[part - 1]) == station.name}
    below = {part: [under.z for _, under in places.below(station, spot)] for part, spot in stand.items()}
    for level in sorted({spot.z for spot in stand.values()}):
        of = tuple(part for part, own in below.items() if level in own)
        parts = tuple(part for part, spot in stand.items() if spot.z == level)
        if of:
            yield Precedence(parts, RouteStep(station.name, leaves=True), of, RouteStep(station.name, leaves=True))


def _from_file(task: Task, order: Order) -> Iterator[Precedence]:
    """The precedences of the file's [[after]]; those of kinds that the order does not contain are left out."""
    for number, rule in enumerate(task.after, 1):
        parts, of = _numbers(order, [rule.part]), _numbers(order, [rule.of])
        if not parts or (not of and rule.count == "all"):
            continue
        if rule.count == "each" and len(of) < len(parts):
            raise BadInput(
                f"after {number}: {counted(len(parts), rule.part)} would wait for as many of '{rule.of}', and the order has "
                f"{len(of)}: wanted count = 'all', more of '{rule.of}', or fewer of '{rule.part}'"
            )
        needs = tuple(range(1, len(parts) + 1)) if rule.count == "each" else ()
        steps = (
            RouteStep(rule.station, rule.step == "leaves"),
            RouteStep(rule.of_station or rule.station, rule.of_step == "leaves"),
        )
        yield Precedence(parts, steps[0], of, steps[1], needs)


def _numbers(order: Order, kinds: list[str]) -> tuple[int, ...]:
    return tuple(number for number, kind in enumerate(order, 1) if kind in kinds)


# ---- a scene laid out and surveyed --------------------------------------------------------------------------------------


@dataclass
class Prepared:
    """A task whose scene is surveyed, which took `wall_s` [s]; nothing has been learned or written yet."""

    task: Task
    order: Order
    seed: int
    layout: Layout
    surveys: Surveys
    skillset: SkillSet
    problems: dict[str, Problem]
    wall_s: float = 0.0

    @property
    def words(self) -> str:
        """The order in words, such as "3 slices"."""
        return in_words(self.order)

    def reach(self, name: str) -> BoolArray:
        """The states of a skill's problem that the arm can reach, whatever is in the way, (S,) bool; all if no arm moves."""
        skill, arm = self.skillset.skills[name], arm_of(self.task.robot, self.task.folder)
        states = range(self.problems[name].mdp.n_states)
        if not skill.moves_arm:
            return np.ones(len(states), bool)
        poses = np.array([[pose.x, pose.y, pose.z, pose.yaw] for pose in map(skill.pose, states)])
        reached: BoolArray = np.hypot(poses[:, 0], poses[:, 1]) >= arm.nearest_m
        reached &= ~np.isnan(arm.inverse_each(poses)[:, 0])
        return reached


def lay_out(task: Task, order: Order, seed: int) -> Layout:
    """The layout drawn with `seed`; BadInput when an obstacle cannot be placed."""
    return places_of(task).draw(order, np.random.default_rng([seed, 1]))


def prepare(task: Task, order: Order, seed: int, only: str | None = None, workers: Workers | None = None) -> Prepared:
    """The scene laid out with `seed` and surveyed, with every problem of it, or `only` that of one skill.

    workers: processes that share the surveys; None: this one makes them all. Nothing is written.
    Raises BadInput for a scene or a problem without a solution.
    """
    began = time.perf_counter()
    with task.in_its_file():
        task = check_scene(task)
        check_apart(task, len(order))
        precedences(task, order)
        skillset = SkillSet.of(task, order)
        layout = lay_out(task, order, seed)
        surveys = Surveys(task, order, layout)
        scene = scene_in_words(task, order, layout)
        chosen = {name: skill for name, skill in skillset.skills.items() if only in (None, name)}
        if workers is not None:
            for step in (slice(1), slice(1, None)):
                surveys.make([name for skill in chosen.values() for name in skill.needs[step]], workers)
        problems = {
            name: replace(skill.setup(surveys), scene=scene, arm=task.robot.model) for name, skill in chosen.items()
        }
    return Prepared(task, order, seed, layout, surveys, skillset, problems, time.perf_counter() - began)


def scene_in_words(task: Task, order: Order, layout: Layout) -> str:
    """The scene as a policy's card describes it: the number of parts, and the obstacles' positions [m]."""
    places = zip(task.obstacles, layout.obstacles, strict=True)
    stand = [f"{obstacle.name} at ({x:.3f}, {y:.3f})" for obstacle, (x, y) in places]
    return ", ".join([in_words(order), *stand])


def check_task(file: str, toasts: int | None, seed: int) -> tuple[list[str], list[str]]:
    """The faults and the warnings of a task file with its scene and problems, or of a cell or a world.

    toasts: how many parts of the first kind; None: the order in the file. A warning is about a problem that can be
    learned, but hardly without advice.
    Raises BadInput for a missing file, and for a number of parts that this kind of file never takes.
    """
    if not file.startswith(RANDOM):
        find(file)
    try:
        task = load_any(file)
    except LabError as error:
        return [str(error)], []
    if toasts is not None and not isinstance(task, GridWorld):
        check_number(toasts) if isinstance(task, Task) else task.ordered(toasts)
    warnings: list[str] = []
    try:
        if isinstance(task, Task):
            prepared = prepare(task, task.order(toasts), seed)
            crash = {p.subtask: None for p in prepared.problems.values() if (p.mdp.terminal & ~p.mdp.goal).any()}
            slips = {name: task.subtask(name).warning() for name in crash}
            warnings += [f"subtasks.{name}.{slip}" for name, slip in slips.items() if slip]
        elif isinstance(task, GridWorld):
            task.check()
            warnings += [slip for slip in [task.warning()] if slip]
        else:
            task.cell(toasts)
    except LabError as error:
        return [str(error)], []
    return [], warnings
