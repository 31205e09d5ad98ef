"""Waits on purpose, by hand: a part is brought late where it could not leave in time, and lies rather than is held."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DataObject, SearchStrategy

from lab.errors import BadInput
from lab.production.order import checked_order, moves_from
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import UNLIMITED, Arrivals, Product, Robot, Stage, Station
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.follow import follow, simulate, waits_in, waits_of, waits_of_several
from lab.sequencing.simulate.run import NO_WAIT, Run, Wait, Windowless

Cells = Callable[..., SearchStrategy[Cell]]

IN_TURN = (1, 1, 2, 1, 2, 2)


def line(*machines: tuple[float, float | None], parts: int = 2) -> Cell:
    """Machines one after the other, each with its time and window; empty ways take 1 s, with a part 2 s."""
    stations = (
        Station("in", "storage", 9),
        *(Station(f"m{n}", "machine", 1, took, window) for n, (took, window) in enumerate(machines, 1)),
        Station("out", "storage", 9),
    )
    table = np.ones((len(stations), len(stations))) - np.eye(len(stations))
    return Cell.alike(stations, tuple(Stage(one.name) for one in stations), table, 2 * table, "in", parts)


@pytest.fixture(scope="module")
def slow_second() -> Cell:
    """Nothing may stay in the first machine, which takes half as long as the second one."""
    return line((10.0, 0.0), (20.0, None))


def test_a_part_is_picked_late_so_that_the_next_machine_is_free_in_time(slow_second: Cell) -> None:
    """Part 1 is in m2 from 14 to 34 s and out at 36 s; the robot is back at m1 at 37 s. So 2 comes there at 27 s, not at 17 s."""
    assert waits_in(Run(slow_second), IN_TURN) == (NO_WAIT, NO_WAIT, Wait(10.0, 0.0), NO_WAIT, NO_WAIT, NO_WAIT)
    picks_s = [(move.pick_s, move.drop_s) for move in moves_from(Run(slow_second), IN_TURN, "order")]
    assert picks_s == [(0, 2), (12, 14), (25, 27), (34, 36), (37, 39), (59, 61)]
    assert simulate(slow_second, IN_TURN).makespan_s == follow(slow_second, IN_TURN).end_s == 61.0
    assert optimum(slow_second).cost == 61.0
    assert simulate(slow_second, (1, 1, 1, 2, 2, 2)).makespan_s == 73.0  # the only order without waits
    assert checked_order(slow_second, "1 1 2 1 2 2") == IN_TURN


def test_what_may_not_lie_is_held() -> None:
    """Nothing may stay in m1 or m2; m3 is busy until 46 s: the part is taken out of m1 at once, and held over m2."""
    cell = line((10.0, 0.0), (10.0, 0.0), (40.0, None))
    sequence = (1, 1, 1, 2, 2, 1, 2, 2)
    waits = waits_in(Run(cell), sequence)
    moves = moves_from(Run(cell), sequence, "order")
    # 1 is in m3 from 26 to 66 s and out at 68 s, the robot at m2 at 69 s: 2 has to come there at 59 s, and is done in m1 at 39 s
    assert (moves[4].pick_s, moves[4].drop_s) == (39.0, 59.0)
    assert waits[4] == Wait(0.0, 18.0)
    assert (moves[5].pick_s, moves[6].pick_s) == (66.0, 69.0)


def test_a_part_lies_as_long_as_its_own_window_lets_it() -> None:
    """As before, but 5 of these 18 s it may lie in m1."""
    cell = line((10.0, 5.0), (10.0, 0.0), (40.0, None))
    assert waits_in(Run(cell), (1, 1, 1, 2, 2, 1, 2, 2))[4] == Wait(5.0, 13.0)


def test_no_waits_where_none_help(slow_second: Cell) -> None:
    """There is no room for 2 in m1; a list that needs no waits has none; 1 may not stay in m1 while 2 is brought there, too."""
    assert waits_of(Run(slow_second), (1, 2)) is None
    assert waits_in(Run(slow_second), (1, 1, 1, 2, 2, 2)) == ()
    roomy = replace(slow_second.stations[1], capacity=2, processing_s=2.0)
    crossing = replace(slow_second, stations=(slow_second.stations[0], roomy, *slow_second.stations[2:]))
    assert waits_of(Run(crossing), (1, 2, 1)) is None
    with pytest.raises(BadInput, match="would burn"):
        simulate(crossing, (1, 2, 1))


def test_from_the_middle(slow_second: Cell) -> None:
    """From 14 s on, the robot at m2: as from the beginning."""
    run = Run(slow_second)
    run.move(1)
    run.move(1)
    assert waits_in(run, IN_TURN[2:]) == (Wait(10.0, 0.0), NO_WAIT, NO_WAIT, NO_WAIT)


def test_beyond_the_window(slow_second: Cell) -> None:
    """Of a window of 4 s the part may have 4 s more, of one of nothing nothing: waits are shorter by so much."""
    four = line((10.0, 4.0), (20.0, None))
    first = [
        waits[2].pick_s
        for cell, beyond_s in ((slow_second, 9.0), (four, 0.0), (four, 1.0), (four, 9.0))
        if (waits := waits_of(Run(cell), IN_TURN, beyond_s)) is not None
    ]
    assert first == pytest.approx([10.0, 6.0, 5.0, 2.0], abs=1e-5)


def test_of_two_robots_one_holds_a_part_until_the_other_can_fetch_it_in_time(slow_second: Cell) -> None:
    """The first robot only brings parts to m1. The second one has 1 in m2 at 14 s and out at 36 s, and is back at m1 at 37 s.

    So 2 comes to m1 at 27 s, though there is room from 12 s on, and it is picked at 3 s.
    """
    cell = replace(
        slow_second, robots=(Robot("a", "in", serves=("in", "m1")), Robot("b", "m1", serves=("m1", "m2", "out")))
    )
    assert waits_of(Run(cell), IN_TURN) == (NO_WAIT, NO_WAIT, Wait(0.0, 22.0), NO_WAIT, NO_WAIT, NO_WAIT)
    picks_s = [(move.pick_s, move.drop_s) for move in follow(cell, IN_TURN).moves]
    assert picks_s == [(0, 2), (12, 14), (3, 27), (34, 36), (37, 39), (59, 61)]
    found = cp_sat(cell)
    assert (found.status, found.cost) == ("optimal", 61.0)
    assert simulate(cell, found.sequence).makespan_s == 61.0


def test_a_server_begins_late_so_that_the_next_one_is_free_in_time(slow_second: Cell) -> None:
    """Nobody carries: 1 is in m1 until 10 s and in m2 until 30 s, so 2 begins in m1 at 20 s."""
    machines = [replace(one, capacity=UNLIMITED, servers=1) for one in slow_second.stations[1:3]]
    stations, route = (
        (slow_second.stations[0], *machines, slow_second.stations[-1]),
        (Stage("in"), Stage("m1"), Stage("m2")),
    )
    cell = replace(slow_second, stations=stations, products=(Product("toast", (route,)),), robots=())
    assert waits_in(Run(cell), (1, 1, 2, 2)) == (NO_WAIT, NO_WAIT, Wait(10.0, 0.0), NO_WAIT)
    assert [move.end_s for move in follow(cell, (1, 1, 2, 2)).moves] == [10.0, 30.0, 30.0, 50.0]
    assert (found := cp_sat(cell)).status == "optimal"
    assert found.cost == 50.0


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_all_again_until_none_is_late_and_the_network_come_to_the_same(cells: Cells, data: DataObject) -> None:
    """Of one robot, any list: what times several robots has a solution where the network has, and the same earliest ends."""
    cell = data.draw(cells(many=True, max_parts=4, windows=True))
    run = Windowless(cell)
    found = list[int]()
    while allowed := run.allowed():
        found.append(data.draw(st.sampled_from(allowed)))
        run.move(found[-1])
    both = waits_of(Run(cell), found), waits_of_several(Run(cell), found, 0.0)
    assert (both[0] is None) == (both[1] is None)
    ends_s = []
    for waits in both:
        timed = Windowless(cell)
        ends_s.append([timed.move(*one).drop_s for one in zip(found, waits or (), strict=False)])
    assert ends_s[0] == pytest.approx(ends_s[1], abs=1e-5)


def test_where_parts_come_after_a_pick_none_is_put_off(slow_second: Cell) -> None:
    """A later pick would bring the next part later: it is picked as soon as it is there, and held."""
    cell = replace(slow_second, arrivals=Arrivals((1.0, 1.0), "pick"))
    assert waits_in(Run(cell), IN_TURN)[2] == Wait(0.0, 10.0)
