"""Insert: the camera's grid, the way through it, the slice in the slot; and what the camera notices."""

import re
from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import greedy_path
from lab.sim.scene.places import Layout
from lab.skills import Insert, PlacePart
from lab.skills.insert import ACTIONS, IN_SLOT_M, SEEN_WITHIN_M
from lab.skills.skill import Bench, Skill, Status
from lab.skills.surveys import Surveys
from lab.tasks.task import Task
from lab.tasks.task_fields import CameraGrid, Obstacle
from lab.toolbox.policy import Policy

PolicyOf = Callable[[Problem], Policy]
Run = Callable[[Skill, Bench, Policy], Status]
Stage = Callable[..., Bench]
SLICE = "slice 1"
ORDER = ("slice", "slice")
CELL = 0.05


def with_cubes(task: Task, *places: tuple[float, float], cubes: int = 3) -> Task:
    """The task with these cubes alone: 'cube 1', 'cube 2', ..."""
    made = tuple(Obstacle(name=f"cube {n}", position_m=at, cubes=cubes) for n, at in enumerate(places, start=1))
    return task.changed(obstacles=made)


def surveyed(task: Task) -> Surveys:
    return Surveys(task, ORDER, Layout(tuple(o.position_m for o in task.obstacles), ()))


def grid_of_toaster(task: Task) -> CameraGrid:
    grid = task.station("toaster").grid
    assert grid is not None
    return grid


def centre(task: Task, cell: tuple[int, int]) -> tuple[float, float]:
    x, y = grid_of_toaster(task).origin_m
    return x + (cell[0] + 0.5) * CELL, y + (cell[1] + 0.5) * CELL


def moved(layout: Layout, number: int, dx: float, dy: float = 0.0) -> Layout:
    x, y = layout.obstacles[number]
    return Layout((*layout.obstacles[:number], (x + dx, y + dy), *layout.obstacles[number + 1 :]), ())


