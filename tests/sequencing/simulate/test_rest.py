"""Work that begins in the middle: the rest of a run is a cell that costs what was left, in every simulation and method."""

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
from lab.sequencing.cell.objectives import OBJECTIVES, cost
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.session_readable import learn_compiled, learn_readably
from lab.sequencing.methods.srl import Srl
from lab.sequencing.search import Search
from lab.sequencing.simulate import kernels
from lab.sequencing.simulate.cell_arrays import cell_arrays, run_arrays
from lab.sequencing.simulate.follow import follow, simulate
from lab.sequencing.simulate.rest import Mishaps, Rest, rest_of
from lab.sequencing.simulate.run import Run
from lab_studies.thesis.branch_and_bound import branch_and_bound

CellMaker = Callable[..., Cell]
Cells = Callable[..., SearchStrategy[Cell]]
Ends = Callable[[Run], Iterator[Run]]


def two_ovens(parts: int = 3, buffer: str | None = None) -> Cell:
    """Toast through one of two ovens of 10 s, by routes of their own; empty ways 1 s, loaded ways 2 s."""
    stations = (
        Station("in", "storage", 9),
        Station("left", "machine", 1, 10.0),
        Station("right", "machine", 1, 10.0),
        Station("rack", "buffer", 2),
        Station("out", "storage", 9),
    )
    routes = tuple((Stage("in"), Stage(oven, buffer), Stage("out")) for oven in ("left", "right"))
    table = 1.0 - np.eye(5)
    return Cell(stations, (Product("toast", routes),), ("toast",) * parts, table, 2.0 * table, one_robot("in"))


def made(rest: Rest) -> Cell:
    assert rest.cell is not None
    return rest.cell


def walked(data: DataObject, cell: Cell) -> Run:
    """A run after a few decisions of any kind."""
    run = Run(cell)
    for _ in range(data.draw(st.integers(0, 6))):
        if allowed := run.allowed():
            run.move(data.draw(st.sampled_from(allowed)))
    return run


@settings(max_examples=60, deadline=None)
@given(data=st.data(), many=st.booleans())
def test_what_is_left_of_the_best_sequence_is_the_best_of_what_is_left(
    cells: Cells, data: DataObject, many: bool
) -> None:
    """After any number of moves of an optimal sequence: A* of the rest, and the time so far, are the optimum."""
    cell = data.draw(cells(max_machines=2, max_parts=3, many=many))
    best = optimum(cell)
    made_moves = data.draw(st.integers(0, len(best.sequence) - 1))
    run = follow(cell, best.sequence[:made_moves])
    rest = rest_of(run)
    found = optimum(made(rest))
    assert rest.stuck == {}
    assert found.proven
    assert run.now_s + found.cost == pytest.approx(best.cost, abs=1e-5)
    assert follow(cell, (*best.sequence[:made_moves], *found.sequence)).now_s == pytest.approx(best.cost, abs=1e-5)


