"""CP-SAT on several robots, servers, rooms and setups: by hand, against every list of decisions, and on a published instance."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import OBJECTIVES, cost
from lab.sequencing.cell.stations import Arrivals, Product, Robot, Stage, Station
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.cp_sat_tasks import possible_tasks
from lab.sequencing.methods.rules import first_come
from lab.sequencing.simulate.follow import follow, simulate
from lab.sequencing.simulate.run import Run

Ends = Callable[[Run], Iterator[Run]]
CellMaker = Callable[..., Cell]
NEAR = ((0, 1, 1), (1, 0, 1), (1, 1, 0))  # one second between any two of LU, M1 and M2


@pytest.mark.parametrize(("vehicles", "ends_s"), [(1, 15.0), (2, 15.0)])
def test_two_parts_by_hand(job_shop: CellMaker, vehicles: int, ends_s: float) -> None:
    """M1 has 14 s of work, and nothing to do in the first second."""
    found = cp_sat(job_shop([[(1, 10.0)], [(1, 4.0)]], NEAR, vehicles))
    assert (found.status, found.cost, found.bound) == ("optimal", ends_s, ends_s)


@pytest.mark.parametrize(("vehicles", "ends_s"), [(1, 161.0), (2, 96.0)])
def test_a_published_instance(ex11: Callable[[int], Cell], vehicles: int, ends_s: float) -> None:
    """96 is the printed best value of EX11; with symmetric times it would be 86."""
    cell = ex11(vehicles)
    found = cp_sat(cell)
    assert (found.status, found.cost, found.bound) == ("optimal", ends_s, ends_s)
    assert simulate(cell, found.sequence).makespan_s == ends_s


def test_the_faster_robot_and_the_one_that_may(job_shop: CellMaker) -> None:
    """From M1 only the slow one may carry on: 1 / 2 s, 3 s of work, and 1 s."""
    robots = (Robot("fast", "LU", 2.0, ("LU", "M1")), Robot("slow", "M1", 1.0, ("M1", "M2")))
    cell = job_shop([[(1, 3.0), (2, 5.0)]], NEAR, robots=robots)
    found = cp_sat(cell)
    assert found.cost == found.bound == 0.5 + 3.0 + 1.0 + 5.0


def test_setups_are_between_products(job_shop: CellMaker) -> None:
    """Two of each: one change, 10 s from the second to the first, or 1 s the other way."""
    cell = job_shop([[(1, 5.0)], [(1, 5.0)]], NEAR, 2)
    changes = (("job 1", "job 2", 1.0), ("job 2", "job 1", 10.0))
    stations = (cell.stations[0], replace(cell.stations[1], setups=changes), cell.stations[2])
    cell = replace(cell, stations=stations, order=("job 2", "job 1", "job 2", "job 1"), due_s=(0.0,) * 4)
    found = cp_sat(cell)
    assert (found.status, found.cost) == ("optimal", 1.0 + 4 * 5.0 + 1.0)


def rooms_cell(**change: object) -> Cell:
    """Two jobs that cross each other, by two robots, through machines with room for one."""
    stations = (Station("in", "storage", 2), Station("A", "machine", 1, 3.0), Station("B", "machine", 1, 3.0))
    ways = ("in", "A", "B", "out"), ("in", "B", "A", "out")
    products = tuple(Product("".join(way), (tuple(Stage(name) for name in way),)) for way in ways)
    table = 1.0 - np.eye(4)
    order = tuple(product.name for product in products)
    described = {"robots": (Robot("left", "in"), Robot("right", "in"))} | change
    return Cell((*stations, Station("out", "storage", 2)), products, order, table, table, **described)  # type: ignore[arg-type]


def test_parts_change_places_where_two_robots_hold_them() -> None:
    """Each is in the other one's way, and both are taken out at 4 s: 1 + 3 + 1 + 3 + 1 s, as if each were alone."""
    cell = rooms_cell()
    found = cp_sat(cell)
    assert found.status == "optimal"
    assert simulate(cell, found.sequence).makespan_s == found.cost == found.bound == 9.0


def test_a_detour_that_takes_longer_than_the_best_order_does_not_hide_it() -> None:
    """Two robots bring parts to a machine, 1 s, where a server works for 4 s on each; by its buffer it would take 40 s."""
    far = np.array([[0, 1, 20], [1, 0, 20], [20, 20, 0]], float)
    stations = Station("in", "storage", 9), Station("m", "machine", 2, 4.0, servers=1), Station("b", "buffer", 1)
    product = Product("p", ((Stage("in"), Stage("m", "b")),))
    robots = Robot("r1", "in"), Robot("r2", "in")
    cell = Cell(stations, (product,), ("p",) * 3, far, far, robots, buffers="free")
    assert cost(follow(cell, first_come(cell)), "makespan") == 13.0
    found = cp_sat(cell)
    assert (found.status, found.cost, found.bound) == ("optimal", 13.0, 13.0)


def test_a_server_works_on_a_part_twice_in_a_row() -> None:
    """Part a is in A from 1 to 3 s, in B from 4 to 7 s, in A again from 8 to 10 s; b, after it in A, is late anyhow."""
    served = (
        Station(name, "machine", 2, 2.0, None, 1, setups) for name, setups in (("A", (("b", "a", 9.0),)), ("B", ()))
    )
    routes = {"a": (Stage("A"), Stage("B", processing_s=3.0), Stage("A")), "b": (Stage("A", processing_s=20.0),)}
    products = tuple(Product(name, ((Stage("in"), *stages),)) for name, stages in routes.items())
    table = 1.0 - np.eye(3)
    stations = (Station("in", "storage", 2), *served)
    cell = Cell(stations, products, ("a", "b"), table, table, (Robot("r", "in"),), due_s=(10.0, 10.0))
    found = cp_sat(cell, "tardy-parts")
    assert (found.status, found.cost) == ("optimal", 1.0)


