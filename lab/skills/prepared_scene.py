"""A task whose scene is laid out and surveyed: what there is to learn, before anything is learned."""

import time
from dataclasses import dataclass, replace

import numpy as np

from lab.errors import LabError, counted
from lab.learning.problem import Problem
from lab.sim.scene import Layout, check_apart, draw_layout
from lab.skills.skillset import SkillSet
from lab.skills.surveys import Surveys
from lab.tasks.grid_world import RANDOM, GridWorld
from lab.tasks.task_file import Task, check_number, check_toasts, find, fitting, load_any


@dataclass
class Prepared:
    """A task whose scene is surveyed, which took `wall_s`: nothing is learned yet, and nothing is written."""

    task: Task
    toasts: int
    seed: int
    layout: Layout
    surveys: Surveys
    skillset: SkillSet
    problems: dict[str, Problem]
    wall_s: float = 0.0


def prepare(task: Task, toasts: int, seed: int, only: str | None = None) -> Prepared:
    """Lay the scene out as the seed says and survey every problem of it, or `only` one skill's.

    BadInput for whatever cannot be; writes nothing.
    """
    began = time.perf_counter()
    check_toasts(toasts, task)
    check_apart(task, toasts)
    skillset = SkillSet.of(task, toasts)
    layout = draw_layout(task, toasts, np.random.default_rng([seed, 1]))
    surveys = Surveys(task, layout)
    scene = in_words(task, toasts, layout)
    problems = {
        name: replace(skill.setup(surveys), scene=scene, arm=task.robot.model)
        for name, skill in skillset.skills.items()
        if only in (None, name)
    }
    return Prepared(task, toasts, seed, layout, surveys, skillset, problems, time.perf_counter() - began)


def in_words(task: Task, toasts: int, layout: Layout) -> str:
    """A scene as a policy's card tells of it: how many slices there are, and where the obstacles stand [m]."""
    places = zip(task.obstacles, layout.obstacles, strict=True)
    stand = [f"{obstacle.name} at ({x:.3f}, {y:.3f})" for obstacle, (x, y) in places]
    return ", ".join([counted(toasts, "slice"), *stand])


def check_task(file: str, toasts: int | None, seed: int) -> tuple[list[str], list[str]]:
    """What is wrong with a task file, its scene and its problems for so many toasts, or with a cell or a world; warnings.

    Without a number: a task for 3 toasts, or as many as there is room for; a cell for its own order. A warning is of what
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
            prepared = prepare(task, fitting(task, 3) if toasts is None else toasts, seed)
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
