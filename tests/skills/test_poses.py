"""Where a state of a skill's problem is in the cell: one truth for the motion and for whoever shows the lesson."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lab.learning.problem import Problem
from lab.mdp import greedy_path
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME as ROBOT
from lab.skills import SKILLS, Skill, Transfer
from lab.skills.skill import Bench, Status
from lab.skills.surveys import Surveys
from lab.toolbox.policy import Policy

Make = Callable[[str], Skill]
Stage = Callable[..., Bench]
CellOf = Callable[[str], Any]
PolicyOf = Callable[[Problem], Policy]
SLICE = "slice 1"
# [m] corners are rounded
WITHIN = {"transfer": 0.12, "grasp": 0.008, "insert": 0.003, "cover": 0.002, "place": 0.008}
every_skill = pytest.mark.parametrize(
    "name",
    [
        *SKILLS,
        "fms-arm: grasp sign on pallet at incoming",
        "fms-arm: place sign at mill-out",
        "fms-arm: vacuum at mill",
        "breakfast: place cup at tray",
    ],
)


def free_states(problem: Problem) -> list[int]:
    return [int(state) for state in np.flatnonzero(~problem.mdp.terminal | problem.mdp.goal)]


def found(skill: Skill, bench: Bench) -> ToolPose:
    """Where the skill's tool is in physics: the arm's, or the machine's head."""
    if skill.moves_arm:
        return bench.scene.robot.tool()
    (x, y, z), _ = bench.scene.world.pose(skill.station, "head")
    return ToolPose(float(x), float(y), float(z))


def apart(one: ToolPose, other: ToolPose) -> float:
    return float(np.linalg.norm(np.subtract((one.x, one.y, one.z), (other.x, other.y, other.z))))


@every_skill
def test_shown_in_any_free_state_the_tool_is_at_its_pose(name: str, make: Make, cell_of: CellOf, stage: Stage) -> None:
    skill = make(name)
    problem = skill.setup(cell_of(name).surveys)
    bench = stage(skill)
    for state in free_states(problem):
        assert skill.show(bench, state)
        at, pose = found(skill, bench), skill.pose(state)
        assert apart(at, pose) < 1e-6
        assert at.yaw == pytest.approx(pose.yaw, abs=1e-6)
        if skill.carries:
            held = bench.part_pose(str(bench.held), pose.yaw)
            assert (held.x, held.y, held.z, held.yaw) == pytest.approx((pose.x, pose.y, pose.z, pose.yaw), abs=1e-6)


@every_skill
def test_the_motion_goes_through_the_poses_of_the_learned_states(
    name: str, make: Make, cell_of: CellOf, stage: Stage, optimal: PolicyOf
) -> None:
    skill = make(name)
    problem = skill.setup(cell_of(name).surveys)
    bench = stage(skill)
    policy = optimal(problem)
    skill.start(bench, policy)
    way = []
    while skill.step() is Status.RUNNING:
        bench.scene.world.step()
        way.append(found(skill, bench))
    assert skill.status is Status.SUCCESS, skill.reason
    states, _, _ = greedy_path(policy.q, problem.mdp, 500)
    if name == "transfer":
        states = states[-1:]  # the others it may go straight past
    for state in states if not problem.mdp.starts else states[-3:]:  # from above it begins where the tool is
        assert min(apart(skill.pose(state), at) for at in way) < WITHIN[skill.subtask]


def test_out_of_reach_nothing_moves(surveys: Surveys, stage: Stage) -> None:
    skill = Transfer("plate", "toaster_buffer", "slice")
    mdp = skill.setup(surveys).mdp
    bench = stage(skill)
    assert skill.show(bench, mdp.start)
    tool, held = bench.scene.robot.tool(), bench.part_pose(SLICE)
    far = [state for state in range(mdp.n_states) if arm_named("up6").inverse(skill.pose(state)) is None]
    assert far
    assert all(mdp.terminal[state] for state in far)
    assert not any(skill.show(bench, state) for state in far)
    assert (bench.scene.robot.tool(), bench.part_pose(SLICE)) == (tool, held)


def test_around_another_slice_the_poses_are_that_much_away(make: Make, surveys: Surveys) -> None:
    """A slice 2 cm to the right of the spot and turned by a quarter: the slice's own x axis is the world's y axis."""
    for name in ("grasp", "place"):
        skill = make(name)
        mdp = skill.setup(surveys).mdp
        goal = skill.pose(int(np.flatnonzero(mdp.goal)[0]))
        there = goal.shifted(dx=0.02, dyaw=np.pi / 2)
        beside = int(np.ravel_multi_index((3, 2, 1, 2)[: len(mdp.shape)], mdp.shape))  # a step right, a step up
        pose = skill.pose(beside, there)  # type: ignore[call-arg]
        assert (pose.x - there.x, pose.y - there.y, pose.z - there.z) == pytest.approx((0.0, 0.012, 0.030))
        assert pose.yaw == pytest.approx(goal.yaw + np.pi / 2)


def test_the_head_stands_before_the_cell_that_it_butters(surveys: Surveys, stage: Stage, make: Make) -> None:
    butter = make("cover")
    mdp = butter.setup(surveys).mdp
    bench = stage(butter)
    (x, y, z), _ = bench.scene.world.pose(SLICE)
    third = 0.120 / 3
    for row, column in np.ndindex(3, 3):
        state = (row * 3 + column) << 9
        assert mdp.state_cell(state) == (row, column)
        pose = butter.pose(state)
        assert (pose.x, pose.z) == pytest.approx((x + (column - 1) * third, z + (1 - row) * third), abs=2e-3)
        assert pose.y < y - 0.1
    assert bench.scene.world.joints(ROBOT, ("joint_s",))[0] == 0.0  # the arm has no part in it
