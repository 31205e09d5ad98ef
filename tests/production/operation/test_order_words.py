"""An order in words: two toasts of the thesis's case I, each to the toaster, the butter applier and the finished plate."""

import pytest

from lab.errors import BadInput
from lab.production.operation.order_words import order_in_words
from lab.sequencing.simulate.run import Run
from lab.tasks.task_file import load_cell


def run() -> Run:
    return Run(load_cell("toast-case-1").cell(2))


def test_moves_are_understood_among_those_that_are_allowed_when_they_are_due() -> None:
    start = run()
    said = "toast 1 to the toaster, then toast 1 into the butter applier; toast 2 to the toaster, toast 1"
    assert order_in_words(said, start) == (1, 1, 2, 1)
    assert start.now_s == 0


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ("toast 1 to the oven", "move 1, 'toast 1 to the oven': 'oven': not understood"),
        ("toast 1 to the toaster, then be quiet", "move 2, 'be quiet': wanted a move, such as toast"),
        ("toast 1 to the finished plate", "move 1, 'toast 1 to the finished plate': that is none of the moves now"),
    ],
)
def test_what_is_no_move_is_said_in_one_line(said: str, why: str) -> None:
    with pytest.raises(BadInput) as error:
        order_in_words(said, run())
    assert str(error.value).startswith(why)
