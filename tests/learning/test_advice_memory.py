"""What is remembered, by hand: where moves led, the way, trust, showings, practice."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.learning import advice_memory as memory
from lab.learning.advice_memory import (
    ASKED,
    LOSS,
    MOST,
    NOTHING,
    NOWHERE,
    OWN,
    PRACTISED,
    START,
    UNKNOWN,
    Memory,
    Recall,
)
from lab.learning.session_events import AdviceEnded, AdviceRemembered
from lab.mdp import distances

STATES, GOAL, PIT = 10, 8, 9  # states 0..9; an action leads to the state of its number
EPISODES, WINDOW = 20, 2  # the last 15 %: episodes 17 to 19, and 20 is the very last


def fresh() -> Memory:
    return memory.blank(STATES, STATES, 30)


def goes(kept: Memory, state: int, entered: int, source: int, action: int | None = None) -> None:
    """A move by the action of the entered state's number, or by another."""
    number = state * STATES + (entered if action is None else action)
    memory.moved(kept, memory.RememberedMove(number, source, entered, entered >= GOAL, entered == GOAL))


def walk(kept: Memory, episode: int, moves: list[tuple[int, int]], gate: bool = True) -> bool:
    """An episode from state 0 of such moves (state entered, source); whether it was open."""
    is_open = memory.opens(kept, episode, EPISODES, WINDOW, gate)
    if memory.starts(kept, 0):
        memory.plan(kept, 0)
    state = 0
    for entered, whose in moves:
        goes(kept, state, entered, whose)
        state = entered
    memory.ended(kept, len(moves), state == GOAL, sum(whose == ASKED for _, whose in moves))
    return is_open


def straight(states: list[int], source: int) -> list[tuple[int, int]]:
    return [(state, source) for state in states]


def way(kept: Memory, start: int = 0) -> list[int]:
    """The states of the way that is planned from a state."""
    memory.plan(kept, start)
    states = [start]
    while kept.now.best < UNKNOWN and states[-1] != GOAL:
        states.append(kept.path[states[-1]])
    return states


def test_an_advised_move_to_a_new_place_earns_a_quarter_up_to_three_points() -> None:
    kept = fresh()
    walk(kept, 1, straight([1, 2], ASKED))
    assert kept.now.trust == START + 2
    walk(kept, 2, straight([3, 4], OWN))
    assert kept.now.trust == START + 2
    for episode in range(3, 9):
        walk(kept, episode, straight([1, 2, 3], ASKED))
    assert kept.now.trust == MOST


def test_a_loop_with_an_advised_move_costs_a_point() -> None:
    kept = fresh()
    walk(kept, 1, [(1, ASKED), (2, ASKED), (3, OWN), (1, OWN)])
    assert (kept.now.trust, kept.now.at, kept.now.loops) == (START + 2 - LOSS, 1, 1)


def test_staying_in_place_is_a_loop() -> None:
    kept = fresh()
    walk(kept, 1, [(1, ASKED), (1, ASKED)])
    assert kept.now.trust == START + 1 - LOSS


def test_a_loop_of_own_moves_proves_nothing() -> None:
    kept = fresh()
    walk(kept, 1, [(1, ASKED), (2, OWN), (1, OWN)])  # the advised move is before the loop, not in it
    assert (kept.now.trust, kept.now.loops) == (START + 1, 0)


def test_a_loop_is_one_on_the_way_that_is_left_when_earlier_loops_are_cut_out() -> None:
    kept = fresh()
    walk(kept, 1, [(1, OWN), (2, OWN), (1, OWN), (2, ASKED)])  # 2 was cut out: it is new again
    assert (kept.now.at, kept.now.trust) == (2, START + 1)


@pytest.mark.parametrize(("source", "lost"), [(ASKED, LOSS), (OWN, 0)])
def test_a_crash_by_an_advised_move_costs_a_point(source: int, lost: int) -> None:
    kept = fresh()
    walk(kept, 1, [(1, OWN), (PIT, source)])
    assert kept.now.trust == START - lost


def test_below_0_nobody_is_asked_again() -> None:
    kept = fresh()
    for episode in (1, 1 + WINDOW):
        assert walk(kept, episode, [(PIT, ASKED)])
    assert kept.now.trust == START - 2 * LOSS
    assert not walk(kept, 1 + 2 * WINDOW, [])


def test_the_way_is_put_together_from_different_walks() -> None:
    kept = fresh()
    assert way(kept) == [0]
    walk(kept, 1, [(1, OWN), (2, OWN), (3, ASKED), (GOAL, OWN)])
    assert way(kept) == [0, 1, 2, 3, GOAL]
    walk(kept, 2, [(4, OWN), (5, OWN), (6, OWN), (3, OWN), (PIT, OWN)])  # it failed, and 3 was reached as late
    walk(kept, 3, [(5, OWN), (2, OWN), (6, OWN), (2, OWN)])
    assert way(kept) == [0, 1, 2, 3, GOAL]
    walk(kept, 4, [(5, OWN), (4, OWN), (0, OWN), (6, OWN)])
    assert way(kept) == [0, 6, 3, GOAL]  # 6 to 3 from the second walk, 3 to the goal from the first
    assert (kept.now.best, kept.path[6], kept.path[1]) == (3, 3, NOTHING)


