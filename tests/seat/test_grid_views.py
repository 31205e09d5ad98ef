"""The views of a space from above and from the front: what a person would see, to be redone by hand."""

import numpy as np
import pytest

from lab.learning.requests import AdviceRequest
from lab.mdp import TabularMDP, grid
from lab.seat.grid_text import Marks, both_views, views_of

CUBE = ("left", "right", "backward", "forward", "down", "up")
FROM_SIDE = ("lower", "higher", "backward", "forward", "in", "out")


def space(labels: tuple[str, ...] = CUBE) -> TabularMDP:
    """3 x 2 x 2 cells, one blocked at (1, 0, 0), from (0, 1, 1) to (2, 0, 0)."""
    blocked = np.zeros((3, 2, 2), bool)
    blocked[1, 0, 0] = True
    return grid((3, 2, 2), blocked, (0, 1, 1), (2, 0, 0), action_labels=labels)


def asked(mdp: TabularMDP, cell: tuple[int, ...], own: int) -> AdviceRequest:
    q = [[0.0] * mdp.n_actions] * mdp.n_states
    state = int(np.ravel_multi_index(cell, mdp.shape))
    return AdviceRequest(mdp=mdp, q=q, state=state, episode=1, step=1, own=own, allowed=range(mdp.n_actions))


def drawn(request: AdviceRequest, width: int = 60, height: int = 9) -> list[str]:
    picture = both_views(request, Marks(), width, height)
    assert picture is not None
    return [line.plain.rstrip() for line in picture.lines]


def test_forward_is_up_from_above_and_up_is_up_from_the_front() -> None:
    assert drawn(
        asked(space(), (0, 1, 1), own=1)
    ) == [  # above: level 1; front: the row behind; the goal lies before it
        " from above    from the front",
        " R → ·         R → ·",
        " · · g         · · g",
    ]
    assert drawn(asked(space(), (0, 0, 0), own=5)) == [
        " from above    from the front",
        " · · ·         ↑ · ·",
        " R # G         R # G",
    ]


def test_from_the_side_in_is_to_the_right() -> None:
    """The front view runs along the way in, as the page's camera sees it; the first axis is the height."""
    lines = drawn(asked(space(FROM_SIDE), (0, 1, 1), own=4))
    assert lines[0].split("   ") == [" from above", " from the front"]
    assert [line[:4] for line in lines[1:3]] == [" R →", " · g"]  # rows: forward, backward
    assert [line.strip()[-3:] for line in lines[1:4]] == ["· g", "· ·", "R →"]  # rows: higher to lower


def test_a_view_that_is_too_wide_is_cut_around_the_robot_and_says_so() -> None:
    picture = both_views(asked(space(), (2, 1, 1), own=0), Marks(), 11, 3)
    assert picture is not None
    assert picture.shown == ((0, 1, 2),)
    assert picture.width <= 11


@pytest.mark.parametrize("labels", [("up", "down", "left", "right", "a", "b"), CUBE[2:4] + CUBE[:2] + CUBE[4:]])
def test_other_moves_have_no_views(labels: tuple[str, ...]) -> None:
    assert views_of(space(labels)) == ()
    assert both_views(asked(space(labels), (0, 1, 1), own=0), Marks(), 60, 9) is None