def test_every_list_of_crossing_parts(ends: Ends) -> None:
    cell = rooms_cell()
    assert cp_sat(cell).cost == min(run.end_s for run in ends(Run(cell)))


@settings(max_examples=25, deadline=None)
@given(data=st.data(), objective=st.sampled_from(sorted(OBJECTIVES)))
def test_job_shops_of_two_vehicles(
    job_shops: Callable[..., st.SearchStrategy[Cell]], ends: Ends, data: st.DataObject, objective: str
) -> None:
    cell = replace(data.draw(job_shops((2, 1), 2)), due_s=(15.0, 20.0))
    found = cp_sat(cell, objective)
    assert found.status == "optimal"
    assert found.cost == pytest.approx(min(cost(run, objective) for run in ends(Run(cell))))
    assert found.cost == cost(follow(cell, found.sequence), objective)


@st.composite
def drawn_cells(draw: st.DrawFn) -> Cell:
    """Two parts through machines with room for one or a queue, one or two robots; with windows, arrivals, two routes."""
    seconds = st.integers(0, 9).map(float)
    stations = [Station("in", "storage", 2), Station("out", "storage", 2), Station("buffer", "buffer", 1)]
    for name in "AB":
        served = draw(st.booleans())
        window_s = draw(st.sampled_from([None, None, 3.0]))
        stations.append(Station(name, "machine", 1, draw(seconds), window_s, 1 if served else None))
    routes = []
    for _ in range(draw(st.integers(1, 2))):
        middle = draw(st.sampled_from(["A", "B", "AB", "BA"]))
        waits = draw(st.booleans()) and stations["AB".index(middle[0]) + 3].servers is None
        stages = [Stage(name, "buffer" if waits and n == 0 else None) for n, name in enumerate(middle)]
        routes.append((Stage("in"), *stages, Stage("out")))
    robots = tuple(Robot(name, draw(st.sampled_from(["in", "A"]))) for name in ("r1", "r2")[: draw(st.integers(1, 2))])
    empty_s, loaded_s = (
        np.array([[0.0 if a == b else 1.0 + draw(seconds) for b in range(5)] for a in range(5)]) for _ in range(2)
    )
    arrivals = draw(st.sampled_from([None, Arrivals((2.0, 5.0), "clock"), Arrivals((2.0, 5.0), "pick")]))
    buffers = draw(st.sampled_from(["busy", "free"]))
    product = Product("part", tuple(routes))
    place = tuple(stations), (product,), ("part", "part"), empty_s, loaded_s, robots, arrivals, buffers, (20.0, 25.0)
    return Cell(*place)  # type: ignore[arg-type]


@settings(max_examples=25, deadline=None)
@given(cell=drawn_cells(), objective=st.sampled_from(sorted(OBJECTIVES)))
def test_random_cells(ends: Ends, cell: Cell, objective: str) -> None:
    """Rooms, windows, buffers, arrivals, routes to choose from: no list that never waits on purpose is below the bound.

    A plan of two robots may be one that no list says.
    """
    best = min((cost(run, objective) for run in ends(Run(cell))), default=inf)
    found = cp_sat(cell, objective)
    assert found.bound <= best + 1e-6
    if found.sequence:
        assert found.cost == cost(follow(cell, found.sequence), objective)
    if len(cell.robots) == 1:
        assert found.status in ("optimal", "impossible")
        assert found.cost == pytest.approx(best, abs=1e-6) if not cell.has_windows else found.cost <= best + 1e-6


def test_it_begins_with_the_sequence_it_is_given(ex11: Callable[[int], Cell]) -> None:
    """Nothing longer than the hint is looked at: a bound of it is all that a moment can give."""
    cell = ex11(2)
    found = cp_sat(cell, hint=cp_sat(cell).sequence, time_limit_s=5.0)
    assert found.cost == 96.0
    with pytest.raises(BadInput, match="hint"):
        cp_sat(cell, hint=(1, 1, 1, 1, 1, 1, 1, 1))
    with pytest.raises(BadInput, match="hint: the sequence ends after"):
        cp_sat(cell, hint=first_come(cell)[:-1])


def test_without_time_the_hint_is_what_there_is(ex11: Callable[[int], Cell]) -> None:
    cell = ex11(2)
    found = cp_sat(cell, time_limit_s=1e-6)
    assert (found.status, found.sequence) == ("feasible", first_come(cell))
    assert found.bound <= 96.0 < found.cost == simulate(cell, found.sequence).makespan_s


def test_workers(ex11: Callable[[int], Cell]) -> None:
    assert cp_sat(ex11(2), workers=2).cost == 96.0
    with pytest.raises(BadInput, match="workers"):
        cp_sat(ex11(2), workers=0)


def test_times_that_are_not_whole(job_shop: CellMaker) -> None:
    """A third of a second is rounded, and said so; the cost is the simulation's."""
    cell = job_shop([[(1, 1 / 3)], [(1, 1 / 3)]], NEAR, 2)
    found = cp_sat(cell)
    assert found.rounded_s > 0
    assert found.cost == pytest.approx(1 + 2 / 3)


def test_alike_robots_are_counted_once(job_shop: CellMaker) -> None:
    """Two moves to carry it and two to work on it, whoever carries; two that are not alike are to choose from."""
    jobs = [[(1, 1.0), (2, 1.0)]]
    assert possible_tasks(job_shop(jobs, NEAR, 1)) == possible_tasks(job_shop(jobs, NEAR, 9)) == 4
    robots = (Robot("fast", "LU", 2.0), Robot("slow", "LU"))
    assert possible_tasks(job_shop(jobs, NEAR, robots=robots)) == 6
