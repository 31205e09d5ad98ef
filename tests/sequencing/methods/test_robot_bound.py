"""The lower bounds: by hand on one oven, and never above what any sequence still takes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Arrivals, Product, Stage, Station
from lab.sequencing.cell.ways import FAR, TICKS_PER_S, distances, follows, ticks, ways_of
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.lower_bound import LowerBound
from lab.sequencing.methods.robot_bound import RobotWork
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


def test_what_follows_what(oven_cell: CellMaker) -> None:
    """With room for one in the oven, a second part cannot be brought before the first is taken out."""
    cell = oven_cell(2)
    bring, take = ways_of(cell)
    assert follows(cell, bring, take, same=True)
    assert not follows(cell, bring, bring, same=False)
    assert not follows(cell, bring, take, same=False)
    assert follows(cell, take, bring, same=False)
    assert not follows(cell, take, take, same=False)


def test_what_is_full_stays_full_when_a_buffer_was_used(toast_cell: CellMaker) -> None:
    """A toast goes to the buffer because the toaster is full: none can be brought to the toaster next."""
    cell = toast_cell("I", 2)
    buffered = next(way for way in ways_of(cell) if way.option.if_full == cell.index("toaster"))
    following = [way for way in ways_of(cell) if follows(cell, buffered, way, same=False)]
    assert following
    assert all(cell.names[way.option.target] != "toaster" for way in following)


def test_distances_take_the_shortest_way(toast_cell: CellMaker) -> None:
    """Case I: station 4 to 6 is never travelled at once, but through 5 it takes 19 + 12 s."""
    table = distances(toast_cell("I", 2), 1.0)
    assert table[3][5] == 31
    assert table[1][0] == 21
    assert all(table[place][place] == 0 for place in range(6))


def test_distances_know_what_is_out_of_reach(oven_cell: CellMaker) -> None:
    """One part needs no way back from the end."""
    empty_s, loaded_s = np.full((3, 3), np.nan), np.full((3, 3), np.nan)
    loaded_s[0, 1] = loaded_s[1, 2] = 2.0
    table = distances(oven_cell(1, empty_s=empty_s, loaded_s=loaded_s), 1.0)
    assert table == [[0, 2, 4], [FAR, 0, 2], [FAR, FAR, 0]]


def test_ticks() -> None:
    assert ticks([1.5, float("nan"), 1e-9]) == [1_500_000_000, -1, 1]