def test_a_move_that_led_to_different_places_belongs_to_no_way() -> None:
    kept = fresh()
    walk(kept, 1, straight([1, GOAL], OWN))
    walk(kept, 2, straight([2, 3, GOAL], OWN))
    memory.opens(kept, 3, EPISODES, WINDOW, False)
    memory.starts(kept, 0)
    goes(kept, 0, 1, OWN)
    goes(kept, 1, 1, OWN, GOAL)  # this time it slipped
    assert kept.led[1 * STATES + GOAL] == NOWHERE
    assert way(kept) == [0, 2, 3, GOAL]
    goes(kept, 1, GOAL, OWN)
    assert way(kept) == [0, 2, 3, GOAL]  # and it stays so


def test_one_clean_showing_is_enough() -> None:
    kept = fresh()
    assert walk(kept, 1, straight([1, GOAL], ASKED))
    assert not any(walk(kept, episode, straight([1, GOAL], OWN)) for episode in range(2, EPISODES + 1))


LOOPING = [(1, ASKED), (1, ASKED), (2, ASKED), (3, ASKED), (4, ASKED), (GOAL, ASKED)]
MISSING = [(1, ASKED), (2, OWN), (PIT, OWN)]


@pytest.mark.parametrize("showing", [LOOPING, MISSING])
def test_another_showing_is_asked_for_k_episodes_later_three_in_all(showing: list[tuple[int, int]]) -> None:
    kept = fresh()
    opened = [episode for episode in range(1, 12) if walk(kept, episode, showing if episode in (1, 3, 5) else [])]
    assert opened == [1, 3, 5]
    again = fresh()
    walk(again, 1, showing)
    walk(again, 3, straight([1, GOAL], ASKED))
    assert not walk(again, 5, [])


def test_an_open_episode_without_advice_is_no_showing() -> None:
    kept = fresh()
    assert walk(kept, 1, straight([1, GOAL], OWN))
    assert walk(kept, 2, [])


def test_the_gate_has_the_first_word_and_nobody_is_asked_in_the_last_15_percent() -> None:
    kept = fresh()
    assert not walk(kept, 1, [], gate=False)
    assert walk(kept, 16, [])
    assert kept.now.late == 0
    for episode in (17, EPISODES):
        assert not walk(kept, episode, [])
        assert kept.now.late == 1


def practised(kept: Memory, own: list[int]) -> list[int]:
    """The late episodes that practise, when all that is the learner's own goes over these states."""
    found = []
    for episode in range(17, EPISODES + 1):
        memory.opens(kept, episode, EPISODES, WINDOW, True)
        if memory.starts(kept, 0):
            memory.plan(kept, 0)
        practises = kept.now.practices > 0
        found += [episode] * practises
        states = [0]
        while states[-1] != GOAL:
            entered = kept.path[states[-1]] if practises else own[len(states) - 1]
            goes(kept, states[-1], entered, PRACTISED if practises else OWN)
            states.append(entered)
        memory.ended(kept, len(states) - 1, True, 0)
    return found


def test_the_way_is_practised_late_while_its_own_last_result_is_longer() -> None:
    kept = fresh()
    walk(kept, 1, straight([1, GOAL], OWN))  # a way of two moves
    walk(kept, 2, straight([1, 2, 3, GOAL], OWN))  # and then a longer walk
    assert practised(kept, [1, 2, 3, GOAL]) == [17, 18]  # as often as the way has moves; then it tries alone twice
    assert (kept.now.best, kept.now.practised) == (2, 0)


def test_after_a_try_that_was_too_long_it_plans_and_practises_again() -> None:
    kept = fresh()
    walk(kept, 1, straight([1, 2, 3, GOAL], OWN))
    walk(kept, 2, straight([4, GOAL], OWN))  # as good as the way: 17 is tried alone
    assert practised(kept, [5, 6, 3, GOAL]) == [18, 19]


def test_a_learner_that_does_as_well_as_the_way_does_not_practise() -> None:
    kept = fresh()
    walk(kept, 1, straight([1, GOAL], OWN))
    assert practised(kept, [1, GOAL]) == []


def test_nothing_is_practised_before_a_way_is_known() -> None:
    kept = fresh()
    walk(kept, 17, [(1, OWN), (2, OWN)])
    assert (kept.now.practices, kept.now.best) == (-1, UNKNOWN)  # planned anew in the next one


