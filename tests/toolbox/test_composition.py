"""Ways composed of shorter ones, on rows of cells that can be checked by hand."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lab.learning.environment import Judged
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, greedy_path
from lab.toolbox.composition import composed
from lab.toolbox.policy import Origin, Policy

WEST, EAST = range(2)


def row(start: int, goal: int, blocked: Sequence[int] = ()) -> TabularMDP:
    """The cells 0 to 6 in a row: from one to another, without the blocked ones."""
    successor = np.array([[max(0, n - 1), min(6, n + 1)] for n in range(7)], np.int32)
    ends, goals = np.zeros(7, bool), np.arange(7) == goal
    ends[[goal, *blocked]] = True
    successor[ends] = np.flatnonzero(ends)[:, None]
    reward = np.where(goals[successor], 1.5, -0.1)
    reward[ends] = 0.0
    return TabularMDP(successor, reward, ends, goals, start, ("west", "east"))


def made(name: str, mdp: TabularMDP, moves: Sequence[tuple[int, int]]) -> Policy:
    """A policy that has made these moves, each once."""
    visits = np.zeros((7, 2), np.int64)
    for state, action in moves:
        visits[state, action] = 1
    result = SessionResult.of_table(np.zeros((7, 2)), visits, Judged(3, 3, True))
    return Policy.of(result, mdp, LearnerSettings(), GateSettings(), Origin(name, "way", "floor", "nobody", 0))


TO_DOOR = made("to the door", row(0, 3), [(0, EAST), (1, EAST), (2, EAST)])
FROM_DOOR = made("from the door", row(3, 6), [(3, EAST), (4, EAST), (5, EAST)])


def test_two_ways_that_meet_at_a_door_make_a_longer_one() -> None:
    composition = composed([TO_DOOR, FROM_DOOR], row(1, 5))
    assert composition is not None
    assert [(part.name, moves) for part, moves in composition.parts] == [("to the door", 2), ("from the door", 2)]
    assert composition.reason == "a path by 'to the door' (2 moves), then 'from the door' (2 moves)"
    assert greedy_path(composition.q, row(1, 5), 10)[0] == [1, 2, 3, 4, 5]
    assert composition.visits.tolist() == [[0, 1]] * 5 + [[0, 0]] * 2  # nothing is done in the goal


def test_a_way_that_nobody_has_made_is_missing() -> None:
    composition = composed([TO_DOOR, FROM_DOOR], row(5, 1))
    assert composition is not None
    assert (composition.parts, composition.reason) == ((), "the moves of others, which do not lead to the goal yet")


def test_a_detour_is_taken_only_where_there_is_no_shorter_way() -> None:
    back = made("back", row(6, 0), [(2, WEST), (1, WEST), (1, EAST), (2, EAST), (3, EAST)])
    composition = composed([back], row(2, 4))
    assert composition is not None
    assert composition.parts == ((back, 2),)


def test_where_something_is_in_the_way_now_or_was_then_no_move_counts() -> None:
    for then, now in (
        (TO_DOOR, row(1, 4, blocked=[2])),
        (made("past", row(0, 4, blocked=[2]), [(1, EAST)]), row(1, 4)),
    ):
        assert composed([FROM_DOOR, then], now) is not None
        composition = composed([then], now)
        assert composition is None or composition.visits[1, EAST] == 0


def test_there_is_none_of_no_policy_of_another_table_or_for_several_starts() -> None:
    several = replace(row(1, 5), starts=(1, 2))
    other = replace(TO_DOOR, action_labels=("left", "right"))
    assert [composed([], row(1, 5)), composed([other], row(1, 5)), composed([TO_DOOR], several)] == [None] * 3


def test_the_same_policies_make_the_same_table_in_any_order() -> None:
    one, other = composed([TO_DOOR, FROM_DOOR], row(1, 5)), composed([FROM_DOOR, TO_DOOR], row(1, 5))
    assert one is not None
    assert other is not None
    assert one.q.tobytes() == other.q.tobytes()
    assert one.parts == other.parts
