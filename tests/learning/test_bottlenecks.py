"""Bottlenecks of small graphs that can be checked by hand."""

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning import splitmix
from lab.learning.bottlenecks import METHODS, Experience, RecordedTable, bottlenecks
from lab.learning.environment import Step
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid

# two rooms of three cells, 0 1 2 and 4 5 6, each one move from the others, joined by the door 3 between 2 and 4
TWO_ROOMS = ((1, 2, 0), (0, 2, 1), (0, 1, 3), (2, 4, 3), (5, 6, 3), (4, 6, 5), (4, 5, 6))


def made_moves(rows: tuple[tuple[int, ...], ...]) -> Experience:
    """Every move made once."""
    experience = Experience(len(rows), len(rows[0]))
    experience.entered[:] = rows
    experience.counts[:] = 1
    return experience


def walked(mdp: TabularMDP, episodes: int = 60) -> Experience:
    """The moves of a learner alone."""
    experience = Experience(mdp.n_states, mdp.n_actions)
    learner = LearnerSettings(learner="q", episodes=episodes)
    place = RecordedTable(mdp, experience)
    Session(place, learner, GateSettings(gate="never"), None, splitmix.stream(1)).run()
    return experience


@pytest.mark.parametrize("method", METHODS)
def test_the_door_between_two_rooms_is_found(method: str) -> None:
    experience = made_moves(TWO_ROOMS)
    experience.paths = [[0, 2, 3, 4, 6], [1, 2, 3, 4, 5], [6, 4, 3, 2, 2, 0]]
    assert bottlenecks(experience, method) == [(3,)]


@pytest.mark.parametrize("method", METHODS)
def test_a_single_room_has_none(method: str) -> None:
    mdp = grid((3, 4), np.zeros((3, 4), bool), (0, 0), (2, 3))
    assert bottlenecks(walked(mdp), method) == []


@pytest.mark.parametrize("method", METHODS)
def test_the_doorway_of_a_grid_is_found_and_the_same_each_time(method: str) -> None:
    wall = np.zeros((5, 7), bool)
    wall[:, 3] = True
    wall[2, 3] = False
    mdp = grid((5, 7), wall, (0, 0), (4, 6), deadly=False)
    found = bottlenecks(walked(mdp), method)
    assert found == [(2 * 7 + 3,)]
    assert bottlenecks(walked(mdp), method) == found


def test_nothing_is_found_before_the_first_move() -> None:
    assert all(bottlenecks(Experience(4, 2), method) == [] for method in METHODS)


def test_an_unknown_method_is_named() -> None:
    with pytest.raises(BadInput, match=r"unknown method 'hexq'.*known: betweenness, paths, spectral"):
        bottlenecks(Experience(4, 2), "hexq")


def test_moves_are_counted_and_paths_kept_only_to_the_goal() -> None:
    experience = Experience(3, 1)
    experience.begins(0)
    experience.moved(0, 0, Step(-0.1, 1, False))
    experience.moved(1, 0, Step(1.5, 2, True, True))
    experience.begins(0)
    experience.moved(0, 0, Step(-0.1, 1, False))
    assert experience.entered.ravel().tolist() == [1, 2, -1]
    assert (experience.counts.ravel().tolist(), experience.moves) == ([2, 1, 0], 3)
    assert experience.paths == [[0, 1, 2]]


def test_where_an_episode_failed_is_no_way() -> None:
    experience = Experience(3, 2)
    experience.begins(0)
    experience.moved(0, 0, Step(-1.0, 2, True, False))
    experience.begins(0)
    experience.moved(0, 1, Step(-0.1, 1, False))
    assert experience.neighbours() == {0: {1}, 1: {0}}
