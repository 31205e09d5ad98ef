"""Place: the part in the gripper stands on its spot at the end, alone and upright."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.learning.problem import Problem
from lab.skills import PlacePart
from lab.skills.camera_grids import RELEASE_ABOVE
from lab.skills.place import ACTIONS, GOAL, release_pose
from lab.skills.skill import Bench, Skill, Status
from lab.skills.surveys import Surveys
from lab.tasks.task import Task
from lab.toolbox.policy import Policy

PolicyOf = Callable[[Problem], Policy]
Run = Callable[[Skill, Bench, Policy], Status]
Stage = Callable[..., Bench]
SLICE = "slice 1"


@pytest.mark.parametrize("station", ["toaster_buffer", "butter_buffer", "butter_applier", "finished_plate"])
def test_a_slice_is_set_down_and_left_standing(
    station: str, surveys: Surveys, task: Task, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    place = PlacePart(surveys.task, "slice", station)
    policy = optimal(place.setup(surveys))
    bench = stage(place)
    assert run(place, bench, policy) is Status.SUCCESS, place.reason
    spot = surveys.places.spots(task.station(station))[0]
    at = bench.part_pose(SLICE)
    assert (at.x, at.y, at.z) == pytest.approx((spot.x, spot.y, spot.z + 0.09), abs=3e-3)
    assert at.yaw == pytest.approx(spot.yaw, abs=0.02)
    assert bench.upright(SLICE) > 0.999
    assert bench.held is None
    assert not bench.holds(SLICE)
    assert not bench.scene.robot.closed


def test_it_goes_to_the_spot_it_is_told(
    surveys: Surveys, task: Task, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    place = PlacePart(surveys.task, "slice", "finished_plate")
    policy = optimal(place.setup(surveys))
    chosen = surveys.places.spots(task.station("finished_plate"))[5]
    bench = stage(place.aim(SLICE, chosen))
    for number in (2, 3, 4):  # on the spots before it
        bench.scene.add(f"slice {number}", "slice", surveys.places.spots(task.station("finished_plate"))[number])
    assert run(place, bench, policy) is Status.SUCCESS, place.reason
    at = bench.part_pose(SLICE)
    assert (at.x, at.y) == pytest.approx((chosen.x, chosen.y), abs=3e-3)
    assert all(bench.upright(f"slice {number}") > 0.999 for number in (2, 3, 4))


def test_with_an_empty_gripper_there_is_nothing_to_place(
    surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    place = PlacePart(surveys.task, "slice", "toaster_buffer")
    policy = optimal(place.setup(surveys))
    bench = stage(place)
    bench.held = None
    assert run(place, bench, policy) is Status.FAILURE
    assert place.reason == "nothing in the gripper to place at 'toaster_buffer'"


def test_a_slice_that_falls_over_does_not_count_as_placed(
    surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    place = PlacePart(surveys.task, "slice", "toaster_buffer")
    policy = optimal(place.setup(surveys))
    bench = stage(place)
    place.start(bench, policy)
    while place.step() is Status.RUNNING:
        bench.scene.world.step()
        if bench.held is None:  # let go: now it is pushed over
            bench.scene.world.put(SLICE, (0.6, 0.2, 0.03), (np.sin(np.pi / 4), 0, 0, np.cos(np.pi / 4)))
    assert place.status is Status.FAILURE
    assert place.reason == "slice 1 does not stand on 'toaster_buffer'"


def test_the_problem_ends_at_the_spot_and_begins_above_it(surveys: Surveys) -> None:
    mdp = PlacePart(surveys.task, "slice", "toaster_buffer").setup(surveys).mdp
    assert mdp.action_labels == ACTIONS
    assert [mdp.state_cell(int(s)) for s in np.flatnonzero(mdp.goal)] == [GOAL]
    assert {mdp.state_cell(s)[2] for s in mdp.starts} == {mdp.shape[2] - 1}


def test_it_lets_go_where_the_slice_not_the_tool_is_over_the_spot(surveys: Surveys, task: Task, stage: Stage) -> None:
    """A slice that hangs 1 cm along its width and 1 cm low is let go 1 cm to the other side and 1 cm higher."""
    bench = stage(PlacePart(surveys.task, "slice", "toaster_buffer"))
    world, tool = bench.scene.world, bench.scene.robot.tool()
    position, turn = world.pose(SLICE)
    spot = surveys.places.spots(task.station("toaster_buffer"))[0]
    before = release_pose(bench, SLICE, spot)
    wanted = surveys.kinds["slice"].held_at(spot)
    assert (before.x, before.y) == pytest.approx((wanted.x, wanted.y), abs=1e-3)
    assert before.z == pytest.approx(wanted.z + RELEASE_ABOVE + tool.z - bench.part_pose(SLICE).z)
    world.put(SLICE, position + np.array([0.01, 0.0, -0.01]), turn)
    after = release_pose(bench, SLICE, spot)
    assert (after.x - before.x, after.y - before.y, after.z - before.z) == pytest.approx((-0.01, 0, 0.01), abs=1e-6)
