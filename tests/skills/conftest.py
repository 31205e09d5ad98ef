"""What the skills' tests stand on: one survey of the shipped cell, benches set up for a skill, and optimal policies."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import NamedTuple

import numpy as np
import pytest

from lab.learning.problem import Problem
from lab.mdp import optimal_values, shortest_steps
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.world import World
from lab.skills import Skill
from lab.skills.skill import Bench, Status
from lab.skills.skillset import SkillSet
from lab.skills.surveys import Surveys
from lab.tasks.task import Order, Task
from lab.tasks.task_file import load
from lab.toolbox.policy import GOAL, ON, OUT, Policy

SLICE = "slice 1"
ORDER: Order = ("slice", "slice")


def still(task: Task) -> Task:
    """The task with everything where the file says, and brisk processes."""
    obstacles = tuple(o.model_copy(update={"area": (0.0, 0.0)}) for o in task.obstacles)
    brisk = {n: p.model_copy(update={"speed_m_s": 0.2, "dwell_s": 0.05}) for n, p in task.processes.items()}
    return task.changed(obstacles=obstacles, processes=brisk)


@pytest.fixture(scope="session")
def task() -> Task:
    """The shipped task with everything where the file says, and a brisk butter applier."""
    return still(load("toast"))


@pytest.fixture(scope="session")
def fms() -> Task:
    """The task with pallets and a service of the robot's, likewise."""
    return still(load("fms-arm"))


@pytest.fixture(scope="session")
def breakfast() -> Task:
    """The task with two kinds of parts, likewise."""
    return still(load("breakfast"))


@pytest.fixture(scope="session")
def layout(task: Task) -> Layout:
    """Every cube at its place, no slices."""
    return Layout(tuple(o.position_m for o in task.obstacles), ())


@pytest.fixture(scope="session")
def surveys(task: Task, layout: Layout) -> Surveys:
    """One set of surveys for all tests."""
    return Surveys(task, ORDER, layout)


@pytest.fixture(scope="session")
def surveyed() -> Callable[..., Surveys]:
    """Surveys of a task with every obstacle where the file has it: surveyed(task, order)."""

    def survey(task: Task, order: Order = ORDER) -> Surveys:
        return Surveys(task, order, Layout(tuple(o.position_m for o in task.obstacles), ()))

    return survey


class Cell(NamedTuple):
    """A cell in which skills are tried: its surveys, and the parts that are made there."""

    surveys: Surveys
    order: Order

    def skills(self) -> dict[str, Skill]:
        """All skills that it needs, fresh ones."""
        return SkillSet.of(self.surveys.task, self.order).skills


@pytest.fixture(scope="session")
def cells(surveys: Surveys, surveyed: Callable[..., Surveys], fms: Task, breakfast: Task) -> dict[str, Cell]:
    """The cells of shipped tasks: of toast, with pallets, and with two kinds of parts."""
    others = {"fms-arm": (fms, ("rook", "sign")), "breakfast": (breakfast, ("slice", "cup"))}
    made = {name: Cell(surveyed(task, order), order) for name, (task, order) in others.items()}
    return {"toast": Cell(surveys, ORDER)} | made


@pytest.fixture(scope="session")
def cell_of(cells: dict[str, Cell]) -> Callable[[str], Cell]:
    """Where a skill is: 'fms-arm: vacuum at mill', or in toast's cell where no task is named."""

    def where(name: str) -> Cell:
        return cells[name.partition(": ")[0] if ": " in name else "toast"]

    return where


@pytest.fixture(scope="session")
def make(cell_of: Callable[[str], Cell]) -> Callable[[str], Skill]:
    """A fresh skill by its full name, or the first of a sub-task, told about the first part of its kind."""

    def example(name: str) -> Skill:
        cell, wanted = cell_of(name), name.rpartition(": ")[2]
        skill = next(skill for skill in cell.skills().values() if wanted in (skill.name, skill.subtask))
        return skill.aim(f"{cell.surveys.task.made_as(skill.kind).name} 1" if skill.kind else SLICE)

    return example


@pytest.fixture(scope="session")
def optimal() -> Callable[[Problem], Policy]:
    """The policy that always takes a shortest way."""

    def make_policy(problem: Problem) -> Policy:
        return _policy(problem, optimal_values(problem.mdp, 0.99))

    return make_policy


@pytest.fixture(scope="session")
def clueless() -> Callable[[Problem], Policy]:
    """The policy that has learned nothing."""

    def make_policy(problem: Problem) -> Policy:
        return _policy(problem, np.zeros((problem.mdp.n_states, problem.mdp.n_actions)))

    return make_policy


def _policy(problem: Problem, q: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Policy:
    mdp = problem.mdp
    steps = shortest_steps(mdp)
    return Policy(
        name=f"{problem.name} policy",
        subtask=problem.subtask,
        task="toast",
        q=q,
        visits=np.zeros(q.shape, np.int64),
        action_labels=mdp.action_labels,
        shape=mdp.shape,
        start=mdp.start,
        signature=mdp.signature,
        learner={},
        gate={},
        advisor="none",
        seed=0,
        curve=[],
        guided=[],
        helped_steps=0,
        requests=0,
        optimal_steps=steps,
        final_steps=steps,
        solved=True,
        created="2024-05-01T12:00:00+00:00",
        versions={},
        ends=np.where(mdp.goal, GOAL, np.where(mdp.terminal, OUT, ON)).astype(np.uint8),
    )


@pytest.fixture
def stage(surveys: Surveys) -> Iterator[Callable[..., Bench]]:
    """A bench in its own cell on which a set-up skill can begin: `stage(skill, layout=..., off=...)`."""
    with ExitStack() as worlds:

        def make_bench(
            skill: Skill, layout: Layout | None = None, off: tuple[float, float, float] = (0.0, 0.0, 0.0)
        ) -> Bench:
            own = vars(skill).setdefault("surveys", surveys)
            bench = Bench(Scene(worlds.enter_context(World()), own.task, (), layout or own.layout))
            spot = skill.spot
            skill.begin(bench, off)
            skill.spot = spot
            return bench

        yield make_bench


@pytest.fixture(scope="session")
def run() -> Callable[[Skill, Bench, Policy], Status]:
    """Carry a skill out to its end in physics."""

    def carry_out(skill: Skill, bench: Bench, policy: Policy) -> Status:
        skill.start(bench, policy)
        while skill.step() is Status.RUNNING:
            bench.scene.world.step()
        return skill.status

    return carry_out
