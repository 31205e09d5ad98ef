"""Where parts are as the camera in the hand has seen it: grasped there, set down and looked at; nothing seen, and said so."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import WorkFailed
from lab.learning.problem import Problem
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.world import World
from lab.skills import Grasp, PlacePart
from lab.skills.skill import Bench, Skill, Status
from lab.skills.surveys import Surveys
from lab.tasks.task import Task
from lab.toolbox.policy import Policy

PolicyOf = Callable[[Problem], Policy]
Run = Callable[[Skill, Bench, Policy], Status]
Stage = Callable[..., Bench]
SLICE = "slice 1"


@pytest.fixture(scope="module")
def seeing(task: Task, layout: Layout) -> Surveys:
    return Surveys(task.changed(perception="camera"), ("slice", "slice"), layout)


def test_without_a_word_the_simulator_says_where_parts_are(task: Task) -> None:
    assert task.perception == "truth"
    with World() as world:
        assert Bench(Scene(world, task.changed(obstacles=()), (), Layout((), ()))).sight is None


@pytest.mark.parametrize("seed", range(3))
def test_a_slice_is_grasped_where_it_was_seen(
    seed: int, seeing: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    grasp = Grasp(seeing.task, "slice", "plate").aim(SLICE)
    policy = optimal(grasp.setup(seeing))
    off = tuple(map(float, np.random.default_rng(seed).uniform(-1, 1, 3) * (0.02, 0.006, 0.12)))
    bench = stage(grasp, off=off)
    truly = bench.true_pose(SLICE)
    assert run(grasp, bench, policy) is Status.SUCCESS, grasp.reason
    assert bench.sight is not None
    seen = bench.scene.kind_of[SLICE].held_at(bench.sight.where[SLICE])
    assert np.hypot(seen.x - truly.x, seen.y - truly.y) < 0.002
    assert abs(seen.yaw - truly.yaw) < np.radians(2)
    assert bench.part_pose(SLICE) == bench.scene.robot.tool()  # it is where the gripper is, as far as is known


def test_a_slice_that_is_gone_is_not_grasped_and_that_is_said(
    seeing: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    grasp = Grasp(seeing.task, "slice", "plate").aim(SLICE)
    policy = optimal(grasp.setup(seeing))
    bench = stage(grasp)
    bench.scene.world.put(SLICE, (0.6, 0.9, 0.06))
    assert run(grasp, bench, policy) is Status.FAILURE
    assert grasp.reason == "the camera in the hand does not see slice 1 at 'plate'"
    assert bench.held is None
    with pytest.raises(WorkFailed, match="slice 1 has not been seen yet"):
        bench.part_pose(SLICE)


def test_an_empty_slot_is_not_taken_for_a_slice(seeing: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    grasp = Grasp(seeing.task, "slice", "toaster").aim(SLICE)
    policy = optimal(grasp.setup(seeing))
    bench = stage(grasp)
    bench.scene.world.put(SLICE, (0.6, 0.9, 0.06))
    assert run(grasp, bench, policy) is Status.FAILURE
    assert grasp.reason == "the camera in the hand does not see slice 1 at 'toaster'"


def test_what_is_set_down_is_looked_at(seeing: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    place = PlacePart(seeing.task, "slice", "finished_plate").aim(SLICE)
    policy = optimal(place.setup(seeing))
    bench = stage(place)
    assert run(place, bench, policy) is Status.SUCCESS, place.reason
    assert bench.sight is not None
    seen, truly = bench.sight.where[SLICE], bench.scene.kind_of[SLICE].foot_at(bench.true_pose(SLICE))
    assert np.hypot(seen.x - truly.x, seen.y - truly.y) < 0.002


def test_at_the_beginning_parts_are_where_the_task_says(seeing: Surveys) -> None:
    order = ("slice", "slice")
    layout = Layout(seeing.layout.obstacles, ((0.01, 0.0, 0.05), (0.0, 0.0, 0.0)))
    with World() as world:
        bench = Bench(Scene(world, seeing.task, order, layout))
        spot = bench.scene.places.begins(order)[0]
        assert bench.part_pose(SLICE) == bench.scene.kind_of[SLICE].held_at(spot)
        assert abs(bench.true_pose(SLICE).x - bench.part_pose(SLICE).x) == pytest.approx(0.01, abs=1e-6)
