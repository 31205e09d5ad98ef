"""Dispatching rules, each on a choice that can be redone by hand."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Route, Stage, Station, one_robot
from lab.sequencing.methods.rules import RULES, dispatch, dispatched, first_come, usable, work_left_s
from lab.sequencing.search import Search
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]
NAMES = ("in", "oven", "mill", "out")


def two_lines(
    order: str, *, oven_room: int = 1, service_s: float = 0.0, due_s: tuple[float, ...] | None = None
) -> Cell:
    """Parts "a" by the oven (10 s), "b" by the mill (30 s). Empty moves 1 s; loaded ones 2 s, to the mill 3 s."""
    stations = (
        Station("in", "storage", 9),
        Station("oven", "machine", oven_room, 10.0),
        Station("mill", "machine", 1, 30.0),
        Station("out", "storage", 9),
    )
    by_oven: Route = (Stage("in"), Stage("oven", service_s=service_s), Stage("out"))
    by_mill: Route = (Stage("in"), Stage("mill"), Stage("out"))
    loaded_s = np.full((4, 4), 2.0)
    loaded_s[:, 2] = 3.0
    np.fill_diagonal(loaded_s, 0.0)
    products = (Product("a", (by_oven,)), Product("b", (by_mill,)))
    return Cell(stations, products, tuple(order), 1.0 - np.eye(4), loaded_s, one_robot("in"), due_s=due_s)


def opposite() -> Cell:
    """Two parts that want each other's machine: a by m then n, b by n then m; loaded moves 2 s, empty 1 s."""
    stations = (
        Station("in", "storage", 9),
        Station("m", "machine", 1, 10.0),
        Station("n", "machine", 1, 10.0),
        Station("out", "storage", 9),
    )
    there: Route = (Stage("in"), Stage("m"), Stage("n"), Stage("out"))
    back: Route = (Stage("in"), Stage("n"), Stage("m"), Stage("out"))
    table = 1.0 - np.eye(4)
    return Cell(
        stations, (Product("a", (there,)), Product("b", (back,))), ("a", "b"), table, 2.0 * table, one_robot("in")
    )


def choose(name: str, cell: Cell, *moves: int) -> int:
    """What the rule takes after these moves."""
    run = Run(cell)
    for decision in moves:
        run.move(decision)
    return RULES[name](run, run.allowed())


def test_the_shortest_move_counts_travel_but_no_waiting() -> None:
    """At first 2 s to the oven, 3 s to the mill; then out of the oven 2 s, though not done, but part 2 1 + 3 s."""
    assert choose("shortest-move", two_lines("ba")) == 2
    assert choose("shortest-move", two_lines("ab"), 1) == 1


def test_the_shortest_move_counts_service() -> None:
    """Out of the oven 5 + 2 s; part 2 from "in" into the mill 1 + 3 s."""
    assert choose("shortest-move", two_lines("ab", service_s=5.0), 1) == 2


def test_the_longest_work_goes_first() -> None:
    """a: 2 + 10 + 2 s; b: 3 + 30 + 2 s. Part 2 in the mill at 3 s has 30 + 2 s left; a second b has 35 s."""
    assert choose("longest-remaining-work", two_lines("ab")) == 2
    assert choose("longest-remaining-work", two_lines("ab"), 2) == 2
    assert choose("longest-remaining-work", two_lines("aba"), 2, 2) == 1


def test_work_left_takes_the_shortest_way(oven_cell: CellMaker, fms_cell: CellMaker) -> None:
    """A rook by lathe 1: 40 + 65 s in, 185 s, pallet 15 s, out 20 + 40 s = 365 s; by lathe 2 60 + 65 + 185 + 15 + 20 + 60."""
    assert work_left_s(oven_cell()) == (14.0, 2.0, 0.0)
    assert work_left_s(fms_cell("R"))[0] == 365.0


