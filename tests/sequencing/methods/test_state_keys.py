"""What values are kept under, and that a number says the same."""

from collections.abc import Callable

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DataObject, SearchStrategy

from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.state_keys import decoded, key_of, keys_of, timed_positions
from lab.sequencing.search import STATES, VALUES, SrlSettings
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]


def test_keys_by_parts(oven_cell: CellMaker) -> None:
    """Positions: in (0), oven (1), out (2)."""
    run = Run(oven_cell(2))
    pairs, states = SrlSettings(), SrlSettings(values="states")
    assert [key_of(run, decision, pairs) for decision in run.allowed()] == [((0, 0), 1), ((0, 0), 2)]
    assert [key_of(run, decision, states) for decision in run.allowed()] == [((1, 0), 0), ((0, 1), 0)]


def test_keys_by_stations_see_no_difference_between_alike_parts(toast_cell: CellMaker) -> None:
    """Positions that take room: toaster (1), its buffer (2), butter (3), its buffer (4); machines in 1 and 3."""
    run = Run(toast_cell("I", 2))
    pairs = SrlSettings(state="stations")
    assert {key_of(run, decision, pairs) for decision in run.allowed()} == {((0, 0, 0, 0, 0, 0), 1)}
    run.move(1)  # toasting
    assert [key_of(run, decision, pairs) for decision in run.allowed()] == [
        ((1, 0, 0, 0, 0, 0), 2),  # the toast at position 1
        ((1, 0, 0, 0, 0, 0), 1),
    ]
    run.move(2)  # the other into the buffer
    run.move(1)  # toasted and carried: buttering; position 3
    states = SrlSettings(values="states", state="stations")
    assert key_of(run, 1, states) == ((0, 1, 0, 0, 0, 0), 0)
    assert key_of(run, 2, states) == ((1, 0, 1, 0, 0, 0), 0)
    run.move(2)  # from the buffer: 26 s there and 24 s back, the butter takes 60
    assert key_of(run, 1, states) == ((1, 0, 0, 0, 0, 0), 0)


def test_keys_by_stations_know_which_machine_has_finished(fms_cell: CellMaker) -> None:
    """The rook's lathe needs 185 s; its pallet is brought on while it turns, and again once it has finished."""
    run = Run(fms_cell("RR", 0.0))
    both = [SrlSettings(values=values, state="stations") for values in VALUES]  # type: ignore[arg-type]
    first, second = run.allowed()
    state, label = key_of(run, first, both[0])
    assert set(state) == {0}
    assert [label, key_of(run, second, both[0])[1]] == [1, 1 + len(run.cell.positions)]
    run.move(first)  # its pallet to lathe 1 in
    run.move(1)  # into the lathe
    before = key_of(run, 1, both[1])[0]  # the pallet on: still turning
    finished = len(before) - len(timed_positions(run.cell))
    assert sum(before[finished:]) == 0
    run.wait(run.now_s + 185.0)
    assert sum(key_of(run, 1, both[1])[0][finished:]) == 1
    assert sum(key_of(run, 1, both[0])[0][finished:]) == 1


@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_a_number_is_one_state_and_label(cells: Callable[..., SearchStrategy[Cell]], data: DataObject) -> None:
    cell = data.draw(cells(many=True))
    keys = keys_of(cell, data.draw(st.sampled_from(VALUES)), data.draw(st.sampled_from(STATES)))
    assert keys is not None
    number = data.draw(st.integers(0, keys.size - 1))
    digits, label = decoded(keys, number)
    scale = np.cumprod([1, *keys.radix.tolist()])
    assert number == sum(d * s for d, s in zip(digits, scale[:-1].tolist(), strict=True)) * keys.labels + label
    assert all(0 <= d < r for d, r in zip(digits, keys.radix.tolist(), strict=True))
