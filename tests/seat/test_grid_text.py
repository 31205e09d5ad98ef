"""The picture of a request: planes, slices, windows, and drawings from elsewhere with nothing but their colours."""

import re
from io import StringIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from lab.learning.requests import AdviceRequest
from lab.learning.session_events import Improvement
from lab.mdp import TabularMDP, coverage, grid
from lab.seat.grid_text import Marks, TextPicture, bracketed, direction_of, picture_of, safe_ansi, window
from lab.view.value_levels import GridPlanes

CUBE = ("left", "right", "backward", "forward", "down", "up")
SKY = ("south", "north", "east", "west", "pick up")


def request(mdp: TabularMDP, action: int = 3, cell: tuple[int, ...] | None = None) -> AdviceRequest:
    state = mdp.start if cell is None else int(np.ravel_multi_index(cell, mdp.shape))
    return AdviceRequest(
        mdp=mdp,
        q=[[0.0] * mdp.n_actions] * mdp.n_states,
        state=state,
        episode=31,
        step=2,
        own=action,
        improvement=Improvement(0.0125, 39.5, 40.0),
        allowed=range(mdp.n_actions),
    )


def board(shape: tuple[int, ...] = (3, 4), labels: tuple[str, ...] = ("up", "down", "left", "right")) -> TabularMDP:
    blocked = np.zeros(shape, bool)
    blocked[1, 1] = True
    return grid(shape, blocked, (0,) * len(shape), tuple(n - 1 for n in shape), action_labels=labels)


def space() -> TabularMDP:
    blocked = np.zeros((2, 3, 4), bool)
    blocked[0, 1, 2] = True
    labels = ("-x", "+x", "-y", "+y", "-z", "+z")
    return grid(blocked.shape, blocked, (1, 2, 2), (0, 0, 0), action_labels=labels)


def cube(levels: int = 5) -> TabularMDP:
    blocked = np.zeros((3, 2, levels), bool)
    blocked[1, 0, 1] = True
    return grid(blocked.shape, blocked, (0, 0, 1), (2, 1, levels - 1), action_labels=CUBE)


def picture(asked: AdviceRequest) -> list[str]:
    """The robot's own layer, without its title, and what the marks mean."""
    found = fitting(asked, 2 * GridPlanes(asked.mdp).columns, 99)
    return [*(line.plain.strip() for line in found.lines if "level" not in line.plain), found.legend]


def fitting(asked: AdviceRequest, width: int, height: int) -> TextPicture:
    found = picture_of(asked, Marks(), width, height)
    assert found is not None
    return found


def plain(found: TextPicture) -> list[str]:
    return [line.plain for line in found.lines]


# ---- one plane ------------------------------------------------------------------------------------------------------


def test_a_plane_is_shown_whole_with_the_learners_own_move() -> None:
    assert picture(request(board()))[:3] == ["R → · ·", "· # · ·", "· · · G"]
    assert picture(request(board(), action=0))[0] == "R · · ·"  # up leads nowhere
    assert picture(request(board()))[3] == "R robot, G goal, # obstacle, arrow: the learner's own choice"


def test_obstacles_and_goals_are_not_hidden_by_the_arrow() -> None:
    assert picture(request(board(), 1, (0, 1)))[1] == "· # · ·"
    assert picture(request(board(), 3, (2, 2)))[2:] == ["· · R G", "R robot, G goal, # obstacle"]


def test_a_goal_in_another_plane_casts_its_shadow() -> None:
    assert picture(request(space(), action=0)) == [
        "g # ↑",
        "· · R",
        "R robot, g the goal's shadow, # obstacle, arrow: the learner's own choice",
    ]
    assert picture(request(space(), 5, (1, 2, 0)))[:2] == ["G · ·", "· · R"]


def test_one_axis_runs_to_the_right() -> None:
    mdp = grid((4,), np.zeros(4, bool), (1,), (3,), action_labels=("back", "on"))
    assert picture(request(mdp, action=1))[0] == "· R → G"


def test_covering_shows_head_and_covered_cells() -> None:
    mdp = coverage((2, 3))
    right = int(mdp.successor[mdp.start, 3])
    asked = AdviceRequest(
        mdp=mdp, q=[[0.0] * 4] * mdp.n_states, state=right, episode=31, step=2, own=1, allowed=range(mdp.n_actions)
    )
    assert picture(asked) == ["x R ·", "· ↓ ·", "R head, x covered, arrow: the learner's own choice"]


def test_a_map_is_seen_from_above_with_y_upwards() -> None:
    mdp = grid((3, 2), np.zeros((3, 2), bool), (0, 0), (2, 1), action_labels=CUBE[:4])
    assert picture(request(mdp, 3))[:2] == ["↑ · G", "R · ·"]


def test_states_without_a_grid_have_no_picture() -> None:
    end = np.array([False, True])
    mdp = TabularMDP(np.array([[0, 1], [1, 1]]), np.zeros((2, 2)), end, end, 0, ("wait", "go"))
    assert picture_of(request(mdp, 0), Marks(), 80, 24) is None


def test_actions_named_after_directions_point_there_in_any_order() -> None:
    labels = ("left", "down", "right", "up")
    turned = TabularMDP(board().successor, board().reward, board().terminal, board().goal, 0, labels, (3, 4))
    assert [direction_of(turned, action) for action in range(4)] == [2, 1, 3, 0]
    end = np.array([True])
    taxi = TabularMDP(np.zeros((1, 5), int), np.zeros((1, 5)), ~end, ~end, 0, SKY)
    assert [direction_of(taxi, action) for action in range(5)] == [1, 0, 3, 2, None]
    assert [direction_of(cube(), action) for action in range(6)] == [2, 3, 1, 0, None, None]


