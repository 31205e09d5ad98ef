"""The order that an operator gives: taken whole where every move may be made, else refused with the reason."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.production.order import checked_order, taken_moves
from lab.sequencing.cell.cell import Cell
from lab.sequencing.simulate.run import Run
from lab.tasks.task_file import load_cell

TWO = load_cell("toast-case-1").cell(2)  # plate > toaster (buffer) > applier (buffer) > finished plate, one place each


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("1 1 1 1", "move 4 '1': toast 1 is already at 'finished_plate'; allowed here: 2 (toast 2)"),
        ("1,2,2", "move 3 '2': toast 2 at 'toaster_buffer' cannot move on: 'toaster' full; allowed here: 1 (toast 1)"),
        ("3", "move 1 '3': there is no part 3, only 1 to 2; allowed here: 1 (toast 1), 2 (toast 2)"),
        ("1 two", "move 2 'two' is no part's number, 1 to 2"),
        ("1 -2", "move 2 '-2' is no part's number, 1 to 2"),
        ("1 ²", "move 2 '²' is no part's number, 1 to 2"),
        (" , ", "no moves; wanted part numbers such as 1 2 1"),
        (
            "1 2 1",
            "it ends after 3 moves, but toast 1 is still at 'butter_applier'; allowed here: 1 (toast 1), 2 (toast 2)",
        ),
    ],
)
def test_an_order_is_refused_with_the_first_move_that_may_not_be_made(words: str, reason: str) -> None:
    with pytest.raises(BadInput) as refused:
        checked_order(TWO, words)
    assert str(refused.value) == f"--order '{words}': {reason}"


def test_the_moves_before_the_refused_one_are_taken() -> None:
    assert taken_moves(TWO, "1 2 2 1") == (
        (1, 2),
        "move 3 '2': toast 2 at 'toaster_buffer' cannot move on: 'toaster' full; allowed here: 1 (toast 1)",
    )
    assert taken_moves(TWO, "1 2 2", done=(1, 2, 1)) == ((1, 2, 2), "")


@given(st.data(), st.sampled_from([" ", ",", ", "]))
def test_every_way_through_a_cell_is_an_order(data: st.DataObject, comma: str) -> None:
    cell: Cell = load_cell("toast-case-1").cell(data.draw(st.integers(1, 4)))
    run, made = Run(cell), list[int]()
    while not run.done:
        made.append(data.draw(st.sampled_from(run.allowed())))
        run.move(made[-1])
    assert checked_order(cell, comma.join(map(str, made))) == tuple(made)
