"""The search of one robot's tours: by hand, against every list of decisions, and on a published instance."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN
from lab.sequencing.cell.stations import Arrivals, Product, Robot, Stage, Station
from lab.sequencing.methods import one_robot as searched
from lab.sequencing.methods.exact import exact
from lab.sequencing.methods.one_robot import one_robot, why_not
from lab.sequencing.search import Search
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run

Ends = Callable[[Run], Iterator[Run]]
CellMaker = Callable[..., Cell]
NEAR = ((0, 1, 1), (1, 0, 1), (1, 1, 0))  # one second between any two of LU, M1 and M2


def test_two_parts_by_hand(job_shop: CellMaker) -> None:
    """Both are at M1 at 1 and 3: the first is worked on from 1 to 11, the second from 11 to 15."""
    found = one_robot(job_shop([[(1, 10.0)], [(1, 4.0)]], NEAR))
    assert (found.cost, found.bound, found.proven, found.rounded_s) == (15.0, 15.0, True, 0.0)


def test_what_comes_first_need_not_be_worked_on_first(job_shop: CellMaker) -> None:
    """Brought first, the second job is at M1 at 1, at M2 at 3 and done at 33; the first has long been done then.

    Brought second, at 3, M1 may still wait for it: it is at M2 at 5 and done at 35.
    """
    jobs = [[(1, 20.0)], [(1, 1.0), (2, 30.0)]]
    found = one_robot(job_shop(jobs, NEAR))
    assert found.cost == 1.0 + 1.0 + 1.0 + 30.0
    waited = simulate(job_shop(jobs, NEAR), (1, 2, 2, 2, 2, 1))
    assert waited.makespan_s == 3.0 + 1.0 + 1.0 + 30.0


@settings(max_examples=40)
@given(data=st.data(), operations=st.sampled_from([(3, 3), (2, 1, 1)]))
def test_no_list_of_decisions_is_shorter(
    job_shops: Callable[..., st.SearchStrategy[Cell]], ends: Ends, data: st.DataObject, operations: tuple[int, ...]
) -> None:
    cell = data.draw(job_shops(operations))
    found = one_robot(cell)
    assert found.proven
    assert found.cost == simulate(cell, found.sequence).makespan_s == min(run.end_s for run in ends(Run(cell)))


def test_a_published_instance_with_one_vehicle(ex11: Callable[[int], Cell]) -> None:
    """CP-SAT proves the same 161, see `test_cp_sat_transport`."""
    cell = ex11(1)
    found = one_robot(cell)
    assert (found.cost, found.bound) == (161.0, 161.0)
    assert simulate(cell, found.sequence).makespan_s == 161.0
    assert exact(cell, Search(), np.random.default_rng(0)).cost == 161.0


@pytest.mark.parametrize("width", [1, 30])
def test_a_search_that_was_too_narrow_is_widened(
    ex11: Callable[[int], Cell], monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    monkeypatch.setattr(searched, "FIRST_WIDTH", width)
    assert one_robot(ex11(1)).bound == 161.0


def test_without_time_the_best_found_and_the_bound(
    ex11: Callable[[int], Cell], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(searched, "FIRST_WIDTH", 1)
    found = one_robot(ex11(1), time_limit_s=1e-9)
    assert found.bound <= 161.0 <= found.cost == simulate(ex11(1), found.sequence).makespan_s


def test_speed_service_and_an_end_at_a_store(job_shop: CellMaker) -> None:
    """Twice as fast: 0.5 s to M1, 10 s there, 3 s of service, 0.5 s to the store."""
    cell = job_shop([[(1, 10.0)]], NEAR)
    stations = (*cell.stations[:2], Station("store", "storage", 1))
    route = (Stage("LU"), Stage("M1", processing_s=10.0, service_s=3.0), Stage("store"))
    cell = replace(cell, stations=stations, products=(Product("job 1", (route,)),), robots=(Robot("fast", "M1", 2.0),))
    assert one_robot(cell).cost == 0.5 + 0.5 + 10.0 + 3.0 + 0.5


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"vehicles": 2}, "one robot"),
        ({"arrivals": Arrivals((1.0, 1.0))}, "arrive"),
    ],
)
def test_what_it_does_not_know(job_shop: CellMaker, change: dict[str, object], reason: str) -> None:
    cell = job_shop([[(1, 1.0)], [(2, 1.0)]], NEAR, **change)
    assert reason in why_not(cell)
    with pytest.raises(BadInput, match=reason):
        one_robot(cell)
    assert exact(cell, Search(objective=MAKESPAN), np.random.default_rng(0)).cost > 0  # by CP-SAT then


def test_no_table_that_does_not_fit(job_shop: CellMaker) -> None:
    assert "too many states" in why_not(job_shop([[(1, 1.0), (2, 1.0)]] * 20, NEAR))
