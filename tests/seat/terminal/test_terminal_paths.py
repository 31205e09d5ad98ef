"""Answers taken back, whole paths typed at once, and whole sessions at the teaching prompt."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput
from rich.console import Console

from lab.advice.advisors import AdvisorName
from lab.advice.journal import Again, Journal, Undo
from lab.advice.table_level import TableLevel
from lab.learning.requests import AdviceRequest, Ask
from lab.learning.session import Session
from lab.learning.session_events import EpisodeEnded, Event, Improvement
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid
from lab.seat.terminal.line_reader import PlainReader, TerminalReader
from lab.seat.terminal.prompt import TeachingPrompt
from lab.teaching.events import LessonEvent


def board() -> TabularMDP:
    """R . . .
    . # . .
    . . . G"""
    blocked = np.zeros((3, 4), bool)
    blocked[1, 1] = True
    return grid((3, 4), blocked, (0, 0), (2, 3), action_labels=("up", "down", "left", "right"))


BOARD = board()


def request(mdp: TabularMDP = BOARD, action: int = 3, state: int = 0) -> AdviceRequest:
    q = [[0.0] * mdp.n_actions] * mdp.n_states
    return AdviceRequest(
        mdp=mdp,
        q=q,
        state=state,
        episode=31,
        step=2,
        own=action,
        improvement=Improvement(0.0125, 39.5, 40.0),
        allowed=range(mdp.n_actions),
    )


def said(console: Console) -> str:
    assert isinstance(console.file, StringIO)
    return console.file.getvalue()


def prompted(lines: str) -> tuple[TeachingPrompt, Console]:
    """A prompt for a person who types these lines, and where it writes."""
    shown = Console(file=StringIO(), width=100, height=30)
    return TeachingPrompt(shown, PlainReader(shown, StringIO(lines))), shown


# ---- undo -----------------------------------------------------------------------------------------------------------


def test_undo_is_raised_where_there_is_something_to_take_back() -> None:
    prompt, shown = prompted("undo\nundo\nright\n")
    with pytest.raises(Undo):
        prompt(replace(request(), undoable=True))
    assert "Your last answer is taken back." in said(shown)
    assert prompt(request()) == 3
    assert "There is nothing to take back: you have answered nothing yet in this episode." in said(shown)


def test_a_session_with_an_answer_taken_back_is_one_without_it() -> None:
    """Up, into the wall, is taken back; the session then goes as if it had never been said."""
    assert np.array_equal(again("up\nundo\nright\nauto\n")[0].q, again("right\nauto\n")[0].q)
    result, shown = again("up\nundo\nright\nauto\n")
    assert result.helped_steps == 1
    assert shown.count("step 1: at (0, 0)") == 2  # asked anew
    assert shown.count("the learner asks for advice") == 1  # and not told anew


def again(lines: str) -> tuple[SessionResult, str]:
    """A session as its driver runs it: from the beginning whenever an answer is taken back."""
    prompt, shown = prompted(lines)
    journal = Journal()

    def tell(event: Event) -> None:
        if journal.tell(event):
            prompt.hear(LessonEvent("", event))

    while True:
        try:
            return teach(lambda asked: journal.answer("terminal", asked, prompt), tell), said(shown)
        except Again:
            journal.rewind()


# ---- paths ----------------------------------------------------------------------------------------------------------


def walked(prompt: TeachingPrompt, moves: Sequence[int | None], mdp: TabularMDP = BOARD) -> None:
    """Asks at each step where the answers lead, and holds them against what is expected."""
    state = mdp.start
    for step, expected in enumerate(moves, start=1):
        action = prompt(replace(request(mdp, 3, state), step=step))
        assert action == expected
        state = int(mdp.successor[state, 3 if action is None else action])


@pytest.mark.parametrize("line", ["rrd", "path rrd", "2r d", "→→↓", "right right down"])
def test_a_path_is_given_move_by_move(line: str) -> None:
    prompt, shown = prompted(f"{line}\nskip\n")
    walked(prompt, [3, 3, 1, None])
    assert said(shown).count("Which way?") == 2
    assert "A path of 3 moves: → → ↓" in said(shown)


def test_a_path_into_a_wall_says_so_and_goes_on() -> None:
    prompt, shown = prompted("urd\n\n")
    walked(prompt, [0, 3, 1])
    assert "↑ up: that leads nowhere: given all the same." in said(shown)
    assert "↓ down: that leads into an obstacle: given all the same." in said(shown)


def test_a_long_path_is_counted_and_a_wall_named_once() -> None:
    prompt, shown = prompted("6u 2l\nu\nu\n")
    walked(prompt, [0] * 6 + [2] * 2 + [0] * 2)
    assert "A path of 8 moves: 6 x ↑ ← ←" in said(shown)
    assert said(shown).count("↑ up: that leads nowhere: given all the same.") == 3  # of the path, and each time alone
    assert said(shown).count("← left: that leads nowhere: given all the same.") == 1


def test_a_path_is_dropped_where_the_learner_is_elsewhere() -> None:
    prompt, shown = prompted("rrdd\nup\n")
    assert prompt(request()) == 3
    assert prompt(request(state=4)) == 0  # it should be at 1
    assert "The rest of your path is dropped (→ ↓ ↓): the learner is at (1, 0) now." in said(shown)
    assert said(shown).count("dropped") == 1


def test_a_path_is_dropped_at_the_end_of_its_episode() -> None:
    prompt, shown = prompted("rrdd\nleft\n")
    assert prompt(request()) == 3
    prompt.hear(LessonEvent("", EpisodeEnded(31, 201, True, 1, 0.0, False)))
    assert "The rest of your path is dropped (→ ↓ ↓): episode 31 is over." in said(shown)
    assert prompt(replace(request(state=1), episode=32)) == 2


def test_a_path_of_another_episode_or_skill_is_not_followed() -> None:
    for asked in (replace(request(state=1), episode=32), request(board(), state=1)):
        prompt, shown = prompted("rr\nleft\n")
        assert prompt(request()) == 3
        assert prompt(asked) == 2
        assert "The rest of your path is dropped (→)" in said(shown)


def test_where_no_table_says_where_moves_lead_a_path_goes_on_step_by_step() -> None:
    no = np.zeros(2, bool)
    mdp = TabularMDP(np.array([[0, 0], [1, 1]]), np.zeros((2, 2)), no, no, 0, ("wait", "go"))
    prompt, shown = prompted("path wgw\ngo\n")
    asked = [replace(request(mdp, 0, state), step=step) for state, step in ((0, 2), (1, 3), (1, 5))]
    assert [prompt(each) for each in asked] == [0, 1, 1]
    assert "The rest of your path is dropped (wait): the learner is at 1 now." in said(shown)
    assert "nowhere" not in said(shown)


def test_a_letter_that_is_no_move_gets_the_letters() -> None:
    prompt, shown = prompted("rruq\nup\n")
    assert prompt(request()) == 0
    assert "'rruq' is no path: 'q' is no move; letters: u up, d down, l left, r right" in said(shown)


# ---- whole sessions -------------------------------------------------------------------------------------------------


def teach(ask: Ask, on_event: Callable[..., None]) -> SessionResult:
    rng = np.random.default_rng(0)
    advisor = TableLevel(BOARD, 0.99, rng, {"terminal": ask}).advisor(AdvisorName.of("terminal"))
    gate = GateSettings(first_episode=4, window=1, omega=0, lambda_threshold=1.0)
    settings = LearnerSettings(episodes=12, max_steps=20)
    return Session(BOARD, settings, gate, advisor, rng).run(on_event)


def taught(lines: str) -> tuple[SessionResult, str]:
    prompt, shown = prompted(lines)
    return teach(prompt, lambda event: prompt.hear(LessonEvent("", event))), said(shown)


@pytest.mark.parametrize("lines", ["right\nright\nright\ndown\ndown\nauto\n", "3r2d\nauto\n", "rrrd\nd\nauto\n"])
def test_a_whole_session_with_piped_answers(lines: str) -> None:
    result, shown = taught(lines)
    assert (result.helped_steps, result.requests, len(result.steps), result.interrupted) == (5, 2, 12, False)
    assert result.steps[3] == 5
    assert "Episode 4 reached the goal in 5 steps, better than the 21.0 before; moves advised: 5." in shown
    assert "advice has ended" in shown


def test_the_rest_of_a_path_is_dropped_when_its_episode_ends() -> None:
    result, shown = taught("3r2d rrr\nauto\n")
    assert result.helped_steps == 5
    assert "The rest of your path is dropped (→ → →): episode 4 is over." in shown


def test_a_session_whose_adviser_misleads_says_so() -> None:
    _, shown = taught("up\n" * 40)
    assert "The learner takes no more advice (episodes misled: 1, tolerated: 0)." in shown


@pytest.mark.parametrize("keys", ["right\rright\r\x03", "rr\r\x03", "right\rpath r\x03", "rr\rquit\r"])
def test_ctrl_c_keeps_what_was_learned(keys: str) -> None:
    shown = Console(file=StringIO())
    with create_pipe_input() as pipe:
        pipe.send_text(keys)
        prompt = TeachingPrompt(shown, TerminalReader(shown, pipe, DummyOutput()))
        result = teach(prompt, lambda event: prompt.hear(LessonEvent("", event)))
    assert (result.interrupted, len(result.steps), result.helped_steps) == (True, 3, 0)
    assert result.visits.sum() > 0
