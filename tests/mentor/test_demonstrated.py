"""The nearest demonstrated steps, against looking at all of them."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.mentor.demonstrated import Demonstrated
from lab.recordings.episode import Episode


@settings(max_examples=50, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 8),
    st.integers(1, 60),
    st.integers(1, 7),
    st.sampled_from([0.0, 0.1, 9.0]),
)
def test_the_nearest_steps_are_those_of_all(seed: int, d: int, n: int, count: int, away: float) -> None:
    """Numbers that hang together, as those of a robot do, on the way and off it."""
    rng = np.random.default_rng(seed)
    states = (rng.normal(size=(n, 2)) @ rng.normal(size=(2, d)) + rng.normal(0.0, 0.1, (n, d))).astype(np.float32)
    episode = Episode("move", states, np.zeros((n, 1), np.float32), np.zeros(n, bool))
    demonstrated = Demonstrated.of([episode], rng)
    state = demonstrated.standardized(states[0] + away * rng.normal(size=d))
    distances, numbers = demonstrated.near(state, count)
    apart = np.linalg.norm(demonstrated.states - state, axis=1)
    assert np.array_equal(distances, apart[numbers])
    np.testing.assert_allclose(distances, np.sort(apart)[:count], rtol=1e-9, atol=1e-9)
