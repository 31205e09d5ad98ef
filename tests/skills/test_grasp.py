"""Grasp: from wherever a part may stand, it is lifted; when it is not, the skill says so."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.learning.problem import Problem
from lab.skills import Grasp
from lab.skills.skill import Bench, Skill, Status
from lab.skills.surveys import Surveys
from lab.tasks.task import Task
from lab.toolbox.policy import Policy

PolicyOf = Callable[[Problem], Policy]
Run = Callable[[Skill, Bench, Policy], Status]
Stage = Callable[..., Bench]
SLICE = "slice 1"
ORDER = ("slice", "slice")
MAY_STAND = np.array([0.012, 0.005, 0.08])  # [m], [m], [rad]: a little wider than what ships


@pytest.mark.parametrize("seed", range(6))
def test_a_slice_is_lifted_from_wherever_it_stands(
    seed: int, surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    grasp = Grasp(surveys.task, "slice", "plate").aim(SLICE)
    policy = optimal(grasp.setup(surveys))
    off = tuple(map(float, np.random.default_rng(seed).uniform(-1, 1, 3) * MAY_STAND))
    bench = stage(grasp, off=off)
    low = bench.scene.world.pose(SLICE)[0][2]
    assert run(grasp, bench, policy) is Status.SUCCESS, grasp.reason
    assert bench.scene.world.pose(SLICE)[0][2] > low + 0.15
    assert bench.upright(SLICE) > 0.999
    assert bench.held == SLICE
    tool, wanted = bench.scene.robot.tool(), surveys.approach("plate")
    assert (tool.x, tool.y, tool.z) == pytest.approx((wanted.x, wanted.y, wanted.z), abs=2e-3)


def test_beside_other_slices_none_of_them_is_knocked_over(
    surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run, task: Task
) -> None:
    grasp = Grasp(surveys.task, "slice", "plate").aim(SLICE)
    policy = optimal(grasp.setup(surveys))
    bench = stage(grasp, off=(0.008, -0.003, 0.05))
    for number, spot in enumerate(surveys.places.spots(task.station("plate"))[1:6], start=2):
        bench.scene.add(f"slice {number}", "slice", spot, (-0.008, 0.003, -0.05))
    assert run(grasp, bench, policy) is Status.SUCCESS, grasp.reason
    assert all(bench.upright(f"slice {number}") > 0.999 for number in range(2, 7))


def test_a_slippery_slice_is_not_lifted_and_that_is_said(
    surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    grasp = Grasp(surveys.task, "slice", "plate").aim(SLICE)
    policy = optimal(grasp.setup(surveys))
    bench = stage(grasp)
    position, turn = bench.scene.world.pose(SLICE)
    bench.scene.world.friction(SLICE, 0.0)
    assert run(grasp, bench, policy) is Status.FAILURE
    assert grasp.reason == "slice 1 is not in the gripper after grasping at 'plate'"
    assert bench.held is None
    bench.scene.world.friction(SLICE, 0.8, spinning=0.001)
    bench.scene.world.put(SLICE, position, turn)
    assert run(grasp, bench, policy) is Status.SUCCESS, grasp.reason  # and can be tried again from there


def test_a_slice_that_is_not_there_is_not_lifted(surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    grasp = Grasp(surveys.task, "slice", "plate").aim(SLICE)
    policy = optimal(grasp.setup(surveys))
    bench = stage(grasp)
    bench.scene.world.put(SLICE, (0.5, 0.0, 0.06), (0.7071068, 0.0, 0.0, 0.7071068))  # flat on the table
    assert run(grasp, bench, policy) is Status.FAILURE
    assert "slice 1" in grasp.reason
    assert bench.held is None
