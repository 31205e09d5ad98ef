"""The least time a part with several parts a cycle, by hand, and what is proven of it."""

from collections.abc import Callable
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.cyclic import line, several
from lab.sequencing.cyclic.line import at_speed, away_s
from lab.sequencing.cyclic.several import EVERY_CYCLE, Tried, best_rhythm, least_s, usual_parts

CellMaker = Callable[..., Cell]
NEAR = 1e-5


def mills(number: int, mill_s: float, washer_s: float, washers: int = 2) -> Cell:
    """Parts go to one of the mills, all alike, and to the washer; every way takes 8 s."""
    names = [f"mill-{n}" for n in range(1, number + 1)]
    stations = [Station("in", "storage", 9), *(Station(name, "machine", 1, mill_s) for name in names)]
    stations += [Station("washer", "machine", washers, washer_s), Station("out", "storage", 9)]
    product = Product("part", tuple(tuple(map(Stage, ("in", name, "washer", "out"))) for name in names))
    table = 8.0 * (1.0 - np.eye(len(stations)))
    return Cell(tuple(stations), (product,), ("part",) * 4, table, table, one_robot("in"))


def test_two_mills_before_a_washer_of_two() -> None:
    """A part goes the same way in every cycle of one part: 85.23 s in a mill, 8 s out, 8 s to the next part, 8 s in. With two
    parts both mills work, and the washer is the one that is waited for: (104 + 24) / 2 s a part."""
    found = best_rhythm(mills(2, 85.23, 104.0), ("part",))
    assert found.tried == (Tried(1, 109.23, 109.23, True), Tried(2, 128.0, 128.0, True))
    assert (found.per_part_s, found.cycle.parts, found.proven, found.proven_of) == (64.0, 2, True, EVERY_CYCLE)
    assert {move["origin"] for move in found.cycle.to_json()} == {"in", "mill-1", "mill-2", "washer"}


def test_three_mills_want_three_parts_a_cycle() -> None:
    """(120 + 24) / 3 s a part; the washer, of one, takes 10 + 24 s."""
    found = best_rhythm(mills(3, 120.0, 10.0, 1), ("part",))
    assert [one.period_s for one in found.tried] == [144.0, 144.0, 144.0]
    assert (found.per_part_s, found.proven_of) == (48.0, EVERY_CYCLE)


def test_what_is_asked_for_is_not_exceeded() -> None:
    found = best_rhythm(mills(3, 120.0, 10.0, 1), ("part",), 2)
    assert (found.per_part_s, found.bound_part_s, found.proven, found.most_parts) == (72.0, 72.0, True, 2)
    assert found.proven_of == "cycles of up to 2 parts"
    assert found.least_part_s == pytest.approx(48.0, abs=NEAR)


def test_a_mix_enters_whole() -> None:
    """Of two parts that enter together, once: no cycle of 3 parts is looked for, and 4 would be two mixes."""
    found = best_rhythm(mills(3, 120.0, 10.0, 1), ("part", "part"), 3)
    assert ([one.parts for one in found.tried], found.proven_of) == ([2], "cycles of 2 parts")


def test_one_oven_needs_no_more_than_one_part(oven_cell: CellMaker) -> None:
    """15 s a toast whatever a cycle takes: after one part nothing more is tried."""
    found = best_rhythm(oven_cell(), ("toast",), 9)
    assert ([one.parts for one in found.tried], found.per_part_s, found.proven_of) == ([1], 15.0, EVERY_CYCLE)


def test_where_none_is_better_that_is_proven(toast_cell: CellMaker) -> None:
    """150 s a toast; the bound of all cycles is a little less, for a toaster may be filled over its buffer, too."""
    found = best_rhythm(toast_cell("I", 3), ("toast",), 2)
    assert found.tried == (Tried(1, 150.0, 150.0, True), Tried(2, None, 300.0, True))
    assert (found.per_part_s, found.proven, found.proven_of) == (150.0, True, "cycles of up to 2 parts")
    assert 149.0 < found.least_part_s < 150.0
    alone = best_rhythm(toast_cell("I", 3), ("toast",))
    assert (alone.most_parts, alone.why_no_more) == (1, "less than 1% of the time could be gained")


def test_the_usual_number_of_parts_is_small(toast_cell: CellMaker, hoist_cell: CellMaker) -> None:
    """At most 4 parts, 30 moves (13 a carrier) and 100 choices of ways (8 mills: 36 for two parts, 120 for three)."""
    assert usual_parts(mills(2, 85.23, 104.0), ("part",)) == 4
    assert usual_parts(mills(2, 85.23, 104.0), ("part",) * 3) == 3
    assert usual_parts(hoist_cell(), ("carrier",)) == 2
    assert usual_parts(mills(8, 1.0, 1.0), ("part",)) == 2
    assert usual_parts(toast_cell("I", 3), ("toast",)) == 3  # as many as the cell has


def test_more_parts_than_can_be_modelled_are_not_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 3 moves a part, where 5 are allowed."""
    monkeypatch.setattr(line, "MOST_MOVES", 5)
    found = best_rhythm(mills(2, 85.23, 104.0), ("part",), 4)
    assert (found.most_parts, found.per_part_s) == (1, 109.23)
    assert found.why_no_more == "--cyclic: a cycle of 2 parts has 6 moves; allowed are 5"


def test_time_that_is_over_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that goes on by 30 s each time it is asked: at the begin, and before each number of parts."""
    told_s = count(0.0, 30.0)
    monkeypatch.setattr(several, "time", SimpleNamespace(perf_counter=lambda: next(told_s)))
    found = best_rhythm(mills(2, 85.23, 104.0), ("part",), 4)
    assert (found.most_parts, found.why_no_more) == (1, "the 60 s were over")
    assert (found.per_part_s, found.proven_of) == (109.23, "cycles of 1 part")


def test_what_has_no_cycle_is_refused(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="has no 'bun'"):
        best_rhythm(oven_cell(), ("bun",))


def bound(cell: Cell, *mix: str) -> float:
    return least_s(at_speed(cell), mix, away_s(at_speed(cell)))


def test_the_bound_of_all_cycles_by_hand(oven_cell: CellMaker) -> None:
    """The mills' washer; the oven; mills that are waited for: half of 109.23 s; the robot: three
    ways of 8 s with a part, one back, and 1 s beside a mill, but none beside the washer, where another part may be done."""
    assert bound(mills(2, 85.23, 104.0), "part") == pytest.approx(64.0, abs=NEAR)
    assert bound(oven_cell(), "toast") == pytest.approx(15.0, abs=NEAR)
    assert bound(mills(2, 85.23, 1.0), "part") == pytest.approx(54.615, abs=NEAR)
    assert bound(mills(2, 1.0, 1.0), "part") == pytest.approx(33.0, abs=NEAR)
    assert bound(mills(2, 85.23, 104.0), "part", "part") == pytest.approx(128.0, abs=NEAR)
