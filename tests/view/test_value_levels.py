"""Maps of what a policy has learned: on rows and boards that a reader can draw by hand."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.mdp import coverage, grid
from lab.toolbox.policy import GOAL, ON, OUT, Policy
from lab.view import value_levels as levels
from lab.view.canvas import ORANGE, RED
from lab.view.value_levels import GridPlanes, LearnedValues, Planes, can_be_drawn, is_map, value_levels

MakePolicy = Callable[..., Policy]
SPACE = ("left", "right", "backward", "forward", "down", "up")


@pytest.fixture(scope="session")
def policy(make_policy: MakePolicy) -> MakePolicy:
    """Makes a policy of a grid whose goal is its last cell, and which has seen every cell."""

    def made(shape: tuple[int, ...], labels: tuple[str, ...] = SPACE, ends: Any = None, **changed: Any) -> Policy:
        states = int(np.prod(shape)) if shape else 6
        closed = np.full(states, ON, np.uint8)
        closed[-1] = GOAL
        fields: dict[str, Any] = {
            "q": np.arange(float(states * len(labels))).reshape(states, -1),
            "visits": np.ones((states, len(labels)), np.int64),
            "action_labels": labels,
            "shape": shape,
            "ends": closed if ends is None else ends,
        }
        return make_policy(**(fields | changed))

    return made


def colours(path: Path) -> set[str]:
    """Every colour of a PNG file, as #RRGGBB."""
    from matplotlib.image import imread

    pixels = np.unique((imread(path)[..., :3] * 255).round().astype(int).reshape(-1, 3), axis=0)
    return {"#{:02X}{:02X}{:02X}".format(*pixel) for pixel in pixels}


@pytest.mark.parametrize(
    ("shape", "labels"),
    [((5,), ("left", "right")), ((3, 4), ("up", "down", "left", "right")), ((3, 2, 7), SPACE), ((2, 2, 2, 3), SPACE)],
)
def test_grids_of_any_dimension_are_drawn_alike_each_time(
    policy: MakePolicy, tmp_path: Path, shape: tuple[int, ...], labels: tuple[str, ...]
) -> None:
    for file in ("one.png", "two.png"):
        value_levels(policy(shape, labels), tmp_path / file)
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()
    assert colours(tmp_path / "one.png") >= {ORANGE, RED}


def test_another_best_move_and_another_end_are_another_picture(policy: MakePolicy, tmp_path: Path) -> None:
    shape, drawn = (3, 2, 2), []
    turned = np.full((12, 6), 0.0)
    turned[:, 2] = 71.0
    blocked = np.full(12, ON, np.uint8)
    blocked[[4, 11]] = OUT, GOAL
    unseen = np.ones((12, 6), np.int64)
    unseen[5] = 0
    for changed in ({}, {"q": turned}, {"ends": blocked}, {"visits": unseen}, {"start": 3}):
        value_levels(policy(shape, **changed), tmp_path / "map.png")
        drawn.append((tmp_path / "map.png").read_bytes())
    assert len(set(drawn)) == 5


def test_one_that_nothing_was_learned_of_is_drawn(policy: MakePolicy, tmp_path: Path) -> None:
    value_levels(policy((3, 4), visits=np.zeros((12, 6), np.int64)), tmp_path / "new.png")
    assert ORANGE in colours(tmp_path / "new.png")


def test_of_too_many_levels_those_with_the_ends_and_the_most_visited_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """A column of six levels of one cell: the start is in level 1, the goal in 4; visited is 3, too."""
    monkeypatch.setattr(levels, "MAX_LEVELS", 3)
    ends = np.array([0, 0, 0, 0, GOAL, 0], np.uint8)
    learned = LearnedValues(np.zeros(6), np.zeros(6, np.int64), np.array([0, 0, 0, 1, 0, 0], bool), ends)
    assert levels._chosen(Planes((1, 1, 6), False), learned, 1) == [1, 3, 4]


def test_levels_are_named_by_their_axes() -> None:
    assert [levels._level_name((2, 2), 0), levels._level_name((2, 2, 3), 2)] == ["", "level 2"]
    assert levels._level_name((2, 2, 3, 5), 7) == "level 1, turn 2"
    assert levels._level_name((2, 2, 2, 2, 2), 5) == "axis 2 1, axis 3 0, axis 4 1"


def test_up_is_out_of_the_plane_where_there_is_forward() -> None:
    assert levels._signs(SPACE).keys() == {"down", "up"}
    assert levels._signs(("left", "down", "right", "up")) == {}


def test_what_is_no_grid_is_refused(policy: MakePolicy, tmp_path: Path) -> None:
    assert not can_be_drawn(policy(()))
    with pytest.raises(BadInput, match="a grid with up to 10000 cells a level is needed"):
        value_levels(policy(()), tmp_path / "map.png")
    with pytest.raises(BadInput, match=r"plots are written as \.png"):
        value_levels(policy((2, 2)), tmp_path / "map.svg")
    assert not list(tmp_path.iterdir())


# ---- grid planes ------------------------------------------------------------------------------------------------------


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
