"""Cover: every cell of a surface is met, in the order that was learned: by a head's ray on a part, or by the robot's tool."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from lab.learning.problem import Problem
from lab.mdp import shortest_steps
from lab.sim.world import TIME_STEP
from lab.skills.cover import REST, CoverPart
from lab.skills.skill import Bench, Skill, Status
from lab.skills.surveys import Surveys
from lab.tasks.task import Task
from lab.toolbox.policy import Policy

PolicyOf = Callable[[Problem], Policy]
Run = Callable[[Skill, Bench, Policy], Status]
Stage = Callable[..., Bench]
SLICE = "slice 1"
HEAD = ("head_x", "head_z")
SHAPE = (3, 3)


def butter_of(task: Task) -> CoverPart:
    """The applier's process, told about the first slice."""
    return CoverPart(task, "butter", "butter_applier", "slice").aim(SLICE)


def prepared(surveys: Surveys, stage: Stage, optimal: PolicyOf) -> tuple[CoverPart, Bench, Policy]:
    butter = butter_of(surveys.task)
    policy = optimal(butter.setup(surveys))
    return butter, stage(butter), policy


def test_the_shortest_coverage_is_eight_moves(surveys: Surveys) -> None:
    assert shortest_steps(butter_of(surveys.task).setup(surveys).mdp) == 8


def test_nine_cells_are_met_by_the_ray_one_beside_the_other(
    surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    butter, bench, policy = prepared(surveys, stage, optimal)
    assert run(butter, bench, policy) is Status.SUCCESS, butter.reason
    assert butter.covered[0] == (0, 0)
    assert sorted(butter.covered) == sorted(np.ndindex(*SHAPE))
    assert all(abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1 for a, b in pairwise(butter.covered))
    assert bench.scene.world.joints("butter_applier", HEAD) == pytest.approx(REST, abs=1e-3)
    assert bench.upright(SLICE) > 0.999


def test_the_time_is_the_way_and_the_rests(surveys: Surveys, task: Task, stage: Stage, optimal: PolicyOf) -> None:
    """Nine rests and, at the head's speed, eight steps of 4 cm, the way there and the way back."""
    butter, bench, policy = prepared(surveys, stage, optimal)
    butter.start(bench, policy)
    steps = 0
    while butter.step() is Status.RUNNING:
        bench.scene.world.step()
        steps += 1
    process = task.processes["butter"]
    there = back = np.hypot(0.04, 0.1)
    at_least = 9 * process.dwell_s + (there + 8 * 0.04) / process.speed_m_s
    assert at_least < steps * TIME_STEP < at_least + (back + 0.04) / process.speed_m_s


def test_without_a_slice_nothing_is_covered(surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    butter, bench, policy = prepared(surveys, stage, optimal)
    bench.scene.world.put(SLICE, (0.0, 0.0, -5.0))
    assert run(butter, bench, policy) is Status.FAILURE
    assert butter.reason.startswith("'butter at butter_applier' missed 9 of 9 cells of slice 1: [(0, 0), (0, 1), ")
    assert butter.covered == []


def test_another_slice_does_not_count(surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    butter, bench, policy = prepared(surveys, stage, optimal)
    butter.aim("slice 2")
    assert run(butter, bench, policy) is Status.FAILURE
    assert "of slice 2" in butter.reason


def test_a_shifted_slice_is_missed_in_part(surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    butter, bench, policy = prepared(surveys, stage, optimal)
    position, turn = bench.scene.world.pose(SLICE)
    bench.scene.world.put(SLICE, position + np.array([0.05, 0.0, 0.0]), turn)  # more than one cell to the right
    assert run(butter, bench, policy) is Status.FAILURE
    assert butter.reason.startswith("'butter at butter_applier' missed 3 of 9 cells of slice 1: [(0, 2), (1, 2), (2, 2)]")


def test_a_second_slice_is_buttered_afresh(surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    butter, bench, policy = prepared(surveys, stage, optimal)
    assert run(butter, bench, policy) is Status.SUCCESS
    bench.scene.world.put(SLICE, (0.0, 0.0, -5.0))
    assert run(butter, bench, policy) is Status.FAILURE
    assert butter.covered == []
