"""The cell in which alike parts are one says the same as the readable run: held together by a walk through both."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.cell.ways import TICKS_PER_S
from lab.sequencing.simulate.merged import MergedCell, MergedState
from lab.sequencing.simulate.run import Run

Cells = Callable[..., st.SearchStrategy[Cell]]


def places(run: Run) -> set[tuple[int, int]]:
    """By position and choice, what a run allows."""
    parts = run.cell.parts
    return {(run.locations[part_of(d, parts) - 1], choice_of(d, parts)) for d in run.allowed()}


def same(merged: MergedCell, state: MergedState, run: Run) -> bool:
    """Whether a state is where a run is; times to a microsecond."""
    counts = [run.locations.count(place) for place in range(len(run.cell.positions))]
    now_s = state.now / TICKS_PER_S
    assert (merged.counted(state.counts), state.robot, merged.fetched(state)) == (counts, run.robot, run.fetched)
    assert (merged.done(state), merged.finished(state)) == (run.done, sum(s is not None for s in run.finished_s))
    return now_s == pytest.approx(run.now_s, abs=1e-6)


@given(data=st.data(), named=st.booleans())
def test_a_walk_through_the_states_is_a_run(cells: Cells, data: st.DataObject, named: bool) -> None:
    """Alike parts are one, so there may be fewer ways than decisions, but every position and choice is among them."""
    merged = MergedCell(data.draw(cells(max_machines=2, max_parts=4, many=True)))
    state, run, waited, sequence = merged.start(named=named), Run(merged.cell), 0, list[int]()
    while choices := merged.choices(state):
        assert set(choices) == places(run)
        at = data.draw(st.sampled_from(sorted(choices)))
        in_order = merged.cell.arrivals is not None and at[0] in merged.starts
        named_parts = () if state.who is None or in_order else state.who[at[0]]
        ahead = merged.after(state, choices[at], data.draw(st.sampled_from([0, *named_parts])))
        waited += merged.waited(state, ahead)
        sequence = [*sequence, merged.decision(ahead)] if named else list(merged.decisions(ahead))
        run.move(sequence[-1])
        state = ahead
        assert same(merged, state, run)
        assert waited / TICKS_PER_S == pytest.approx(run.waited_s, abs=1e-6)
    assert not run.allowed()


@given(data=st.data())
def test_it_goes_on_from_where_a_run_is(cells: Cells, data: st.DataObject) -> None:
    """Built from a run on its way, a state has the same ways ahead, and they take as long."""
    merged = MergedCell(data.draw(cells(max_machines=2, max_parts=4, many=True)))
    run = Run(merged.cell)
    for _ in range(data.draw(st.integers(0, 8))):
        if allowed := run.allowed():
            run.move(data.draw(st.sampled_from(allowed)))
    state = merged.of_run(run)
    while choices := merged.choices(state):
        assert set(choices) == places(run)
        state = merged.after(state, choices[data.draw(st.sampled_from(sorted(choices)))])
        run.move(merged.decision(state))
        assert same(merged, state, run)
    assert not run.allowed()


def test_alike_parts_are_one_and_the_first_goes_first(toast_cell: Callable[..., Cell]) -> None:
    merged = MergedCell(toast_cell("I", 3))
    state = merged.start()
    assert list(merged.choices(state)) == [(0, 0)]
    for _ in range(2):
        state = merged.after(state, merged.choices(state)[0, 0])
    assert merged.decisions(state) == (1, 2)
    assert merged.counted(state.counts) == [1, 1, 1, 0, 0, 0]
    # toast 1 reached the toaster at 57 s and is done at 117; 2 has been brought to the buffer: 57 + 22 + 24 = 103
    assert merged.key(state) == (state.counts, 1, (round(14 * TICKS_PER_S),))


def test_told_apart_any_part_may_go(toast_cell: Callable[..., Cell]) -> None:
    merged = MergedCell(toast_cell("I", 3))
    state = merged.start(named=True)
    assert state.who == ((1, 2, 3), (), (), (), (), ())
    state = merged.after(state, merged.choices(state)[0, 0], 2)
    assert (merged.decision(state), state.who) == (2, ((1, 3), (2,), (), (), (), ()))
