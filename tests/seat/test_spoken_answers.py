"""What is said in sentences at the prompt: paths, rules that hold, times without questions, and agreement at a terminal."""

from collections.abc import Iterator
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from lab.advice.journal import Undo
from lab.learning.requests import AdviceRequest, AdvisorLeft
from lab.mdp import TabularMDP, grid
from lab.seat.spoken_answers import STUCK_VISITS, kept_moves, order_scene
from lab.seat.terminal.prompt import TeachingPrompt
from lab.sequencing.search import SequenceRequest
from lab.sequencing.simulate.run import Run
from lab.tasks.task_file import load_cell
from lab.words.meaning import Before, Finish, Work

WORDS = ("up", "down", "left", "right")
UP, DOWN, LEFT, RIGHT = range(4)


def board() -> TabularMDP:
    """R . . . .
    . . . . .
    . . # . .
    . . . . G"""
    blocked = np.zeros((4, 5), bool)
    blocked[2, 2] = True
    return grid((4, 5), blocked, (0, 0), (3, 4), action_labels=WORDS)


BOARD = board()


def request(state: int = 0, own: int = RIGHT, episode: int = 1, step: int = 1) -> AdviceRequest:
    q = [[0.0, 0.5, 0.0, 1.0]] * BOARD.n_states
    return AdviceRequest(mdp=BOARD, q=q, state=state, episode=episode, step=step, own=own, allowed=range(4))


class Reader:
    """Says these lines, one a question; confirms: as at a terminal."""

    def __init__(self, lines: tuple[str, ...], confirms: bool = False) -> None:
        self._lines: Iterator[str] = iter(lines)
        self.confirms = confirms

    def __call__(self, prompt: str) -> str:
        try:
            return next(self._lines)
        except StopIteration:
            raise EOFError from None


def prompt(*lines: str, confirms: bool = False) -> tuple[TeachingPrompt, StringIO]:
    written = StringIO()
    console = Console(file=written, width=100, height=25, no_color=True)
    return TeachingPrompt(console, Reader(lines, confirms)), written


def test_a_sentence_answers_along_its_path() -> None:
    ask, written = prompt("two steps right, then down", "take that back")
    assert [ask(request(0)), ask(request(1, step=2)), ask(request(2, step=3))] == [RIGHT, RIGHT, DOWN]
    assert "Understood: right 2, then down 1." in written.getvalue()
    with pytest.raises(Undo):
        ask(replace(request(7, step=4), undoable=True))


def test_what_is_not_understood_or_not_free_is_said_and_the_question_waits() -> None:
    ask, written = prompt("go to the fridge", "left", "go up two steps", "right")
    assert ask(request(own=DOWN)) == LEFT  # typed as ever: given, although it leads nowhere
    assert ask(request(own=DOWN, step=2)) == RIGHT
    assert "'fridge': not understood" in written.getvalue()
    assert "up 2: it does not go on after 0 of 2 steps: not done." in written.getvalue()


def test_a_person_at_a_terminal_agrees_before_it_counts() -> None:
    ask, written = prompt("go to the goal", "no", "two steps down", "yes", confirms=True)
    assert ask(request()) == DOWN
    assert "Dropped." in written.getvalue()


def test_a_rule_that_is_not_agreed_to_does_not_hold() -> None:
    ask, _ = prompt("keep away from the cube, then go to the goal", "no", "right", confirms=True)
    assert ask(request(5, own=RIGHT)) == RIGHT


def test_what_is_said_after_taking_back_is_done_when_the_question_comes_again() -> None:
    ask, _ = prompt("undo that and go two down instead")
    with pytest.raises(Undo):
        ask(replace(request(0), undoable=True))
    assert [ask(request(0)), ask(request(5, step=2))] == [DOWN, DOWN]


def test_a_rule_answers_where_the_learner_would_break_it_until_it_is_taken_back() -> None:
    ask, written = prompt("keep away from the cube", "down", "why", "right", "forget all rules", "right")
    assert ask(request(0)) == DOWN
    assert ask(request(5, own=RIGHT, step=2)) == DOWN  # (1, 1) is next to the cube
    assert "By your rule (keep away from the cube): down instead of right." in written.getvalue()
    assert ask(request(0, own=DOWN, step=3)) == RIGHT
    assert "Your rules hold: keep away from the cube." in written.getvalue()
    assert ask(request(0, own=DOWN, step=4)) == RIGHT
    with pytest.raises(AdvisorLeft):
        ask(request(5, own=RIGHT, step=5))  # no rule, and no more answers


def test_times_without_questions() -> None:
    ask, _ = prompt("no questions for 2 steps", "left", "stop asking until you are stuck", "up", "never ask me again")
    assert [ask(request(6, step=n)) for n in (1, 2)] == [None, None]
    assert ask(request(6, step=3)) == LEFT
    asked = [ask(request(7, step=3 + n)) for n in range(STUCK_VISITS)]
    assert asked == [None] * (STUCK_VISITS - 1) + [UP]
    for _again in range(2):
        with pytest.raises(AdvisorLeft):
            ask(request(8, step=9))


def test_the_same_again_and_the_other_way() -> None:
    ask, _ = prompt("right 2", "like last time", "the other way")
    assert ask(request(0)) == RIGHT
    assert ask(request(1, step=2)) == RIGHT
    assert [ask(request(0, episode=2)), ask(request(1, episode=2, step=2))] == [RIGHT, RIGHT]
    assert ask(request(6, own=DOWN, episode=3)) == UP


# ---- the order of transfers --------------------------------------------------------------------------------------------


def order() -> SequenceRequest:
    """At the start of the thesis's case I with 3 toasts, one of them in the toaster."""
    run = Run(load_cell("toast-case-1").cell(3))
    run.move(1)
    return SequenceRequest(run=run, allowed=run.allowed(), own=1, episode=1, step=1, state=0)


def test_an_order_is_given_in_words_and_rules_leave_moves_out() -> None:
    asked = order()
    moves = {move.part: move.number for move in order_scene(asked).moves}
    assert sorted(moves) == ["toast 1", "toast 2", "toast 3"]
    assert kept_moves(asked, [Finish("toast 2")]) == [moves["toast 2"]]
    assert kept_moves(asked, [Before(Work("toast 1"), Work("toast 3"))]) == sorted([moves["toast 1"], moves["toast 2"]])
    ask, written = prompt("finish slice 2 first", "forget the rules", "move 3")
    assert ask(asked) == moves["toast 2"]
    assert "By your rule (finish toast 2 first): move 2." in written.getvalue()
