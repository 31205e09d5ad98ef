"""What a skill says of a state in words: every length as the simulator has it, every skill with words of its own."""

from collections.abc import Callable
from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.skills import SKILLS, Skill
from lab.skills.state_words import away_in_words, size_in_words
from lab.skills.surveys import Surveys

Make = Callable[[str], Skill]
NEAR = ("left", "right", "backward", "forward", "down", "up", "turn right", "turn left")


def test_a_state_is_as_far_from_the_goal_as_its_cells_are() -> None:
    by, steps = (-2, 2, 5, 1), (0.012, 0.012, 0.03, 0.06)
    said = away_in_words("The open fingers are", "where they close on the slice", by, NEAR, steps)
    assert said == (
        "The open fingers are 2.4 cm left of, 2.4 cm behind and 15 cm above where they close on the slice, "
        "turned 3 degrees to the left."
    )
    assert away_in_words("It is", "its place", (0, 0, 1), NEAR[:6], steps[:3]) == "It is 3 cm above its place."
    assert away_in_words("It is", "its place", (0, 0, 0), NEAR[:6], steps[:3]) == "It is at its place."


@given(st.floats(0.001, 2.0))
def test_a_length_is_told_to_a_millimetre(step: float) -> None:
    number, unit = size_in_words("left", step).split()
    assert unit == "cm"
    assert abs(float(number) / 100 - step) <= 0.0005 + 1e-9


@pytest.mark.parametrize("name", [name for name in SKILLS if name != "cover"])
def test_the_words_measure_what_the_poses_do(make: Make, surveys: Surveys, name: str) -> None:
    skill = make(name)
    skill.setup(surveys)
    mdp = skill.problem.mdp
    goal = skill.pose(int(np.flatnonzero(mdp.goal)[0]))
    for axis, step in enumerate(skill.cell_steps()):
        cell = np.array(mdp.state_cell(int(np.flatnonzero(mdp.goal)[0])))
        away = 1 if cell[axis] == 0 else -1
        cell[axis] += away
        pose = skill.pose(int(np.ravel_multi_index(tuple(cell), mdp.shape)))
        moved = hypot(pose.x - goal.x, pose.y - goal.y, pose.z - goal.z)
        assert step == pytest.approx(moved or abs(pose.yaw - goal.yaw))
        label = mdp.action_labels[2 * axis + (away > 0)]
        assert size_in_words(label, step) in skill.in_words(int(np.ravel_multi_index(tuple(cell), mdp.shape)))


@pytest.mark.parametrize("name", SKILLS)
def test_every_skill_has_words_of_its_own(make: Make, surveys: Surveys, name: str) -> None:
    skill = make(name)
    skill.setup(surveys)
    said = skill.in_words(skill.problem.mdp.start)
    assert said.endswith(".")
    assert not [word for word in ("its goal", "(", "_") if word in said]
    assert all(skill.moves_in_words())
    assert len(skill.moves_in_words()) == skill.problem.mdp.n_actions


def test_a_covered_cell_is_counted(make: Make, surveys: Surveys) -> None:
    skill = make("cover")
    skill.setup(surveys)
    mdp = skill.problem.mdp
    before, after = (skill.in_words(state) for state in (mdp.start, int(mdp.successor[mdp.start, 1])))
    for said, row, covered in ((before, 1, 1), (after, 2, 2)):
        assert f"row {row} from the top, column 1 from the left" in said
        assert f"; {covered} of 9 cells are covered" in said
