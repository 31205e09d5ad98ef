"""A point that has to go along a line to 1: a world in which a student, a teacher and a mentor fit into a test."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lab.recordings.episode import Episode, Recording

RollOut = Callable[..., Episode]
MOST = 40


def straight_on(observation: Any) -> np.ndarray:
    """The teacher: towards 1."""
    return np.asarray(np.clip((1.0 - np.asarray(observation)[:1]) * 20.0, -1.0, 1.0), np.float32)


def rolled_out(policy: Any, seed: int, *, asks: Any = None, teacher: Any = straight_on) -> Episode:
    """An episode from a place between 0 and 0.5; a step is at most 0.05, with noise. It ends within 0.03 of 1."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(0.0, 0.5)
    states, actions, corrected = list[Any](), list[Any](), list[bool]()
    while len(states) < MOST and abs(x - 1.0) > 0.03:
        observation = np.array([x], np.float32)
        action = np.asarray(policy(observation), np.float32)
        taken = bool(asks is not None and asks(observation, action))
        if taken:
            action = teacher(observation)
        states.append(observation)
        actions.append(action)
        corrected.append(taken)
        x += 0.05 * float(np.clip(action[0], -1.0, 1.0)) + rng.normal(0.0, 0.005)
    return Episode("go", np.array(states), np.array(actions), np.array(corrected), abs(x - 1.0) <= 0.03)


@pytest.fixture
def roll_out() -> RollOut:
    return rolled_out


@pytest.fixture
def shown() -> Recording:
    """Two demonstrations by the teacher."""
    return Recording(10, "point", ("x",), ("speed",), [rolled_out(straight_on, seed) for seed in (1, 2)])