@settings(max_examples=12, deadline=None)
@given(data=st.data(), many=st.booleans())
def test_the_constraint_model_agrees(cells: Cells, data: DataObject, many: bool) -> None:
    cell = data.draw(cells(max_machines=1 if many else 2, max_parts=2, many=many))
    best = optimum(cell)
    made_moves = data.draw(st.integers(0, len(best.sequence) - 1))
    run = follow(cell, best.sequence[:made_moves])
    found = cp_sat(made(rest_of(run)))
    assert found.status == "optimal"
    assert run.now_s + found.cost == pytest.approx(best.cost, abs=1e-4)


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_the_rest_is_the_run_going_on(cells: Cells, data: DataObject) -> None:
    """From any state, not only good ones: the same decisions at the same times, in the run and in a run of the rest."""
    run = walked(data, data.draw(cells(many=True, max_parts=4)))
    assume(not run.done)
    begun_s, ahead = run.now_s, Run(made(rest_of(run)))
    while allowed := run.allowed():
        assert ahead.allowed() == allowed
        decision = data.draw(st.sampled_from(allowed))
        whole, rest = run.move(decision), ahead.move(decision)
        assert (rest.origin, rest.target, rest.start) == (whole.origin, whole.target, whole.start)
        assert begun_s + rest.drop_s == pytest.approx(whole.drop_s, abs=1e-6)
    assert ahead.allowed() == ()
    assert ahead.done == run.done


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_the_kernels_begin_there_too(cells: Cells, data: DataObject) -> None:
    first = walked(data, data.draw(cells(many=True, max_parts=4)))
    assume(not first.done)
    rest = rest_of(first, Mishaps(lost=frozenset(data.draw(st.sets(st.just(1))))), 3.0)
    assume(rest.cell is not None)
    cell = made(rest)
    run, arrays, there = Run(cell), cell_arrays(cell), run_arrays(cell)
    kernels.reset(arrays, there, np.uint64(0))
    while True:
        count = kernels.list_allowed(arrays, there)
        assert run.allowed() == tuple(there.allowed[:count].tolist())
        assert run.locations == there.locations.tolist()
        assert there.ready_s.tolist() == pytest.approx(run.ready_s)
        assert there.whole[1] == run.finished_s.count(None)
        assert there.clock.tolist() == pytest.approx([run.now_s, run.waited_s, run.processed_s, run.end_s])
        if count == 0:
            break
        i = data.draw(st.integers(0, count - 1))
        run.move(int(there.allowed[i]))
        kernels.move(arrays, there, i, np.uint64(0))
    for objective in OBJECTIVES:
        assert kernels.cost(cell_arrays(cell, objective), there) == pytest.approx(cost(run, objective))


@settings(max_examples=20, deadline=None)
@given(data=st.data())
def test_compiled_sessions_learn_the_same_there(cells: Cells, data: DataObject) -> None:
    run = walked(data, data.draw(cells(max_machines=2, max_parts=3)))
    assume(not run.done)
    cell, search = made(rest_of(run)), Search(15)
    keys = Srl.keys(cell, search.settings)
    assert keys is not None
    compiled, readable = learn_compiled(cell, search, 5, Srl, keys), learn_readably(cell, search, 5, Srl)
    assert compiled.log.costs == pytest.approx(readable.log.costs)
    assert compiled.log.best == readable.log.best


@pytest.mark.parametrize("name", sorted(SEQUENCERS))
def test_every_sequencer_goes_on_from_the_middle(toast_cell: CellMaker, name: str) -> None:
    """Case I, three toasts; toast 2 is lost after four moves of an optimal order: toasts 1 and 3 are still made."""
    cell = replace(toast_cell("I", 3), due_s=(500.0,) * 3)
    run = follow(cell, optimum(cell).sequence[:4])
    rest = made(rest_of(run, Mishaps(lost=frozenset({2}))))
    found = SEQUENCERS[name](rest, Search(30), np.random.default_rng(0))
    ended = follow(rest, found.sequence)
    assert ended.done
    assert ended.now_s == pytest.approx(found.cost)
    assert 2 not in found.sequence
    assert found.cost >= optimum(rest).cost - 1e-6
    if name in ("exact", "cp-sat"):
        assert found.cost == pytest.approx(optimum(rest).cost)


@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_never_below_or_above_brute_force(cells: Cells, data: DataObject, ends: Ends) -> None:
    """From any state, with parts that are lost or come later than believed: all orders of the rest tried."""
    run = walked(data, data.draw(cells(max_machines=2, max_parts=2, many=data.draw(st.booleans()))))
    assume(not run.done)
    late_s = data.draw(st.dictionaries(st.just(1), st.integers(0, 40).map(float)))
    if run.cell.arrivals is not None and run.locations[0] == run.cell.starts[0]:
        late_s = {}
    lost = frozenset(data.draw(st.sets(st.sampled_from([1, 2]))) & set(range(1, run.cell.parts + 1)))
    rest = rest_of(run, Mishaps(lost=lost, ready_s=late_s), 3.0)
    assume(rest.cell is not None)
    cell = made(rest)
    all_s = [one.now_s for one in ends(Run(cell))]
    if not all_s:  # the state reached is a deadlock
        with pytest.raises(WorkFailed, match="all were tried"):
            optimum(cell)
        assert cp_sat(cell).status == "impossible"
        return
    assert optimum(cell).cost == pytest.approx(min(all_s), abs=1e-6)
    assert simulate(cell, branch_and_bound(cell).optimal).makespan_s == pytest.approx(min(all_s), abs=1e-6)
    assert cp_sat(cell).cost == pytest.approx(min(all_s), abs=1e-4)


