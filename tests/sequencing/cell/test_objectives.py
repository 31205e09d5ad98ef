"""What a sequence is judged by, on runs that can be redone by hand."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import OBJECTIVES, WITH_DUE_TIMES, check_objective, cost, machine_places, stuck_cost
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]


def ran(cell: Cell, *decisions: int) -> Run:
    run = Run(cell)
    for decision in decisions:
        run.move(decision)
    return run


@pytest.mark.parametrize(
    ("objective", "value"),
    [
        ("makespan", 29.0),
        ("mean-tardiness", (0.0 + 9.0) / 2),
        ("tardy-parts", 1.0),
        ("robot-idle", 10.0 + 10.0),
        ("machine-idle", 29.0 - 20.0),
    ],
)
def test_two_toasts_by_hand(oven_cell: CellMaker, objective: str, value: float) -> None:
    """In the oven 2 to 12 and 17 to 27 s, out at 14 and 29 s, wanted at 14 and 20 s."""
    assert cost(ran(oven_cell(2, due_s=(14.0, 20.0)), 1, 1, 2, 2), objective) == value


def test_a_part_on_time_is_not_tardy_and_an_early_one_makes_up_for_nothing(oven_cell: CellMaker) -> None:
    run = ran(oven_cell(2, due_s=(50.0, 28.0)), 1, 1, 2, 2)
    assert [cost(run, name) for name in WITH_DUE_TIMES] == [0.5, 1.0]
    assert cost(ran(oven_cell(2, due_s=(14.0, 29.0)), 1, 1, 2, 2), "tardy-parts") == 0.0


def test_each_part_has_its_own_due_time(oven_cell: CellMaker) -> None:
    """Part 2 is the first to be finished here."""
    assert cost(ran(oven_cell(2, due_s=(14.0, 20.0)), 2, 2, 1, 1), "mean-tardiness") == (29.0 - 14.0) / 2


def test_machines_are_those_of_the_routes(toast_cell: CellMaker, fms_cell: CellMaker, oven_cell: CellMaker) -> None:
    assert machine_places(toast_cell("I", 3)) == 2
    assert machine_places(fms_cell("R")) == 3
    spare = (*oven_cell().stations, Station("spare", "machine", 1, 5.0))
    assert machine_places(oven_cell(stations=spare, empty_s=1 - np.eye(4), loaded_s=2 - 2 * np.eye(4))) == 1


def test_a_machine_for_two_is_idle_where_one_stands_in_it(oven_cell: CellMaker) -> None:
    """In from 2 to 12 and 5 to 15 s: 20 s of work in two places until the end at 17 s."""
    stations = [Station("oven", "machine", 2, 10.0) if s.name == "oven" else s for s in oven_cell().stations]
    run = ran(oven_cell(2, stations=tuple(stations)), 1, 2, 1, 2)
    assert (run.now_s, cost(run, "machine-idle")) == (17.0, 2 * 17.0 - 20.0)


def test_waiting_for_arrivals_is_idle(fms_cell: CellMaker) -> None:
    """One sign: 200 s until it comes, then from 345 to 880 s at the mill."""
    assert cost(ran(fms_cell("S"), *[1] * 5), "robot-idle") == 200.0 + 535.0


def test_the_way_into_a_deadlock_costs_more_than_any_that_ends() -> None:
    """Two parts that want each other's machine."""
    names = ("in", "m", "n", "out")
    stations = [Station(name, "machine" if name in "mn" else "storage", 1 if name in "mn" else 9) for name in names]
    ways = [tuple(Stage(name) for name in way) for way in (names, ("in", "n", "m", "out"))]
    products = tuple(Product(name, (way,)) for name, way in zip("ab", ways, strict=True))
    table = 1.0 - np.eye(4)
    cell = Cell(tuple(stations), products, ("a", "b"), table, table, one_robot("in"), due_s=(1.0, 1.0))
    stuck, done = ran(cell, 1, 2), ran(cell, 1, 1, 1, 2, 2, 2)
    assert not stuck.allowed()
    for objective in OBJECTIVES:
        assert cost(stuck, objective) == stuck_cost(cell, objective) > cost(done, objective)


@given(data=st.data())
def test_a_run_that_ends_costs_nothing_or_more_and_less_than_a_deadlock(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject
) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=4, many=True))
    run = Run(cell)
    while allowed := run.allowed():
        run.move(data.draw(st.sampled_from(allowed)))
    for objective in OBJECTIVES:
        assert cost(run, objective) < stuck_cost(cell, objective)
        assert cost(run, objective) >= -1e-9


def test_what_cannot_be_asked_for(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match=r"unknown objective 'span' .*did you mean 'makespan'"):
        check_objective("span", oven_cell())
    for name in WITH_DUE_TIMES:
        with pytest.raises(BadInput, match=f"'{name}': the cell has no due times"):
            check_objective(name, oven_cell())
        check_objective(name, oven_cell(1, due_s=(5.0,)))
