"""CP-SAT on shops, flexible ones among them: by hand, and against every list of decisions."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, cost
from lab.sequencing.cell.stations import UNLIMITED, Begins, Product, Robot, Stage, Station
from lab.sequencing.methods import cp_sat as module
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.cp_sat_shop import shop_of
from lab.sequencing.simulate.follow import follow
from lab.sequencing.simulate.run import Run

Ends = Callable[[Run], Iterator[Run]]
Operation = dict[int, float]  # from a machine, numbered from 1, to its seconds


def flexible(jobs: Sequence[Sequence[Operation]], travel_s: object = None, vehicles: int = 0, **change: object) -> Cell:
    """Parts whose operations take one of several machines, each with one server and room for all."""
    machines = 1 + max(machine for job in jobs for ways in job for machine in ways)
    stations = (
        Station("LU", "storage", UNLIMITED),
        *(Station(f"M{n}", "machine", UNLIMITED, servers=1) for n in range(1, machines)),
    )

    def stage(ways: Operation) -> Stage:
        first, *more = (Stage(f"M{machine}", processing_s=seconds) for machine, seconds in ways.items())
        return replace(first, alternatives=tuple(more))

    products = tuple(Product(f"job {n}", ((Stage("LU"), *map(stage, job)),)) for n, job in enumerate(jobs, 1))
    travel = np.zeros((machines, machines)) if travel_s is None else np.array(travel_s, float)
    robots = tuple(Robot(f"vehicle {n}", "LU") for n in range(1, vehicles + 1))
    described = {
        "stations": stations,
        "products": products,
        "order": tuple(one.name for one in products),
        "robots": robots,
    }
    return Cell(**(described | {"empty_s": travel, "loaded_s": travel} | change))  # type: ignore[arg-type]


def test_two_parts_share_the_fast_machine_or_not() -> None:
    """M1 takes 3 s, M2 5 s: one part each, 5 s, where both on M1 take 6 s."""
    found = cp_sat(flexible([[{1: 3.0, 2: 5.0}], [{1: 3.0, 2: 5.0}]]))
    assert (found.status, found.cost, found.bound) == ("optimal", 5.0, 5.0)


def test_the_vehicle_decides_for_the_near_machine() -> None:
    """M1: 1 s of way and 8 s; M2: 6 s of way and 5 s."""
    cell = flexible([[{1: 8.0, 2: 5.0}]], [[0, 1, 6], [1, 0, 5], [6, 5, 0]], 1)
    found = cp_sat(cell)
    assert (found.status, found.cost) == ("optimal", 9.0)
    assert follow(cell, found.sequence).moves[0].target == "M1"


def test_a_part_stays_where_its_next_operation_is() -> None:
    """2 s of way, 4 s on M1, then 3 s there; M2 would take 1 s, but is 5 s away."""
    cell = flexible([[{1: 4.0}, {1: 3.0, 2: 1.0}]], [[0, 2, 9], [2, 0, 5], [9, 5, 0]], 1)
    found = cp_sat(cell)
    assert (found.status, found.cost) == ("optimal", 9.0)


@pytest.mark.parametrize("look", [0.0, 5.0])
def test_without_a_choice_either_model_proves_it(monkeypatch: pytest.MonkeyPatch, look: float) -> None:
    """2 s of way to either machine and 4 s of work: 6 s with two vehicles; where the shop's model has no time, the other does."""
    monkeypatch.setattr(module, "SHOP_LOOK", look)
    cell = flexible([[{1: 4.0}], [{2: 4.0}]], [[0, 2, 2], [2, 0, 5], [2, 5, 0]], 2)
    found = cp_sat(cell)
    assert (found.status, found.cost, found.bound) == ("optimal", 6.0, 6.0)


def test_what_is_more_than_a_shop_is_none() -> None:
    cell = flexible([[{1: 3.0, 2: 5.0}, {2: 1.0}], [{1: 3.0}, {2: 1.0}]], [[0, 1, 1], [1, 0, 1], [1, 1, 0]], 1)
    assert shop_of(cell, MAKESPAN) is not None
    small = replace(cell.stations[1], capacity=1)
    assert shop_of(replace(cell, stations=(cell.stations[0], small, cell.stations[2])), MAKESPAN) is None
    assert shop_of(cell, "machine-idle") is None
    slow = (Robot("a", "LU"), Robot("b", "LU", 0.5))
    assert shop_of(replace(cell, robots=slow), MAKESPAN) is None


@st.composite
def shops(draw: st.DrawFn) -> Cell:
    vehicles = draw(st.integers(0, 2))
    ways = st.dictionaries(st.integers(1, 3), st.integers(0, 9).map(float), min_size=1, max_size=2)
    jobs = draw(st.lists(st.lists(ways, min_size=1, max_size=2), min_size=1, max_size=3 if vehicles < 2 else 2))
    machines = 1 + max(machine for job in jobs for one in job for machine in one)
    travel = [[0 if a == b else draw(st.integers(1, 9)) for b in range(machines)] for a in range(machines)]
    due = tuple(draw(st.integers(0, 30).map(float)) for _ in jobs)
    cell = flexible(jobs, travel if vehicles else None, vehicles, due_s=due)
    come = draw(st.lists(st.integers(0, 9).map(float), min_size=len(jobs), max_size=len(jobs)))
    return replace(cell, begins=tuple(map(Begins, cell.starts, come))) if any(come) else cell


@pytest.mark.parametrize("objective", [MAKESPAN, "mean-tardiness", "tardy-parts"])
@settings(max_examples=25, deadline=None)
@given(cell=shops())
def test_no_list_of_decisions_is_better(ends: Ends, objective: str, cell: Cell) -> None:
    found = cp_sat(cell, objective)
    assert found.status == "optimal"
    assert found.cost == pytest.approx(min(cost(run, objective) for run in ends(Run(cell))))
    assert found.cost == pytest.approx(cost(follow(cell, found.sequence), objective))
