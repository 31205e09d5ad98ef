"""The teaching prompt: what it shows, what it does with words and paths, what it tells of a session, who may answer."""

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput
from rich.console import Console

from lab.learning.praise import Judgement
from lab.learning.requests import AdviceRequest, AdvisorLeft, Reply, Standing, TooSlow
from lab.learning.session_events import (
    AdviceEnded,
    AdviceGiven,
    AdviceRejected,
    AdviceRequested,
    AdvisorDropped,
    AdvisorReadmitted,
    AdvisorsDisagreed,
    EpisodeEnded,
    Improvement,
)
from lab.mdp import TabularMDP, grid
from lab.seat.terminal.line_reader import PlainReader, TerminalReader
from lab.seat.terminal.prompt import TeachingPrompt
from lab.teaching.events import LessonEvent

WORDS = ("up", "down", "left", "right")
CUBE = ("left", "right", "backward", "forward", "down", "up")
QUESTION = "Which way? [enter = → right, ? explains]"


def board() -> TabularMDP:
    """R . . .
    . # . .
    . . . G"""
    blocked = np.zeros((3, 4), bool)
    blocked[1, 1] = True
    return grid((3, 4), blocked, (0, 0), (2, 3), action_labels=WORDS)


BOARD = board()


def request(mdp: TabularMDP = BOARD, action: int = 3, state: int | None = None) -> AdviceRequest:
    q = [[0.0] * mdp.n_actions] * mdp.n_states
    return AdviceRequest(
        mdp=mdp,
        q=q,
        state=mdp.start if state is None else state,
        episode=31,
        step=2,
        own=action,
        improvement=Improvement(0.0125, 39.5, 40.0),
        allowed=range(mdp.n_actions),
    )


def console(encoding: str = "utf-8", width: int = 100) -> Console:
    class Encoded(StringIO):
        @property
        def encoding(self) -> str:  # type: ignore[override]
            return encoding

    return Console(file=Encoded(), width=width, height=30)


def said(console: Console) -> str:
    assert isinstance(console.file, StringIO)
    return console.file.getvalue()


def prompted(lines: str, shown: Console | None = None, plain: bool = False) -> tuple[TeachingPrompt, Console]:
    """A prompt for a person who types these lines, and where it writes."""
    shown = shown or console()
    return TeachingPrompt(shown, PlainReader(shown, StringIO(lines)), plain), shown


def ask(lines: str, asked: AdviceRequest | None = None, encoding: str = "utf-8") -> tuple[Reply, str]:
    """The answer of a person who types these lines, and what was shown."""
    prompt, shown = prompted(lines, console(encoding))
    return prompt(asked or request()), said(shown)


# ---- answers --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "action"),
    [("down", 1), (" DOWN ", 1), ("d", 1), ("le", 2), ("→", 3), (">", 3), ("^", 0), ("", 3), ("skip", None)],
)
def test_answers(line: str, action: int | None) -> None:
    assert ask(line + "\n")[0] == action


def test_a_question_shows_picture_numbers_and_choice() -> None:
    shown = ask("\n")[1].splitlines()
    assert shown[1].rstrip() == "Episode 31, step 2: at (0, 0)"
    assert shown[2].startswith(" R → · ·     ↑ up     ██▌         25%")
    assert "Alone the learner would now go → right, drawn at random: all moves are alike to it here" in shown[7]
    assert "lately 39.5, before that 40.0; improvement +1.2%, threshold 0%." in " ".join(shown[8:11])
    assert shown[-1] == f"{QUESTION} "


def test_wrong_words_get_one_line_and_another_chance() -> None:
    answer, shown = ask("sideways\nu\n")
    assert answer == 0
    assert "'sideways' is no direction: type up, down, left, right, path, why, undo, skip, auto" in shown
    assert shown.count(QUESTION) == 2


def test_a_question_mark_explains() -> None:
    answer, shown = ask("?\nhelp\n\n")
    assert answer == 3
    assert shown.count("leave this step to the learner") == 2
    assert shown.count("The learner is stuck and asks you where to go.") == 2


def test_why_explains_with_numbers() -> None:
    answer, shown = ask("why\nup\n", replace(request(), reason=TooSlow(0.012, 0.05)))
    assert answer == 0
    assert "It asks because its improvement is +1.2%, below 5%." in shown
    assert "Its last episodes took 39.5 steps on average, those before them 40.0" in shown
    assert "What it thinks each move is worth here: ↑ up +0.00" in shown


