"""The teaching prompt: what it shows, what it understands, with piped lines and with a terminal's keys."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput
from rich.console import Console

import lab.view.terminal as terminal
from lab.advice.advisors import AdviceRequest, AdvisorLeft, make_advisor
from lab.learning.session import AdviceEnded, AdviceRejected, AdviceRequested, EpisodeEnded, SessionResult, run_session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, coverage, grid
from lab.view.terminal import (
    TeachingPrompt,
    default_reader,
    draw,
    other_axes,
    plain_reader,
    terminal_reader,
    understand,
)

WORDS = ("up", "down", "left", "right")


def board() -> TabularMDP:
    blocked = np.zeros((3, 4), bool)
    blocked[1, 1] = True
    return grid((3, 4), blocked, (0, 0), (2, 3), action_labels=WORDS)


def space() -> TabularMDP:
    blocked = np.zeros((2, 3, 4), bool)
    blocked[0, 1, 2] = True
    labels = ("-x", "+x", "-y", "+y", "-z", "+z")
    return grid(blocked.shape, blocked, (1, 2, 2), (0, 0, 0), action_labels=labels)


def request(mdp: TabularMDP, action: int = 3, state: int | None = None) -> AdviceRequest:
    q = [[0.0] * mdp.n_actions] * mdp.n_states
    return AdviceRequest(mdp, q, mdp.start if state is None else state, 31, 2, action, 0.0125, 39.5, 40.0)


def console(encoding: str = "utf-8") -> Console:
    class Encoded(StringIO):
        @property
        def encoding(self) -> str:  # type: ignore[override]
            return encoding

    return Console(file=Encoded(), width=100)


def said(console: Console) -> str:
    assert isinstance(console.file, StringIO)
    return console.file.getvalue()


def ask(lines: str, asked: AdviceRequest | None = None, encoding: str = "utf-8") -> tuple[int | None, str]:
    """The answer of a person who types these lines, and what was shown."""
    shown = console(encoding)
    prompt = TeachingPrompt(shown, plain_reader(shown, StringIO(lines)))
    return prompt(asked or request(board())), said(shown)


def picture(asked: AdviceRequest) -> list[str]:
    drawn = draw(asked)
    assert drawn is not None
    return [line.strip() for line in drawn.plain.splitlines()]


def test_a_plane_is_shown_whole_with_the_learners_own_move() -> None:
    assert picture(request(board()))[:3] == ["R → · ·", "· # · ·", "· · · G"]
    assert picture(request(board(), action=0))[0] == "R · · ·"  # up leads nowhere


def test_obstacles_and_goals_are_not_hidden_by_the_arrow() -> None:
    assert picture(request(board(), action=1, state=1))[1] == "· # · ·"
    _, shown = ask("skip\n", request(board(), action=1, state=1))
    assert "would go ↓ down, into an obstacle." in shown
    assert "would go → right, to the goal." in ask("skip\n", request(board(), 3, 10))[1]
    assert "would go ↑ up, which leads nowhere." in ask("skip\n", request(board(), 0))[1]


def test_a_space_shows_the_robots_slice_and_names_the_rest() -> None:
    mdp = space()
    assert picture(request(mdp, action=0)) == [
        "g # ↑",
        "· · R",
        "R robot, g goal, in another plane, # obstacle, arrow: the learner's own choice",
    ]
    assert other_axes(request(mdp)) == ["Not in the picture: -z / +z is at 2 of 0..3; the goal is 2 below (-z)."]
    bottom = int(np.ravel_multi_index((1, 2, 0), mdp.shape))
    assert picture(request(mdp, action=5, state=bottom))[:2] == ["G · ·", "· · R"]
    assert other_axes(request(mdp, state=bottom))[0].endswith("the goal is level with it.")
    assert "Moves: ↑ -x   ↓ +x   ← -y   → +y   -z   +z" in ask("+z\n", request(mdp))[1]


def test_four_axes_name_two_others() -> None:
    labels = ("-x", "+x", "-y", "+y", "-z", "+z", "turn left", "turn right")
    mdp = grid((2, 2, 2, 3), np.zeros((2, 2, 2, 3), bool), (0, 0, 0, 0), (1, 1, 1, 2), action_labels=labels)
    lines = other_axes(request(mdp))
    assert [line.split(": ")[1] for line in lines] == [
        "-z / +z is at 0 of 0..1; the goal is 1 above (+z).",
        "turn left / turn right is at 0 of 0..2; the goal is 2 above (turn right).",
    ]
    assert picture(request(mdp))[:2] == ["R →", "· g"]


def test_one_axis_runs_to_the_right() -> None:
    mdp = grid((4,), np.zeros(4, bool), (1,), (3,), action_labels=("back", "on"))
    assert picture(request(mdp, action=1))[0] == "· R → G"
    assert ask("right\n", request(mdp, action=0))[0] == 1


def test_covering_shows_head_and_covered_cells() -> None:
    mdp = coverage((2, 3))
    right = int(mdp.successor[mdp.start, 3])
    assert picture(request(mdp, action=1, state=right)) == [
        "x R ·",
        "· ↓ ·",
        "R head, x covered, arrow: the learner's own choice",
    ]
    assert "at (0, 1) covered 2 of 6" in ask("\n", request(mdp, 1, right))[1]


def test_states_without_a_grid_are_named() -> None:
    end = np.array([False, True])
    mdp = TabularMDP(np.array([[0, 1], [1, 1]]), np.zeros((2, 2)), end, end, 0, ("wait", "go"))
    answer, shown = ask("g\n", request(mdp, action=0))
    assert (answer, draw(request(mdp, 0))) == (1, None)
    assert "at 0" in shown
    assert "Moves: wait   go" in shown


def test_the_moving_averages_are_shown() -> None:
    assert "lately 39.5, before that 40.0; improvement +1.2%" in ask("\n")[1]
    early = replace(request(board()), improvement_rate=None, current_mean=None, previous_mean=None)
    assert "Too few episodes" in ask("\n", early)[1]


def test_a_plain_console_gets_plain_characters() -> None:
    answer, shown = ask("v\n", encoding="ascii")
    assert answer == 1
    assert shown.isascii()
    assert " R > . ." in shown


@pytest.mark.parametrize(
    ("line", "action"),
    [("down", 1), (" DOWN ", 1), ("d", 1), ("le", 2), ("→", 3), (">", 3), ("^", 0), ("", 3), ("skip", None)],
)
def test_answers(line: str, action: int | None) -> None:
    assert ask(line + "\n")[0] == action


def test_labels_come_before_directions() -> None:
    labels = ("left", "right", "back", "forward", "down", "up")
    mdp = grid((2, 2, 2), np.zeros((2, 2, 2), bool), (0, 0, 0), (1, 1, 1), action_labels=labels)
    assert [understand(word, mdp) for word in ("up", "l", "b", "↑", "^")] == [5, 0, 2, 3, 3]
    assert [understand(word, space()) for word in ("up", "r", "+", "-z")] == [
        0,
        3,
        "'+' could be +x or +y or +z: type more of it",
        4,
    ]


def test_wrong_words_get_one_line_and_another_chance() -> None:
    answer, shown = ask("sideways\nu\n")
    assert answer == 0
    assert "'sideways' is no direction: type up, down, left, right, skip, auto, done or ?\n" in shown
    assert shown.count("Which way? [enter = → right, ? explains]") == 2


def test_a_question_mark_explains() -> None:
    answer, shown = ask("?\nhelp\n\n")
    assert answer == 3
    assert shown.count("leave this step to the learner") == 2


@given(st.text(max_size=30))
def test_any_line_is_an_action_a_command_or_a_hint(line: str) -> None:
    answer = understand(line, board())
    if isinstance(answer, int):
        assert 0 <= answer < 4
    else:
        assert answer in ("own", "skip", "auto", "done", "help") or "no direction" in answer


@pytest.mark.parametrize("lines", ["auto\n", "done\n", "", "?\n", "sideways"])
def test_auto_and_the_end_of_the_input_end_advice(lines: str) -> None:
    with pytest.raises(AdvisorLeft):
        ask(lines)


def test_done_ends_advice_for_every_skill() -> None:
    shown = console()
    prompt = TeachingPrompt(shown, plain_reader(shown, StringIO("done\nright\n")))
    with pytest.raises(AdvisorLeft):
        prompt(request(board()))
    assert "No more advice in this run" in said(shown)
    before = said(shown)
    prompt.on_event(AdviceEnded(31, "advisor left"), "insert at toaster")
    prompt.on_event(AdviceRequested(30, None, None, None), "place at plate")
    with pytest.raises(AdvisorLeft):
        prompt(request(space()))
    assert said(shown) == before


def test_auto_ends_advice_for_one_skill() -> None:
    shown = console()
    prompt = TeachingPrompt(shown, plain_reader(shown, StringIO("auto\nright\n")))
    with pytest.raises(AdvisorLeft):
        prompt(request(board()))
    assert prompt(request(board())) == 3


@contextmanager
def at_terminal(keys: Sequence[str]) -> Iterator[TeachingPrompt]:
    with create_pipe_input() as pipe:
        pipe.send_text("".join(keys))
        shown = console()
        yield TeachingPrompt(shown, terminal_reader(shown, pipe, DummyOutput()))


@pytest.mark.parametrize(
    ("keys", "action"),
    [
        ("down\r", 1),
        ("\x1b[A", 0),
        ("\x1b[D", 2),
        ("\r", 3),
        ("sideways\rleft\r", 2),
        ("x\x7fu\r", 0),
        ("skip\r", None),
    ],
)
def test_keys_of_a_terminal(keys: str, action: int | None) -> None:
    with at_terminal(keys) as prompt:
        assert prompt(request(board())) == action


def test_ctrl_d_ends_advice_and_ctrl_c_the_session() -> None:
    with at_terminal("\x04") as prompt, pytest.raises(AdvisorLeft):
        prompt(request(board()))
    with at_terminal("\x03") as prompt, pytest.raises(KeyboardInterrupt):
        prompt(request(board()))


def test_the_reader_fits_the_input(monkeypatch: pytest.MonkeyPatch) -> None:
    class Tty(StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setattr(terminal, "terminal_reader", lambda console: lambda prompt: "from the terminal")
    assert default_reader(console(), Tty("typed\n"))("?") == "from the terminal"
    monkeypatch.setattr("sys.stdin", StringIO("piped\n"))
    assert default_reader(console())("?") == "piped\n"


def test_events_are_told_with_their_numbers() -> None:
    shown = console()
    prompt = TeachingPrompt(shown)
    for event in (
        AdviceRequested(30, 0.01, 39.6, 40.0),
        EpisodeEnded(30, 12, True, 9, 0.2, True),
        EpisodeEnded(31, 201, True, 40, 0.2, False),
        EpisodeEnded(32, 15, False, 0, 0.2, True),
        AdviceRejected(33, 8, 7, 201, 44.25),
        AdviceEnded(34, "converged"),
        AdviceEnded(35, "advisor left"),
    ):
        prompt.on_event(event)
    prompt.on_event(AdviceRequested(36, None, None, None), "insert at toaster")
    assert said(shown).splitlines() == [
        "Episode 30: the learner asks for advice.",
        "Episode 30 reached the goal in 12 steps; moves advised: 9.",
        "Episode 31 did not reach the goal; moves advised: 40.",
        "The learner takes no more advice (episodes misled: 8, tolerated: 7). Episode 33 counted 201 steps, ",
        "those before it 44.2.",
        "Episode 34: the same result again and again; the learner asks no more.",
        "Episode 35: advice has ended; the learner goes on alone.",
        "Episode 36: the learner asks for advice about 'insert at toaster'.",
    ]


def teach(prompt: TeachingPrompt) -> SessionResult:
    mdp, rng = board(), np.random.default_rng(0)
    advisor = make_advisor("terminal", mdp, 0.99, rng, prompt)
    gate = GateSettings(first_episode=4, window=1, omega=0, lambda_threshold=1.0)
    settings = LearnerSettings(episodes=12, max_steps=20)
    return run_session(mdp, settings, gate, advisor, rng, on_event=prompt.on_event)


def taught(lines: str) -> tuple[SessionResult, str]:
    shown = console()
    return teach(TeachingPrompt(shown, plain_reader(shown, StringIO(lines)))), said(shown)


def test_a_whole_session_with_piped_answers() -> None:
    result, shown = taught("right\nright\nright\ndown\ndown\nauto\n")
    assert (result.helped_steps, result.requests, len(result.steps), result.interrupted) == (5, 2, 12, False)
    assert result.steps[3] == 5
    assert "Episode 4 reached the goal in 5 steps; moves advised: 5." in shown
    assert "advice has ended" in shown


def test_a_session_whose_adviser_misleads_says_so() -> None:
    _, shown = taught("up\n" * 40)
    assert "The learner takes no more advice (episodes misled: 1, tolerated: 0)." in shown


def test_ctrl_c_keeps_what_was_learned() -> None:
    with at_terminal("right\rright\r\x03") as prompt:
        result = teach(prompt)
    assert (result.interrupted, len(result.steps), result.helped_steps) == (True, 3, 0)
    assert result.visits.sum() > 0


def test_a_map_is_seen_from_above_with_y_upwards() -> None:
    labels = ("left", "right", "backward", "forward")
    mdp = grid((3, 2), np.zeros((3, 2), bool), (0, 0), (2, 1), action_labels=labels)
    request = AdviceRequest(
        mdp, np.zeros((6, 4)).tolist(), mdp.start, 30, 1, 3, None, None, None
    )  # it would go forward
    picture = draw(request)
    assert picture is not None
    assert picture.plain.splitlines()[:2] == [" ↑ · G", " R · ·"]
    assert [understand(word, mdp) for word in ("right", "→", "forward", "↑")] == [1, 1, 3, 3]
