"""A learned skill is tried in physics before it is kept."""

from collections.abc import Callable

from lab.learning.problem import Problem
from lab.sim.scene import Scene
from lab.sim.world import World
from lab.skills.prepared_scene import Prepared
from lab.skills.skill import SETTLE_STEPS, Bench, Skill, Status
from lab.toolbox.policy import Policy


def trial_of(prepared: Prepared) -> Callable[[Problem, Policy], str | None]:
    """What tries a skill of a prepared scene: a grasp must lift its slice; most skills are not tried."""

    def trial(problem: Problem, policy: Policy) -> str | None:
        skill = prepared.skillset.skills[problem.name]
        return try_out(prepared, skill, policy) if skill.tried else None

    return trial


def try_out(prepared: Prepared, skill: Skill, policy: Policy) -> str | None:
    """Carry a skill out once in physics; None when it did what it is for, else why it did not."""
    with World() as world:
        bench = Bench(Scene(world, prepared.task, 0, prepared.surveys.layout))
        for _ in range(SETTLE_STEPS):
            world.step()
        skill.begin(bench)
        skill.start(bench, policy)
        while skill.step() is Status.RUNNING:
            world.step()
        return None if skill.status is Status.SUCCESS else skill.reason