def test_the_part_in_the_oven_goes_on_baking(oven_cell: CellMaker) -> None:
    """In at 2 s, done at 12 s; now is 2 s: out at 12 s of the rest, that is 14 s. The chart begins with 10 s of baking."""
    run = follow(oven_cell(1), [1])
    rest = made(rest_of(run))
    assert optimum(rest).cost == 12.0
    schedule = simulate(rest, [1])
    assert [(a.kind, a.start_s, a.end_s) for a in schedule.machines] == [("process", 0.0, 10.0)]
    later = schedule.later(run.now_s)
    assert (later.makespan_s, later.machines[0].start_s, later.robot[-1].end_s) == (14.0, 2.0, 14.0)


def test_finished_and_lost_parts_have_no_row(oven_cell: CellMaker) -> None:
    """1 is finished at 14 s, 2 is lost: 3 alone takes 1 + 2 + 10 + 2 s, and keeps its name."""
    run = follow(oven_cell(3), [1, 1])
    rest = made(rest_of(run, Mishaps(lost=frozenset({2}))))
    assert (rest.unfinished, optimum(rest).cost, optimum(rest).sequence) == ((3,), 15.0, (3, 3))
    assert {a.resource for a in simulate(rest, [3, 3]).parts} == {"toast 3"}
    assert Run(rest).finished_s == [0.0, 0.0, None]
    assert Run(rest).refusal(2) == "toast 2 is already at 'out'"


def test_a_part_that_is_later_than_believed(oven_cell: CellMaker) -> None:
    """Half as long again: done 5 s later than planned."""
    run = follow(oven_cell(1), [1])
    assert optimum(made(rest_of(run, Mishaps(ready_s={1: 15.0})))).cost == 17.0


def test_a_part_that_stands_elsewhere(oven_cell: CellMaker) -> None:
    """It was believed to be in the oven, and stands at the beginning: everything again, from where the robot is."""
    run = follow(oven_cell(1), [1])
    assert optimum(made(rest_of(run, Mishaps(moved={1: "in"})))).cost == 1.0 + 2.0 + 10.0 + 2.0
    there = rest_of(Run(oven_cell(1)), Mishaps(moved={1: "oven"}, robot="oven"))
    assert optimum(made(there)).cost == 12.0  # it begins to bake now
    done = rest_of(Run(oven_cell(1)), Mishaps(moved={1: "out"}))
    assert (done.cell, done.stuck) == (None, {})


def test_out_of_use_the_other_oven_does_it() -> None:
    """The left oven fails with toast 1 in it, 8 s before it is done; 2 and 3 go one after the other through the right one."""
    run = follow(two_ovens(), [1, 2 + 3])
    assert run.now_s == 5.0
    rest = rest_of(run, Mishaps(closed=("left",)))
    assert rest.stuck == {1: "toast 1 is not done in 'left', which is out of use"}
    cell = made(rest)
    assert cell.unfinished == (2, 3)
    assert Run(cell).occupied[1] == 1
    assert Run(cell).refusal(1) == "toast 1 stays at 'left'"
    assert Run(cell).refusal(3) == "toast 3 at 'in': the route by 'left' is closed"
    best = optimum(cell)
    assert best.sequence == (2, 3 + 3, 3)
    assert best.cost == cp_sat(cell).cost == 10.0 + 2.0 + 1.0 + 2.0 + 10.0 + 2.0
    again = rest_of(follow(cell, best.sequence), Mishaps(closed=()))  # it is mended, with 7 s still to bake
    assert again.stuck == {}
    assert optimum(made(again)).cost == 7.0 + 2.0