def test_a_slice_ends_in_the_slot_and_the_camera_agrees_on_the_way(
    surveys: Surveys, task: Task, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    insert = Insert(surveys.task, "slice", "toaster")
    problem = insert.setup(surveys)
    bench = stage(insert)
    assert run(insert, bench, optimal(problem)) is Status.SUCCESS, insert.reason
    spot = surveys.places.spots(task.station("toaster"))[0]
    position, _ = bench.scene.world.pose(SLICE)
    assert np.hypot(position[0] - spot.x, position[1] - spot.y) < IN_SLOT_M
    assert position[2] == pytest.approx(spot.z + 0.120 / 2, abs=2e-3)
    assert bench.upright(SLICE) > 0.99
    assert bench.held is None
    states, _, _ = greedy_path(optimal(problem).q, problem.mdp, 200)
    assert len(insert.deviations_m) == len(states)  # a look in every cell, the first included
    assert 0 < max(insert.deviations_m) < SEEN_WITHIN_M == 0.008


def test_the_picture_becomes_start_goal_and_blocked_cells(surveys: Surveys, task: Task) -> None:
    insert = Insert(surveys.task, "slice", "toaster")
    mdp = insert.setup(surveys).mdp
    assert mdp.shape == grid_of_toaster(task).shape
    assert mdp.action_labels == ACTIONS
    assert centre(task, insert.seen.start) == pytest.approx(grid_of_toaster(task).start_m)
    toaster = task.station("toaster").pose
    assert centre(task, insert.seen.goal) == pytest.approx(toaster[:2], abs=CELL / 2 + 1e-9)
    blocked = (mdp.terminal & ~mdp.goal).reshape(mdp.shape)
    for obstacle in task.obstacles[:3]:
        x, y = obstacle.position_m
        cell = tuple(int((p - o) / CELL) for p, o in zip((x, y), grid_of_toaster(task).origin_m, strict=True))
        assert blocked[cell]


def test_a_cell_is_blocked_where_the_slice_would_touch_a_cube(task: Task) -> None:
    """A cube of 6 cm in the middle of cell (6, 6): a slice of 12 x 1.5 cm needs 9.6 cm along x and 4.35 cm along y."""
    alone = with_cubes(task, centre(task, (6, 6)))
    mdp = Insert(task, "slice", "toaster").setup(surveyed(alone)).mdp
    blocked = {mdp.state_cell(int(s)) for s in np.flatnonzero(mdp.terminal & ~mdp.goal)}
    assert blocked == {(5, 6), (6, 6), (7, 6)}


def test_a_low_cube_is_passed_over_and_a_tall_one_keeps_the_wide_gripper_away(task: Task) -> None:
    low = Insert(task, "slice", "toaster").setup(surveyed(with_cubes(task, centre(task, (6, 6)), cubes=1))).mdp
    assert not (low.terminal & ~low.goal).any()
    tall = Insert(task, "slice", "toaster").setup(surveyed(with_cubes(task, centre(task, (6, 6)), cubes=4))).mdp
    blocked = {tall.state_cell(int(s)) for s in np.flatnonzero(tall.terminal & ~tall.goal)}
    assert blocked == {(i, j) for i in (5, 6, 7) for j in (5, 6, 7)}


@pytest.mark.parametrize(("number", "dx", "dy"), [(0, 0.02, 0.0), (1, 0.0, -0.015), (2, 0.05, 0.05)])
def test_a_cube_moved_since_is_noticed(
    number: int, dx: float, dy: float, surveys: Surveys, layout: Layout, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    insert = Insert(surveys.task, "slice", "toaster")
    policy = optimal(insert.setup(surveys))
    bench = stage(insert, layout=moved(layout, number, dx, dy))
    assert run(insert, bench, policy) is Status.FAILURE
    by = np.hypot(dx, dy)
    assert insert.reason.startswith("the camera sees the obstacle at (")
    assert f"moved by {by:.2f}" in insert.reason
    assert insert.reason.endswith("m since 'insert at toaster' was learned")
    assert bench.held == SLICE  # nothing was tried


def test_a_cube_moved_by_less_than_the_camera_trusts_is_let_pass(
    surveys: Surveys, layout: Layout, stage: Stage, optimal: PolicyOf
) -> None:
    insert = Insert(surveys.task, "slice", "toaster")
    policy = optimal(insert.setup(surveys))
    bench = stage(insert, layout=moved(layout, 2, 0.004))
    insert.start(bench, policy)
    assert insert.step() is Status.RUNNING


def test_from_elsewhere_it_first_comes_to_the_start(
    surveys: Surveys, task: Task, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    """As when it is tried again: from above the toaster, the gripper hides the toaster's marker from the camera."""
    insert = Insert(surveys.task, "slice", "toaster")
    policy = optimal(insert.setup(surveys))
    bench = stage(PlacePart(surveys.task, "slice", "toaster"))
    assert run(insert, bench, policy) is Status.SUCCESS, insert.reason


def test_a_marker_that_is_hidden_is_a_reason(surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    insert = Insert(surveys.task, "slice", "toaster")
    policy = optimal(insert.setup(surveys))
    bench = stage(insert)
    bench.scene.world.put("toaster marker", (0.0, 0.0, -1.0))
    assert run(insert, bench, policy) is Status.FAILURE
    assert re.fullmatch(
        r"the camera does not see the toaster at \(.*\) m that 'insert at toaster' was learned with", insert.reason
    )


@pytest.mark.parametrize("number", [0, 2])
def test_a_cube_that_was_taken_away_has_not_moved_to_another_ones_place(
    number: int, surveys: Surveys, layout: Layout, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    """The next one stands where it stood before, decimetres away."""
    insert = Insert(surveys.task, "slice", "toaster")
    policy = optimal(insert.setup(surveys))
    bench = stage(insert, layout=moved(layout, number, 5.0, 0.0))
    assert run(insert, bench, policy) is Status.FAILURE
    x, y = layout.obstacles[number]
    said = re.fullmatch(r"the camera does not see the obstacle at \((.*), (.*)\) m that 'insert .*", insert.reason)
    assert said, insert.reason
    assert (float(said[1]), float(said[2])) == pytest.approx((x, y), abs=0.01)


def test_what_is_lost_on_the_way_is_said_and_no_way_is_looked_for(
    surveys: Surveys, stage: Stage, optimal: PolicyOf
) -> None:
    """The fingers open over the grid: the slice falls, and where it lies now says nothing about where the tool has to go."""
    insert = Insert(surveys.task, "slice", "toaster")
    policy = optimal(insert.setup(surveys))
    bench = stage(insert)
    insert.start(bench, policy)
    while insert.step() is Status.RUNNING and not insert.deviations_m:
        bench.scene.world.step()
    bench.scene.robot.lose()
    status = insert.step()
    while status is Status.RUNNING:
        bench.scene.world.step()
        status = insert.step()
    assert (status, insert.reason) == (Status.FAILURE, "slice 1 is not in the gripper any more")


def test_a_cube_that_came_along_is_noticed(
    surveys: Surveys, layout: Layout, task: Task, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    insert = Insert(surveys.task, "slice", "toaster")
    policy = optimal(insert.setup(surveys))
    bench = stage(insert)
    x, y = centre(task, (5, 9))
    bench.scene.world.box("new cube", (0.06, 0.06, 0.18), (x, y, 0.09), (0.7, 0.5, 0.3, 1.0))
    bench.scene.world.disc("new marker", 0.017, 0.004, (x, y, 0.182), (0.0, 0.8, 0.0, 1.0))
    assert run(insert, bench, policy) is Status.FAILURE
    assert insert.reason == "the camera sees 4 obstacles, 'insert at toaster' was learned with 3"


def test_with_an_empty_gripper_there_is_nothing_to_insert(
    surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    insert = Insert(surveys.task, "slice", "toaster")
    policy = optimal(insert.setup(surveys))
    bench = stage(insert)
    bench.held = None
    assert run(insert, bench, policy) is Status.FAILURE
    assert insert.reason == "nothing in the gripper to insert at 'toaster'"


def test_a_slice_beside_the_slot_is_a_failure(surveys: Surveys, stage: Stage, optimal: PolicyOf) -> None:
    insert = Insert(surveys.task, "slice", "toaster")
    policy = optimal(insert.setup(surveys))
    bench = stage(insert)
    insert.start(bench, policy)
    while insert.step() is Status.RUNNING:
        bench.scene.world.step()
        if bench.held is None:
            bench.scene.world.put(SLICE, (0.6, 0.2, 0.06))
    assert insert.status is Status.FAILURE
    assert insert.reason == "slice 1 is not in the slot of 'toaster'"


def test_a_toaster_enclosed_by_cubes_is_bad_input_that_names_them(task: Task) -> None:
    """A wall of cubes across the grid, between start and toaster; one more stands aside."""
    wall = [centre(task, (6, j)) for j in range(12)]
    enclosed = with_cubes(task, *wall, centre(task, (1, 10)))
    with pytest.raises(BadInput) as caught:
        Insert(task, "slice", "toaster").setup(surveyed(enclosed))
    message = str(caught.value)
    assert message.startswith("insert at toaster: no path reaches the goal; the goal is enclosed by: cube 1, ")
    assert all(f"cube {n}" in message for n in range(1, 13))
    assert "cube 13" not in message


def test_a_cube_over_the_toaster_or_the_start_is_named(task: Task) -> None:
    x, y, _ = task.station("toaster").pose
    with pytest.raises(BadInput, match=r"insert at toaster: the machine's cell is blocked by cube 1$"):
        Insert(task, "slice", "toaster").setup(surveyed(with_cubes(task, (x - 0.09, y))))
    x, y = grid_of_toaster(task).start_m
    with pytest.raises(
        BadInput, match=r"'toaster': grid\.start_m \[.*\]: cube 1 is in the way of a carried slice there$"
    ):
        Insert(task, "slice", "toaster").setup(surveyed(with_cubes(task, (x + 0.08, y))))


@pytest.mark.parametrize("perception", ["truth", "camera"])
def test_a_gripper_beside_its_cell_is_moved_by_what_the_camera_sees(
    perception: str,
    task: Task,
    layout: Layout,
    stage: Stage,
    optimal: PolicyOf,
    run: Run,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """An arm that goes 1 cm beside where it is sent, as one that was pushed: the camera sees it, and may correct it."""
    own = Surveys(task.changed(perception=perception), ORDER, layout)
    insert = Insert(own.task, "slice", "toaster")
    policy = optimal(insert.setup(own))
    bench = stage(insert)
    robot = bench.scene.robot
    follow = robot.follow
    monkeypatch.setattr(robot, "follow", lambda poses, **more: follow([p.shifted(dy=0.010) for p in poses], **more))
    status = run(insert, bench, policy)
    assert insert.deviations_m[0] == pytest.approx(0.010, abs=0.003)
    if perception == "truth":
        assert status is Status.FAILURE
        assert insert.reason == f"the camera sees the gripper {insert.deviations_m[0]:.3f} m off its cell"
    else:
        assert status is Status.SUCCESS, insert.reason
        assert max(insert.deviations_m[1:]) < 0.004
        assert bench.stands(SLICE, own.places.spots(task.station("toaster"))[0], IN_SLOT_M, truly=True)
