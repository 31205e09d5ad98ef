"""One question on screens of any size: picture, numbers and prompt together, nothing wider or longer than the screen."""

from io import StringIO

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from rich.console import Console
from rich.text import Text

from lab.learning.requests import AdviceRequest, Standing, TooSlow
from lab.learning.session_events import Improvement
from lab.mdp import TabularMDP
from lab.seat.grid_text import Marks
from lab.seat.terminal.screen import folded, packed, question, room, screen

LABELS = {
    1: ("back", "on"),
    2: ("up", "down", "left", "right"),
    3: ("left", "right", "backward", "forward", "down", "up"),
    4: ("left", "right", "backward", "forward", "down", "up", "turn right", "turn left"),
}
WHY = TooSlow(-0.083, 0.05)


def world(shape: tuple[int, ...], density: float = 0.0) -> TabularMDP:
    """Cells in which every move stays; the first is the start, the last the goal."""
    states = int(np.prod(shape))
    goal = np.zeros(states, bool)
    goal[-1] = True
    blocked = np.random.default_rng(1).random(states) < density
    blocked[0] = False
    stays = np.tile(np.arange(states, dtype=np.int32)[:, None], (1, 2 * len(shape)))
    return TabularMDP(stays, np.zeros(stays.shape), goal | blocked, goal, 0, LABELS[len(shape)], shape)


def request(mdp: TabularMDP, state: int = 0, action: int = 1) -> AdviceRequest:
    table = [[0.0] * mdp.n_actions] * mdp.n_states
    now = Standing(123, 500, 3, 7, 0.05)
    return AdviceRequest(
        mdp=mdp,
        q=table,
        state=state,
        episode=131,
        step=102,
        own=action,
        reason=WHY,
        temperature=0.01,
        selection="softmax",
        standing=now,
        improvement=Improvement(-0.083, 201.0, 185.6),
        allowed=range(mdp.n_actions),
    )


def shown(asked: AdviceRequest, width: int, height: int) -> list[str]:
    return [line.plain for line in screen(asked, Marks(), width, height)]


def test_numbers_stand_beside_a_picture_that_leaves_room() -> None:
    lines = shown(request(world((3, 4))), 79, 22)
    assert lines[:4] == [
        "Episode 131, step 102: at (0, 0)",
        " R · · ·     ↑ up     ██▌         25%",
        " · · · ·   ▸ ↓ down   ██▌         25%",
        " · · · G     ← left   ██▌         25%",
    ]
    assert lines[-1] == "R robot, G goal"
    text = " ".join(line[11:].strip() for line in lines[1:-1])
    assert "below 5%: lately 201.0 steps per episode, before that 185.6." in text
    assert "Advised so far: 123 of 500 moves; episodes misled: 3, tolerated: 7." in text


def test_numbers_stand_below_a_picture_that_leaves_none() -> None:
    lines = shown(request(world((3, 30))), 79, 22)
    assert lines[1] == " R" + " ·" * 29
    assert lines[4] == "R robot, G goal"
    assert lines[5] == "↑ up 25%  [↓ down 25%]  ← left 25%  → right 25%"


def test_a_small_screen_leaves_the_least_important_away() -> None:
    asked = request(world((30, 30)))
    tall, low = shown(asked, 40, 24), shown(asked, 40, 12)
    assert "R robot" in tall
    assert tall[-2:] == ["Steps 185.6, now 201.0: -8.3% < 5%", "Advised 123 of 500 moves; misled 3 of 7."]
    assert "R robot" not in low
    assert low[-2:] == ["→ right 25%", "Steps 185.6, now 201.0: -8.3% < 5%"]
    assert sum(line.startswith((" R", " ·")) for line in low) == 6
    assert "Rows 0..5 of 30, columns 0..19 of 30;" in low


@pytest.mark.parametrize(("width", "height"), [(80, 24), (120, 40), (34, 20), (40, 15)])
@pytest.mark.parametrize("shape", [(100, 100), (30, 30, 30), (5, 5, 6, 5), (12, 12), (9,)])
def test_a_question_fits_the_usual_screens(shape: tuple[int, ...], width: int, height: int) -> None:
    mdp = world(shape, 0.1)
    robot = mdp.n_states // 3
    lines = shown(request(mdp, robot), width, height - 2)
    assert len(lines) <= height - 2
    assert max(map(len, lines)) <= width
    assert sum("R " in f"{line} " for line in lines) >= 1


@given(st.data())
def test_a_question_fits_any_screen(data: st.DataObject) -> None:
    shape = tuple(data.draw(st.lists(st.integers(1, 12), min_size=1, max_size=4), "shape"))
    assume(np.prod(shape) > 1)
    mdp = world(shape, data.draw(st.sampled_from((0.0, 0.3)), "density"))
    asked = request(mdp, data.draw(st.integers(0, mdp.n_states - 1)), data.draw(st.integers(0, mdp.n_actions - 1)))
    width, height = data.draw(st.integers(30, 140), "width"), data.draw(st.integers(15, 60), "height")
    lines = shown(asked, width, height - 2)
    assert len(lines) <= height - 2
    assert max(map(len, lines)) <= width
    assert any("R" in line for line in lines[1:])


def test_the_question_leaves_room_to_type() -> None:
    asked = request(world((3, 4)), action=3)
    forms = [question(asked, Marks(), width) for width in (80, 41, 40, 30)]
    assert forms == [
        "Which way? [enter = → right, ? explains] ",
        "Which way? [enter = → right] ",
        "Which way? [→ right] ",
        "Which way? ",
    ]


def test_text_is_folded_between_words() -> None:
    assert [line.plain for line in folded(["one two three", ""], 9)] == ["one two", "three", ""]
    parts = [Text("← left 1%"), Text("→ right 2%"), Text("up")]
    assert [line.plain for line in packed(parts, 21)] == ["← left 1%  → right 2%", "up"]


def test_a_dumb_terminal_has_its_own_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.delenv("LINES", raising=False)
    monkeypatch.delenv("COLUMNS", raising=False)
    in_memory = Console(file=StringIO(), force_terminal=True)
    assert room(in_memory) == (80, 25)  # rich's guess
    assert room(Console(file=StringIO(), width=34, height=20)) == (34, 20)