def test_done_in_a_closed_oven_a_part_is_taken_out() -> None:
    run = follow(two_ovens(2), [1, 2 + 2])
    rest = rest_of(run, Mishaps(closed=("left",), ready_s={1: 0.0}))
    assert rest.stuck == {}
    assert set(made(rest).unfinished) == {1, 2}


def test_a_stuck_part_shuts_others_out(oven_cell: CellMaker) -> None:
    """The only oven fails: who is in it stays, and who waits for it cannot be made either."""
    rest = rest_of(follow(oven_cell(2), [1]), Mishaps(closed=("oven",)))
    assert rest.cell is None
    assert rest.stuck == {
        1: "toast 1 is not done in 'oven', which is out of use",
        2: "toast 2 at 'in' cannot continue: 'oven' is out of use",
    }


def test_a_buffer_before_a_closed_oven_is_not_used_either() -> None:
    cell = made(rest_of(Run(two_ovens(2, "rack")), Mishaps(closed=("left",))))
    assert {way.target for at in cell.positions[:1] for way in at.options} == {2, 3}
    assert optimum(cell).cost == cp_sat(cell).cost


def test_ways_that_nobody_has_timed() -> None:
    """From the oven's rack no empty way was ever needed: a stand-in is asked for, and used."""
    stations = (*two_ovens().stations[:2], Station("out", "storage", 9), Station("rack", "buffer", 1))
    empty = np.full((4, 4), np.nan)
    empty[1, 0] = empty[2, 0] = empty[2, 1] = 1.0
    loaded = np.full((4, 4), np.nan)
    loaded[0, 1] = loaded[1, 2] = 2.0
    route = (Stage("in"), Stage("left"), Stage("out"))
    cell = Cell(stations, (Product("toast", (route,)),), ("toast",) * 2, empty, loaded, one_robot("in"))
    with pytest.raises(BadInput, match="empty_s 'rack' -> 'in' is missing"):
        rest_of(Run(cell), Mishaps(robot="rack"))
    assert optimum(made(rest_of(Run(cell), Mishaps(robot="rack"), 7.0))).cost == 7.0 + 14.0 + 15.0


def test_what_there_is_not(oven_cell: CellMaker) -> None:
    run = Run(oven_cell(2))
    with pytest.raises(BadInput, match="there is no part 3, only 1 to 2"):
        rest_of(run, Mishaps(lost=frozenset({3})))
    with pytest.raises(BadInput, match=r"unknown station 'ofen' .*did you mean 'oven'"):
        rest_of(run, Mishaps(closed=("ofen",)))
    with pytest.raises(BadInput, match=r"where toast 1 stands.: did you mean 'oven'"):
        rest_of(run, Mishaps(moved={1: "ofen"}))
    with pytest.raises(BadInput, match="toast 1 moved to position 7: its routes have 0 to 2"):
        rest_of(run, Mishaps(moved={1: 7}))
    with pytest.raises(BadInput, match="station 'oven' holds 2 parts; its capacity is 1"):
        rest_of(run, Mishaps(moved={1: "oven", 2: "oven"}))


def test_a_stay_as_long_as_all_the_work() -> None:
    """2 has left the oven, which is far from everything: the model has room for the way back from there that nobody goes."""
    stations = (*two_ovens().stations[:2], Station("shelf", "storage", 2), Station("out", "storage", 9))
    route = (Stage("in"), Stage("left"), Stage("shelf"), Stage("out"))
    far = 1.0 - np.eye(4)
    far[2:, :2] = 90.0
    cell = Cell(stations, (Product("toast", (route,)),), ("toast",) * 2, far, far, one_robot("in"))
    run = Run(cell)
    rest = made(rest_of(run, Mishaps(moved={2: "shelf"})))
    assert cp_sat(rest, hint=optimum(rest).sequence).cost == optimum(rest).cost
