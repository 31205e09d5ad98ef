"""A cycle carried out for a number of parts: legal in the simulation, and as fast as the cycle once the line is full."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.cyclic.cycle import best_cycle
from lab.sequencing.cyclic.several import best_rhythm
from lab.sequencing.cyclic.unrolled import of_parts, period_of, steady, unrolled
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.follow import simulate

CellMaker = Callable[..., Cell]
RandomCells = Callable[..., SearchStrategy[Cell]]
SEARCH = (Phase.explicit, Phase.reuse, Phase.generate)


@pytest.mark.parametrize(("case", "period_s", "more_s"), [("I", 150.0, 4.0), ("II", 200.0, 10.0), ("III", 295.0, 20.0)])
def test_toasts_one_after_the_other(toast_cell: CellMaker, case: str, period_s: float, more_s: float) -> None:
    """Twenty toasts take as much longer than six as fourteen periods; the best order saves a few seconds at the ends."""
    cycle = best_cycle(toast_cell(case, 2), ("toast",))
    six, twenty = (unrolled(cycle, toast_cell(case, parts)) for parts in (6, 20))
    assert not six.waits
    assert period_of(six.schedule, cycle) == period_of(twenty.schedule, cycle) == period_s
    assert twenty.schedule.makespan_s - six.schedule.makespan_s == pytest.approx(14 * period_s)
    assert six.schedule.makespan_s - optimum(toast_cell(case, 6)).cost == pytest.approx(more_s)


def test_the_hoist_fills_its_line_in_time(hoist_cell: CellMaker) -> None:
    cycle = best_cycle(hoist_cell(), ("carrier",))
    made = unrolled(cycle, hoist_cell(12))
    assert made.schedule == simulate(made.cell, made.sequence)
    assert period_of(made.schedule, cycle) == 521.0


def test_more_parts_than_whole_cycles(oven_cell: CellMaker) -> None:
    """15 s a toast (see the cycle's test); the last of five comes alone."""
    cycle = best_cycle(oven_cell(), ("toast", "toast"))
    made = unrolled(cycle, of_parts(oven_cell(), ("toast", "toast"), 5))
    assert made.schedule.makespan_s == 2 + 10 + 4 * 15 + 2
    assert period_of(made.schedule, cycle) == 30.0


def test_two_parts_a_cycle_are_carried_out_as_planned() -> None:
    """Two machines of 30 s, and 1 s out, back and in: two parts in 33 s, as long as parts are brought between them."""
    stations = [Station(name, "storage", 9) for name in ("in", "out")] + [Station("m", "machine", 1, 30.0)]
    stations += [Station("n", "machine", 1, 30.0), Station("washer", "machine", 1, 10.0)]
    product = Product("part", tuple(tuple(map(Stage, ("in", machine, "washer", "out"))) for machine in "mn"))
    table = 1.0 - np.eye(5)
    cell = Cell(tuple(stations), (product,), ("part",) * 8, table, table, one_robot("in"))
    cycle = best_rhythm(cell, ("part",)).cycle
    made = unrolled(cycle, cell)
    assert (cycle.parts, cycle.period_s, period_of(made.schedule, cycle)) == (2, 33.0, 33.0)
    taken = [one.resource for one in made.schedule.machines if one.kind == "process" and one.resource != "washer"]
    assert sorted(taken) == ["m"] * 4 + ["n"] * 4


def test_too_few_parts_have_no_period(oven_cell: CellMaker) -> None:
    assert period_of(simulate(oven_cell(1), (1, 1)), best_cycle(oven_cell(), ("toast",))) is None


def test_two_places_alike_are_filled_in_turns(oven_cell: CellMaker) -> None:
    """A toast every 7.5 s in the mean (see the cycle's test), carried out as early as can be: two in 15 s."""
    places = (Station("in", "storage", 40), Station("oven", "machine", 2, 10.0), Station("out", "storage", 40))
    cycle = best_cycle(oven_cell(stations=places), ("toast",))
    made = unrolled(cycle, of_parts(cycle.line.cell, ("toast",), 12))
    assert cycle.recurs == 2
    assert period_of(made.schedule, cycle) == 7.5


@pytest.mark.parametrize("windows", [False, True])
@settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck), phases=SEARCH)
@given(data=st.data())
def test_every_cycle_can_be_begun_and_ended(windows: bool, cells: RandomCells, data: st.DataObject) -> None:
    cell = data.draw(cells(max_machines=3, max_parts=2, windows=windows))
    assume(cell.parts > 1)
    mix = ("toast",) * data.draw(st.integers(1, 2))
    try:
        cycle = best_cycle(cell, mix)
    except WorkFailed:
        return  # no order can be repeated: the windows of some stations
    enough = tuple(replace(one, capacity=40) if one.name in ("in", "out") else one for one in cell.stations)
    parts = 16 * len(mix)
    many = of_parts(replace(cell, stations=enough), mix, parts)
    try:
        made = unrolled(cycle, many)
    except WorkFailed as error:
        # The first parts find no machine full, or, on a way that is longer than one by somewhere else, come too late.
        has_buffer = any(move.option.if_full is not None for move in cycle.line.moves)
        assume(not (has_buffer and "begun with an empty line" in str(error)))
        assume(not (windows and "picked too late" in str(error)))
        raise
    assert len(made.schedule.sequence) == len(made.sequence)
    if not made.waits:
        assert made.schedule == simulate(made.cell, made.sequence)
    assert made.schedule.makespan_s >= (parts // len(mix) - 1) * cycle.period_s - 1e-6
    assert period_of(made.schedule, cycle) == pytest.approx(cycle.period_s, abs=1e-5)


def test_no_cycle_beats_what_is_proven_of_its_parts(hoist_cell: CellMaker) -> None:
    """Issue 33: a cycle waits on purpose, and so does the optimum. Four carriers by orders that never wait take 2626 s."""
    best = optimum(hoist_cell(4))
    assert (best.cost, best.proven) == (2551.0, True)
    assert unrolled(best_cycle(hoist_cell(), ("carrier",)), hoist_cell(4)).schedule.makespan_s >= best.cost


def test_a_cycle_of_five_tanks_is_an_optimum() -> None:
    """As issue 33's first row: six carriers whose cycle takes less than all orders that never wait, 1410 s here."""
    soak_s, size = [(71.0, 6.0), (80.0, 22.0), (36.0, 4.0), (98.0, 5.0), (76.0, 20.0)], 7
    tanks = [Station(f"tank {n}", "machine", 1, *both) for n, both in enumerate(soak_s)]
    stations = (Station("load", "storage", 9), *tanks, Station("unload", "storage", 9))
    empty = 2.0 * np.abs(np.subtract.outer(np.arange(size), np.arange(size)))
    loaded = np.full((size, size), np.nan)
    loaded[np.arange(size - 1), np.arange(1, size)] = 12.0
    route = tuple(Stage(station.name) for station in stations)
    cell = Cell(stations, (Product("carrier", (route,)),), ("carrier",) * 6, empty, loaded, one_robot("unload"))
    best = optimum(cell)
    assert best.proven
    assert best.cost == unrolled(best_cycle(cell, ("carrier",)), cell).schedule.makespan_s == 1147.0


# ---- steady -----------------------------------------------------------------------------------------------------------


def test_each_period_is_like_the_one_before(hoist_cell: CellMaker) -> None:
    cycle = best_cycle(hoist_cell(), ("carrier",))
    schedule = steady(cycle, 3).schedule

    def within(period: int) -> set[tuple[str, str, float, float]]:
        start_s, end_s = period * 521.0, (period + 1) * 521.0
        return {
            (one.resource, one.kind, one.start_s - start_s, one.end_s - start_s)
            for one in (*schedule.robot, *schedule.machines)
            if start_s < one.start_s and one.end_s < end_s
        }

    assert within(0) == within(1) == within(2)
    assert sum(one.kind == "carry" for one in schedule.robot) == 3 * 13


def test_the_robot_is_never_in_two_places(toast_cell: CellMaker) -> None:
    """Its row leaves no gap: it carries, drives, or waits where it is to pick."""
    row = steady(best_cycle(toast_cell("I", 2), ("toast",)), 2).schedule.robot
    assert [one.start_s for one in row[1:]] == pytest.approx([one.end_s for one in row[:-1]])
    assert (row[0].start_s, row[-1].end_s) == (0.0, 300.0)
    assert [one.origin for one in row[1:]] == [one.target for one in row[:-1]]


def test_parts_are_named_by_their_products(crossing_cell: Callable[[], Cell]) -> None:
    shown = steady(best_cycle(crossing_cell(), ("there", "back")), 2)
    assert {name.split()[0] for name in shown.names.values()} == {"there", "back"}
    assert sorted(shown.names) == [*range(1, len(shown.names) + 1)]


def test_no_periods(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="periods = 0: allowed are whole numbers from 1"):
        steady(best_cycle(oven_cell(), ("toast",)), 0)
