"""The runs of a table's paths, held to the greedy paths themselves, and velocities by hand."""

from math import dist

import numpy as np
import pytest

from lab.control import ControlEnv
from lab.control.table_paths import GAIN, TablePaths
from lab.mdp import greedy_path, optimal_values
from lab.sim.arms.kinematics import ToolPose

GOAL = ToolPose(0.3, 0.5, 0.1, 0.0)
TOP_M = 0.15  # the height of the highest cells above the goal: 5 steps of 3 cm


@pytest.fixture(scope="module")
def paths(grasp: ControlEnv) -> TablePaths:
    return TablePaths(grasp.skill, optimal_values(grasp.skill.mdp, 0.99))


def test_runs_are_those_of_the_greedy_paths(grasp: ControlEnv, paths: TablePaths) -> None:
    mdp = grasp.skill.mdp
    q = optimal_values(mdp, 0.99)
    for state in np.flatnonzero(grasp.skill.free & ~mdp.goal)[::7].tolist():
        states, actions, _ = greedy_path(q, mdp, mdp.n_states, state)
        first = next((k for k, action in enumerate(actions) if action != actions[0]), len(actions))
        weighted = paths.poses[states] * [1.0, 1.0, 1.0, 0.15]
        assert paths.ends[state] == states[first]
        assert paths.left_m[state] == pytest.approx(sum(map(dist, weighted[:-1], weighted[1:])))


def test_a_policy_that_misses_the_goal_leaves_no_path(grasp: ControlEnv) -> None:
    mdp = grasp.skill.mdp
    stuck = TablePaths(grasp.skill, np.eye(mdp.n_actions)[np.zeros(mdp.n_states, int)])  # always to the left
    assert stuck.left_m[mdp.start] == np.inf
    assert np.isfinite(stuck.left_m[np.flatnonzero(mdp.goal)]).all()


def test_above_the_part_the_tool_goes_over_it_before_it_goes_down(paths: TablePaths) -> None:
    aside = paths.velocity(GOAL.shifted(0.04, -0.02, TOP_M + 0.05, 0.1), GOAL)
    assert aside[:2] == pytest.approx([-0.04 * GAIN, 0.02 * GAIN])
    assert aside[2:] == pytest.approx([0.0, -0.1 * GAIN])
    over = paths.velocity(GOAL.shifted(dz=TOP_M + 0.05), GOAL)
    assert over[:2] == pytest.approx([0.0, 0.0])
    assert over[2] < -0.3


def test_a_tool_that_has_strayed_rises_first(paths: TablePaths) -> None:
    """Beside the grid, and turned so far that the fingers would touch the part."""
    for tool in (GOAL.shifted(dx=0.1, dz=0.03), GOAL.shifted(dz=0.03, dyaw=0.5)):
        velocity = paths.velocity(tool, GOAL)
        assert velocity[2] > 0.3
        assert velocity[[0, 1, 3]] == pytest.approx([0.0, 0.0, 0.0])


def test_velocities_turn_with_the_goal(paths: TablePaths) -> None:
    """A goal that is turned by a quarter sees the same velocity turned by a quarter."""
    tool = GOAL.shifted(0.01, 0.02, TOP_M + 0.02)
    turned = GOAL.shifted(dyaw=np.pi / 2)
    x, y, z, _ = paths.velocity(tool, GOAL)
    other = paths.velocity(turned.local(0.01, 0.02, TOP_M + 0.02), turned)
    assert other[:3] == pytest.approx([-y, x, z])
