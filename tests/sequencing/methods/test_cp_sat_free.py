"""Robots wherever they are wanted: a bound that no list of decisions is below, and moves carried out by those that there are."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import OBJECTIVES, cost
from lab.sequencing.cell.stations import Robot
from lab.sequencing.methods.cp_sat import carried_out, free_robots
from lab.sequencing.methods.shared import Shared
from lab.sequencing.search import SAME
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run

NEAR = ((0, 1, 1), (1, 0, 1), (1, 1, 0))  # one second between any two of LU, M1 and M2


def test_the_bound_by_hand(job_shop: Callable[..., Cell]) -> None:
    """One vehicle, two jobs of 2 s on M1 and M2: it carries for 2 s, then 2 s of work; but it has to come back first, 1 s."""
    cell = job_shop([[(1, 2.0)], [(2, 2.0)]], NEAR, 1)
    shared = Shared(cell, "makespan")
    free_robots(shared, 10.0, 0, 1)
    assert (shared.bound, shared.cost) == (4.0, 5.0)


def test_the_robot_that_can_pick_soonest_carries(job_shop: Callable[..., Cell]) -> None:
    """From LU, position 0 of a part, to M1, where it waits, and is worked on: by the one that stands there already."""
    cell = job_shop([[(1, 3.0)]], NEAR, robots=(Robot("far", "M2"), Robot("near", "LU")))
    order = carried_out(cell, [(0, place, place + 1) for place in range(2)])
    assert simulate(cell, order).makespan_s == 1.0 + 3.0  # the other one would take a second to come


def test_moves_that_cannot_be_made_give_no_order(job_shop: Callable[..., Cell]) -> None:
    cell = job_shop([[(1, 3.0)]], NEAR, 1)
    assert carried_out(cell, [(0, 1, 2)]) == ()
    assert carried_out(cell, [(0, 0, 1)]) == ()


@settings(max_examples=15, deadline=None)
@given(data=st.data(), objective=st.sampled_from(sorted(set(OBJECTIVES) - {"robot-idle"})))
def test_no_list_of_decisions_is_below_the_bound(
    shops: Callable[..., st.SearchStrategy[Cell]],
    ends: Callable[[Run], Iterator[Run]],
    data: st.DataObject,
    objective: str,
) -> None:
    cell = replace(cell := data.draw(shops(2)), due_s=(15.0,) * cell.parts)
    shared = Shared(cell, objective)
    free_robots(shared, 10.0, 0, 1)
    least = min((cost(run, objective) for run in ends(Run(cell))), default=float("inf"))
    assert shared.bound <= least + SAME
    assert shared.cost >= least - SAME
