"""The teacher: it reaches the goal of each skill, from starts and from where others have strayed to."""

import numpy as np
import pytest

from lab import teach
from lab.control import ENVIRONMENTS, ControlEnv, ScriptedTeacher, roll_out
from lab.errors import BadInput


@pytest.mark.parametrize("skill", ENVIRONMENTS.values())
def test_the_teacher_succeeds(skill: str) -> None:
    env = ControlEnv(skill=skill)
    assert roll_out(env, ScriptedTeacher(env), 1).success
    env.close()


def test_the_teacher_commands_joints_too() -> None:
    env = ControlEnv(skill="place at finished_plate", actions="joints")
    assert roll_out(env, ScriptedTeacher(env), 1).success
    env.close()


@pytest.mark.parametrize("skill", ["grasp at plate", "insert at toaster"])
def test_the_teacher_takes_over_after_others_have_strayed(skill: str) -> None:
    env = ControlEnv(skill=skill)
    (_, _), rng, teacher, ended = env.reset(seed=2), np.random.default_rng(2), ScriptedTeacher(env), False
    keeps = 1.0 if env.closes else -1.0
    for _ in range(12):
        env.step(np.append(rng.uniform(-1.0, 1.0, 4), keeps).astype(np.float32))
    info: dict[str, object] = {}
    while not ended:
        _, _, terminated, truncated, info = env.step(teacher(None))
        ended = terminated or truncated
    assert info["is_success"]
    env.close()


def test_a_policy_of_another_problem_is_refused(grasp: ControlEnv) -> None:
    other = teach("world-1", seed=1, episodes=1).policy
    with pytest.raises(BadInput, match="was learned for another problem"):
        ScriptedTeacher(grasp, other)
