"""The second opinion: CP-SAT agrees with the exact search and with brute force, and its sequences run."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import OBJECTIVES, WITH_DUE_TIMES, cost
from lab.sequencing.cell.stations import Arrivals, Product, Robot, Stage, Station, one_robot
from lab.sequencing.cell.ways import ways_of
from lab.sequencing.methods.cp_sat import carried_out, cp_sat, cp_sat_sequencer, fits, free_robots
from lab.sequencing.methods.cp_sat_times import Times, longest, timed
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.rules import first_come
from lab.sequencing.methods.shared import Shared
from lab.sequencing.search import SAME, Search
from lab.sequencing.simulate.follow import follow, simulate
from lab.sequencing.simulate.run import Run

Ends = Callable[[Run], Iterator[Run]]
CellMaker = Callable[..., Cell]


@pytest.mark.parametrize("case", ["I", "II", "III"])
@pytest.mark.parametrize("toasts", [1, 3, 4])
def test_toasts(toast_cell: CellMaker, case: str, toasts: int) -> None:
    cell = toast_cell(case, toasts)
    found = cp_sat(cell)
    assert (found.status, found.rounded_s) == ("optimal", 0.0)
    assert found.cost == found.bound == optimum(cell).cost == simulate(cell, found.sequence).makespan_s


@pytest.mark.parametrize(("order", "interval_s"), [("RS", 200.0), ("SR", 100.0), ("RSR", 100.0), ("RSR", 200.0)])
def test_the_fms(fms_cell: CellMaker, order: str, interval_s: float) -> None:
    """Pallets, two lathes to choose from, vacuuming, arrivals after each pick."""
    cell = fms_cell(order, interval_s)
    found = cp_sat(cell)
    assert (found.status, found.cost) == ("optimal", optimum(cell).cost)
    assert simulate(cell, found.sequence).makespan_s == found.cost


@settings(max_examples=20)
@given(data=st.data(), size=st.sampled_from([(1, 3, False), (2, 2, False), (1, 2, True)]))
def test_random_cells(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject, size: tuple[int, int, bool]
) -> None:
    cell = data.draw(cells(*size))
    found = cp_sat(cell)
    assert found.status == "optimal"
    assert found.cost == pytest.approx(optimum(cell).cost, abs=1e-3)
    assert found.bound == pytest.approx(found.cost, abs=1e-3)
    assert simulate(cell, found.sequence).makespan_s == found.cost


@pytest.mark.slow
@settings(max_examples=25)
@given(data=st.data(), objective=st.sampled_from(sorted(OBJECTIVES)))
def test_every_objective(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject, objective: str, ends: Ends
) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=2, many=True))
    came_s = sum(cell.arrivals.interval_s) if cell.arrivals else 0.0
    due_s = tuple(came_s + data.draw(st.integers(5, 80)) for _ in cell.order)
    cell = replace(cell, due_s=due_s)
    found = cp_sat(cell, objective)
    assert found.status == "optimal"
    assert found.cost == cost(follow(cell, found.sequence), objective)
    assert found.bound == pytest.approx(found.cost, abs=1e-3)
    assert found.cost == pytest.approx(min(cost(run, objective) for run in ends(Run(cell))), abs=1e-3)


@pytest.mark.parametrize("order", ["PN", "PNP"])
def test_no_room_for_deadlocks(order: str, ends: Ends) -> None:
    """Pins go from the lathe to the mill, nuts from the mill to the lathe; room for one each."""
    ways = {"P": ("in", "lathe", "mill", "out"), "N": ("in", "mill", "lathe", "out")}
    stations = (Station("in", "storage", 9), Station("lathe", "machine", 1, 7.0), Station("mill", "machine", 1, 3.0))
    products = tuple(Product(name, (tuple(Stage(place) for place in way),)) for name, way in ways.items())
    table = 2.0 * (np.ones((4, 4)) - np.eye(4))
    cell = Cell((*stations, Station("out", "storage", 9)), products, tuple(order), table, table, one_robot("in"))
    found = cp_sat(cell)
    assert (found.status, found.cost) == ("optimal", min(run.now_s for run in ends(Run(cell))))
    assert simulate(cell, found.sequence).makespan_s == found.cost


def test_due_times_tell_alike_parts_apart(oven_cell: CellMaker) -> None:
    """14 s and 29 s are the ends: the second part is wanted first, and only then is none late."""
    cell = oven_cell(2, due_s=(29.0, 14.0))
    found = cp_sat(cell, "tardy-parts")
    assert (found.cost, found.sequence) == (0.0, (2, 2, 1, 1))
    assert cp_sat(replace(cell, due_s=(14.0, 14.0)), "mean-tardiness").cost == 7.5


def test_one_machine_is_bound_by_itself(oven_cell: CellMaker) -> None:
    assert cp_sat(oven_cell(3)).cost == 14.0 + 15.0 + 15.0


def test_two_ovens_hold_no_third(oven_cell: CellMaker, ends: Ends) -> None:
    """100 s for two at a time: the third goes in when the first is out."""
    room = Station("oven", "machine", 2, 100.0)
    stations = oven_cell(3).stations
    cell = oven_cell(3, stations=(stations[0], room, stations[2]))
    found = cp_sat(cell)
    assert found.cost == found.bound == min(run.now_s for run in ends(Run(cell))) > 200


def rack_cell(oven_cell: CellMaker, order: tuple[str, ...], buffers: str) -> Cell:
    """A rack before the oven: toast takes 2 s to it and 2 s on, 100 s directly; bread goes from the start to the end.

    It is 1000 s from the oven back to the start, 1 s from elsewhere.
    """
    stations = (*oven_cell(1).stations, Station("rack", "buffer", 1))
    toast = Product("toast", ((Stage("in"), Stage("oven", "rack"), Stage("out")),))
    bread = Product("bread", ((Stage("in"), Stage("out")),))
    empty_s, loaded_s = np.ones((4, 4)) - np.eye(4), 2.0 * (np.ones((4, 4)) - np.eye(4))
    empty_s[1, 0], loaded_s[0, 1] = 1000.0, 100.0
    change = {"stations": stations, "products": (toast, bread), "order": order, "buffers": buffers}
    return oven_cell(1, **change, empty_s=empty_s, loaded_s=loaded_s)


@pytest.mark.parametrize(
    ("order", "buffers", "ends_s"),
    [
        (("toast", "bread"), "free", 2.0 + 2.0 + 10.0 + 2.0 + 1.0 + 2.0),
        (("toast", "bread"), "busy", 112.0 + 1.0 + 2.0),
        (("toast", "toast", "bread", "bread"), "busy", 112.0 + 1.0 + 112.0 + 1.0 + 2.0 + 1.0 + 2.0),
    ],
)
def test_a_busy_buffer_is_for_when_the_oven_is_full(
    oven_cell: CellMaker, order: tuple[str, ...], buffers: str, ends_s: float, ends: Ends
) -> None:
    """The oven is empty at the start, and again when the robot has brought a toast to the end: toast goes directly."""
    cell = rack_cell(oven_cell, order, buffers)
    assert min(run.now_s for run in ends(Run(cell))) == ends_s
    found = cp_sat(cell)
    assert found.cost == found.bound == ends_s


@pytest.mark.parametrize(("after", "ends_s"), [("clock", 1014.0), ("pick", 1019.0)])
def test_arrivals_by_hand(oven_cell: CellMaker, after: str, ends_s: float) -> None:
    """Every empty way takes 5 s, so the first is picked at 5; 1000 s after it came, or after that pick, comes the other."""
    arrivals = Arrivals((0.0, 1000.0), after)  # type: ignore[arg-type]
    cell = oven_cell(2, robots=one_robot("out"), arrivals=arrivals, empty_s=5.0 * np.ones((3, 3)) - 5.0 * np.eye(3))
    found = cp_sat(cell)
    assert found.cost == found.bound == ends_s


def test_arrivals_by_the_clock(oven_cell: CellMaker) -> None:
    """The second comes at 105 s; until then the robot waits 5 s, 10 s at the oven, and from 20 s on."""
    cell = oven_cell(2, arrivals=Arrivals((5.0, 100.0), "clock"))
    assert cp_sat(cell).cost == 119.0
    assert cp_sat(cell, "robot-idle").cost == 5.0 + 10.0 + 85.0 + 10.0


def test_a_time_limit_leaves_a_bound(toast_cell: CellMaker) -> None:
    """So short that nothing is proven: what is returned is at least the hint, and the bound holds."""
    cell = toast_cell("III", 12)
    best = optimum(cell)
    found = cp_sat(cell, time_limit_s=0.5, hint=best.sequence)
    assert found.bound <= best.cost
    assert found.status == "unknown" or simulate(cell, found.sequence).makespan_s == found.cost


def test_the_same_seed_gives_the_same_sequence(toast_cell: CellMaker) -> None:
    cell = toast_cell("II", 4)
    assert cp_sat(cell, seed=3).sequence == cp_sat(cell, seed=3).sequence


def test_the_sequencer(toast_cell: CellMaker) -> None:
    found = cp_sat_sequencer(toast_cell("II", 3), Search(), np.random.default_rng(0))
    assert (found.cost, found.episode_costs) == (700.0, (700.0,))


@pytest.mark.parametrize("limit_s", [0.0, -1.0, float("inf"), float("nan")])
def test_time_limits_that_are_none(oven_cell: CellMaker, limit_s: float) -> None:
    with pytest.raises(BadInput, match=r"time limit = .*: allowed are finite times above 0"):
        cp_sat(oven_cell(1), time_limit_s=limit_s)


def test_cells_that_are_too_large(toast_cell: CellMaker) -> None:
    """A toast has 7 moves to choose from: 3 stages, 2 buffers to go to and to leave."""
    assert fits(toast_cell("I", 114))
    with pytest.raises(BadInput, match="the 115 parts have 805 moves to choose from; allowed are 800"):
        cp_sat(toast_cell("I", 115))


def test_hints_that_cannot_be(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match=r"hint: .*'oven' full"):
        cp_sat(oven_cell(2), hint=(1, 2, 1, 2))
    with pytest.raises(BadInput, match="hint: the sequence ends after 2 moves"):
        cp_sat(oven_cell(2), hint=(1, 1))


@pytest.mark.parametrize("objective", WITH_DUE_TIMES)
def test_objectives_that_need_due_times(oven_cell: CellMaker, objective: str) -> None:
    with pytest.raises(BadInput, match="no due times"):
        cp_sat(oven_cell(1), objective)


@pytest.mark.parametrize(
    ("seconds", "per_s", "rounded"),
    [(10.0, 1.0, False), (2.5, 10.0, False), (0.001, 1000.0, False), (1 / 3, 1e6, True)],
)
def test_times_are_whole_in_their_unit(oven_cell: CellMaker, seconds: float, per_s: float, rounded: bool) -> None:
    cell = oven_cell(1)
    oven = replace(cell.stations[1], processing_s=seconds)
    times = Times(replace(cell, stations=(cell.stations[0], oven, cell.stations[2])))
    assert times.per_s == per_s
    assert (times.rounded_s > 0) == rounded
    assert times.rounded_s <= 0.5 / per_s


def test_a_move_that_takes_no_time_is_given_a_little(oven_cell: CellMaker) -> None:
    """The model keeps moves in order by their times; it says so, and the sequence is right all the same."""
    cell = oven_cell(2, loaded_s=np.zeros((3, 3)))
    found = cp_sat(cell)
    assert found.rounded_s == 1e-6
    assert found.cost == optimum(cell).cost == 21.0


@given(data=st.data())
def test_model_times_are_those_of_the_simulation(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject
) -> None:
    cell = data.draw(cells(max_parts=4, many=True))
    ways = ways_of(cell)
    times = Times(cell)
    moves = timed(cell, times, ways, first_come(cell))
    makespan_s = simulate(cell, first_come(cell)).makespan_s
    assert moves[-1].drop / times.per_s == pytest.approx(makespan_s, abs=1e-3)
    assert moves[-1].drop <= longest(cell, times, ways)


def test_what_is_not_found_in_time_is_no_deadlock(toast_cell: CellMaker, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nobody knows an order to begin with, and a hundredth of a second is too short to find one."""
    monkeypatch.setattr("lab.sequencing.methods.cp_sat.first_come", lambda cell: ())
    monkeypatch.setattr("lab.sequencing.methods.cp_sat.TIME_LIMIT_S", 0.01)
    with pytest.raises(
        WorkFailed, match=r"^no sequence for 12 parts was found in time by CP-SAT \(0 s\), which does not"
    ):
        cp_sat_sequencer(toast_cell("III", 12), Search(20), np.random.default_rng(0))


# ---- cp sat free ------------------------------------------------------------------------------------------------------


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
