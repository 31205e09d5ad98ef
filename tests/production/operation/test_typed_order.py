"""An order of moves that is typed: each entry checked, the first that may not be taken named; two parts, one machine, by hand."""

import numpy as np
import pytest

from lab.errors import BadInput
from lab.production.operation.typed_order import checked
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.simulate.run import Run


@pytest.fixture
def state() -> Run:
    """2 s into the oven, 10 s in it, 2 s out; the robot comes back in 1 s: 14 s for one, 29 s for two."""
    stations = (Station("in", "storage", 9), Station("hot", "machine", 1, 10.0), Station("out", "storage", 9))
    step = np.ones((3, 3)) - np.eye(3)
    route = (Stage("in"), Stage("hot"), Stage("out"))
    return Run(Cell(stations, (Product("toast", (route,)),), ("toast", "toast"), step, 2 * step, one_robot("in")))


def test_an_order_that_may_be_taken_is_held_against_the_optimum(state: Run) -> None:
    order = checked(state, (2, 2, 1, 1))
    assert (order.sequence, order.schedule.makespan_s, order.gap, order.proven) == ((2, 2, 1, 1), 29.0, 0.0, True)
    assert order.words == "4 moves, 29.0 s: as short as the proven optimum"
    assert state.locations == Run(state.cell).locations  # it was only tried


@pytest.mark.parametrize(
    ("sequence", "why"),
    [
        ((3,), "order: move 1 '3': there is no part 3, only 1 to 2; allowed here: 1 (toast 1), 2 (toast 2)"),
        (
            (1, 2),
            "order: move 2 '2': toast 2 at 'in' cannot move on: 'hot' full; allowed here: 1 (toast 1)",
        ),
        (
            (1, 1, 1),
            "order: move 3 '1': toast 1 is already at 'out'; allowed here: 2 (toast 2)",
        ),
        ((1, 1, 2), "order: it ends after 3 moves, but toast 2 is still at 'hot'; allowed here: 2 (toast 2)"),
    ],
)
def test_the_first_entry_that_may_not_be_taken_is_named(state: Run, sequence: tuple[int, ...], why: str) -> None:
    with pytest.raises(BadInput) as error:
        checked(state, sequence)
    assert str(error.value) == why


def test_it_goes_on_from_where_the_run_is(state: Run) -> None:
    state.move(1)
    assert checked(state, (1, 2, 2)).schedule.makespan_s == 29.0
    with pytest.raises(BadInput, match="order: move 1 '2'"):
        checked(state, (2, 1, 2))
