"""A cart on a line that has to go from 0 to 1 in ten steps, and recordings of it."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from lab.recordings.episode import Episode, Recording

Run = Callable[..., Episode]


@pytest.fixture
def run() -> Run:
    """Makes an episode of the cart from its places; its actions are the ways to the next place."""

    def made(places: Sequence[float], success: bool | None = True, corrected: Sequence[int] = ()) -> Episode:
        states = np.array(places, np.float32)[:, None]
        actions = np.append(np.diff(states, axis=0), [[0.1]], axis=0).astype(np.float32)
        return Episode("go right", states, actions, np.isin(np.arange(len(states)), corrected), success)

    return made


@pytest.fixture
def straight(run: Run) -> Episode:
    """The cart goes to the end, a tenth a step."""
    return run([0.1 * step for step in range(11)])


@pytest.fixture
def recording(straight: Episode) -> Recording:
    """Three times the same way."""
    return Recording(10, "cart", ("x",), ("dx",), [straight] * 3)
