"""Transfer: the tool's way through the work space, around what stands in it."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.sim.scene.places import Layout
from lab.skills import Transfer
from lab.skills.skill import Bench, Skill, Status
from lab.skills.surveys import INSERT, Surveys
from lab.skills.transfer import ACTIONS
from lab.tasks.task import Task
from lab.tasks.task_fields import Obstacle
from lab.toolbox.policy import Policy

PolicyOf = Callable[[Problem], Policy]
Run = Callable[[Skill, Bench, Policy], Status]
Stage = Callable[..., Bench]
SLICE = "slice 1"
ORDER = ("slice", "slice")


def towers(task: Task, *places: tuple[float, float], cubes: int = 10) -> Surveys:
    made = tuple(Obstacle(name=f"tower {n}", position_m=at, cubes=cubes) for n, at in enumerate(places, start=1))
    changed = task.changed(obstacles=made)
    return Surveys(changed, ORDER, Layout(places, ()))


@pytest.mark.parametrize(
    ("origin", "target"),
    [("toaster_buffer", "plate"), ("finished_plate", "plate"), ("butter_applier", "toaster"), ("toaster", "plate")],
)
def test_the_empty_gripper_comes_to_the_targets_approach(
    origin: str, target: str, surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    transfer = Transfer(origin, target)
    policy = optimal(transfer.setup(surveys))
    bench = stage(transfer)
    transfer.start(bench, policy)
    while transfer.step() is Status.RUNNING:
        bench.scene.world.step()
        touched = [name for name in bench.scene.solid if bench.scene.world.touching("robot", name)]
        assert touched == []
    assert transfer.status is Status.SUCCESS, transfer.reason
    tool, wanted = bench.scene.robot.tool(), surveys.approach(target)
    assert (tool.x, tool.y, tool.z, tool.yaw) == pytest.approx((wanted.x, wanted.y, wanted.z, wanted.yaw), abs=2e-3)


@pytest.mark.parametrize(("origin", "target"), [("plate", INSERT), ("toaster", "butter_buffer")])
def test_a_slice_comes_along_and_meets_nothing(
    origin: str, target: str, surveys: Surveys, stage: Stage, optimal: PolicyOf
) -> None:
    transfer = Transfer(origin, target, "slice")
    policy = optimal(transfer.setup(surveys))
    bench = stage(transfer)
    transfer.start(bench, policy)
    while transfer.step() is Status.RUNNING:
        bench.scene.world.step()
        assert not any(bench.scene.world.touching(SLICE, name) for name in bench.scene.solid)
    assert transfer.status is Status.SUCCESS, transfer.reason
    assert bench.holds(SLICE)
    grid = surveys.task.station("toaster").grid
    assert grid is not None
    height = grid.height_m if target == INSERT else surveys.approach(target).z
    assert bench.scene.robot.tool().z == pytest.approx(height, abs=2e-3)


def test_a_slice_lost_on_the_way_is_noticed(surveys: Surveys, stage: Stage, optimal: PolicyOf) -> None:
    transfer = Transfer("plate", INSERT, "slice")
    policy = optimal(transfer.setup(surveys))
    bench = stage(transfer)
    transfer.start(bench, policy)
    for step in range(10_000):
        if step == 100:
            bench.scene.world.put(SLICE, (0.6, 0.2, 0.06))
        if transfer.step() is not Status.RUNNING:
            break
        bench.scene.world.step()
    assert transfer.status is Status.FAILURE
    assert transfer.reason == "the part is not in the gripper on the way to 'insert'"


def test_the_problem_is_the_work_space(surveys: Surveys, task: Task) -> None:
    problem = Transfer("toaster_buffer", "plate").setup(surveys)
    assert problem.name == "transfer toaster_buffer to plate"
    assert problem.mdp.shape == task.workspace.shape
    assert problem.mdp.action_labels == ACTIONS
    blocked = (problem.mdp.terminal & ~problem.mdp.goal).reshape(problem.mdp.shape)
    assert np.array_equal(blocked, surveys.workspace("").blocked)
    loaded = Transfer("plate", "toaster_buffer", "slice").setup(surveys)
    assert loaded.name == "transfer plate to toaster_buffer with slice"


def test_a_tower_on_the_straight_way_is_gone_round(task: Task, optimal: PolicyOf, stage: Stage, run: Run) -> None:
    surveys = towers(task, (0.21, 0.68))
    transfer = Transfer("toaster_buffer", "plate")
    policy = optimal(transfer.setup(surveys))
    free = Transfer("toaster_buffer", "plate")
    assert (policy.optimal_steps or 0) > (optimal(free.setup(towers(task))).optimal_steps or 0) > 0
    bench = stage(transfer)
    assert run(transfer, bench, policy) is Status.SUCCESS, transfer.reason


def test_a_station_walled_in_by_towers_is_bad_input_that_names_them(task: Task) -> None:
    x, y, _ = task.station("toaster_buffer").pose
    ring = [(x + 0.3 * np.cos(a), y + 0.3 * np.sin(a)) for a in np.linspace(0, 2 * np.pi, 12, endpoint=False)]
    surveys = towers(task, *[(float(a), float(b)) for a, b in ring], (0.0, -0.5))
    with pytest.raises(BadInput) as caught:
        Transfer("toaster_buffer", "finished_plate").setup(surveys)
    message = str(caught.value)
    assert message.startswith(
        "transfer toaster_buffer to finished_plate: no path reaches the goal; the start is enclosed"
    )
    assert "tower 1" in message
    assert "tower 13" not in message


def test_a_tower_on_a_station_is_bad_input_that_names_both(task: Task) -> None:
    x, y, _ = task.station("butter_buffer").pose
    surveys = towers(task, (x, y + 0.02))
    with pytest.raises(BadInput, match="station 'butter_buffer' cannot be approached: in the way: tower 1"):
        Transfer("plate", "butter_buffer").setup(surveys)
    with pytest.raises(BadInput, match="station 'butter_buffer' cannot be approached with slice: in the way: tower 1"):
        Transfer("plate", "butter_buffer", "slice").setup(surveys)


def test_stations_in_one_cell_are_too_near_to_each_other_for_this_grid(task: Task) -> None:
    x, y, yaw = task.station("butter_buffer").pose
    near = task.station("butter_applier").model_copy(update={"pose": (x + 0.17, y, yaw)})
    stations = tuple(near if s.name == near.name else s for s in task.stations)
    _, low_y, low_z = task.workspace.lower_m
    wide = task.workspace.model_copy(
        update={"cell_m": (0.4, 0.12, 0.12), "shape": (4, 18, 3), "lower_m": (x - 0.12 - 0.4, low_y, low_z)}
    )
    crowded = task.changed(stations=stations, workspace=wide, obstacles=())
    surveys = Surveys(crowded, ORDER, Layout((), ()))
    with pytest.raises(
        BadInput, match=r"^transfer .*: both ends are approached from the same cell \(1, \d+, 0\) of the"
    ):
        Transfer("butter_buffer", "butter_applier").setup(surveys)
