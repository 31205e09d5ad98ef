"""The worlds of the deep student: what is seen of a state, and the points of an episode."""

import numpy as np
import pytest

from lab_studies.comparisons.deep_student.places import POLE_SCALE, PoleEnvironment, place


def test_each_state_of_the_empty_room_is_seen_differently() -> None:
    here = place("empty")
    seen = np.array([here.sight.now(state) for state in range(here.benched.mdp.n_states)])
    assert seen.shape == (62, here.sight.width)
    assert set(seen.ravel().tolist()) == {0.0, 1.0}
    assert len(np.unique(seen, axis=0)) == 62


def test_points_are_100_for_the_shortest_path_and_0_for_a_failed_episode() -> None:
    here = place("empty")
    assert here.par == 7
    assert here.points([7, here.benched.learner.max_steps + 1]).tolist() == [100.0, 0.0]


def test_a_pole_is_seen_where_it_is_and_where_it_was() -> None:
    world = PoleEnvironment()
    state = world.reset(1, lambda: 0.75)  # each of its four numbers is 0.025
    start = np.full(4, 0.025) / POLE_SCALE
    assert world.now(state) == pytest.approx(start)
    entered = world.step(state, 1, lambda: 0.0).state
    assert world.left(state) == pytest.approx(start)
    assert world.now(entered)[1] > start[1]  # it was pushed to the right
    assert world.now(0) == pytest.approx(np.array(world.physics.bounds.centre(0)) / POLE_SCALE)
