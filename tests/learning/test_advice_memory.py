"""What is remembered, by hand: trust, what is forgotten, the way, showings, practice."""

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
    OWN,
    PRACTISED,
    REMEMBERED,
    START,
    UNKNOWN,
    Memory,
    Recall,
)
from lab.learning.session_events import AdviceEnded, AdviceRemembered

GOAL, PIT = 8, 9  # of states 0..9
EPISODES, WINDOW = 20, 2  # the last 15 %: episodes 17 to 19, and 20 is the very last


def fresh() -> Memory:
    return memory.blank(10, 30)


def walk(kept: Memory, episode: int, moves: list[tuple[int, int]], source: int = OWN, gate: bool = True) -> bool:
    """An episode from state 0 of such moves (state entered, source), by action 0; whether it was open."""
    is_open = memory.opens(kept, episode, EPISODES, WINDOW, gate)
    memory.starts(kept, 0)
    state = 0
    for entered, whose in moves:
        if whose == ASKED:
            kept.said[state] = 0
        memory.moved(kept, memory.Move(state, 0, whose, entered, entered >= GOAL, entered == GOAL))
        state = entered
    helped = sum(whose == ASKED for _, whose in moves)
    memory.ended(kept, EPISODES, len(moves), state == GOAL, helped)
    return is_open


def straight(states: list[int], source: int) -> list[tuple[int, int]]:
    return [(state, source) for state in states]


def test_an_asked_move_to_a_new_place_earns_a_quarter_up_to_three_points() -> None:
    kept = fresh()
    walk(kept, 1, straight([1, 2], ASKED))
    assert kept.now.trust == START + 2
    for episode in range(2, 9):
        walk(kept, episode, straight([1, 2, 3], ASKED))
    assert kept.now.trust == MOST
    walk(kept, 9, straight([1, 2, 3], REMEMBERED))
    assert kept.now.trust == MOST  # what is done again earns nothing


def test_a_loop_of_advice_is_forgotten_and_costs_a_point() -> None:
    kept = fresh()
    walk(kept, 1, [(1, ASKED), (2, ASKED), (3, REMEMBERED), (1, ASKED)])
    assert kept.now.trust == START + 2 - LOSS  # no quarter for the move that closed it
    assert list(kept.said[:4]) == [0, NOTHING, NOTHING, NOTHING]  # state 0 is before the loop
    assert (kept.now.at, kept.now.loops) == (1, 1)


def test_staying_in_place_is_a_loop() -> None:
    kept = fresh()
    walk(kept, 1, [(1, ASKED), (1, ASKED)])
    assert (list(kept.said[:2]), kept.now.trust) == ([0, NOTHING], START + 1 - LOSS)


def test_a_loop_with_an_own_move_proves_nothing() -> None:
    kept = fresh()
    walk(kept, 1, [(1, ASKED), (2, ASKED), (3, OWN), (1, ASKED)])
    assert (kept.now.trust, list(kept.said[:4]), kept.now.loops) == (START + 2, [0, 0, NOTHING, 0], 0)
    walk(kept, 2, [(1, OWN), (2, ASKED), (1, ASKED)])  # the own move is before the loop, not in it
    assert kept.now.trust == START + 3 - LOSS


def test_a_loop_is_one_on_the_way_that_is_left_when_earlier_loops_are_cut_out() -> None:
    kept = fresh()
    walk(kept, 1, [(1, OWN), (2, OWN), (1, OWN), (2, ASKED)])  # 2 was cut out: it is new again
    assert (kept.now.at, kept.now.trust) == (2, START + 1)


@pytest.mark.parametrize(("source", "lost"), [(ASKED, LOSS), (REMEMBERED, LOSS), (OWN, 0)])
def test_a_crash_after_an_advised_move_costs_a_point(source: int, lost: int) -> None:
    kept = fresh()
    kept.said[1] = 0
    walk(kept, 1, [(1, OWN), (PIT, source)])
    assert kept.now.trust == START - lost
    assert (kept.said[1] == NOTHING) == (source != OWN)


def test_below_0_nobody_is_asked_again() -> None:
    kept = fresh()
    for episode in (1, 2):
        assert walk(kept, episode, [(PIT, ASKED)])
    assert kept.now.trust == START - 2 * LOSS
    assert not walk(kept, 3, [])


def test_the_shortest_walk_without_its_loops_is_the_way_whoever_led_it() -> None:
    kept = fresh()
    walk(kept, 1, [(1, OWN), (2, OWN), (1, OWN), (3, ASKED), (4, REMEMBERED), (GOAL, OWN)])
    assert kept.now.best == 4
    assert [state for state in range(10) if kept.way[state] != NOTHING] == [0, 1, 3, 4]
    walk(kept, 2, straight([5, 6, 7, 1, GOAL], OWN))
    assert kept.now.best == 4  # a longer one changes nothing
    walk(kept, 3, straight([5, GOAL], OWN))
    assert [state for state in range(10) if kept.way[state] != NOTHING] == [0, 5]


def test_one_clean_showing_is_enough() -> None:
    kept = fresh()
    assert walk(kept, 1, straight([1, GOAL], ASKED))
    assert not any(walk(kept, episode, straight([1, GOAL], OWN)) for episode in range(2, EPISODES + 1))