@pytest.mark.parametrize(
    ("line", "state", "told"),
    [
        ("up", 0, "↑ up: that leads nowhere: given all the same."),
        ("down", 1, "↓ down: that leads into an obstacle: given all the same."),
    ],
)
def test_advice_into_a_wall_is_given_as_it_was_said(line: str, state: int, told: str) -> None:
    answer, shown = ask(f"{line}\n", request(state=state))
    assert answer == WORDS.index(line)
    assert told in shown
    assert "given all the same" not in ask("right\n", request(state=state))[1]


def test_a_plain_console_gets_plain_characters() -> None:
    answer, shown = ask("v\n", encoding="ascii")
    assert answer == 1
    assert shown.isascii()
    assert " R > . ." in shown
    assert "> > right" in shown  # its own choice


def test_a_narrow_console_gets_short_lines() -> None:
    prompt, shown = prompted("why\n?\nup\n", console(width=30))
    assert prompt(request()) == 0
    assert max(map(len, said(shown).splitlines())) <= 30


def test_nothing_typed_or_named_gets_an_escape_code_through() -> None:
    prompt, shown = prompted("\x1b[2J\nup\n")
    prompt(request())
    prompt.hear(LessonEvent("skill", AdvisorDropped(3, "tau=1\x1b[2J", 0.1, "why\x1b[2J")))
    assert "\x1b" not in said(shown)
    assert said(shown).count("\\x1b[2") == 4  # echoed, refused, named, explained


@pytest.mark.parametrize("lines", ["auto\n", "done\n", "", "?\n", "sideways"])
def test_auto_and_the_end_of_the_input_end_advice(lines: str) -> None:
    with pytest.raises(AdvisorLeft):
        ask(lines)


def test_quit_stops_the_session() -> None:
    with pytest.raises(KeyboardInterrupt):
        ask("quit\n")


def test_done_ends_advice_for_every_skill() -> None:
    prompt, shown = prompted("done\nright\n")
    with pytest.raises(AdvisorLeft):
        prompt(request())
    assert "No more advice in this run" in said(shown)
    before = said(shown)
    prompt.hear(LessonEvent("insert at toaster", AdviceEnded(31, "advisor left")))
    prompt.hear(LessonEvent("place at plate", AdviceRequested(30, None, None, None)))
    prompt.hear(LessonEvent("place at plate", AdvisorDropped(30, "novice", 0.2, "it misled")))
    with pytest.raises(AdvisorLeft):
        prompt(request(board()))
    assert said(shown) == before


def test_auto_ends_advice_for_one_skill() -> None:
    prompt, _ = prompted("auto\nright\n")
    with pytest.raises(AdvisorLeft):
        prompt(request())
    assert prompt(request()) == 3


# ---- at a terminal, and from outside --------------------------------------------------------------------------------


@contextmanager
def at_terminal(keys: Sequence[str]) -> Iterator[TeachingPrompt]:
    with create_pipe_input() as pipe:
        pipe.send_text("".join(keys))
        shown = console()
        yield TeachingPrompt(shown, TerminalReader(shown, pipe, DummyOutput()))


@pytest.mark.parametrize(
    ("keys", "action"),
    [
        ("down\r", 1),
        ("\x1b[A", 0),
        ("\x1b[D", 2),
        ("\r", 3),
        ("sideways\rleft\r", 2),
        ("x\x7fu\r", 0),
        ("skip\r", None),
        ("\x1bOP\x1b[B", 1),  # F1 is no answer
    ],
)
def test_keys_of_a_terminal(keys: str, action: int | None) -> None:
    with at_terminal(keys) as prompt:
        assert prompt(request()) == action


@pytest.mark.parametrize("keys", ["", "rig", "path rr"])
def test_ctrl_d_ends_advice_and_ctrl_c_the_session(keys: str) -> None:
    with at_terminal(f"{keys}\x03") as prompt, pytest.raises(KeyboardInterrupt):
        prompt(request())
    with at_terminal("\x04") as prompt, pytest.raises(AdvisorLeft):
        prompt(request())


