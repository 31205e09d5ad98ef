"""Trials in physics: a learned skill is carried out once before it is kept in the toolbox."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from lab.learning.problem import Problem
from lab.sim.scene.scene import Scene
from lab.sim.world import TIME_STEP, World
from lab.skills.prepared_scene import Prepared
from lab.skills.skill import NOT_OFF, SETTLE_STEPS, Bench, Skill, Status
from lab.toolbox.policy import Policy


def trial_of(prepared: Prepared) -> Callable[[Problem, Policy], str | None]:
    """A function that tries a skill of a prepared scene and returns why it failed, or None; most skills are not tried."""

    def trial(problem: Problem, policy: Policy) -> str | None:
        skill = prepared.skillset.skills[problem.name]
        return try_out(prepared, skill, policy) if skill.tried else None

    return trial


class SkillTrial(NamedTuple):
    """The outcome of carrying a skill out once: why it failed (None: it succeeded), and its simulated duration [s]."""

    failure: str | None
    sim_s: float


def try_out(prepared: Prepared, skill: Skill, policy: Policy) -> str | None:
    """Why a skill fails when it is carried out once in physics; None when it succeeds."""
    return carry_out(prepared, skill, policy).failure


def carry_out(prepared: Prepared, skill: Skill, policy: Policy, off: Sequence[float] = NOT_OFF) -> SkillTrial:
    """The outcome of carrying a skill out once in physics; `off`: displacement of the part, see `Skill.begin`."""
    with World() as world:
        bench = Bench(Scene(world, prepared.task, (), prepared.surveys.layout))
        for _ in range(SETTLE_STEPS):
            world.step()
        skill.begin(bench, off)
        skill.start(bench, policy)
        began = world.steps
        while skill.step() is Status.RUNNING:
            world.step()
        return SkillTrial(None if skill.status is Status.SUCCESS else skill.reason, (world.steps - began) * TIME_STEP)
