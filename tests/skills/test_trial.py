"""A skill is carried out once in physics: why it failed, and how long it took."""

from collections.abc import Callable

import pytest

from lab.learning.problem import Problem
from lab.skills.prepared_scene import Prepared, prepare
from lab.skills.trial import carry_out, try_out
from lab.tasks.task import Task
from lab.toolbox.policy import Policy

GRASP = "grasp at plate"


@pytest.fixture(scope="module")
def prepared(task: Task) -> Prepared:
    return prepare(task, ("slice", "slice"), 0, GRASP)


def test_it_says_whether_it_worked_and_how_long_it_took(
    prepared: Prepared, optimal: Callable[[Problem], Policy], clueless: Callable[[Problem], Policy]
) -> None:
    skill, problem = prepared.skillset.skills[GRASP], prepared.problems[GRASP]
    done = carry_out(prepared, skill, optimal(problem))
    assert done.failure is None
    assert 1.0 < done.sim_s < 20.0
    failed = carry_out(prepared, skill, clueless(problem))
    assert failed.failure == try_out(prepared, skill, clueless(problem))
    assert failed.failure is not None
    assert "does not reach its goal" in failed.failure


def test_a_slice_off_its_spot_is_followed_until_it_is_out_of_reach(
    prepared: Prepared, optimal: Callable[[Problem], Policy]
) -> None:
    skill, policy = prepared.skillset.skills[GRASP], optimal(prepared.problems[GRASP])
    near = carry_out(prepared, skill, policy, (0.02, 0.006, 0.12))
    assert near.failure is None
    assert near.sim_s != carry_out(prepared, skill, policy).sim_s
    far = carry_out(prepared, skill, policy, (0.0, 3.0, 0.0))
    assert far.failure is not None
    assert "slice 1 is out of reach" in far.failure