@pytest.mark.parametrize(("word", "action"), [("down", 1), ("→", 3), ("", 3), ("skip", None), ("rd", 3)])
def test_a_page_may_answer_instead_of_the_keyboard(word: str, action: int | None) -> None:
    """A real thread, which speaks once the prompt is up: what it shows comes after the question is open."""
    with create_pipe_input() as pipe:
        waits = threading.Event()
        shown = console()
        prompt = TeachingPrompt(shown, TerminalReader(shown, pipe, _Screen(waits)))

        def page() -> None:
            waits.wait()
            prompt.answer_from_outside(word)

        prompt.answer_from_outside("up")  # nothing waits: no effect
        thread = threading.Thread(target=page)
        thread.start()
        assert prompt(request()) == action
        thread.join()
        prompt.answer_from_outside("up")  # nothing waits any more
        pipe.send_text("left\r")
        assert prompt(replace(request(), episode=32)) == 2


class _Screen(DummyOutput):
    """A screen that tells when something is drawn on it."""

    def __init__(self, drawn: threading.Event) -> None:
        self._drawn = drawn

    def write(self, data: str) -> None:
        self._drawn.set()


def test_an_unknown_word_from_outside_is_said_and_the_question_waits_on() -> None:
    with create_pipe_input() as pipe:
        waits = threading.Event()
        shown = console()
        prompt = TeachingPrompt(shown, TerminalReader(shown, pipe, _Screen(waits)))

        def page() -> None:
            waits.wait()
            prompt.answer_from_outside("sideways")
            prompt.answer_from_outside("undo")
            prompt.answer_from_outside("down")

        thread = threading.Thread(target=page)
        thread.start()
        assert prompt(request()) == 1
        thread.join()
    assert "'sideways' is no direction" in said(shown)
    assert "There is nothing to take back" in said(shown)


# ---- what is told ---------------------------------------------------------------------------------------------------


def test_events_are_told_with_their_numbers() -> None:
    shown = console()
    prompt = TeachingPrompt(shown)
    for event in (
        AdviceRequested(30, 0.01, 185.6, 200.0),
        AdviceGiven(30, 1, 0, 3, 2),
        EpisodeEnded(30, 12, True, 9, 0.2, True),
        EpisodeEnded(31, 201, True, 40, 0.2, False),
        EpisodeEnded(32, 15, False, 0, 0.2, True),
        AdviceRejected(33, 8, 7, 201, 44.25),
        AdviceEnded(34, "converged"),
        AdviceEnded(35, "advisor left"),
    ):
        prompt.hear(LessonEvent("", event))
    prompt.hear(LessonEvent("insert at toaster", AdviceRequested(36, None, None, None)))
    prompt.hear(LessonEvent("insert at toaster", EpisodeEnded(36, 1, True, 1, None, True)))
    assert said(shown).splitlines() == [
        "Episode 30: the learner asks for advice.",
        "Episode 30 reached the goal in 12 steps, better than the 185.6 before; moves advised: 9.",
        "Episode 31 did not reach the goal: 201 steps, no better than the 185.6 before; moves advised: 40.",
        "The learner takes no more advice (episodes misled: 8, tolerated: 7). Episode 33 counted 201 steps,",
        "those before it 44.2.",
        "Episode 34: the same result again and again; the learner asks no more.",
        "Episode 35: advice has ended; the learner goes on alone.",
        "Episode 36: the learner asks for advice about 'insert at toaster'.",
        "Episode 36 reached the goal in 1 step; moves advised: 1.",  # no mean to compare it with
    ]


def test_an_episode_as_good_as_the_best_is_no_bad_one() -> None:
    shown = console()
    prompt = TeachingPrompt(shown)
    prompt.hear(LessonEvent("", AdviceRequested(30, 0.0, 16.0, 16.0)))
    prompt.hear(LessonEvent("", EpisodeEnded(30, 16, True, 9, 0.0, True, "best")))
    assert said(shown).splitlines()[1:] == [
        "Episode 30 reached the goal in 16 steps, as good as the best so far; moves advised: 9."
    ]


def test_misled_episodes_are_counted_aloud() -> None:
    """Four episodes with advice, three of which the learner counts as misled."""
    prompt, shown = prompted("up\n" * 5)
    for episode, (steps, misleads) in enumerate([(12, 0), (201, 1), (201, 2), (201, 3)], start=31):
        before = misleads - (steps == 201)
        prompt(replace(request(), episode=episode, standing=Standing(misleads=before, omega=7)))
        prompt.hear(LessonEvent("", EpisodeEnded(episode, steps, True, 1, None, steps < 201)))
    prompt(replace(request(), episode=35, standing=Standing(misleads=3, omega=7)))
    told = [line for line in said(shown).splitlines() if line.startswith("Your advice")]
    assert told == [
        "Your advice did not help in 1 of 2 episodes; it tolerates 7.",
        "Your advice did not help in 2 of 3 episodes; it tolerates 7.",
        "Your advice did not help in 3 of 4 episodes; it tolerates 7.",
    ]