def test_a_way_that_is_found_late_counts_at_once() -> None:
    kept = fresh()
    walk(kept, 17, [(1, OWN), (2, OWN)])  # no way is known yet
    walk(kept, 18, straight([1, 2, 3, GOAL], OWN))
    memory.opens(kept, 19, EPISODES, WINDOW, False)
    assert memory.starts(kept, 0)
    assert way(kept) == [0, 1, 2, 3, GOAL]
    assert kept.now.practices == 0  # its last result was as short


def test_another_session_begins_with_nothing() -> None:
    kept = fresh()
    walk(kept, 1, [(1, ASKED), (1, ASKED), (GOAL, ASKED)])
    memory.plan(kept, 0)
    memory.clear(kept)
    assert (set(kept.led), set(kept.path), set(kept.on_walk)) == ({NOTHING}, {NOTHING}, {0})
    assert (kept.now.trust, kept.now.best, kept.now.showings, kept.now.practices) == (START, UNKNOWN, 0, -1)


@given(st.lists(st.lists(st.tuples(st.integers(0, 9), st.integers(OWN, ASKED)), max_size=25), max_size=8))
def test_whatever_happens_a_walk_has_no_repeats_and_the_way_is_the_shortest_known(
    episodes: list[list[tuple[int, int]]],
) -> None:
    kept = fresh()
    successor = np.tile(np.arange(STATES, dtype=np.int32)[:, None], (1, STATES))  # a move not made leads nowhere
    for number, moves in enumerate(episodes, start=1):
        over = next((n for n, (entered, _) in enumerate(moves) if entered >= GOAL), len(moves))
        walk(kept, number, moves[: over + 1])
        states = [0, *(entered for entered, _ in moves[: over + 1])]
        for left, entered in pairwise(states):
            successor[left, entered] = entered
        on_walk = list(kept.walk[: kept.now.at + 1])
        assert len(set(on_walk)) == len(on_walk)
        assert on_walk[0] == 0
        assert kept.now.trust <= MOST
        shortest = int(distances(successor, np.arange(STATES) >= GOAL, 0)[GOAL])
        found = way(kept)
        assert (len(found) - 1, kept.now.best) == ((shortest, shortest) if shortest > 0 else (0, UNKNOWN))
        assert sum(one != NOTHING for one in kept.path) == len(found) - 1


def test_lists_and_arrays_are_alike() -> None:
    def arrays(kept: Memory) -> Any:
        return Memory(*(np.array(cells, np.int32) for cells in kept[:-1]), now=kept.now)  # type: ignore[misc, arg-type]

    plain, other = fresh(), arrays(fresh())
    for episode, moves in enumerate([[(1, ASKED), (1, ASKED), (2, ASKED), (GOAL, OWN)], [(3, OWN), (GOAL, OWN)]], 1):
        walk(plain, episode, moves)
        walk(other, episode, moves)
    assert way(plain) == way(other) == [0, 3, GOAL]
    for name in Memory._fields[:-1]:
        np.testing.assert_array_equal(getattr(plain, name), getattr(other, name))
    assert plain.now == other.now


def test_practice_and_lost_trust_are_told_once() -> None:
    recall = Recall(STATES, STATES, 30, EPISODES, WINDOW)
    told = []
    for episode, states in ((1, [1, 2, GOAL]), (2, [0]), (4, [0])):
        assert recall.opens(episode, True)
        recall.starts(0)
        for left, entered in zip([0, *states], states, strict=False):
            if episode > 1:
                recall.asked()
            recall.moved(left, entered, entered, entered == GOAL, entered == GOAL)
        told += list(recall.ended(3 if episode == 1 else None, int(episode > 1)))
    assert told == [AdviceEnded(4, "misled by what was remembered")]
    assert not recall.trusts
    assert not recall.opens(17, True)
    assert recall.late
    recall.starts(0)
    assert [recall.chosen(state, 7) for state in (0, 1, 3)] == [7, 7, 7]  # its own last walk was no longer than the way


def test_in_practice_the_way_is_taken_and_off_it_the_learners_own() -> None:
    recall = Recall(STATES, STATES, 30, EPISODES, WINDOW)
    for episode, states in ((1, [1, GOAL]), (2, [2, 3, GOAL])):
        recall.opens(episode, False)
        recall.starts(0)
        for left, entered in zip([0, *states], states, strict=False):
            recall.moved(left, entered, entered, entered == GOAL, entered == GOAL)
        assert list(recall.ended(len(states), 0)) == []
    recall.opens(17, False)
    recall.starts(0)
    assert [recall.chosen(0, 7)] == [1]
    recall.moved(0, 1, 1, False, False)
    assert recall.chosen(4, 7) == 7
    assert list(recall.ended(None, 0)) == [AdviceRemembered(17, 1)]
