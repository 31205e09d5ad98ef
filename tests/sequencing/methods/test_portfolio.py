"""The methods together: by hand, against every list of decisions, side by side, stopped, and on what is too large to prove."""

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import OBJECTIVES, cost
from lab.sequencing.cell.stations import Product, Robot, Stage, Station, one_robot
from lab.sequencing.methods import portfolio as tried
from lab.sequencing.methods.anneal import Annealing
from lab.sequencing.methods.cp_sat import beside, fits
from lab.sequencing.methods.portfolio import BestKnown, best_known, fewer_moves
from lab.sequencing.methods.shared import Shared
from lab.sequencing.search import SAME
from lab.sequencing.simulate.follow import follow, simulate
from lab.sequencing.simulate.run import Run

Ends = Callable[[Run], Iterator[Run]]
CellMaker = Callable[..., Cell]
NEAR = ((0, 1, 1), (1, 0, 1), (1, 1, 0))  # one second between any two of LU, M1 and M2


@pytest.fixture(autouse=True, scope="module")
def _short_annealing() -> Iterator[None]:
    """So that small cells take milliseconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tried, "MOVES", 20_000)
        yield


def shuttles(jobs: int, operations: int = 4, robots: int = 2, seed: int = 0) -> Sequence[object]:
    """What `job_shop` builds a large shop of: jobs over four machines, times and ways from 1 to 20 s."""
    rng = np.random.default_rng(seed)
    ways = [[(int(m) + 1, float(rng.integers(1, 21))) for m in rng.permutation(4)[:operations]] for _ in range(jobs)]
    return ways, rng.integers(1, 21, (5, 5)) * (1 - np.eye(5, dtype=int)), robots


@pytest.mark.parametrize("workers", [1, 2])
def test_two_parts_by_hand(job_shop: CellMaker, workers: int) -> None:
    """M1 has 14 s of work, and nothing to do in the first second."""
    found = best_known(job_shop([[(1, 10.0)], [(1, 4.0)]], NEAR, 2), workers=workers)
    assert (found.cost, found.bound, found.proven) == (15.0, 15.0, True)
    assert found.found_by
    assert found.bound_by == "CP-SAT"


@pytest.mark.slow
def test_who_proves_what(job_shop: CellMaker, toast_cell: CellMaker) -> None:
    """One robot that does all: A*; a job shop with one vehicle: its tours, 1 + 10 + 4 s here, too."""
    toasts = best_known(toast_cell("I", 2))
    assert (toasts.found_by, toasts.bound_by, toasts.proven) == ("A*", "A*", True)
    found = best_known(job_shop([[(1, 10.0)], [(1, 4.0)]], NEAR, 1))
    assert (found.found_by, found.bound_by, found.cost) == ("search of tours", "search of tours", 15.0)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(data=st.data(), objective=st.sampled_from(sorted(OBJECTIVES)), workers=st.sampled_from([1, 2]))
def test_no_list_of_decisions_is_better(
    shops: Callable[..., st.SearchStrategy[Cell]], ends: Ends, data: st.DataObject, objective: str, workers: int
) -> None:
    """The bound is below every list's cost; what is proven is the best of all; and the order costs what is said."""
    cell = replace(cell := data.draw(shops(2)), due_s=(15.0,) * cell.parts)
    least = min((cost(run, objective) for run in ends(Run(cell))), default=None)
    found = best_known(cell, objective, 10.0, workers=workers)
    if least is None:
        assert found.sequence == ()
        return
    assert found.bound - SAME <= least <= found.cost + SAME
    assert found.cost == pytest.approx(cost(follow(cell, found.sequence), objective))
    assert not found.proven or found.cost == pytest.approx(least)


@settings(max_examples=25, deadline=None)
@given(data=st.data(), objective=st.sampled_from(sorted(set(OBJECTIVES) - {"makespan"})))
def test_one_robot_that_does_all(
    cells: Callable[..., st.SearchStrategy[Cell]], ends: Ends, data: st.DataObject, objective: str
) -> None:
    """Pallets, arrivals, routes to choose from, and what is not the makespan."""
    cell = data.draw(cells(max_machines=1, max_parts=2, many=True))
    costs = [cost(run, objective) for run in ends(Run(cell))]
    found = best_known(cell, objective, 3.0, workers=2)
    if costs:
        assert found.bound - 1e-4 <= min(costs) <= found.cost + SAME  # times are rounded to a millionth


