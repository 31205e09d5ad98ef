"""The run in which alike parts are one says the same as the readable one."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import part_of
from lab.sequencing.methods.robot_bound import TICKS_PER_S
from lab.sequencing.simulate.merged import Flow, Layout
from lab.sequencing.simulate.run import Run

Cells = Callable[..., st.SearchStrategy[Cell]]


@given(data=st.data(), distinct=st.booleans())
def test_a_flow_is_a_run(cells: Cells, data: st.DataObject, distinct: bool) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=4, many=True))
    flow, run = Flow(Layout.of(cell), distinct=distinct), Run(cell)
    while actions := list(flow.actions()):
        # Alike parts are one, so that there may be fewer actions than decisions, but every position is among them.
        places = {(run.locations[part_of(d, cell.parts) - 1], (d - 1) // cell.parts) for d in run.allowed()}
        assert {(place, choice) for place, choice, _ in actions} == places
        run.move(flow.take(data.draw(st.sampled_from(actions))))
        assert flow.now / TICKS_PER_S == pytest.approx(run.now_s, abs=1e-6)
        assert flow.waited / TICKS_PER_S == pytest.approx(run.waited_s, abs=1e-6)
        assert flow.processed / TICKS_PER_S == pytest.approx(run.processed_s, abs=1e-6)
        assert flow.occupied == run.occupied
        assert flow.counts == [run.locations.count(place) for place in range(len(cell.positions))]
    assert flow.done == run.done


def test_alike_parts_are_one_and_the_first_goes_first(toast_cell: Callable[..., Cell]) -> None:
    flow = Flow(Layout.of(toast_cell("I", 3)))
    assert list(flow.actions()) == [(0, 0, 0)]
    assert [flow.take((0, 0, 0)), flow.take((0, 0, 0))] == [1, 2]
    assert flow.counts == [1, 1, 1, 0, 0, 0]
    # toast 1 reached the toaster at 57 s and is done at 117; 2 has been brought to the buffer: 57 + 22 + 24 = 103
    assert flow.state() == ((1, 1, 1, 0, 0, 0), 1, ((1, round(14 * TICKS_PER_S)),))


def test_told_apart_each_part_is_an_action(toast_cell: Callable[..., Cell]) -> None:
    flow = Flow(Layout.of(toast_cell("I", 3)), distinct=True)
    assert list(flow.actions()) == [(0, 0, 1), (0, 0, 2), (0, 0, 3)]
    assert flow.take((0, 0, 2)) == 2
    assert list(flow.actions()) == [(0, 0, 1), (0, 0, 3), (1, 0, 2)]
