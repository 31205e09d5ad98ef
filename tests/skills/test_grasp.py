"""Grasp: from wherever a part may stand, it is lifted; when it is not, the skill says so."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import grid
from lab.sim.kinematics import ToolPose
from lab.sim.kinds import Spot
from lab.sim.places import Layout
from lab.skills import Grasp, Place
from lab.skills.around_part import entry_cell, from_above
from lab.skills.grasp import ACTIONS, GOAL
from lab.skills.skill import Bench, Skill, Status
from lab.skills.surveys import NEAR_SHAPE, NEAR_STEP_M, NEAR_YAW_STEP, Surveys, near_pose
from lab.tasks.task import Task
from lab.tasks.task_fields import Obstacle
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


def test_every_station_that_is_picked_from_has_the_same_problem_when_its_surroundings_are(surveys: Surveys) -> None:
    """A policy learned at one buffer serves at another: the table is relative to the slice."""
    one, other = (Grasp(surveys.task, "slice", place).setup(surveys).mdp for place in ("toaster_buffer", "butter_buffer"))
    assert one.signature == other.signature
    assert one.action_labels == ACTIONS


def test_episodes_begin_anywhere_free_on_the_highest_level() -> None:
    blocked = np.zeros((2, 2, NEAR_SHAPE[2]), dtype=bool)
    blocked[1, 1, -1] = True
    top = NEAR_SHAPE[2] - 1
    mdp = from_above(grid(blocked.shape, blocked, (0, 0, top), (1, 0, 0)))
    assert [mdp.state_cell(s) for s in mdp.starts] == [(0, 0, top), (0, 1, top), (1, 0, top)]


@pytest.mark.parametrize("yaw", [0.0, 0.4, -1.2, 1.5])
@pytest.mark.parametrize("cell", [(0, 0, 5, 0), (2, 2, 5, 2), (4, 1, 5, 3), (1, 3, 5, 4)])
def test_the_entry_is_the_cell_above_which_the_tool_is(yaw: float, cell: tuple[int, int, int, int]) -> None:
    goal = ToolPose(0.4, -0.3, 0.1, yaw)
    assert entry_cell(goal, near_pose(goal, cell)) == cell
    turned = near_pose(goal, cell).shifted(dyaw=np.pi)  # the fingers are alike
    assert entry_cell(goal, turned) == cell


def test_from_far_away_the_entry_is_at_the_grids_border() -> None:
    goal = ToolPose(0.4, -0.3, 0.1, 0.0)
    top = NEAR_SHAPE[2] - 1
    assert entry_cell(goal, ToolPose(2.0, -0.3, 0.5, 0.0)) == (NEAR_SHAPE[0] - 1, 2, top, 2)
    assert entry_cell(goal, ToolPose(0.4, -2.0, 0.5, -0.3)) == (2, 0, top, 0)


def test_near_poses_are_relative_to_the_slice(surveys: Surveys) -> None:
    goal = surveys.kinds["slice"].held_at(Spot(0.4, 0.5, 0.012, np.pi / 2))
    assert near_pose(goal, GOAL) == goal
    ahead = near_pose(goal, (3, 2, 1, 3))
    assert (ahead.x, ahead.y) == pytest.approx((0.4, 0.5 + NEAR_STEP_M[0]))
    assert ahead.z == pytest.approx(goal.z + NEAR_STEP_M[2])
    assert ahead.yaw == pytest.approx(np.pi / 2 + NEAR_YAW_STEP)
    assert near_pose(goal, (2, 3, 0)).x == pytest.approx(0.4 - NEAR_STEP_M[1])


def test_obstacles_elsewhere_do_not_change_the_problem(task: Task, surveys: Surveys) -> None:
    bare = Surveys(task.changed(obstacles=()), ORDER, Layout((), ()))
    assert Grasp(surveys.task, "slice", "plate").setup(bare).mdp.signature == Grasp(surveys.task, "slice", "plate").setup(surveys).mdp.signature


def test_no_room_beside_the_slice_is_bad_input_that_names_what_is_in_the_way(task: Task) -> None:
    x, y, _ = task.station("toaster_buffer").pose
    near = Obstacle(name="pillar", position_m=(x, y - 0.06), cubes=3)
    surveys = Surveys(task.changed(obstacles=(near,)), ORDER, Layout((near.position_m,), ()))
    for skill in (Grasp(surveys.task, "slice", "toaster_buffer"), Place(surveys.task, "slice", "toaster_buffer")):
        with pytest.raises(BadInput, match=rf"^{skill.name}: no room for gripper and part; in the way: pillar$"):
            skill.setup(surveys)


def test_a_pillar_at_one_side_leaves_the_other_side_to_begin_from(task: Task) -> None:
    x, y, _ = task.station("toaster_buffer").pose
    near = Obstacle(name="pillar", position_m=(x, y - 0.105), cubes=6)
    surveys = Surveys(task.changed(obstacles=(near,)), ORDER, Layout((near.position_m,), ()))
    mdp = Grasp(surveys.task, "slice", "toaster_buffer").setup(surveys).mdp
    assert mdp.terminal[int(np.ravel_multi_index((0, 0, NEAR_SHAPE[2] - 1, 0), mdp.shape))]
    assert mdp.start in mdp.starts
