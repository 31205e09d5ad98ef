"""Stages with alternatives: the same as one route for each way through them, and far fewer positions."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Robot, Stage, Station, one_robot
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run

OTHER = (Stage("second", processing_s=5.0), Stage("third", "third buffer", 7.0))


def cell_of(*route: Stage, parts: int = 1, served: bool = False, robots: tuple[Robot, ...] | None = None) -> Cell:
    """Three machines that take 3, 5 and 7 s, and one that takes 4 s; empty ways take 1 s, with a part 2 s."""
    took = {"first": 3.0, "second": 5.0, "third": 7.0, "last": 4.0}
    room = {"capacity": 9, "servers": 1} if served else {"capacity": 1}
    stations = (
        Station("in", "storage", 9),
        *(Station(name, "machine", processing_s=seconds, **room) for name, seconds in took.items()),  # type: ignore[arg-type]
        Station("third buffer", "buffer", 1),
        Station("out", "storage", 9),
    )
    table = np.ones((len(stations), len(stations))) - np.eye(len(stations))
    return Cell(
        stations, (Product("part", (route,)),), ("part",) * parts, table, 2 * table,
        one_robot("in") if robots is None else robots,
    )  # fmt: skip


def enumerated(cell: Cell) -> Cell:
    """The cell with a route for each way through the alternatives."""
    routes = tuple(
        tuple(replace(way, alternatives=()) for way in ways)
        for route in cell.products[0].routes
        for ways in product(*(stage.ways for stage in route))
    )
    return Cell(
        cell.stations, (Product("part", routes),), cell.order, cell.empty_s, cell.loaded_s, cell.robots,
        buffers=cell.buffers,
    )  # fmt: skip


def test_each_alternative_is_a_choice_and_the_rest_is_shared() -> None:
    cell = cell_of(Stage("in"), Stage("first", alternatives=OTHER), Stage("last"), Stage("out"))
    assert [cell.names[place.station] for place in cell.positions] == [
        *("in", "first", "second", "third", "third buffer", "last", "out")
    ]
    assert Run(cell).allowed() == (1, 2, 3)
    ends_s = [simulate(cell, (choice, 1, 1)).makespan_s for choice in (1, 2, 3)]
    assert ends_s == [2 + 3 + 2 + 4 + 2, 2 + 5 + 2 + 4 + 2, 2 + 7 + 2 + 4 + 2]


@given(
    parts=st.integers(1, 3),
    alternatives=st.lists(st.sampled_from(OTHER), unique=True, max_size=2),
    last=st.booleans(),
    service_s=st.sampled_from([0.0, 6.0]),
)
def test_the_optimum_is_that_of_all_ways(parts: int, alternatives: list[Stage], last: bool, service_s: float) -> None:
    first = Stage("first", service_s=service_s, alternatives=tuple(alternatives))
    cell = cell_of(Stage("in"), first, *([Stage("last")] if last else []), Stage("out"), parts=parts)
    assert optimum(cell).cost == optimum(enumerated(cell)).cost
    assert cp_sat(cell).cost == pytest.approx(optimum(cell).cost)


def test_what_is_changed_is_changed_in_the_alternatives_too() -> None:
    """The window of an alternative goes with the others."""
    either = Stage("first", alternatives=(Stage("second", at_most_s=3.0),))
    cell = cell_of(Stage("in"), either, Stage("out"))
    assert cell.has_windows
    assert not cell.without_windows.has_windows


def test_what_stays_at_its_machine_is_not_carried() -> None:
    """Two operations on the same machine with a server: in there at 2 s, done at 5 s and at 9 s, out at 11 s."""
    twice = (Stage("in"), Stage("first"), Stage("first", processing_s=4.0), Stage("out"))
    cell = cell_of(*twice, served=True)
    schedule = simulate(cell, (1, 1, 1, 1))
    assert schedule.makespan_s == cp_sat(cell).cost == 11.0
    assert [(a.start_s, a.end_s) for a in schedule.machines if a.kind == "process"] == [(2.0, 5.0), (5.0, 9.0)]
    assert [a.kind for a in schedule.robot].count("carry") == 2
    alone = cell_of(*twice[:-1], served=True, robots=())
    assert simulate(alone, (1, 1)).makespan_s == cp_sat(alone).cost == 7.0


def test_flexible_shops_go_on_where_they_are_or_elsewhere() -> None:
    """Two parts, two operations that either of two machines does in 3 or 5 s: 6 s and 10 s apart, or changed over, 8 s each."""
    either = Stage("first", alternatives=(Stage("second", processing_s=5.0),))
    cell = cell_of(Stage("in"), either, either, parts=2, served=True, robots=())
    found = cp_sat(cell)
    assert (found.status, found.cost) == ("optimal", simulate(cell, found.sequence).makespan_s)
    assert found.cost == 9.0  # 3 + 3 on the first, then the other part's second operation there, after 5 on the second


@pytest.mark.parametrize(
    ("route", "says"),
    [
        ((Stage("in", alternatives=(Stage("out"),)), Stage("first"), Stage("out")), "alternatives of the start"),
        (
            (Stage("in"), Stage("first", alternatives=(Stage("first"),)), Stage("out")),
            "stage 2 of the route: 'first' stands there twice",
        ),
        (
            (
                Stage("in"),
                Stage("first", alternatives=(Stage("second", alternatives=(Stage("third"),)),)),
                Stage("out"),
            ),
            "alternatives of an alternative",
        ),
        (
            (Stage("in"), Stage("first", alternatives=(Stage("second"),)), Stage("second"), Stage("out")),
            "station 'second' is on the route twice",
        ),
        ((Stage("in"), Stage("first", alternatives=(Stage("mixer"),)), Stage("out")), "unknown station 'mixer'"),
    ],
)
def test_what_cannot_be(route: tuple[Stage, ...], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        cell_of(*route)
