"""Parts that are to be fetched in time: every simulation has the same rule, every exact method the same optimum."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DataObject, SearchStrategy

from lab.errors import BadInput, WorkFailed
from lab.sequencing import SEQUENCERS
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance, Episode
from lab.sequencing.cell.objectives import cost, stuck_cost
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.cell.ways import TICKS_PER_S
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.lower_bound import LowerBound
from lab.sequencing.methods.srl_time import TimeLearner
from lab.sequencing.search import Search
from lab.sequencing.simulate import kernels
from lab.sequencing.simulate.cell_arrays import cell_arrays, run_arrays
from lab.sequencing.simulate.follow import follow, simulate, steps
from lab.sequencing.simulate.merged import MergedCell
from lab.sequencing.simulate.rest import Mishaps, rest_of
from lab.sequencing.simulate.run import Run
from lab.sequencing.simulate.several import replicate
from lab_studies.many_sessions import evaluate
from lab_studies.thesis.branch_and_bound import branch_and_bound

CellMaker = Callable[..., Cell]
Cells = Callable[..., SearchStrategy[Cell]]
Ends = Callable[[Run], Iterator[Run]]
# methods of one sequence, which leaves toast too long in the toaster of the cell below
SPOILING = ("fifo", "longest-remaining-work", "nearest-ready")


def with_window(cell: Cell, **at_most_s: float) -> Cell:
    """The cell with windows at the machines of these names."""
    stations = tuple(replace(one, at_most_s=at_most_s.get(one.name)) for one in cell.stations)
    return replace(cell, stations=stations)


def test_too_late_is_not_allowed(oven_cell: CellMaker) -> None:
    """Two ovens in turn: 1 is done at 12 s; 2 goes to the other one, at 5 s, and is waited for until 15 s: 1 burns."""
    stations = (*oven_cell().stations[:2], Station("stove", "machine", 1, 10.0), Station("out", "storage", 9))
    routes = tuple((Stage("in"), Stage(name), Stage("out")) for name in ("oven", "stove"))
    table = 1.0 - np.eye(4)
    cell = Cell(stations, (Product("toast", routes),), ("toast",) * 2, table, 2.0 * table, one_robot("in"))
    first = follow(with_window(cell, oven=5.0), [1, 4, 2])
    assert first.refusal(1) == "toast 1 in 'oven' would burn: done at 12 s, fetched at 18 s, allowed 5 s"
    assert (first.allowed(), first.done, first.spoils(1), first.spoils(2)) == ((), False, True, False)
    assert cost(first, "makespan") == stuck_cost(first.cell, "makespan")
    with pytest.raises(BadInput, match=r"position 4 of the sequence: .*would burn.*none, it is a deadlock"):
        simulate(with_window(cell, oven=5.0), [1, 4, 2, 1])
    assert follow(with_window(cell, oven=6.0), [1, 4, 2, 1]).done  # to the second
    assert optimum(with_window(cell, oven=5.0)).cost == 17.0  # 1 is fetched first


def test_the_window_of_a_product_counts(oven_cell: CellMaker) -> None:
    """What a stage says goes before what its station says; service before the pick is within the time allowed."""
    cell = with_window(oven_cell(1), oven=1.0)
    route = (Stage("in"), Stage("oven", service_s=4.0, at_most_s=4.0), Stage("out"))
    assert optimum(replace(cell, products=(Product("toast", (route,)),))).cost == 18.0
    with pytest.raises(BadInput, match=r"stage 2 .*at_most_s = 3, but the service before the pick takes 4 s"):
        replace(cell, products=(Product("toast", ((route[0], replace(route[1], at_most_s=3.0), route[2]),)),))


@pytest.mark.parametrize(
    ("station", "says"),
    [
        (
            Station("in", "storage", 9, at_most_s=1.0),
            "station 'in': at_most_s = 1, but it is a storage; only a machine",
        ),
        (Station("oven", "machine", 1, 10.0, -1.0), "station 'oven': at_most_s = -1.0; allowed are 0 to 1e"),
    ],
)
def test_windows_that_cannot_be(oven_cell: CellMaker, station: Station, says: str) -> None:
    cell = oven_cell(1)
    with pytest.raises(BadInput, match=says):
        replace(cell, stations=tuple(station if one.name == station.name else one for one in cell.stations))


def test_a_stage_in_a_storage_has_no_window(oven_cell: CellMaker) -> None:
    route = (Stage("in"), Stage("oven"), Stage("out", at_most_s=1.0))
    with pytest.raises(BadInput, match="stage 3 of the route: at_most_s = 1, but 'out' is a storage"):
        oven_cell(1, products=(Product("toast", (route,)),))


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_the_kernels_have_the_same_rule(cells: Cells, data: DataObject) -> None:
    cell = data.draw(cells(many=True, max_parts=4, windows=True))
    chance = Chance("normal", "normal", data.draw(st.sampled_from([0.0, 0.3])))
    seed = data.draw(st.integers(0, 2**32))
    run, arrays, there = Run(cell, Episode(cell, chance, seed)), cell_arrays(cell, chance=chance), run_arrays(cell)
    kernels.reset(arrays, there, np.uint64(seed))
    while count := kernels.list_allowed(arrays, there):
        assert run.allowed() == tuple(there.allowed[:count].tolist())
        i = data.draw(st.integers(0, count - 1))
        run.move(int(there.allowed[i]))
        kernels.move(arrays, there, i, np.uint64(seed))
    assert run.allowed() == ()
    assert kernels.cost(arrays, there) == pytest.approx(cost(run, "makespan"))


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_merged_states_have_the_same_rule(cells: Cells, data: DataObject) -> None:
    """A walk through both; what can no longer be fetched in time is never finished."""
    merged = MergedCell(data.draw(cells(many=True, max_parts=4, windows=True)))
    run, state, dead = Run(merged.cell), merged.start(named=True), False
    while choices := merged.choices(state):
        parts = merged.cell.parts
        assert set(choices) == {(run.locations[part_of(d, parts) - 1], choice_of(d, parts)) for d in run.allowed()}
        state = data.draw(st.sampled_from(list(merged.successors(state))))
        run.move(merged.decision(state))
        assert state.now / TICKS_PER_S == pytest.approx(run.now_s, abs=1e-6)
        dead = dead or merged.too_late(state)
    assert run.allowed() == ()
    assert not (dead and run.done)
    assert follow(merged.cell, merged.decisions(state)).now_s == pytest.approx(run.now_s)


@settings(max_examples=60, deadline=None)
@given(data=st.data(), size=st.sampled_from([(1, 3, False), (2, 2, False), (1, 2, True), (2, 2, True)]))
def test_exact_methods_agree_with_brute_force(
    cells: Cells, data: DataObject, size: tuple[int, int, bool], ends: Ends
) -> None:
    """All orders tried that never wait on purpose: the search that estimates nothing finds the best, and A* no worse one."""
    cell = data.draw(cells(*size, windows=True))
    all_s = [run.now_s for run in ends(Run(cell))]
    if not all_s:
        return
    assert simulate(cell, branch_and_bound(cell).optimal).makespan_s == pytest.approx(min(all_s), abs=1e-6)
    assert LowerBound(MergedCell(cell)).left(MergedCell(cell).start()) / TICKS_PER_S <= min(all_s) + 1e-6
    best = optimum(cell)
    assert best.proven
    assert best.cost <= min(all_s) + 1e-6


@settings(max_examples=20, deadline=None)
@given(data=st.data(), size=st.sampled_from([(1, 2, False), (2, 2, False), (1, 2, True)]))
def test_the_constraint_model_agrees(cells: Cells, data: DataObject, size: tuple[int, int, bool]) -> None:
    cell = data.draw(cells(*size, windows=True))
    found = cp_sat(cell)
    try:
        best_s = optimum(cell).cost
    except WorkFailed:
        assert (found.status, found.sequence) == ("impossible", ())
        return
    assert found.status == "optimal"
    assert found.cost == pytest.approx(best_s, abs=1e-4)


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_windows_hold_in_the_middle(cells: Cells, data: DataObject) -> None:
    """A part that has been done for a while has only the rest of its time."""
    cell = data.draw(cells(max_machines=2, max_parts=2, many=data.draw(st.booleans()), windows=True))
    try:
        best = optimum(cell)
    except WorkFailed:
        assume(False)
    stop = data.draw(st.integers(0, len(best.sequence) - 1))
    for number, (run, decision, wait) in enumerate(steps(cell, best.sequence)):
        if number == stop:
            break
        run.move(decision, wait)
    rest = rest_of(run).cell
    assert rest is not None
    assert run.now_s + optimum(rest).cost == pytest.approx(best.cost, abs=1e-5)
    assert run.now_s + cp_sat(rest).cost == pytest.approx(best.cost, abs=1e-4)


def test_done_a_while_ago(oven_cell: CellMaker) -> None:
    """Allowed 5 s: done 3 s ago and 2 s of way, it is just in time; done 4 s ago it burns."""
    cell = with_window(oven_cell(1), oven=5.0)
    cell = replace(cell, empty_s=2.0 * cell.empty_s)
    run = follow(cell, [1])
    for ready_s, in_time in ((-3.0, True), (-4.0, False)):
        rest = rest_of(run, Mishaps(ready_s={1: ready_s}, robot="in")).cell
        assert rest is not None
        assert (1 in Run(rest).allowed()) == in_time
        assert (cp_sat(rest).status == "optimal") == in_time


@pytest.mark.parametrize("name", sorted(SEQUENCERS))
def test_every_sequencer_keeps_the_windows(toast_cell: CellMaker, name: str) -> None:
    """What is found is allowed, and nothing is better than what is proven; a rule may find none, and says so."""
    cell = replace(with_window(toast_cell("I", 3), toaster=20.0), due_s=(900.0,) * 3)
    if name in SPOILING:
        with pytest.raises(WorkFailed, match="deadlocks, or parts that would be picked too late"):
            SEQUENCERS[name](cell, Search(60), np.random.default_rng(0))
        return
    found = SEQUENCERS[name](cell, Search(60), np.random.default_rng(0))
    assert simulate(cell, found.sequence).makespan_s == pytest.approx(found.cost)
    assert found.cost >= optimum(cell).cost


@settings(max_examples=30, deadline=None)
@given(data=st.data(), objective=st.sampled_from(["makespan", "mean-tardiness"]))
def test_what_srl_time_learns_keeps_the_windows(cells: Cells, data: DataObject, objective: str) -> None:
    """Each episode, also where parts are told apart: one that waited too long stays where another one may go on."""
    cell = data.draw(cells(many=True, max_parts=4, windows=True))
    learner = TimeLearner(cell, objective, np.random.default_rng(0))
    for _ in range(5):
        sequence, worth, done = learner.episode()
        run = Run(cell)
        for decision in sequence:
            run.move(decision)
        assert run.done == done
        assert cost(run, objective) == pytest.approx(worth)


def test_a_list_that_spoils_by_chance_is_stuck_then(toast_cell: CellMaker) -> None:
    cell = with_window(toast_cell("I", 3), toaster=30.0)
    best = optimum(cell).sequence
    chance = Chance("normal", "constant", 0.3)
    costs = replicate(cell, best, chance, 30, 1)
    stuck = stuck_cost(cell, "makespan")
    assert 0 < np.count_nonzero(costs == stuck) < 30
    compiled = evaluate(cell, [best], range(5), chance)
    assert np.isfinite(compiled).all()


def test_a_schedule_says_until_when(oven_cell: CellMaker) -> None:
    cell = with_window(oven_cell(2), oven=5.0)
    schedule = simulate(cell, optimum(cell).sequence)
    assert [(due.part, due.station, due.done_s, due.until_s) for due in schedule.fetch_by] == [
        (1, "oven", 12.0, 17.0),
        (2, "oven", 27.0, 32.0),
    ]
    assert schedule.to_json()["fetch_by"][0] == {"part": 1, "station": "oven", "done_s": 12.0, "until_s": 17.0}
    assert schedule.later(10.0).fetch_by[0].until_s == 27.0
    assert "fetch_by" not in simulate(oven_cell(1), (1, 1)).to_json()
