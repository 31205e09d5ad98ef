"""Episodes of a policy in a control environment, with a teacher who may take over, as records."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.control.control_env import ControlEnv
from lab.control.scripted_teacher import ScriptedTeacher
from lab.errors import BadInput
from lab.recordings.episode import Episode, Recording

Action = NDArray[np.float32]
Policy = Callable[[Any], Action]  # from an observation to an action (d,)
Asks = Callable[
    [Any, Action], bool
]  # from an observation and the policy's action: whether the teacher gives this step's action


def roll_out(
    env: ControlEnv, policy: Policy, seed: int, *, teacher: Policy | None = None, asks: Asks | None = None
) -> Episode:
    """The episode of a policy from the start of a seed.

    asks: before each step, whether the teacher takes over for it; the policy is asked in any case. The recorded actions are the
    commanded ones, before any disturbance of the environment. extra: "next.reward"; "policy.action", what the policy would have
    done. With pictures observed, they are recorded by camera. Raises BadInput for `asks` without a teacher.
    """
    if asks is not None and teacher is None:
        raise BadInput("roll_out: asks was given without a teacher: wanted both, or none")
    observation, info = env.reset(seed=seed)
    observed, actions, own, corrected, rewards = (
        list[Any](),
        list[Action](),
        list[Action](),
        list[bool](),
        list[float](),
    )
    ended = False
    while not ended:
        action = chosen = np.asarray(policy(observation), np.float32)
        asked = asks is not None and asks(observation, chosen)
        if asked and teacher is not None:
            action = np.asarray(teacher(observation), np.float32)
        observed.append(observation)
        actions.append(action)
        own.append(chosen)
        corrected.append(asked)
        observation, reward, terminated, truncated, info = env.step(action)
        rewards.append(reward)
        ended = terminated or truncated
    by_pictures = isinstance(observed[0], dict)
    states = np.array([step["state"] if by_pictures else step for step in observed], np.float32)
    cameras = [name for name in observed[0] if name != "state"] if by_pictures else []
    return Episode(
        env.skill.skill.name,
        states,
        np.array(actions, np.float32),
        np.array(corrected, bool),
        bool(info["is_success"]),
        {name: [step[name] for step in observed] for name in cameras},
        {"next.reward": np.array(rewards, np.float32), "policy.action": np.array(own, np.float32)},
    )


def demonstrations(env: ControlEnv, teacher: ScriptedTeacher, seeds: Iterable[int]) -> Recording:
    """The episodes of a teacher from the starts of some seeds, failures among them; none of their steps counts as corrected."""
    return recording(env, [roll_out(env, teacher, seed) for seed in seeds])


def recording(env: ControlEnv, episodes: Sequence[Episode]) -> Recording:
    """Episodes of an environment with its names and its steps a second."""
    return Recording(
        env.metadata["render_fps"], env.skill.task.robot.model, env.state_names, env.action_names, episodes
    )
