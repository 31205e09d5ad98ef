"""A task whose scene is laid out and surveyed: what there is to learn, before anything is learned."""

import time
from dataclasses import dataclass

import numpy as np

from lab.sim.scene import Layout, check_apart, draw_layout
from lab.skills.skill import Problem
from lab.skills.skillset import SkillSet
from lab.skills.surveys import Surveys
from lab.tasks.task_file import Task, check_toasts


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
    problems = {name: skill.setup(surveys) for name, skill in skillset.skills.items() if only in (None, name)}
    return Prepared(task, toasts, seed, layout, surveys, skillset, problems, time.perf_counter() - began)
