"""Somebody's demonstrations of a skill: what is taken of them, and which are refused."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from lab.cloning.skill_problem import SkillProblem
from lab.errors import BadInput
from lab.recordings.episode import Episode, Recording


@pytest.fixture(scope="module")
def problem() -> Iterator[SkillProblem]:
    made = SkillProblem("toast", "grasp")
    yield made
    made.close()


@pytest.fixture
def shown(problem: SkillProblem) -> Recording:
    """Two episodes of somebody's, with a picture a step."""
    states = np.zeros((3, len(problem.env.state_names)), np.float32)
    actions = np.zeros((3, len(problem.env.action_names)), np.float32)
    pictures = {"wrist": [np.zeros((8, 8, 3), np.uint8)] * 3}
    episode = Episode("take it", states, actions, np.array([False, True, False]), True, pictures)
    return Recording(10, "another arm", problem.env.state_names, problem.env.action_names, [episode] * 2)


def test_the_numbers_and_marks_are_taken(problem: SkillProblem, shown: Recording) -> None:
    taken = problem.taken(shown, "mine")
    assert [episode.takeovers() for episode in taken.episodes] == [[(1, 2)], [(1, 2)]]
    assert not taken.episodes[0].pictures


def test_other_demonstrations_are_refused(problem: SkillProblem, shown: Recording) -> None:
    names = shown.state_names
    with pytest.raises(BadInput, match="mine: its states are x, "):
        problem.taken(replace(shown, state_names=("x", *names[1:])), "mine")
    with pytest.raises(BadInput, match=r"steps a second are 30: .* 10"):
        problem.taken(replace(shown, fps=30), "mine")
    narrow = [replace(episode, actions=np.zeros((3, 1), np.float32)) for episode in shown.episodes]
    with pytest.raises(BadInput, match=f"actions are go: .*, {', '.join(shown.action_names)}"):
        problem.taken(replace(shown, action_names=("go",), episodes=narrow), "mine")
    nothing = [replace(e, success=False, corrected=np.zeros(3, bool)) for e in shown.episodes]
    with pytest.raises(BadInput, match="all of its episodes failed"):
        problem.taken(replace(shown, episodes=nothing), "mine")