# ---- windows and slices ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("at", "size", "room", "expected"),
    [(5, 12, 4, (3, 7)), (0, 12, 4, (0, 4)), (11, 12, 4, (8, 12)), (2, 3, 9, (0, 3)), (4, 9, 0, (4, 5))],
)
def test_a_window_keeps_the_robot_inside(at: int, size: int, room: int, expected: tuple[int, int]) -> None:
    shown = window(at, size, room)
    assert (shown.start, shown.stop) == expected


def test_a_large_grid_is_cut_to_a_window() -> None:
    mdp = grid((9, 12), np.zeros((9, 12), bool), (4, 6), (0, 0), action_labels=("up", "down", "left", "right"))
    found = fitting(request(mdp), 7, 3)
    assert plain(found) == [" · · ·", " · R →", " · · ·"]
    assert (found.shown, found.hides_goal) == (((0, 3, 5), (1, 5, 7)), True)


def test_a_cut_map_says_its_rows_from_below() -> None:
    mdp = grid((5, 9), np.zeros((5, 9), bool), (2, 1), (4, 8), action_labels=CUBE[:4])
    found = fitting(request(mdp), 80, 3)
    assert plain(found) == [" · · ↑ · ·", " · · R · ·", " · · · · ·"]
    assert found.shown == ((1, 0, 2),)


def test_slices_stand_around_the_robots_own() -> None:
    found = fitting(request(cube(3), 5), 80, 24)
    assert plain(found) == [
        " level 0      [level 1]    level 2",
        " · · ·        · · g        · · G",
        " r · ·        R # ·        * · ·",
    ]
    assert found.legend == "R robot, r its shadow, G goal, g the goal's, # obstacle, *: the learner's own choice"
    assert (found.shown, found.hides_goal) == ((), False)


def test_as_many_slices_as_fit_an_odd_number() -> None:
    asked = request(cube(9), 3, (0, 0, 4))
    assert plain(fitting(asked, 59, 24))[0].split() == ["level", "3", "[level", "4]", "level", "5"]
    assert plain(fitting(asked, 30, 24))[0] == " [level 4]"
    assert fitting(asked, 30, 24).shown == ((2, 4, 4),)
    assert fitting(asked, 36, 24).shown == ((2, 3, 5),)


def test_wide_slices_are_cut_so_that_their_neighbours_can_be_seen() -> None:
    mdp = grid((40, 2, 3), np.zeros((40, 2, 3), bool), (0, 0, 1), (39, 1, 2), action_labels=CUBE)
    found = fitting(request(mdp, 1), 79, 24)
    assert plain(found)[2].startswith(" r · · ·")
    assert plain(found)[2].count("·") == 3 * 12 - 4  # cells without r, R, an arrow and r
    assert found.shown == ((0, 0, 11),)
    assert found.width <= 79


def test_a_fourth_axis_stays_where_the_robot_is() -> None:
    labels = ("-x", "+x", "-y", "+y", "-z", "+z", "turn left", "turn right")
    blocked = np.zeros((2, 2, 2, 3), bool)
    blocked[1, 0, 0, 0] = blocked[0, 1, 0, 1] = True
    mdp = grid(blocked.shape, blocked, (0, 0, 0, 0), (1, 1, 1, 2), action_labels=labels)
    assert picture(request(mdp))[:2] == ["R →", "# g"]
    assert picture(request(mdp, 7))[:2] == ["R ·", "# g"]  # the move that turns is in no slice
    assert picture(request(mdp, 3, (0, 0, 0, 1)))[:2] == ["R #", "· g"]


# ---- drawings from elsewhere ----------------------------------------------------------------------------------------


def test_colours_of_a_drawing_are_kept_and_its_other_codes_are_not() -> None:
    drawn = safe_ansi(
        "\x1b]0;title\x07S\x1b[41mF\x1b[0mF\x1b[2J\x1b[10;10H\r\n\x1b]8;;http://x\x1b\\HG\x1b[?25l\x9b2J\x07"
    )
    assert drawn.plain == "SFF\nHG"
    assert [(span.start, span.end, str(span.style)) for span in drawn.spans] == [(1, 2, "on color(1)")]


def test_a_drawing_takes_the_place_of_the_grid_and_is_cut_in_width() -> None:
    class Drawn:
        def picture(self, state: int) -> str:
            return "S\x1b[41mFFFFFF\x1b[0m\nHG\n"

    asked = AdviceRequest(
        mdp=board(),
        q=[[0.0] * 4] * 12,
        state=0,
        episode=1,
        step=1,
        own=0,
        environment=Drawn(),
        allowed=range(board().n_actions),
    )
    assert plain(fitting(asked, 4, 2)) == ["SFFF", "HG"]


@given(st.text(alphabet=st.one_of(st.characters(), st.sampled_from("\x1b[]m;0123Pl\x9b\x07\\\n")), max_size=60))
def test_no_drawing_gets_an_escape_code_through(drawing: str) -> None:
    for no_color in (False, True):
        console = Console(file=StringIO(), force_terminal=True, color_system="truecolor", no_color=no_color, width=200)
        console.print(safe_ansi(drawing))
        assert isinstance(console.file, StringIO)
        written = console.file.getvalue()
        if no_color:
            assert not re.search(r"\x1b\[[0-9;]*(3|4|9|10)[0-7][;m]", written)
        rest = re.sub(r"\x1b\[[0-9;]*m", "", written)
        assert all(c.isprintable() or c == "\n" for c in rest)


def test_without_colours_a_coloured_place_is_bracketed() -> None:
    assert bracketed(safe_ansi("S\x1b[41mF\x1b[0mF\nHG")).plain == "S[F]F\nHG"
    assert bracketed(safe_ansi("\x1b[31mS\x1b[0m")).plain == "S"  # a colour of letters marks no place