def test_with_one_worker_the_same_seed_gives_the_same(ex11: Callable[[int], Cell]) -> None:
    one, other = (best_known.__wrapped__(ex11(2), seed=3) for _ in range(2))
    assert one == other
    assert one.cost == 96.0


def test_side_by_side_a_published_instance_is_proven(ex11: Callable[[int], Cell]) -> None:
    cell = ex11(2)
    found = best_known(cell, workers=3)
    assert (found.cost, found.bound) == (96.0, 96.0)
    assert simulate(cell, found.sequence).makespan_s == 96.0


def test_when_the_time_is_over_there_is_an_order_and_a_bound(job_shop: CellMaker) -> None:
    cell = job_shop(*shuttles(12))
    found = best_known(cell, time_limit_s=2.0, workers=2)
    assert simulate(cell, found.sequence).makespan_s == found.cost
    assert 0 < found.bound <= found.cost


@pytest.mark.parametrize("workers", [1, 2])
def test_ctrl_c_is_heard_while_cp_sat_looks(job_shop: CellMaker, workers: int) -> None:
    cell, before = job_shop(*shuttles(12, seed=1)), threading.active_count()
    timer = threading.Timer(2.0, signal.pthread_kill, (threading.main_thread().ident, signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        best_known(cell, time_limit_s=120.0, workers=workers)
    timer.join()
    assert threading.active_count() <= before  # nobody goes on in the background


def test_a_small_cell_is_annealed_for_a_moment(job_shop: CellMaker, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two parts into M1 and out again: 4 moves, 16 neighbours, each 500 times, not the three million of a large cell."""
    rounds, advance = list[int](), Annealing.advance

    def counted(self: Annealing, steps: int, done: float) -> tuple[int, ...]:
        rounds.append(steps)
        return advance(self, steps, done)

    monkeypatch.setattr(tried, "MOVES", 12_000_000)
    monkeypatch.setattr(Annealing, "advance", counted)
    found = best_known.__wrapped__(job_shop([[(1, 10.0)], [(1, 4.0)]], NEAR, 2))
    assert (found.cost, found.proven) == (15.0, True)
    assert 8_000 <= sum(rounds) < 8_000 + tried.ROUND


def test_what_one_finds_the_other_goes_on_from(ex11: Callable[[int], Cell]) -> None:
    """Given the best order by another method, CP-SAT proves it, and does not claim it."""
    cell = ex11(2)
    best = best_known(cell, workers=2).sequence
    shared = Shared(cell, "makespan")
    shared.tell("somebody", best)
    beside(shared, 60.0, 0, 2)
    assert (shared.found_by, shared.cost, shared.bound, shared.bound_by) == ("somebody", 96.0, 96.0, "CP-SAT")
    assert shared.over.is_set()


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["makespan", "mean-tardiness"])
def test_too_large_for_a_model_there_is_a_bound_still(job_shop: CellMaker, objective: str) -> None:
    """70 jobs of four operations by two robots that are not alike; every part alone takes 4 s and more, and is due at 1 s."""
    jobs, travel_s, _ = shuttles(70)
    fast = (Robot("fast", "LU", 2.0), Robot("slow", "LU", 1.0))
    cell = job_shop(jobs, travel_s, robots=fast, due_s=(1.0,) * 70)
    assert not fits(cell)
    found = best_known(cell, objective, 3.0, workers=2)
    assert found.sequence
    assert 0 < found.bound <= found.cost


def test_what_is_told_is_kept_only_if_it_is_better(job_shop: CellMaker) -> None:
    """Two jobs of 10 and 4 s on M1, then 5 s on M2 for the first: 1 + 10 + 1 + 5 = 17 s, or 4 s more the other way round."""
    cell = job_shop([[(1, 10.0), (2, 5.0)], [(1, 4.0)]], NEAR, 2)
    shared = Shared(cell, "makespan")
    orders = sorted((cost(run, "makespan"), sequence) for run, sequence in every(cell))
    worst, best = orders[-1], orders[0]
    for who, (value, sequence) in zip("abc", (worst, best, worst), strict=True):
        shared.tell(who, sequence)
        assert shared.cost <= value
    assert (shared.cost, shared.found_by, shared.sequence) == (17.0, "b", best[1])
    for who, bound in (("x", 12.0), ("y", 11.0)):
        shared.tell(who, bound=bound)
    assert (shared.bound, shared.bound_by, shared.over.is_set()) == (12.0, "x", False)
    shared.tell("z", bound=17.0)
    assert shared.over.is_set()


def every(cell: Cell, begun: tuple[int, ...] = ()) -> Iterator[tuple[Run, tuple[int, ...]]]:
    """Every complete list of decisions."""
    run = follow(cell, begun)
    if run.done:
        yield run, begun
    for decision in run.allowed():
        yield from every(cell, (*begun, decision))


def test_a_cell_without_any_order(crossing_cell: Callable[[], Cell]) -> None:
    """A part in each of two machines that want to change places: with due times CP-SAT proves an order, or that there is none."""
    found = best_known(replace(crossing_cell(), due_s=(30.0, 30.0)), "mean-tardiness")
    assert isinstance(found, BestKnown)
    assert found.proven


# ---- fewer moves ------------------------------------------------------------------------------------------------------


def buffered_cell(parts: int) -> Cell:
    """in > (buffer) > oven, 10 s > out: the buffer may be used, or not; every way takes 1 s."""
    stations = (
        Station("in", "storage", 9),
        Station("buffer", "buffer", 9),
        Station("oven", "machine", 1, 10.0),
        Station("out", "storage", 9),
    )
    product = Product("toast", ((Stage("in"), Stage("oven", "buffer"), Stage("out")),))
    table = 1.0 - np.eye(4)
    return Cell(stations, (product,), ("toast",) * parts, table, table, one_robot("in"), buffers="free")


def ways(cell: Cell, sequence: tuple[int, ...]) -> list[tuple[str, str]]:
    run = Run(cell)
    return [(move.origin, move.target) for move in map(run.move, sequence)]


def through_the_buffer(cell: Cell) -> tuple[int, ...]:
    """The decisions of a single part that stops over."""
    run, taken = Run(cell), list[int]()
    while not run.done:
        before = len(taken)
        for decision in run.allowed():
            option = run.option(decision)
            assert option is not None
            if cell.names[option.target] == "buffer" or len(run.allowed()) == 1:
                taken.append(decision)
                run.move(decision)
                break
        assert len(taken) > before
    return tuple(taken)


def test_a_stopover_for_nothing_is_left_out() -> None:
    """in > buffer > oven > out, 1 + 1 + 10 + 1 s, becomes in > oven > out, 1 + 10 + 1 s."""
    cell = buffered_cell(1)
    stopping = through_the_buffer(cell)
    assert ways(cell, stopping) == [("in", "buffer"), ("buffer", "oven"), ("oven", "out")]
    straight = fewer_moves(cell, stopping)
    assert ways(cell, straight) == [("in", "oven"), ("oven", "out")]
    assert (simulate(cell, stopping).makespan_s, simulate(cell, straight).makespan_s) == (13.0, 12.0)


def test_a_straight_order_stays_as_it_is() -> None:
    cell = buffered_cell(1)
    straight = fewer_moves(cell, through_the_buffer(cell))
    assert fewer_moves(cell, straight) == straight


@settings(max_examples=60, deadline=None)
@given(data=st.data(), objective=st.sampled_from(sorted(OBJECTIVES)))
def test_it_costs_no_more_and_makes_no_more_moves(
    cells: Callable[..., SearchStrategy[Cell]], data: st.DataObject, objective: str
) -> None:
    cell = data.draw(cells(many=True))
    run, sequence = Run(cell), list[int]()
    while allowed := run.allowed():
        sequence.append(data.draw(st.sampled_from(allowed)))
        run.move(sequence[-1])
    if not run.done:
        return
    fewer = fewer_moves(cell, sequence, objective)
    assert len(fewer) <= len(sequence)
    assert follow(cell, fewer).done
    assert cost(follow(cell, fewer), objective) <= cost(run, objective) + 1e-6