def test_advisors_that_disagree_leave_and_come_back() -> None:
    prompt, shown = prompted("up\n")
    disagreed = AdvisorsDisagreed(31, 2, 1, (("terminal", 3), ("expert", 1), ("novice", 1)), 1)
    prompt.hear(LessonEvent("", disagreed))
    prompt(request())
    before = len(said(shown))
    prompt.hear(LessonEvent("", disagreed))
    prompt.hear(LessonEvent("", replace(disagreed, followed=0)))
    prompt.hear(LessonEvent("", AdvisorDropped(40, "novice", 0.312, "it misled in 5 of 6 episodes")))
    prompt.hear(LessonEvent("", AdvisorReadmitted(55, "novice", 0.61, "it was right in 4 of 5 states")))
    assert said(shown).splitlines()[:2] == [
        "Step 2 at state 1: terminal says move 3, expert says move 1, novice says move 1; it follows expert",
        "and novice.",
    ]
    assert said(shown)[before:].splitlines() == [
        "Step 2 at (0, 1): terminal says → right, expert says ↓ down, novice says ↓ down; it follows expert",
        "and novice.",
        "Step 2 at (0, 1): terminal says → right, expert says ↓ down, novice says ↓ down; it goes ↑ up.",
        "Episode 40: novice is heard no more (trust 31%): it misled in 5 of 6 episodes.",
        "Episode 55: novice is heard again (trust 61%): it was right in 4 of 5 states.",
    ]


def test_a_question_can_be_shown_with_its_answer() -> None:
    shown = console()
    prompt = TeachingPrompt(shown)
    prompt.show(request())
    prompt.told(request(), 3)
    prompt.told(request(), None)
    assert "Episode 31, step 2: at (0, 0)" in said(shown)
    assert "Which way?" not in said(shown)
    assert said(shown).splitlines()[-2:] == ["Answer: → right", "Answer: skip"]


def test_plain_sentences_for_a_screen_reader() -> None:
    prompt, shown = prompted("?\nrrd\n", plain=True)
    assert prompt(request()) == 3
    lines = said(shown).splitlines()
    assert lines[1:8] == [
        "Episode 31, step 2.",
        "The robot is at row 0, column 0.",
        "The goal lies 2 down and 3 right.",
        "up: border.",
        "down: free.",
        "left: border.",
        "right: free.",
    ]
    assert "Which way? [enter = right, ? explains] ?" in lines
    assert "skip: leave this step to the learner." in lines
    assert "A path of 3 moves: right right down" in lines
    assert said(shown).isascii()


# ---- judgements -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "answer"),
    [("+", Judgement(1)), ("-3", Judgement(-1, 3)), ("", None), ("skip", None), ("good", Judgement(1))],
)
def test_a_question_about_the_move_it_makes(line: str, answer: Reply) -> None:
    given, shown = ask(f"{line}\n", replace(request(), judgement="only"))
    assert given == answer
    assert "It goes → right. How is that? [+ good, - bad, ? explains]" in shown
    assert "The learner now goes → right" in shown
    assert "Judged so far: 0 moves" in shown


def test_a_move_is_no_judgement() -> None:
    given, shown = ask("left\nll\n?\n-\n", replace(request(), judgement="only"))
    assert given == Judgement(-1)
    assert shown.count("this question is about the move that it makes") == 2
    assert "asks how it is" in shown


def test_a_judgement_beside_moves() -> None:
    assert ask("-2\n", replace(request(), judgement="also"))[0] == Judgement(-1, 2)
    assert ask("left\n", replace(request(), judgement="also"))[0] == 2
    assert ask("-\nleft\n")[0] == 2  # nothing was done yet


def test_a_replay_shows_judgements() -> None:
    prompt, shown = prompted("")
    prompt.told(request(), Judgement(-2, 3))
    assert "Answer: clearly bad, of the last 3 moves" in said(shown)
