"""The optimum: the printed ones, and brute force on small cells of every sort."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import cost
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.stations import UNLIMITED, Arrivals, Product, Robot, Stage, Station, one_robot
from lab.sequencing.cell.ways import TICKS_PER_S
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import ExactValues, Optimum, exact, optimum
from lab.sequencing.search import Reference, Search
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.merged import MergedCell
from lab.sequencing.simulate.run import Run
from lab_studies.thesis.branch_and_bound import branch_and_bound

Ends = Callable[[Run], Iterator[Run]]
CellMaker = Callable[..., Cell]


def crossing_cell(order: str, buffers: str = "busy") -> Cell:
    """Pins (P) go from the lathe to the mill, nuts (N) from the mill to the lathe; room for one each: deadlocks."""
    stations = (
        Station("in", "storage", 9),
        Station("lathe", "machine", 1, 7.0),
        Station("mill", "machine", 1, 3.0),
        Station("out", "storage", 9),
    )
    ways = {"pin": ("in", "lathe", "mill", "out"), "nut": ("in", "mill", "lathe", "out")}
    products = tuple(Product(name, (tuple(Stage(place) for place in way),)) for name, way in ways.items())
    table = 1.0 + np.arange(16.0).reshape(4, 4) % 3 - np.eye(4) * (1.0 + np.arange(16.0).reshape(4, 4) % 3)
    names = tuple({"P": "pin", "N": "nut"}[letter] for letter in order)
    return Cell(stations, products, names, table, table, one_robot("in"))


@pytest.mark.parametrize(
    ("case", "toasts", "makespan_s"),
    [("I", 3, 513), ("II", 3, 700), ("III", 3, 995), ("I", 4, 663), ("II", 4, 900), ("III", 4, 1290)],
)
def test_the_six_printed_optima(toast_cell: CellMaker, case: str, toasts: int, makespan_s: float) -> None:
    best = optimum(toast_cell(case, toasts))
    assert best.proven
    assert best.cost == best.bound_s == best.optimal_s == makespan_s


@pytest.mark.parametrize("toasts", [12, 30, 100])
@pytest.mark.parametrize(("case", "fixed_s", "each_s"), [("I", 63, 150), ("II", 100, 200), ("III", 110, 295)])
def test_more_toasts_cost_the_same_each(
    toast_cell: CellMaker, toasts: int, case: str, fixed_s: float, each_s: float
) -> None:
    best = optimum(toast_cell(case, toasts, buffer_room=200))
    assert best.proven
    assert best.cost == fixed_s + toasts * each_s
    assert best.expanded < 100 * toasts  # few more than moves are needed: what is alike is opened once


@settings(max_examples=30)
@given(data=st.data(), size=st.sampled_from([(1, 3, False), (2, 2, False), (3, 2, False), (1, 2, True)]))
def test_never_worse_or_better_than_brute_force(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject, size: tuple[int, int, bool], ends: Ends
) -> None:
    """Random tables, capacities, starts; some also with products, routes, pallets, services, arrivals, free buffers."""
    cell = data.draw(cells(*size))
    best = optimum(cell)
    assert best.proven
    assert best.cost == pytest.approx(min(run.now_s for run in ends(Run(cell))), abs=1e-6)
    assert simulate(cell, best.sequence).makespan_s == best.cost


@settings(max_examples=30)
@given(data=st.data())
def test_the_search_that_estimates_nothing_agrees(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject
) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=3, many=True))
    try:
        tree = branch_and_bound(cell, most=3000)
    except BadInput:
        assume(False)
    assert optimum(cell).cost == pytest.approx(simulate(cell, tree.optimal).makespan_s, abs=1e-6)


@given(data=st.data())
def test_states_keep_the_time_of_the_simulation(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject
) -> None:
    """A walk to the end by any moves, and its decisions simulated."""
    cell = data.draw(cells(max_parts=4, many=True))
    merged = MergedCell(cell)
    state = merged.start()
    while not merged.done(state):
        state = data.draw(st.sampled_from(list(merged.successors(state))))
    assert state.now / TICKS_PER_S == pytest.approx(simulate(cell, merged.decisions(state)).makespan_s, abs=1e-6)


def test_what_is_later_here_and_earlier_there_is_kept(toast_cell: CellMaker, ends: Ends) -> None:
    """Times with which two states that are alike otherwise are each the better one in something, and the best needs both."""
    tens = [
        [0, 5, 3, 5, 9, 9],
        [3, 0, 2, 8, 4, 7],
        [6, 8, 0, 9, 8, 1],
        [1, 2, 6, 0, 2, 1],
        [9, 6, 1, 3, 0, 3],
        [7, 3, 6, 1, 8, 0],
    ]
    cell, slow = toast_cell("I", 2), {"toaster": 110.0, "butter": 130.0}
    stations = tuple(replace(station, processing_s=slow.get(station.name, 0.0)) for station in cell.stations)
    cell = replace(cell, stations=stations, empty_s=10.0 * np.array(tens), loaded_s=10.0 * np.array(tens))
    assert optimum(cell).cost == min(run.now_s for run in ends(Run(cell))) == 760.0


@pytest.mark.parametrize("order", ["PN", "PNP", "PNN", "NNPP"])
def test_deadlocks_lead_nowhere(order: str, ends: Ends) -> None:
    cell = crossing_cell(order)
    stuck = Run(cell)
    for decision in (order.index("P") + 1, order.index("N") + 1):
        stuck.move(decision)
    assert list(ends(stuck)) == []
    best = optimum(cell)
    assert best.proven
    assert best.cost == min(run.now_s for run in ends(Run(cell)))


def test_the_fms_in_the_order_of_arrival(fms_cell: CellMaker, ends: Ends) -> None:
    """Thesis App. III: all sequences of a rook and a sign."""
    cell = fms_cell("RS")
    assert optimum(cell).cost == min(run.now_s for run in ends(Run(cell))) == 1375.0


def test_alike_parts_leave_each_station_first_in_first_out(toast_cell: CellMaker) -> None:
    cell = toast_cell("III", 5)
    run, waiting = Run(cell), dict[int, list[int]]()
    for decision in optimum(cell).sequence:
        part = part_of(decision, cell.parts)
        place = run.locations[part - 1]
        assert waiting.get(place, [part])[0] == part
        waiting[place] = waiting.get(place, [part])[1:]
        run.move(decision)
        waiting.setdefault(run.locations[part - 1], []).append(part)
        waiting = {place: queue for place, queue in waiting.items() if queue}
    first = list(dict.fromkeys(optimum(cell).sequence))
    assert first == [1, 2, 3, 4, 5]


def test_giving_up_says_what_is_proven(toast_cell: CellMaker) -> None:
    """After 10 states: a sequence that works, not proven, with a bound below the true 663 s."""
    cell = toast_cell("I", 4)
    best = optimum(cell, max_expanded=10)
    assert not best.proven
    assert best.optimal_s is None
    assert best.expanded == 10
    assert 0 < best.bound_s <= 663 <= best.cost
    assert simulate(cell, best.sequence).makespan_s == best.cost


def test_it_gives_up_before_all_memory_is_taken(toast_cell: CellMaker, monkeypatch: pytest.MonkeyPatch) -> None:
    """As after so many states; what is kept of each counts, not how many there are."""
    cell = toast_cell("I", 4)
    monkeypatch.setattr("lab.sequencing.methods.exact.MOST_KEPT", 100)
    best = optimum(cell)
    assert not best.proven
    assert 0 < best.expanded <= 100
    assert 0 < best.bound_s <= 663 <= best.cost
    assert simulate(cell, best.sequence).makespan_s == best.cost


def test_giving_up_at_once_still_finds_a_way_out_of_deadlocks() -> None:
    cell = crossing_cell("PNPN")
    best = optimum(cell, max_expanded=1)
    assert (best.proven, best.expanded) == (False, 1)
    assert simulate(cell, best.sequence).makespan_s == best.cost


def test_more_states_never_lower_the_bound(toast_cell: CellMaker) -> None:
    bounds = [optimum(toast_cell("I", 6), most).bound_s for most in (0, 10, 20, 1000)]
    assert all(one <= other for one, other in pairwise(bounds))
    assert bounds[-1] == 963


def test_a_full_buffer_costs_time(toast_cell: CellMaker) -> None:
    roomy, tight = optimum(toast_cell("I", 4)), optimum(toast_cell("I", 4, buffer_room=1))
    assert tight.proven
    assert tight.cost >= roomy.cost


@pytest.mark.parametrize(("after", "ends_s"), [("clock", 1014.0), ("pick", 1019.0)])
def test_arrivals_by_hand(oven_cell: CellMaker, after: str, ends_s: float) -> None:
    """Every empty way takes 5 s, so the first is picked at 5; 1000 s after it came, or after that pick, comes the other."""
    cell = oven_cell(2, robots=one_robot("out"), arrivals=Arrivals((0.0, 1000.0), after))  # type: ignore[arg-type]
    cell = replace(cell, empty_s=5.0 * np.ones((3, 3)) - 5.0 * np.eye(3))
    assert optimum(cell).cost == ends_s


def test_gap() -> None:
    best = Optimum(110.0, (1,), False, 100.0, 1)
    assert best.gap(120.0) == pytest.approx(0.2)
    assert Optimum(0.0, (1,), True, 0.0, 1).gap(0.0) == 0.0
    assert Optimum(0.0, (1,), True, 0.0, 1).gap(1.0) == np.inf


@given(bound_s=st.floats(1.0, 1e6), off=st.floats(-1e-7, 1e-7))
def test_a_gap_of_nothing_but_rounding_is_0(bound_s: float, off: float) -> None:
    """-5e-12 is none, however the sums of the two were rounded."""
    cost = bound_s * (1.0 + off)
    assert Optimum(bound_s, (1,), True, bound_s, 1).gap(cost) == Reference(bound_s, True, "A*").gap(cost) == 0.0


@pytest.mark.parametrize("objective", ["makespan", "mean-tardiness", "tardy-parts", "robot-idle", "machine-idle"])
def test_the_sequencer_is_exact_for_every_objective(toast_cell: CellMaker, objective: str, ends: Ends) -> None:
    cell = replace(toast_cell("II", 2), due_s=(350.0, 450.0))
    found = exact(cell, Search(objective=objective), np.random.default_rng(0))
    assert found.cost == min(cost(run, objective) for run in ends(Run(cell)))
    assert found.episode_costs == (found.cost,)
    simulate(cell, found.sequence)


def test_what_is_not_proven_is_improved_by_cp_sat(toast_cell: CellMaker, monkeypatch: pytest.MonkeyPatch) -> None:
    cell = toast_cell("II", 3)
    rough = optimum(cell, max_expanded=0)
    monkeypatch.setattr("lab.sequencing.methods.exact.optimum", lambda cell, shared: rough)
    assert rough.cost > exact(cell, Search(), np.random.default_rng(0)).cost == 700
    monkeypatch.setattr("lab.sequencing.methods.cp_sat.MOST_MOVES", 20)
    assert exact(cell, Search(), np.random.default_rng(0)).cost == rough.cost


def test_the_sequencer_checks_the_objective(toast_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="no due times"):
        exact(toast_cell("I", 2), Search(objective="tardy-parts"), np.random.default_rng(0))


@pytest.mark.parametrize("case", ["I", "II"])
def test_a_faster_robot_is_as_tables_that_are_shorter(toast_cell: CellMaker, case: str) -> None:
    cell = toast_cell(case, 3)
    fast = replace(cell, robots=(replace(cell.robots[0], speed=2.0),))
    short = replace(cell, empty_s=cell.empty_s / 2.0, loaded_s=cell.loaded_s / 2.0)
    assert optimum(fast).cost == optimum(short).cost < optimum(cell).cost
    assert cp_sat(fast).cost == cp_sat(short).cost == optimum(short).cost


def test_states_are_for_one_robot_and_cp_sat_for_all(oven_cell: CellMaker) -> None:
    """Each of two robots brings a part: 2 s, the oven's time, which has room for both, and 2 s."""
    cell = oven_cell(2)
    oven = replace(cell.stations[1], capacity=UNLIMITED)
    cell = replace(
        cell, stations=(cell.stations[0], oven, cell.stations[2]), robots=(Robot("a", "in"), Robot("b", "in"))
    )
    with pytest.raises(BadInput, match="one robot"):
        optimum(cell)
    found = exact(cell, Search(), np.random.default_rng(0))
    assert found.cost == 2.0 + oven.processing_s + 2.0


# ---- exact values -----------------------------------------------------------------------------------------------------


def test_one_toast_by_hand(oven_cell: CellMaker) -> None:
    """2 s to the oven, 10 s in it, 2 s out."""
    run = Run(oven_cell(1))
    values = ExactValues(run.cell)
    assert values.of(run, run.allowed()) == [14.0]
    run.move(1)
    assert values.of(run, run.allowed()) == [12.0]


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_the_best_value_is_the_optimum_and_leads_to_it(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject
) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=3, many=True))
    run, values, best_s = Run(cell), ExactValues(cell), optimum(cell).cost
    while allowed := run.allowed():
        left_s = values.of(run, allowed)
        assert run.now_s + min(left_s) == pytest.approx(best_s, abs=1e-5)
        run.move(allowed[left_s.index(min(left_s))])
    assert run.now_s == pytest.approx(best_s, abs=1e-5)


def test_too_many_parts_to_know(toast_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="41 parts are too many, at most 40"):
        ExactValues(toast_cell("I", 41))
