"""Waits on purpose, by hand: a part is brought late where it could not leave in time, and lies rather than is held."""

from dataclasses import replace

import numpy as np
import pytest

from lab.errors import BadInput
from lab.production.order import checked_order, moves_from
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Arrivals, Stage, Station
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.follow import follow, simulate, waits_in
from lab.sequencing.simulate.run import NO_WAIT, Run, Wait
from lab.sequencing.simulate.waits import waits_of

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


def test_where_parts_come_after_a_pick_none_is_put_off(slow_second: Cell) -> None:
    """A later pick would bring the next part later: it is picked as soon as it is there, and held."""
    cell = replace(slow_second, arrivals=Arrivals((1.0, 1.0), "pick"))
    assert waits_in(Run(cell), IN_TURN)[2] == Wait(0.0, 10.0)
