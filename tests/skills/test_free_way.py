"""A way through free cells: the shortest from neighbour to neighbour, none where walls are, by hand on a few cells."""

import numpy as np
import pytest

from lab.sim.scene.blocked_cells import Survey
from lab.skills.free_way import shortest


def survey(*levels: str) -> Survey:
    """Levels from below, each rows of x with columns of y; # is blocked."""
    cells = np.array([[list(row) for row in level.split()] for level in levels])  # (z, x, y)
    return Survey(np.where(np.moveaxis(cells, 0, 2) == "#", "a wall", ""))


def test_straight_on_where_nothing_is_in_the_way() -> None:
    assert shortest(survey("... ..."), (0, 0, 0), (0, 2, 0)) == [(0, 0, 0), (0, 1, 0), (0, 2, 0)]


def test_where_it_is_there_is_one_cell() -> None:
    assert shortest(survey("."), (0, 0, 0), (0, 0, 0)) == [(0, 0, 0)]


def test_over_a_wall_by_the_level_above() -> None:
    way = shortest(survey(".#.", "..."), (0, 0, 0), (0, 2, 0))
    assert way == [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 2, 1), (0, 2, 0)]


@pytest.mark.parametrize("levels", [(".#.",), (".#.", ".#.")])
def test_no_way_through_a_wall(levels: tuple[str, ...]) -> None:
    assert shortest(survey(*levels), (0, 0, 0), (0, 2, 0)) == []
