"""The lower bounds: by hand on one oven, and never above what any sequence still takes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Arrivals, Product, Stage, Station
from lab.sequencing.cell.ways import TICKS_PER_S
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.lower_bound import LowerBound, RobotWork
from lab.sequencing.simulate.merged import MergedCell, MergedState
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]


def counted(run: Run) -> list[int]:
    return [run.locations.count(place) for place in range(len(run.cell.positions))]


def least_s(work: RobotWork, counts: list[int], robot: int) -> float:
    """What the robot has to do at least with these counts, standing there [s]."""
    rest = sum(count * each for count, each in zip(counts, work.rest, strict=True))
    return max(0, work.here[robot] + rest) / TICKS_PER_S


def start_s(cell: Cell) -> float:
    """What the robot has to do at least in all [s]."""
    return least_s(RobotWork(cell), counted(Run(cell)), cell.index(cell.robot_start))


def least_left_s(cell: Cell) -> float:
    """The highest of all bounds at the start [s]."""
    merged = MergedCell(cell)
    return LowerBound(merged).left(merged.start()) / TICKS_PER_S


def test_one_part_by_hand(oven_cell: CellMaker) -> None:
    """Carry 2 s, wait 10 s, carry 2 s."""
    cell = oven_cell(1)
    work = RobotWork(cell)
    assert start_s(cell) == 14.0
    assert least_s(work, [0, 1, 0], cell.index("oven")) == 12.0
    assert least_s(work, [0, 0, 1], cell.index("out")) == 0


def test_another_part_costs_the_way_back_too(oven_cell: CellMaker) -> None:
    """Nothing can be done while the oven is full: 14 s each, and 1 s empty between them."""
    assert start_s(oven_cell(2)) == 29.0
    assert start_s(oven_cell(5)) == 5 * 14.0 + 4.0


@pytest.mark.parametrize(("case", "each_s"), [("II", 200), ("III", 295)])
def test_each_toast_costs_what_it_costs_in_the_optimum(toast_cell: CellMaker, case: str, each_s: float) -> None:
    """The thesis's cases II and III are bound by the robot; case I is by a second more."""
    assert start_s(toast_cell(case, 12)) - start_s(toast_cell(case, 11)) == pytest.approx(each_s, abs=1e-6)


@pytest.mark.parametrize("case", ["I", "II", "III"])
def test_all_bounds_together_are_between_the_robots_and_the_optimum(toast_cell: CellMaker, case: str) -> None:
    cell = toast_cell(case, 5)
    assert start_s(cell) <= least_left_s(cell) <= optimum(cell).cost


def test_a_slow_machine_with_room_for_one_bounds_by_itself(toast_cell: CellMaker) -> None:
    """600 s in each machine: the robot's own work is far less than the ten toasts take in the slower place."""
    cell = toast_cell("II", 10)
    slow = replace(cell, stations=tuple(replace(s, processing_s=600.0 * (s.kind == "machine")) for s in cell.stations))
    assert start_s(slow) < 3000 < 6000 < least_left_s(slow) <= optimum(slow).cost


@pytest.mark.parametrize(("after", "ends_s"), [("clock", 119.0), ("pick", 119.0)])
def test_who_comes_last_bounds_the_end(oven_cell: CellMaker, after: str, ends_s: float) -> None:
    """The first comes after 5 s and is taken at once; the second 100 s later, and takes 14 s."""
    cell = oven_cell(2, arrivals=Arrivals((5.0, 100.0), after))  # type: ignore[arg-type]
    assert least_left_s(cell) == optimum(cell).cost == ends_s


@given(data=st.data(), many=st.booleans())
def test_never_above_what_a_sequence_still_takes(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject, many: bool
) -> None:
    """Any sequence at all: at each of its states both bounds are no more than the time to its end."""
    cell = data.draw(cells(max_machines=2, max_parts=4, many=many))
    run, work, least = Run(cell), RobotWork(cell), list[tuple[float, float]]()
    while allowed := run.allowed():
        least.append((run.now_s, least_s(work, counted(run), run.robot)))
        run.move(data.draw(st.sampled_from(allowed)))
    assert run.done
    assert all(now_s + least_s <= run.now_s + 1e-6 for now_s, least_s in least)


@given(data=st.data())
def test_no_state_is_bound_above_what_follows_it(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject
) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=4, many=True))
    merged = MergedCell(cell)
    bound = LowerBound(merged)
    state, least = merged.start(), list[tuple[MergedState, int]]()
    while not merged.done(state):
        least.append((state, bound.left(state)))
        state = data.draw(st.sampled_from(list(merged.successors(state))))
    # A tick for each move that was rounded.
    assert all(before.now + left <= state.now + len(least) for before, left in least)


@pytest.mark.parametrize("kind", ["I", "II", "III", "RSRS"])
def test_no_walk_is_bound_above_its_end(toast_cell: CellMaker, fms_cell: CellMaker, kind: str) -> None:
    """Buffers, pallets, vacuuming and arrivals; whatever is done next, at random."""
    merged = MergedCell(fms_cell(kind) if kind == "RSRS" else toast_cell(kind, 3))
    bound = LowerBound(merged)
    rng = np.random.default_rng(7)
    for _ in range(40):
        state, ends = merged.start(), list[int]()
        while not merged.done(state):
            ends.append(state.now + bound.left(state))
            successors = list(merged.successors(state))
            state = successors[int(rng.integers(len(successors)))]
        assert max(ends) <= state.now


def test_the_shorter_way_on_counts(oven_cell: CellMaker) -> None:
    """From the oven to the end it takes 100 s directly, 2 s and 2 s by a rack: after 10 s in the oven that is 14 s."""
    stations = (*oven_cell(1).stations, Station("rack", "buffer", 1))
    route = (Stage("in"), Stage("oven"), Stage("out", "rack"))
    loaded_s = np.full((4, 4), 2.0) - 2.0 * np.eye(4)
    loaded_s[1, 2] = 100.0
    change = {"stations": stations, "products": (Product("toast", (route,)),), "loaded_s": loaded_s}
    cell = oven_cell(1, **change, empty_s=np.ones((4, 4)) - np.eye(4), buffers="free")
    merged = MergedCell(cell)
    bound = LowerBound(merged)
    (inside,) = merged.successors(merged.start())
    assert bound.left(inside) / TICKS_PER_S == 14.0
    assert optimum(cell).cost == 16.0
