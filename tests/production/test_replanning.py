"""The rest of the work ordered anew, by hand: two toasts through one oven, in the middle, with one lost or in the gripper."""

from dataclasses import replace

import numpy as np
import pytest

from lab.errors import WorkFailed
from lab.production.replanning import Planner, in_another, plan_again
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.simulate.rest import Mishaps
from lab.sequencing.simulate.run import Run
from lab.tasks.sequencing import Sequencing


def oven(seconds: float = 10.0) -> Cell:
    """2 s in, the oven's time, 2 s out; the robot comes back in 1 s: two toasts take 29 s."""
    stations = (Station("in", "storage", 9), Station("hot", "machine", 1, seconds), Station("out", "storage", 9))
    step = np.ones((3, 3)) - np.eye(3)
    route = (Stage("in"), Stage("hot"), Stage("out"))
    return Cell(stations, (Product("toast", (route,)),), ("toast", "toast"), step, 2 * step, one_robot("in"))


@pytest.fixture
def run() -> Run:
    """Toast 1 has just been brought into the oven."""
    run = Run(oven())
    run.move(1)
    return run


def test_the_rest_takes_what_is_left_of_the_whole(run: Run) -> None:
    found = plan_again(run, Mishaps())
    assert found.sequence == (1, 2, 2)
    assert found.proven is not None
    assert found.proven.cost == pytest.approx(29.0 - 2.0)
    assert (found.proven.proven, dict(found.stuck)) == (True, {})
    assert found.schedule is not None
    assert found.schedule.makespan_s == found.proven.cost


def test_a_lost_part_is_left_out(run: Run) -> None:
    assert plan_again(run, Mishaps(lost=frozenset({2}))).sequence == (1,)
    assert plan_again(run, Mishaps(lost=frozenset({1}))).sequence == (2, 2)
    assert plan_again(run, Mishaps(lost=frozenset({1, 2}))).sequence == ()


def test_what_is_in_the_gripper_comes_first() -> None:
    """All of it takes 29 s, whichever toast is first."""
    found = plan_again(Run(oven()), Mishaps(), under_way=2)
    assert (found.sequence, found.method) == ((2, 2, 1, 1), "srl-time")
    assert found.schedule is not None
    assert found.proven is not None
    assert (found.schedule.makespan_s, found.proven.cost, found.proven.bound_s) == pytest.approx((29.0, 29.0, 29.0))
    assert (found.proven.sequence, found.proven.proven) == ((2, 2, 1, 1), True)


def test_beside_what_is_in_the_gripper_a_part_may_be_stuck() -> None:
    """Toast 1 is in the oven, which is closed; toast 2, which goes through the other one, takes 2 + 10 + 2 s after 2 s of way."""
    stations = (
        *(Station("in", "storage", 9), Station("hot", "machine", 1, 10.0)),
        *(Station("warm", "machine", 1, 10.0), Station("out", "storage", 9)),
    )
    products = tuple(Product(name, ((Stage("in"), Stage(name), Stage("out")),)) for name in ("hot", "warm"))
    step = np.ones((4, 4)) - np.eye(4)
    run = Run(Cell(stations, products, ("hot", "warm"), step, 2 * step, one_robot("in")))
    run.move(1)
    found = plan_again(run, Mishaps(closed=("hot",)), under_way=2)
    assert found.schedule is not None
    assert found.proven is not None
    assert (found.sequence, found.schedule.makespan_s, list(found.stuck)) == ((2, 2), 15.0, [1])
    assert (found.proven.bound_s, found.proven.proven) == (15.0, True)


def test_with_windows_nothing_is_proven_of_what_is_in_the_gripper() -> None:
    """It may have to be held for a while."""
    cell = oven()
    route = (Stage("in"), Stage("hot", at_most_s=20.0), Stage("out"))
    found = plan_again(Run(replace(cell, products=(Product("toast", (route,)),))), Mishaps(), under_way=2)
    assert found.schedule is not None
    assert (found.sequence, found.schedule.makespan_s, found.proven) == ((2, 2, 1, 1), 29.0, None)


def test_what_is_in_the_gripper_and_has_nowhere_to_go_stops_the_work(run: Run) -> None:
    with pytest.raises(WorkFailed, match="toast 2 is in the gripper and cannot be brought on: take it out"):
        plan_again(run, Mishaps(), under_way=2)  # toast 1 is in the oven


def test_what_is_in_an_oven_that_is_out_of_order_is_stuck(run: Run) -> None:
    found = plan_again(run, Mishaps(closed=("hot",)))
    assert found.sequence == ()
    assert list(found.stuck) == [1, 2]
    assert found.stuck[1] == "toast 1 is not done in 'hot', which is out of use"


def test_the_same_state_in_a_cell_with_other_times(run: Run) -> None:
    other = in_another(run, oven(30.0))
    assert (other.locations, other.now_s, other.robot) == (run.locations, run.now_s, run.robot)
    assert plan_again(other, Mishaps()).sequence == (1, 2, 2)


@pytest.mark.parametrize("method", ["srl", "srl-time", "fifo", "exact"])
def test_the_rest_is_ordered_by_the_runs_method(run: Run, method: str) -> None:
    found = plan_again(run, Mishaps(), planner=Planner(Sequencing(method=method, episodes=20)))
    assert (found.method, sorted(found.sequence)) == (method, [1, 2, 2])


def test_a_method_that_is_not_made_for_the_rest_gives_way_to_the_exact_search(run: Run) -> None:
    found = plan_again(run, Mishaps(), planner=Planner(Sequencing(method="earliest-due")))  # there are no due times
    assert (found.method, found.sequence) == ("exact", (1, 2, 2))