def test_the_machine_most_behind_is_fed_first() -> None:
    """Oven 2 x 10 s, mill 30 s: the mill. Once it works, nothing more comes to it, so the oven."""
    assert choose("most-urgent-machine", two_lines("aba")) == 2
    assert choose("most-urgent-machine", two_lines("aba"), 2) == 1


def test_a_machine_is_emptied_to_be_fed() -> None:
    """Four a against one b: the oven is behind (2 + 10 + 30 s), part 1 is in it; the mill would end at 32 s."""
    assert choose("most-urgent-machine", two_lines("aaaab"), 1) == 1


def test_a_larger_machine_is_less_behind() -> None:
    """Four a are 40 s for an oven of one place, more than the mill's 30 s; for one of two places they are 20 s."""
    assert choose("most-urgent-machine", two_lines("aaaab")) == 1
    assert choose("most-urgent-machine", two_lines("aaaab", oven_room=2)) == 5


def test_the_earliest_due_goes_first() -> None:
    assert choose("earliest-due", two_lines("aab", due_s=(90.0, 70.0, 80.0))) == 2
    with pytest.raises(BadInput, match=r"earliest-due.*no due times"):
        choose("earliest-due", two_lines("ab"))


def test_the_nearest_ready_is_picked_soonest() -> None:
    """At the oven at 2 s: part 1 may be picked at 12 s, part 2 at 3 s; then, at the mill at 6 s, part 1 at 12 s."""
    assert choose("nearest-ready", two_lines("ab"), 1) == 2
    assert choose("nearest-ready", two_lines("ab"), 1, 2) == 1


@pytest.mark.parametrize("name", sorted(RULES))
def test_ties_go_to_the_lowest(name: str) -> None:
    assert choose(name, two_lines("aaa", due_s=(50.0,) * 3)) == 1


def test_a_run_of_a_rule(oven_cell: CellMaker) -> None:
    run = Run(oven_cell(2))
    sequence = dispatch(run, RULES["nearest-ready"])
    assert (sequence, run.now_s) == ((1, 1, 2, 2), 29.0)


def test_usable_leaves_out_what_needs_due_times() -> None:
    assert set(RULES) - set(usable(two_lines("ab"))) == {"earliest-due"}
    assert set(usable(two_lines("ab", due_s=(50.0, 50.0)))) == set(RULES)


@pytest.mark.parametrize("name", sorted(RULES))
@given(data=st.data())
def test_every_rule_comes_to_the_end(
    cells: Callable[..., st.SearchStrategy[Cell]], name: str, data: st.DataObject
) -> None:
    """Where routes share no machine, and its cost is the simulated one."""
    cell = data.draw(cells(max_machines=2, max_parts=4, many=True))
    result = dispatched(cell, RULES[name], Search())
    assert result.cost == simulate(cell, result.sequence).makespan_s
    assert result.episode_costs == (result.cost,)


def test_a_rule_may_end_in_a_deadlock() -> None:
    """Both parts go into their first machine, and then stand in each other's way."""
    run = Run(opposite())
    sequence = dispatch(run, RULES["nearest-ready"])
    assert (run.done, sequence) == (False, (1, 2))
    with pytest.raises(WorkFailed, match=r"2 parts .* deadlock"):
        dispatched(opposite(), RULES["nearest-ready"], Search())


def test_an_objective_that_the_cell_has_no_data_for(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="due times"):
        dispatched(oven_cell(), RULES["nearest-ready"], Search(objective="tardy-parts"))


@given(data=st.data())
def test_first_come_always_comes_to_its_end(cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject) -> None:
    cell = data.draw(cells(max_parts=4, many=True))
    assert simulate(cell, first_come(cell)).makespan_s <= cell.longest_s


def test_first_come_gets_around_deadlocks() -> None:
    """Both are ready at once; the second would block the first."""
    assert first_come(opposite()) == (1, 1, 1, 2, 2, 2)
