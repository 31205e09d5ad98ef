"""What is decided about trouble, from a state and what was seen, without a scene: each case of the tables in `answers`."""

import pytest

from lab.production.answers import (
    MAX_TRIES,
    MOST_TROUBLES,
    PAUSES_S,
    Answer,
    Belief,
    Believe,
    GiveUp,
    GoOn,
    Stop,
    TryAgain,
    WaitForCamera,
    answer_to,
    belief_in,
    with_room,
)
from lab.production.perception import Deviation, Sort
from lab.production.run_state import GivenUp, RunState, Strange
from lab.production.trouble import Trouble
from lab.tasks.task_file import load_cell

MISSED = Trouble("it missed", "toast 1", "toaster", skill="insert at toaster")
SEEN_AGAIN = Trouble("toast 1 is not at 'plate'", "toast 1", "plate", kind="seen")
MOVED = Deviation("part moved", "toast 1", "toast 1 is not at 'plate'", "plate")


@pytest.fixture
def state() -> RunState:
    """Two toasts at their plate: plate > toaster (buffer) > applier (buffer) > finished plate, one place each."""
    return RunState.of(load_cell("toast-case-1").cell(2))


def answered(state: RunState, trouble: Trouble, *seen: Deviation, tries: int = 1, dark: bool = False) -> Answer:
    state.tries[trouble.key] = tries
    return answer_to(state, trouble, seen, dark=dark)


def test_what_fails_is_tried_again_a_few_times_and_then_given_up_for_what_was_wrong_first(state: RunState) -> None:
    state.first["toast 1"] = "it slipped"
    found = [answered(state, MISSED, tries=tries) for tries in range(1, MAX_TRIES + 1)]
    assert found == [TryAgain(PAUSES_S[1]), TryAgain(PAUSES_S[2]), GiveUp("it slipped (tried 3 times)")]


@pytest.mark.parametrize(
    ("trouble", "seen", "dark", "answer"),
    [
        (Trouble("emergency stop", "toast 1", kind="held"), (MOVED,), True, GoOn()),
        (MISSED, (), True, WaitForCamera()),
        (MISSED, (MOVED,), False, Believe((MOVED,))),
        (SEEN_AGAIN, (), False, GoOn()),
        (Trouble("no spot is free", "toast 1", "toaster", kind="final"), (), False, GiveUp("no spot is free")),
    ],
    ids=["held", "dark", "seen", "not seen any more", "final"],
)
def test_an_answer_follows_from_the_trouble_and_from_what_is_seen(
    state: RunState, trouble: Trouble, seen: tuple[Deviation, ...], dark: bool, answer: Answer
) -> None:
    assert answered(state, trouble, *seen, dark=dark) == answer


def test_a_run_with_too_many_troubles_is_stopped(state: RunState) -> None:
    found = answered(state, MISSED, MOVED, tries=MOST_TROUBLES)
    assert isinstance(found, Stop)
    assert found.why.startswith("toast 1 at 'toaster': it missed")


def test_what_is_fixed_and_was_moved_changes_the_scene() -> None:
    pushed = Deviation("station moved", "toaster", "'toaster' stands elsewhere", "toaster")
    assert Believe((MOVED, pushed)).fixed == (pushed,)


def sort(name: Sort, body: str = "toast 1") -> Deviation:
    return Deviation(name, body, name)


@pytest.mark.parametrize(
    ("seen", "belief"),
    [
        (sort("part moved"), Belief.TAKE_UP),
        (sort("part fallen"), Belief.LEAVE),
        (sort("part gone"), Belief.LEAVE),
        (sort("part out of reach"), Belief.LEAVE),
        (sort("strange part", "toast 9"), Belief.AVOID),
        (sort("part gone", "known stranger"), Belief.FORGET),
        (sort("station moved", "toaster"), Belief.SURVEY),
    ],
)
def test_a_belief_follows_from_what_is_seen_of_a_body(state: RunState, seen: Deviation, belief: Belief) -> None:
    state.strange["known stranger"] = Strange()
    assert belief_in(state, seen) is belief


def test_a_part_that_was_moved_is_left_put_back_or_taken_up(state: RunState) -> None:
    moved = sort("part moved")
    assert belief_in(state, moved, blocked=True, unfinished=True) is Belief.LEAVE
    assert belief_in(state, moved, unfinished=True) is Belief.PUT_BACK
    state.finished[1] = 20.0
    assert belief_in(state, moved) is Belief.PUT_BACK
    state.finished.clear()
    state.waiting.add("toast 1")
    assert belief_in(state, moved) is Belief.PUT_BACK


def test_of_parts_that_come_back_to_one_place_the_one_that_stands_there_is_first(state: RunState) -> None:
    state.plan.move(1)  # toast 1 is in the toaster, which holds one
    left = GivenUp(state.plan.locations[0], None, undone=False, astray=True, finished_s=None)
    state.lost |= {1: "gone", 2: "gone"}
    now, later = with_room(state, {1: left, 2: left}, standing={2})
    assert (list(now), list(later)) == ([2], [1])
    assert state.lost == {1: "gone", 2: "gone"}