def test_a_showing_with_loops_is_asked_for_again_k_episodes_later_three_in_all() -> None:
    kept = fresh()
    looping = [(1, ASKED), (1, ASKED), (2, ASKED), (3, ASKED), (4, ASKED), (GOAL, ASKED)]
    opened = [episode for episode in range(1, 12) if walk(kept, episode, looping if episode in (1, 3, 5) else [])]
    assert opened == [1, 3, 5]
    again = fresh()
    walk(again, 1, looping)
    assert again.said[2] == 0
    assert memory.opens(again, 1 + WINDOW, EPISODES, WINDOW, True)
    assert set(again.said) == {NOTHING}  # it wants to be shown all of it again


def test_a_walk_that_misses_the_goal_is_no_showing() -> None:
    kept = fresh()
    assert walk(kept, 1, straight([1, 2], ASKED))
    assert walk(kept, 2, [])


def test_the_gate_has_the_first_word_and_the_last_episode_is_the_learners_own() -> None:
    kept = fresh()
    assert not walk(kept, 1, [], gate=False)
    assert walk(kept, EPISODES - 1, [])
    assert not walk(kept, EPISODES, [])


def test_the_way_is_practised_late_while_its_own_last_result_is_longer() -> None:
    kept = fresh()
    walk(kept, 1, straight([1, GOAL], OWN))  # a way of two moves
    walk(kept, 2, straight([1, 2, 3, GOAL], OWN))  # and then a longer walk
    practised = []
    for episode in range(3, EPISODES + 1):
        memory.opens(kept, episode, EPISODES, WINDOW, True)
        practised += [episode] * kept.now.practises
        memory.starts(kept, 0)
        whose = PRACTISED if kept.now.practises else OWN
        for state, entered in ((0, 1), (1, 2), (2, 3), (3, GOAL)):
            memory.moved(kept, memory.Move(state, 0, whose, entered, entered == GOAL, entered == GOAL))
        memory.ended(kept, EPISODES, 4, True, 0)
    assert practised == [17, 18]  # as often as the way has moves; 19 is tried alone, 20 never practises
    assert kept.now.best == 2


def test_a_learner_that_does_as_well_as_the_way_does_not_practise() -> None:
    kept = fresh()
    walk(kept, 1, straight([1, GOAL], OWN))
    memory.opens(kept, 18, EPISODES, WINDOW, False)
    assert kept.now.practises == 0


def test_nothing_is_practised_before_a_way_is_known() -> None:
    kept = fresh()
    memory.opens(kept, 18, EPISODES, WINDOW, False)
    assert (kept.now.practises, kept.now.best) == (0, UNKNOWN)


def test_another_session_begins_with_nothing() -> None:
    kept = fresh()
    walk(kept, 1, [(1, ASKED), (1, ASKED), (GOAL, ASKED)])
    memory.clear(kept)
    assert (set(kept.said), set(kept.way), set(kept.on_walk)) == ({NOTHING}, {NOTHING}, {0})
    assert (kept.now.trust, kept.now.best, kept.now.showings, kept.now.practices) == (START, UNKNOWN, 0, -1)


@given(st.lists(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 2)), max_size=25), max_size=8))
def test_whatever_happens_a_walk_is_a_way_without_repeats(episodes: list[list[tuple[int, int]]]) -> None:
    kept = memory.blank(10, 25)
    for number, moves in enumerate(episodes, start=1):
        over = next((n for n, (entered, _) in enumerate(moves) if entered >= GOAL), len(moves))
        walk(kept, number, moves[: over + 1])
        on_walk = list(kept.walk[: kept.now.at + 1])
        assert len(set(on_walk)) == len(on_walk)
        assert on_walk[0] == 0
        assert kept.now.trust <= MOST
        states = [state for state in range(10) if kept.way[state] != NOTHING]
        assert len(states) == (0 if kept.now.best == UNKNOWN else kept.now.best)


def test_lists_and_arrays_are_alike() -> None:
    def arrays(kept: Memory) -> Any:
        return Memory(*(np.array(cells, np.int32) for cells in kept[:-1]), now=kept.now)  # type: ignore[misc, arg-type]

    plain, other = fresh(), arrays(fresh())
    for episode, moves in enumerate([[(1, ASKED), (1, ASKED), (2, ASKED), (GOAL, OWN)], [(3, OWN), (GOAL, OWN)]], 1):
        walk(plain, episode, moves)
        walk(other, episode, moves)
    for name in Memory._fields[:-1]:
        np.testing.assert_array_equal(getattr(plain, name), getattr(other, name))
    assert plain.now == other.now


def test_what_is_done_from_memory_and_lost_trust_are_told_once() -> None:
    recall = Recall(10, 30, EPISODES, WINDOW)
    told = []
    for episode in (1, 2, 3):
        recall.opens(episode, True)
        recall.starts(0)
        if episode == 1:
            assert recall.said(0) is None
            recall.keeps(0, 0)
            recall.moved(0, 0, 1, False, False)
        elif recall.said(0) == 0:
            recall.does()
            recall.moved(0, 0, 0, False, False)  # it stays where it was: a loop of what was remembered
        if recall.said(1) is None and recall.trusts and episode == 2:
            recall.keeps(0, 0)
            recall.moved(0, 0, PIT, True, False)
        told += list(recall.ended(None, 1))
    assert told == [AdviceRemembered(2, 1), AdviceEnded(2, "misled by what was remembered")]
    assert not recall.trusts
