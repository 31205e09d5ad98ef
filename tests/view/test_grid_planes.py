"""Where cells stand in a picture: by hand on boards of six cells."""

import numpy as np

from lab.mdp import coverage, grid
from lab.view.value_levels import GridPlanes, is_map

BLOCKED = np.array([[0, 1, 0], [0, 0, 0]], bool)


def test_rows_run_down_and_columns_to_the_right() -> None:
    planes = GridPlanes(grid((2, 3), BLOCKED, (0, 0), (1, 2), action_labels=("up", "down", "left", "right")))
    assert (planes.rows, planes.columns, planes.layers, planes.place((1, 2))) == (2, 3, 1, (1, 2))
    assert ["".join(row) for row in planes.marks(0)] == [".#.", "..G"]


def test_a_map_has_x_to_the_right_and_y_up() -> None:
    mdp = grid((2, 3), BLOCKED, (0, 0), (1, 2), action_labels=("left", "right", "down", "up"))
    planes = GridPlanes(mdp)
    assert is_map(mdp)
    assert (planes.rows, planes.columns, planes.place((1, 2)), planes.place((0, 0))) == (3, 2, (0, 1), (2, 0))
    assert ["".join(row) for row in planes.marks(0)] == [".G", "#.", ".."]
    assert planes.plane(np.arange(6)).tolist() == [[2, 5], [1, 4], [0, 3]]


def test_axes_beyond_the_second_are_layers() -> None:
    planes = GridPlanes(grid((1, 2, 2, 3), np.zeros((1, 2, 2, 3), bool), (0, 0, 0, 0), (0, 1, 1, 2)))
    assert (planes.layers, planes.layer((0, 1, 1, 2))) == (6, 5)
    assert planes.plane(np.arange(12), 5).tolist() == [[5, 11]]


def test_one_axis_is_a_row_and_of_a_coverage_it_is_the_grid_to_cover() -> None:
    row = GridPlanes(grid((4,), np.zeros(4, bool), (0,), (3,)))
    assert (row.rows, row.columns, row.place((3,)), "".join(row.marks(0).ravel())) == (1, 4, (0, 3), "...G")
    assert (GridPlanes(coverage((2, 2))).rows, GridPlanes(coverage((2, 2))).columns) == (2, 2)
