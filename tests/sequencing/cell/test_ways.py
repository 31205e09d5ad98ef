"""Moves in whole ticks: which may follow which, and how far stations are apart."""

from collections.abc import Callable

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.ways import FAR, distances, follows, ticks, ways_of

CellMaker = Callable[..., Cell]


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
