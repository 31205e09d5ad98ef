"""Two levels over the door of two small rooms: regions, sub-problems, ways, and a task across both."""

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning import splitmix
from lab.learning.bottlenecks import Experience
from lab.learning.settings import LearnerSettings
from lab.learning.two_levels import APART, UNSEEN, TwoLevels, lesson, practised, regions, sub_problem
from lab.mdp import TabularMDP

# 0 1 2 D=3 4 5 6 in a row; the actions go left and right
LEFT_RIGHT = np.array([[max(0, n - 1), min(6, n + 1)] for n in range(7)])
NEAR = {n: {max(0, n - 1), min(6, n + 1)} - {n} for n in range(7)}
LEARNER = LearnerSettings(learner="q", alpha=0.95, beta=1.0, episodes=200, max_steps=50)


def row() -> TabularMDP:
    none = np.zeros(7, bool)
    return TabularMDP(LEFT_RIGHT, np.full((7, 2), -0.1), none, none, 0, ("left", "right"))


def levels(remembers: bool = False, experience: Experience | None = None, off_policy: bool = False) -> TwoLevels:
    return TwoLevels(row(), NEAR, [(3,)], experience or Experience(7, 2), LEARNER, remembers, off_policy)


def known() -> Experience:
    experience = Experience(7, 2)
    experience.entered[:] = LEFT_RIGHT
    return experience


def test_regions_are_what_the_bottlenecks_part() -> None:
    near = {state: others for state, others in NEAR.items() if state < 6}
    near[5] = {4}
    assert regions(7, near, [(3,)]).tolist() == [0, 0, 0, APART, 1, 1, UNSEEN]


def test_a_sub_problem_stays_inside() -> None:
    inside = np.array([True] * 3 + [False] * 4)
    sub = sub_problem(row(), inside, [3], [0, 2])
    assert sub.mdp.successor.tolist() == [[0, 1], [0, 2], [1, 3], [3, 3], [4, 4], [5, 5], [6, 6]]
    assert (np.flatnonzero(sub.mdp.goal).tolist(), sub.mdp.starts) == ([3], (0, 2))
    assert sub.mdp.reward[2].tolist() == [-0.1, 1.5]
    back = sub_problem(row(), inside, [0], [2])
    assert np.argwhere(back.walled)[:1].tolist() == [[2, 1]]  # the door is outside
    assert back.mdp.successor[2].tolist() == [1, 2]


def test_the_ways_lead_to_the_door_from_both_rooms() -> None:
    two = levels()
    episodes, moves = two.learn_ways(splitmix.stream(1))
    assert sorted(two.ways) == [(0, 0), (1, 0)]
    assert [two.ways[0, 0].walk(state) for state in (0, 1, 2)] == [3, 2, 1]
    assert [two.ways[1, 0].walk(state) for state in (4, 5, 6)] == [1, 2, 3]
    assert episodes > 0
    assert moves == two.experience.moves  # all were made in the rooms


def test_a_task_is_a_way_to_the_door_and_a_last_one() -> None:
    two = levels()
    two.learn_ways(splitmix.stream(1))
    path, last = two.solve(1, [6], splitmix.stream(2))
    assert path == [1, 2, 3, 4, 5, 6]
    assert last is not None
    assert last.moves >= last.episodes * (2 + 3)  # each episode also walks to the door


def test_a_task_in_one_room_uses_no_door() -> None:
    two = levels()
    two.learn_ways(splitmix.stream(1))
    assert two.solve(0, [2], splitmix.stream(2))[0] == [0, 1, 2]
    assert two.solve(2, [3], splitmix.stream(2))[0] == [2, 3]


def test_known_moves_need_no_lesson() -> None:
    two = levels(remembers=True, experience=known())
    assert two.learn_ways(splitmix.stream(1)) == (0, 0)
    path, last = two.solve(0, [5], splitmix.stream(2))
    assert (path, last is not None and last.episodes) == ([0, 1, 2, 3, 4, 5], 0)


def test_ways_learned_before_are_used_again() -> None:
    first = levels()
    first.learn_ways(splitmix.stream(1))
    again = TwoLevels(row(), NEAR, [(3,)], Experience(7, 2), LEARNER, before=first.by_signature())
    assert again.learn_ways(splitmix.stream(2)) == (0, 0)


def test_ways_are_learned_off_policy_from_whatever_was_moved() -> None:
    experience = known()
    experience.entered[0] = -1  # nothing was tried in the first cell
    two = levels(experience=experience, off_policy=True)
    assert two.learn_ways(splitmix.stream(1)) == (0, 0)
    assert {way: sorted(learned.starts) for way, learned in two.ways.items()} == {(0, 0): [1, 2], (1, 0): [4, 5, 6]}
    assert [two.ways[0, 0].walk(state) for state in (0, 1, 2)] == [np.inf, 2, 1]
    path, last = two.solve(1, [6], splitmix.stream(2))
    assert path == [1, 2, 3, 4, 5, 6]
    assert last is not None
    assert last.episodes > 0  # the last way is to a goal of its own
    assert two.solve(0, [6], splitmix.stream(2))[0] == []


def test_moves_made_later_make_more_ways() -> None:
    two = levels(off_policy=True)
    two.learn_ways(splitmix.stream(1))
    assert [sorted(way.starts) for way in two.ways.values()] == [[], []]
    two.experience.entered[:] = LEFT_RIGHT
    assert two.solve(0, [6], splitmix.stream(2))[0] == [0, 1, 2, 3, 4, 5, 6]


def test_a_last_way_is_learned_until_the_whole_path_is_good() -> None:
    sub = sub_problem(row(), np.ones(7, bool), [6], [0, 5])
    q0 = np.where([[0, 1]] * 7, [[0.0, 1.0]], 0.0)
    q0[0] = [1.0, 0.0]  # from the first cell it goes against the wall
    approach = {0: 9, 5: 2}
    assert lesson(sub, LEARNER, Experience(7, 2), splitmix.stream(1), q0, approach, enough=3).episodes == 0
    assert lesson(sub, LEARNER, Experience(7, 2), splitmix.stream(1), q0, approach, enough=2).episodes > 0


def test_nothing_leads_to_a_goal_that_nobody_has_seen() -> None:
    near = {state: others for state, others in NEAR.items() if state < 6} | {5: {4}}
    two = TwoLevels(row(), near, [(3,)], Experience(7, 2), LEARNER)
    two.learn_ways(splitmix.stream(1))
    assert two.solve(0, [6], splitmix.stream(2)) == ([], None)
    with pytest.raises(BadInput, match="no known move leads to the states"):
        two.problem(1, [6])


def test_practised_values_are_optimistic_where_nothing_is_known() -> None:
    sub = sub_problem(row(), np.ones(7, bool), [6], [0])
    assert practised(sub, Experience(7, 2), 0.9)[:6].tolist() == [[1.5, 1.5]] * 6
    values = practised(sub, known(), 0.9)
    assert values[5].tolist() == [pytest.approx(-0.1 + 0.9 * (-0.1 + 0.9 * 1.5)), 1.5]


def test_the_same_seed_gives_the_same_lesson() -> None:
    sub = sub_problem(row(), np.ones(7, bool), [6], [0, 1, 2])
    first, second = (lesson(sub, LEARNER, Experience(7, 2), splitmix.stream(5)) for _ in range(2))
    assert (first.episodes, first.moves, first.q.tolist()) == (second.episodes, second.moves, second.q.tolist())
