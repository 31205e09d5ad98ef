"""The prompt that asks a person which part to move next."""

import threading
from collections.abc import Iterator
from io import StringIO

import pytest
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput
from rich.console import Console

from lab.learning.requests import AdvisorLeft, TooSlow
from lab.learning.session_events import Improvement
from lab.seat.terminal.line_reader import TerminalReader
from lab.seat.terminal.prompt import TeachingPrompt
from lab.sequencing.search import SequenceRequest
from lab.sequencing.simulate.run import Run
from lab.tasks.task_file import load_cell


def request(own: int = 1, episode: int = 30) -> SequenceRequest:
    """At the start of the thesis's case I with 3 toasts, one of them in the toaster."""
    run = Run(load_cell("toast-case-1").cell(3))
    run.move(1)
    return SequenceRequest(
        run=run,
        allowed=run.allowed(),
        own=own,
        episode=episode,
        reason=TooSlow(0.012, 0.05),
        improvement=Improvement(0.012, 606.0, 613.4),
        step=1,
        state=0,
    )


def prompt(*lines: str, width: int = 100, plain: bool = False) -> tuple[TeachingPrompt, StringIO]:
    said: Iterator[str] = iter(lines)

    def read_line(text: str) -> str:
        try:
            return next(said)
        except StopIteration:
            raise EOFError from None

    written = StringIO()
    return TeachingPrompt(Console(file=written, width=width, height=25, no_color=True), read_line, plain), written


@pytest.mark.parametrize(("line", "expected"), [("2", 2), (" 3 ", 3), ("", 1), ("skip", None), ("SKIP", None)])
def test_answers(line: str, expected: int | None) -> None:
    ask, _ = prompt(line)
    assert ask(request()) == expected


@pytest.mark.parametrize("lines", [("auto",), ()])
def test_leaving(lines: tuple[str, ...]) -> None:
    ask, _ = prompt(*lines)
    with pytest.raises(AdvisorLeft):
        ask(request())


def test_what_is_shown() -> None:
    ask, written = prompt("9", "?", "2", "1")
    assert ask(request()) == 2
    shown = written.getvalue()
    means = "its improvement is +1.2%, below 5%: the last episodes cost 606 on average, those before 613."
    assert means in " ".join(shown.split())
    assert (
        "Episode 30, 57 s: the robot is at toaster." in shown
    )  # 21 s from the buffer to the plate, 36 s to the toaster
    rows = [line.split() for line in shown.splitlines() if line.strip().startswith(("1 ", "2 ", "3 "))]
    assert rows[0] == ["1", "toast", "1", "toaster", "butter_applier", "60", "s", "its", "own", "choice"]
    assert rows[1] == ["2", "toast", "2", "plate", "toaster_buffer", "now"]
    assert "'9' is none of the moves: type 1, 2, 3, enter, why, undo, skip, auto, quit or ?" in shown
    assert "asks you which part to move next" in shown
    assert "a number" in shown
    assert "a whole path" not in shown
    ask(request())
    assert " ".join(written.getvalue().split()).count(means) == 1, "why it asks is said once an episode"


@pytest.mark.parametrize("word", ["quit", "q"])
def test_quit_ends_the_session(word: str) -> None:
    ask, _ = prompt(word)
    with pytest.raises(KeyboardInterrupt):
        ask(request())


def test_why_and_undo_are_answered_and_the_question_waits() -> None:
    ask, written = prompt("why", "undo", "qiut", "2\x1b[2J", "3")
    assert ask(request()) == 3
    shown = " ".join(written.getvalue().split())
    assert "It asks because its improvement is +1.2%, below 5%: the last episodes cost 606 on average" in shown
    assert "It would move toast 1 to butter_applier itself (1), one of 3 moves." in shown
    assert "There is nothing to take back" in shown
    assert "'qiut' is none of the moves: did you mean 'quit'? type 1, 2, 3, enter" in shown
    assert "\x1b" not in shown


@pytest.mark.parametrize(("width", "plain"), [(34, False), (80, True)])
def test_narrow_and_plain_consoles_get_words(width: int, plain: bool) -> None:
    ask, written = prompt("?", "1", width=width, plain=plain)
    assert ask(request()) == 1
    shown = written.getvalue()
    assert max(map(len, shown.splitlines())) <= width
    assert "Move 1: toast 1 from toaster to butter_applier, ready in 60 s, its own choice." in " ".join(shown.split())
    assert "Move 2: toast 2 from plate to toaster_buffer, ready now." in " ".join(shown.split())


def test_a_page_may_answer_instead() -> None:
    """A real thread speaks once the terminal's prompt is drawn."""
    drawn = threading.Event()

    class Screen(DummyOutput):
        def write(self, data: str) -> None:
            drawn.set()

    console = Console(file=StringIO(), width=100)
    with create_pipe_input() as pipe:
        ask = TeachingPrompt(console, TerminalReader(console, pipe, Screen()))
        ask.answer_from_outside("3")  # nothing waits

        def page() -> None:
            drawn.wait()
            ask.answer_from_outside("2")

        thread = threading.Thread(target=page)
        thread.start()
        assert ask(request()) == 2
        thread.join()
