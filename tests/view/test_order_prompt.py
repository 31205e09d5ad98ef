"""The prompt that asks a person which part to move next."""

from collections.abc import Iterator
from io import StringIO

import pytest
from rich.console import Console

from lab.advice.advisors import AdvisorLeft
from lab.sequencing.advised import SequenceRequest
from lab.sequencing.run import Run
from lab.taskfile import load_cell
from lab.view.order_prompt import OrderPrompt


def request(own: int = 1, episode: int = 30) -> SequenceRequest:
    """At the start of the thesis's case I with 3 toasts, one of them in the toaster."""
    run = Run(load_cell("toast-case-1").cell(3))
    run.move(1)
    return SequenceRequest(run, run.allowed(), own, episode, 0.012, 606.0, 613.4, "its improvement is +1.2%, below 5%")


def prompt(*lines: str) -> tuple[OrderPrompt, StringIO]:
    said: Iterator[str] = iter(lines)

    def read_line(text: str) -> str:
        try:
            return next(said)
        except StopIteration:
            raise EOFError from None

    written = StringIO()
    return OrderPrompt(Console(file=written, width=100, no_color=True), read_line), written


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
    assert "Episode 30: the learner asks which part to move next." in shown
    means = "its improvement is +1.2%, below 5%: the last episodes cost 606 on average, those before 613."
    assert means in " ".join(shown.split())
    assert "57 s: the robot is at toaster." in shown  # 21 s from the buffer to the plate, 36 s to the toaster
    rows = [line.split() for line in shown.splitlines() if line.strip().startswith(("1 ", "2 ", "3 "))]
    assert rows[0] == ["1", "toast", "1", "toaster", "butter_applier", "60", "s"]
    assert rows[1] == ["2", "toast", "2", "plate", "toaster_buffer", "now"]
    assert "'9' is none of the moves: type 1, 2, 3, enter, skip, auto, ?" in shown
    assert "auto: it goes on alone from here" in shown
    ask(request())
    assert written.getvalue().count("Episode 30") == 1, "an episode is announced once"
