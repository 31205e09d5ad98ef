"""Ways for what a sentence means, on a map of 4 x 4 cells that can be followed by hand."""

import numpy as np
import pytest

from lab.mdp import grid
from lab.words.listen import listen
from lab.words.meaning import Refusal
from lab.words.scene_map import SceneMap, obstacles_of
from lab.words.ways import Before, NoWay, way

LETTERS = "fblr"  # forward, backward, left, right


def known() -> SceneMap:
    """. . . G
    . # . .
    . . . .
    R . . ."""
    blocked = np.zeros((4, 4), bool)
    blocked[1, 1] = True
    mdp = grid((4, 4), blocked, (3, 0), (0, 3), action_labels=("forward", "backward", "left", "right"))
    return SceneMap(mdp, mdp.action_labels, lambda cell: (cell[0], cell[1]), obstacles_of(mdp))


MAP = known()


def walked(
    text: str, before: Before | None = None, avoided: frozenset[int] = frozenset(), state: int | None = None
) -> str:
    """The moves for a sentence, one letter each."""
    at = MAP.mdp.start if state is None else state
    heard = listen(text, MAP.scene(at))
    assert not isinstance(heard, Refusal), heard
    return "".join(LETTERS[action] for action in way(heard, MAP, at, before or Before(0), avoided))


@pytest.mark.parametrize(
    ("text", "moves"),
    [
        ("two steps right, please", "rr"),
        ("right until the wall, then up", "rrrf"),
        ("right until the wall, then up until the wall", "rrrfff"),  # the goal ends it
        ("one up, then right until you are next to the cube", "fr"),
        ("go to the goal", "fffrrr"),
        ("go to the cube", "ff"),
        ("right, then up until the cube", "rf"),
        ("right, then right until you are past the cube, then 2 up", "rrff"),
        ("no, the other way", None),
        ("like last time", "rf"),
    ],
)
def test_ways(text: str, moves: str | None) -> None:
    if moves is None:
        with pytest.raises(NoWay):
            walked(text)
    else:
        assert walked(text, Before(0, (3, 0))) == moves


def test_the_cube_is_passed_on_either_side() -> None:
    at = 3 * 4 + 1  # below the cube
    assert walked("around the cube, on its left side", state=at) == "flff"
    assert walked("pass the cube on the right", state=at) == "frff"
    assert walked("around the cube", state=at) in ("flff", "frff")


@pytest.mark.parametrize("text", ["left", "right 4", "forward 5", "right until the cube"])
def test_there_is_no_such_way(text: str) -> None:
    with pytest.raises(NoWay):
        walked(text)


def test_what_is_avoided_is_left_out() -> None:
    near = MAP.near("cube")
    assert len(near) == 9
    assert walked("go to the goal", avoided=near) == "rrrfff"
    with pytest.raises(NoWay, match="keeps away"):
        walked("forward", avoided=near)


def test_obstacles_are_named_by_their_causes_or_by_clusters() -> None:
    blocked = np.zeros((3, 4), bool)
    blocked[0, 0] = blocked[2, 2] = blocked[2, 3] = True
    mdp = grid((3, 4), blocked, (1, 0), (1, 3))
    assert [(thing.id, len(thing.cells)) for thing in obstacles_of(mdp)] == [("cube-1", 1), ("cube-2", 2)]
    causes = np.full((3, 4), "", "U20")
    causes[0, 0], causes[2, 2], causes[2, 3] = "bread_box", "out of reach", "cubes A"
    named = {thing.id: thing.names for thing in obstacles_of(mdp, causes)}
    assert named == {"bread box": ("bread box",), "cubes A": ("cubes A", "cube A", "cubes", "cube")}
