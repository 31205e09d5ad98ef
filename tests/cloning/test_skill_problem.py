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
    rng = np.random.default_rng(4)
    states = rng.uniform(size=(3, len(problem.env.state_names))).astype(np.float32)
    actions = rng.uniform(size=(3, len(problem.env.action_names))).astype(np.float32)
    pictures = {"wrist": [np.zeros((8, 8, 3), np.uint8)] * 3}
    episode = Episode(
        "take it", states, actions, np.array([False, True, False]), True, pictures, {"next.reward": states[:, 0]}
    )
    return Recording(10, "another arm", problem.env.state_names, problem.env.action_names, [episode] * 2)


def test_the_numbers_and_marks_are_taken(problem: SkillProblem, shown: Recording) -> None:
    taken = problem.taken(shown, "mine")
    assert [episode.takeovers() for episode in taken.episodes] == [[(1, 2)], [(1, 2)]]
    assert not taken.episodes[0].pictures
    assert not taken.episodes[0].extra
    assert np.array_equal(taken.episodes[0].states, shown.episodes[0].states)
    assert np.array_equal(taken.episodes[0].actions, shown.episodes[0].actions)
    assert taken.robot != shown.robot


def test_other_demonstrations_are_refused(problem: SkillProblem, shown: Recording) -> None:
    first, second, *rest = shown.state_names
    with pytest.raises(BadInput, match=f"mine: its states have '{second}': wanted '{first}' there"):
        problem.taken(replace(shown, state_names=(second, first, *rest)), "mine")
    with pytest.raises(BadInput, match="30 steps a second: wanted 10"):
        problem.taken(replace(shown, fps=30), "mine")
    narrow = [replace(episode, actions=np.zeros((3, 1), np.float32)) for episode in shown.episodes]
    with pytest.raises(BadInput, match=f"actions have 'nothing more': wanted '{shown.action_names[1]}'"):
        problem.taken(replace(shown, action_names=shown.action_names[:1], episodes=narrow), "mine")
    other = [replace(episode, task="place at toaster_buffer") for episode in shown.episodes]
    with pytest.raises(BadInput, match="'place at toaster_buffer': wanted 'grasp at plate'"):
        problem.taken(replace(shown, episodes=other), "mine")
    nothing = [replace(e, success=False, corrected=np.zeros(3, bool)) for e in shown.episodes]
    with pytest.raises(BadInput, match="shows nothing"):
        problem.taken(replace(shown, episodes=nothing), "mine")
    with pytest.raises(BadInput, match="shows nothing"):
        problem.taken(replace(shown, episodes=[]), "mine")
