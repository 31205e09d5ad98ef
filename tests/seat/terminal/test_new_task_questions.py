"""The questions of `lab new`."""

from collections.abc import Iterator
from io import StringIO

import pytest
from rich.console import Console

from lab.errors import BadInput
from lab.seat.terminal.new_task_questions import ask
from lab.tasks.new_task import MACHINE, NewTask, new_task


def asked(*lines: str) -> tuple[NewTask, list[str], str]:
    """What these answers make, the prompts, and what is shown beside them."""
    prompts: list[str] = []
    typed: Iterator[str] = iter(lines)

    def read(prompt: str) -> str:
        prompts.append(prompt)
        try:
            return next(typed) + "\n"
        except StopIteration:
            raise EOFError from None

    shown = StringIO()
    return ask("t", read, Console(file=shown, width=200)), prompts, shown.getvalue()


def test_enter_takes_the_defaults() -> None:
    made, prompts, _ = asked("", "", "", "", "", "")
    assert made == new_task("t", "up6", (), (MACHINE,), False)
    assert prompts[0] == "Which arm: up6, panda, iiwa, xarm6? [up6] "
    assert prompts[-1] == "A buffer before each machine, yes or no? [no] "


def test_everything_may_be_answered() -> None:
    lines = ("panda", "box:0.1x0.02x0.1:2", "cup=cylinder:0.03x0.1:1", "no", "oven:60", "paint:5", "", "yes")
    made, _, _ = asked(*lines)
    assert made == new_task("t", "panda", lines[1:3], lines[4:6], True)


def test_an_answer_that_cannot_be_is_told_and_asked_again() -> None:
    made, prompts, shown = asked("up5", "up6", "no", "box:1:1", "box:0.1x0.02x0.1:2", "", "box:5", "oven:-1", "no")
    assert made == new_task("t", "up6", ("box:0.1x0.02x0.1:2",), (), False)
    assert [prompts.count(prompt) for prompt in dict.fromkeys(prompts)] == [2, 3, 1, 3]
    for line in (
        "did you mean 'up6'",
        "part 'no'",
        "the size of a box is XxYxZ",
        "the name 'box' is taken",
        "'-1' seconds",
    ):
        assert line in shown


def test_the_input_may_end() -> None:
    with pytest.raises(BadInput, match=r"the input ended at 'Which parts\?': with --yes nothing is asked"):
        asked("")
