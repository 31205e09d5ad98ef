"""The questions of `lab find`."""

from collections.abc import Iterator
from io import StringIO

from rich.console import Console

from lab.seat.terminal.subtask_questions import accepted_by
from lab.teaching.found_subtasks import Proposal

PROPOSALS = (Proposal("doorway 1", (3,)), Proposal("doorway 2", (7, 8)), Proposal("doorway 3", (9,)))


def answered(*lines: str) -> tuple[dict[tuple[int, ...], str], str]:
    """What these answers accept, and what is shown."""
    typed: Iterator[str] = iter(lines)

    def read(prompt: str) -> str:
        try:
            return next(typed) + "\n"
        except StopIteration:
            raise EOFError from None

    shown = StringIO()
    return accepted_by(PROPOSALS, read, Console(file=shown, width=200)), shown.getvalue()


def test_each_is_accepted_renamed_or_refused() -> None:
    assert answered("", "hall", "no")[0] == {(3,): "doorway 1", (7, 8): "hall"}


def test_a_name_is_given_once() -> None:
    accepted, shown = answered("hall", "hall", "kitchen", "no")
    assert accepted == {(3,): "hall", (7, 8): "kitchen"}
    assert "name 'hall': another sub-task has it" in shown


def test_at_the_end_of_the_input_the_others_are_accepted() -> None:
    assert answered("no")[0] == {(7, 8): "doorway 2", (9,): "doorway 3"}
