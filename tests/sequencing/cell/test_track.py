"""A track: shortest ways, what they hold, and two robots who meet on one stretch, by hand."""

from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Robot, Stage, Station
from lab.sequencing.cell.track import HeldStretch, Stretch, travel_s, ways_on
from lab.sequencing.simulate.run import Run

NAMES = ("in", "a", "b", "out")
LINE = (Stretch("in", "a", 10.0), Stretch("a", "b", 5.0), Stretch("b", "out", 10.0))


def line(**changes: Any) -> Cell:
    """Two machines between in and out; a robot on each side; a part for each machine, which brings it back out."""
    stations = (
        Station("in", "storage", 9),
        Station("a", "machine", 1, 20.0),
        Station("b", "machine", 1, 20.0),
        Station("out", "storage", 9),
    )
    products = tuple(Product(f"by {m}", ((Stage("in"), Stage(m), Stage("out")),)) for m in ("a", "b"))
    table = np.full((4, 4), np.nan)
    for (i, j), way in ways_on(LINE, NAMES).items():
        table[i, j] = travel_s(way)
    robots = (Robot("left", "in"), Robot("right", "out"))
    given: dict[str, Any] = {"robots": robots, "track": LINE} | changes
    return Cell(stations, products, ("by a", "by b"), table, table, **given)


def test_ways_are_the_shortest_and_say_when_each_stretch_is_held() -> None:
    ways = ways_on(LINE, NAMES)
    assert ways[0, 2] == (HeldStretch(0, 0.0, 10.0), HeldStretch(1, 10.0, 15.0))
    assert ways[2, 0] == (HeldStretch(1, 0.0, 5.0), HeldStretch(0, 5.0, 15.0))
    assert ways[1, 1] == ()
    around = (*LINE, Stretch("in", "out", 12.0))
    assert [held.stretch for held in ways_on(around, NAMES)[0, 2]] == [0, 1]  # 15 s; by out it would be 22 s
    assert [held.stretch for held in ways_on(around, NAMES)[0, 3]] == [3]


def test_of_ways_as_long_the_one_with_fewer_stretches_is_taken() -> None:
    square = (Stretch("in", "a", 1.0), Stretch("a", "b", 1.0), Stretch("in", "b", 2.0))
    assert [held.stretch for held in ways_on(square, NAMES)[0, 2]] == [2]


def test_two_robots_meet_and_one_waits() -> None:
    """left carries part 1 from in to a, 0 to 10 s; right drives from out to in: 10 + 5 + 10 s, the last stretch from 15 s on.

    It is free then: right does not wait. With part 2, from in to b, it sets out at 25 s, drives in-a till 35 s and a-b till 40 s.
    left takes part 1 up at a when it is done, at 30 s: to b it would meet right on a-b, so it holds it until 40 s, beside a.
    """
    run = Run(line())
    left, right = 1, 1 + 2  # decisions of part 1 by left, and by right
    first = run.move(left)
    assert (first.leave_s, first.pick_s, first.drop_s) == (0.0, 0.0, 10.0)
    second = run.move(right + 1)
    assert (second.leave_s, second.reach_s, second.pick_s, second.drop_s) == (0.0, 25.0, 25.0, 40.0)
    third = run.move(left)
    assert (third.reach_s, third.pick_s, third.held_s, third.drop_s) == (10.0, 30.0, 10.0, 55.0)
    assert run.waited_s == 30.0  # beside a: 20 s for the part, 10 s for the track


def test_who_sets_out_against_another_waits_before_it() -> None:
    """right first: it holds in-a from 15 to 25 s; left, decided after it, may set out only then, though in-a was free before."""
    run = Run(line())
    run.move(1 + 1 + 2)  # part 2 by right: there at 25 s, and on in-a again until 35 s, on a-b until 40 s
    first = run.move(1)
    assert (first.pick_s, first.held_s, first.drop_s) == (0.0, 35.0, 45.0)


def test_without_a_track_nobody_waits_for_it() -> None:
    run = Run(line(track=()))
    assert [run.move(decision).pick_s for decision in (1, 4, 1)] == [0.0, 25.0, 30.0]


@pytest.mark.parametrize(
    ("track", "fault"),
    [
        ((Stretch("in", "c", 1.0),), "unknown station 'c'"),
        ((Stretch("in", "in", 1.0),), "track 'in' - 'in' of 1 s: wanted two stations, and more than 0 s"),
        ((Stretch("in", "a", 0.0),), "wanted two stations, and more than 0 s"),
        ((Stretch("in", "a", -1.0),), "track 'in' - 'a'"),
        ((*LINE, Stretch("a", "in", 3.0)), "track 'a' - 'in': it is there twice"),
        (LINE[:2], "no path of .* s leads from .* to .* on it"),
        ((*LINE[:2], Stretch("b", "out", 11.0)), "no path of .* s leads from .* to .* on it"),
    ],
)
def test_what_cannot_be_a_track(track: tuple[Stretch, ...], fault: str) -> None:
    with pytest.raises(BadInput, match=fault):
        line(track=track)
