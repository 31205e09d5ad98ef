"""A task whose scene is laid out and surveyed: what there is to learn, before anything is learned."""

import time
from dataclasses import dataclass, replace

import numpy as np

from lab.errors import LabError
from lab.learning.problem import Problem
from lab.sim.scene.places import Layout
from lab.sim.scene.scene_check import check_apart, check_scene, places_of
from lab.skills.precedences import precedences
from lab.skills.skillset import SkillSet
from lab.skills.surveys import Surveys
from lab.tasks.grid_world import RANDOM, GridWorld
from lab.tasks.task import Order, Task, check_number, in_words
from lab.tasks.task_file import find, load_any
from lab.workers import Workers


@dataclass
class Prepared:
    """A task whose scene is surveyed, which took `wall_s`: nothing is learned yet, and nothing is written."""

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
        """What is made, such as "3 slices"."""
        return in_words(self.order)


def lay_out(task: Task, order: Order, seed: int) -> Layout:
    """The scene as the seed lays it out; BadInput for what cannot be."""
    return places_of(task).draw(order, np.random.default_rng([seed, 1]))


def prepare(task: Task, order: Order, seed: int, only: str | None = None, workers: Workers | None = None) -> Prepared:
    """Lay the scene out as the seed says and survey every problem of it, or `only` one skill's.

    workers: who shares in the surveys, None: nobody. BadInput for whatever cannot be; writes nothing.
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
    """A scene as a policy's card tells of it: how many parts there are, and where the obstacles stand [m]."""
    places = zip(task.obstacles, layout.obstacles, strict=True)
    stand = [f"{obstacle.name} at ({x:.3f}, {y:.3f})" for obstacle, (x, y) in places]
    return ", ".join([in_words(order), *stand])


def check_task(file: str, toasts: int | None, seed: int) -> tuple[list[str], list[str]]:
    """What is wrong with a task file, its scene and its problems, or with a cell or a world; and warnings.

    toasts: how many parts of the first kind; None: a task or a cell for its own order. A warning is of what
    can be learned, but hardly by a learner that nobody helps.
    Raises BadInput for a file that is not there, and for a number that this kind of file never takes.
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
