"""Episodes as records: whose actions they hold, and their names."""

import numpy as np
import pytest

from lab.control import ControlEnv, ScriptedTeacher, demonstrations, roll_out
from lab.errors import BadInput


def still(observation: object) -> np.ndarray:
    return np.array([0.0, 0.0, 0.0, 0.0, -1.0], np.float32)


def test_the_teacher_gives_the_steps_that_are_asked_for() -> None:
    env = ControlEnv(skill="grasp at plate", seconds=0.5)
    asked = iter([False, True, True, False, False])
    episode = roll_out(env, still, 3, teacher=lambda _: np.full(5, 0.1, np.float32), asks=lambda *_: next(asked))
    assert episode.takeovers() == [(1, 3)]
    assert (len(episode), episode.success, env.reason) == (5, False, "out of time")
    assert episode.actions[1] == pytest.approx(np.full(5, 0.1))
    assert np.array_equal(episode.extra["policy.action"], np.tile(still(None), (5, 1)))
    assert np.array_equal(episode.states[0], env.reset(seed=3)[0])
    env.close()


def test_pictures_are_recorded_by_camera() -> None:
    env = ControlEnv(skill="grasp at plate", observations="pictures", seconds=0.2)
    episode = roll_out(env, still, 0)
    assert {name: np.array([*shown]).shape for name, shown in episode.pictures.items()} == {
        "overhead": (2, 96, 96, 3),
        "hand": (2, 96, 96, 3),
    }
    assert episode.states.shape == (2, 7)
    env.close()


def test_demonstrations_are_those_of_their_seeds(grasp: ControlEnv) -> None:
    record = demonstrations(grasp, ScriptedTeacher(grasp), [4])
    assert (record.fps, record.robot, record.state_names) == (10, "up6", grasp.state_names)
    assert [episode.success for episode in record.episodes] == [True]
    assert not record.episodes[0].corrected.any()


def test_questions_need_a_teacher(grasp: ControlEnv) -> None:
    with pytest.raises(BadInput, match="without a teacher"):
        roll_out(grasp, still, 0, asks=lambda *_: True)
