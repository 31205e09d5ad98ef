"""A skill is carried out once in physics: why it failed, and how long it took."""

from collections.abc import Callable
from typing import Any

import pytest

from lab.learning.problem import Problem
from lab.skills.prepared_scene import Prepared, prepare
from lab.skills.skillset import SkillSet
from lab.skills.trial import carry_out, trial_of, try_out
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


@pytest.mark.parametrize(
    "name",
    [
        "grasp sign on pallet at incoming",
        "place rook on pallet at lathe-1-in",
        "grasp sign at mill-in",  # off its pallet
        "place rook at lathe-1-out",  # onto its pallet
        "place sign at mill",
        "grasp pallet at mill-in",
        "vacuum at mill",
    ],
)
def test_every_skill_brings_what_it_is_tried_with(
    name: str, cells: dict[str, Any], optimal: Callable[[Problem], Policy]
) -> None:
    """Its part, and the pallet that the part stands on, or is to be set down on."""
    surveys, order = cells["fms-arm"].surveys, cells["fms-arm"].order
    skillset = SkillSet.of(surveys.task, order)
    problem = skillset.skills[name].setup(surveys)
    whole = Prepared(surveys.task, order, 0, surveys.layout, surveys, skillset, {name: problem})
    done = carry_out(whole, skillset.skills[name], optimal(problem))
    assert done.failure is None
    assert 1.0 < done.sim_s < 20.0


def test_only_what_is_said_to_be_tried_is_tried(
    prepared: Prepared, optimal: Callable[[Problem], Policy], clueless: Callable[[Problem], Policy]
) -> None:
    trial, problem = trial_of(prepared), prepared.problems[GRASP]
    assert trial(problem, optimal(problem)) is None
    assert "does not reach its goal" in str(trial(problem, clueless(problem)))
    transfer = next(s for s in prepared.skillset.skills.values() if s.subtask == "transfer").setup(prepared.surveys)
    assert trial(transfer, clueless(transfer)) is None
