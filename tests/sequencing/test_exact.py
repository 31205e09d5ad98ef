"""The optimum: the printed ones, and brute force on random small cells."""

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.sequencing.cell import Cell
from lab.sequencing.events import simulate
from lab.sequencing.exact import optimum

CellMaker = Callable[..., Cell]


@pytest.mark.parametrize(
    ("case", "toasts", "makespan_s"),
    [("I", 3, 513), ("II", 3, 700), ("III", 3, 995), ("I", 4, 663), ("II", 4, 900), ("III", 4, 1290)],
)
def test_the_six_printed_optima(toast_cell: CellMaker, case: str, toasts: int, makespan_s: float) -> None:
    best = optimum(toast_cell(case, toasts))
    assert best.proven
    assert best.makespan_s == best.bound_s == makespan_s


@pytest.mark.parametrize(("case", "fixed_s", "each_s"), [("I", 63, 150), ("II", 100, 200), ("III", 110, 295)])
def test_more_toasts_cost_the_same_each(toast_cell: CellMaker, case: str, fixed_s: float, each_s: float) -> None:
    assert optimum(toast_cell(case, 12)).makespan_s == fixed_s + 12 * each_s


def brute_force_s(
    cell: Cell, locations: tuple[int, ...], ready_s: tuple[float, ...], robot: int, now_s: float
) -> float:
    """Every sequence of numbered toasts, timed here anew."""
    ends = []
    for toast in cell.allowed(locations):
        origin, target = locations[toast - 1], cell.destination(locations, toast)
        assert target is not None
        at_s = now_s if robot == origin else now_s + cell.empty_s[robot, origin]
        drop_s = max(at_s, ready_s[toast - 1]) + cell.loaded_s[origin, target]
        moved = (*locations[: toast - 1], target, *locations[toast:])
        done_s = drop_s + cell.stations[target].processing_s
        ends.append(brute_force_s(cell, moved, (*ready_s[: toast - 1], done_s, *ready_s[toast:]), target, drop_s))
    return min(ends) if ends else now_s


@settings(max_examples=60, deadline=None)
@given(data=st.data(), size=st.sampled_from([(1, 3), (2, 2), (3, 2)]))
def test_never_worse_or_better_than_brute_force(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject, size: tuple[int, int]
) -> None:
    """Random tables, capacities, station orders and robot starts; machines x toasts up to `size`."""
    cell = data.draw(cells(*size))
    best = optimum(cell)
    start = cell.start_locations()
    expected_s = brute_force_s(cell, start, (0.0,) * cell.toasts, cell.index(cell.robot_start), 0.0)
    assert best.makespan_s == pytest.approx(expected_s, abs=1e-6)
    assert simulate(cell, best.sequence).makespan_s == best.makespan_s


def test_toasts_leave_each_station_first_in_first_out(toast_cell: CellMaker) -> None:
    schedule = simulate(toast_cell("III", 5), optimum(toast_cell("III", 5)).sequence)
    first_moves = list(dict.fromkeys(schedule.sequence))
    assert first_moves == [1, 2, 3, 4, 5]


def test_giving_up_says_what_is_proven(toast_cell: CellMaker) -> None:
    """After 10 states: a sequence that works, not proven, with a bound below the true 663 s."""
    best = optimum(toast_cell("I", 4), max_expanded=10)
    assert not best.proven
    assert best.expanded == 10
    assert 0 < best.bound_s <= 663 <= best.makespan_s
    assert simulate(toast_cell("I", 4), best.sequence).makespan_s == best.makespan_s


def test_a_full_buffer_costs_time(toast_cell: CellMaker) -> None:
    roomy, tight = optimum(toast_cell("I", 4)), optimum(toast_cell("I", 4, buffer_room=1))
    assert tight.proven
    assert tight.makespan_s >= roomy.makespan_s
