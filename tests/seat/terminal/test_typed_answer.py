"""What typed words mean: moves, paths, the prompt's own words, and hints for the rest."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.learning.praise import Judgement
from lab.mdp import TabularMDP, grid
from lab.seat.terminal.typed_answer import (
    ANSWERS,
    COMMANDS,
    MOST_MOVES,
    example,
    explained,
    judged,
    letters,
    understand,
)

WORDS = ("up", "down", "left", "right")
CUBE = ("left", "right", "backward", "forward", "down", "up")


def board(labels: tuple[str, ...] = WORDS) -> TabularMDP:
    shape = (2,) * (len(labels) // 2)
    return grid(shape, np.zeros(shape, bool), (0,) * len(shape), (1,) * len(shape), action_labels=labels)


@pytest.mark.parametrize(
    ("line", "action"),
    [("down", 1), (" DOWN ", 1), ("d", 1), ("le", 2), ("→", 3), (">", 3), ("^", 0), ("\x1b[A", 0), ("\x1bOC\n", 3)],
)
def test_moves(line: str, action: int) -> None:
    assert understand(line, board()) == action


def test_labels_come_before_directions() -> None:
    mdp = board(("left", "right", "back", "forward", "down", "up"))
    assert [understand(word, mdp) for word in ("up", "l", "b", "↑", "^")] == [5, 0, 2, 3, 3]
    space = board(("-x", "+x", "-y", "+y", "-z", "+z"))
    assert [understand(word, space) for word in ("up", "r", "+", "-z")] == [
        0,
        3,
        "'+' could be +x or +y or +z: type more of it",
        4,
    ]
    plane = board(CUBE[:4])
    assert [understand(word, plane) for word in ("right", "→", "forward", "↑", "u")] == [1, 1, 3, 3, 3]


def test_q_is_quit() -> None:
    assert understand("q", board()) == understand("quit", board()) == "quit"


def test_words_of_the_prompt() -> None:
    for word, (called, _) in COMMANDS.items():
        if word != "path":
            assert understand(f" {word.upper()} \n", board()) == called


@pytest.mark.parametrize(
    ("line", "moves"),
    [
        ("rrud", (3, 3, 0, 1)),
        ("path r", (3,)),
        ("PATH rruf", (1, 1, 5, 3)),
        ("rruf", (1, 1, 5, 3)),
        ("3r 2u", (3, 3, 3, 0, 0)),
        ("3r2u", (3, 3, 3, 0, 0)),
        ("path 2 right, up", (3, 3, 0)),
        ("right right up", (3, 3, 0)),
        ("→→↑", (3, 3, 0)),
        ("\x1b[C\x1b[A", (3, 0)),
        ("path >>^", (3, 3, 0)),
        ("0r u", (0,)),
        ("path ud", (0, 1)),
    ],
)
def test_paths(line: str, moves: tuple[int, ...]) -> None:
    assert understand(line, board(CUBE if "f" in line else WORDS)) == moves


def test_a_single_word_stays_a_direction() -> None:
    assert understand("r", board()) == 3
    assert understand("up", board(CUBE)) == 5
    assert understand("le", board()) == 2


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("rruq", "'rruq' is no path: 'q' is no move; letters: u up, d down, l left, r right"),
        ("path wall", "'wall' is no path: 'w' is no move; letters: u up, d down, l left, r right"),
        ("3r 2", "'3r 2' is no path: '2' is no move; letters: u up, d down, l left, r right"),
        ("path", "path what? letters: u up, d down, l left, r right, such as path rru"),
        ("r 2000u", f"'r 2000u' has more than {MOST_MOVES} moves: a path may have {MOST_MOVES}"),
        (
            "sideways",
            "'sideways' is no direction: type up, down, left, right, path, why, undo, skip, auto, done, quit or ?",
        ),
        (
            "qiut",
            "'qiut' is no direction: did you mean 'quit'? type up, down, left, right, path, why, undo, skip, auto",
        ),
    ],
)
def test_hints(line: str, hint: str) -> None:
    said = understand(line, board())
    assert isinstance(said, str)
    assert said.startswith(hint)


def test_letters_are_those_that_name_one_move() -> None:
    assert letters(board(CUBE)) == {"l": 0, "r": 1, "b": 2, "f": 3, "d": 4, "u": 5}
    assert letters(board((*CUBE, "turn right", "turn left"))) == letters(board(CUBE))
    assert letters(board(("-x", "+x", "-y", "+y"))) == {"u": 0, "d": 1, "l": 2, "r": 3}
    assert letters(board(("ab", "ac"))) == {"l": 0, "r": 1}
    end = np.array([False, True])
    odd = TabularMDP(np.array([[0, 1], [1, 1]]), np.zeros((2, 2)), end, end, 0, ("go on", "go back"))
    assert letters(odd) == {}
    assert understand("path x", odd) == (
        "'x' is no path: 'x' is no move; arrows and whole words are moves here, with spaces between them"
    )


def test_the_example_is_a_path() -> None:
    for labels in (WORDS, CUBE, ("-x", "+x", "-y", "+y")):
        assert isinstance(understand(f"path {example(board(labels))}", board(labels)), tuple)


def test_every_word_is_explained_once() -> None:
    rows = explained(board())
    assert [word for word, _ in rows] == [
        "a move",
        "enter",
        *(word for word in COMMANDS if word not in ("", "help", "q")),
        "a sentence",
    ]
    assert "letters: u up, d down, l left, r right" in rows[0][1]
    assert "path rru, or 3u for uuu" in dict(rows)["path"]


@given(st.text(max_size=30) | st.text(alphabet="udlr 0123→path", max_size=12))
def test_any_line_is_moves_a_word_or_a_hint(line: str) -> None:
    answer = understand(line, board())
    if isinstance(answer, int):
        assert 0 <= answer < 4
    elif isinstance(answer, tuple):
        assert answer
        assert set(answer) <= {0, 1, 2, 3}
    else:
        assert answer in ANSWERS or any(
            hint in answer for hint in ("no direction", "no path", "path what", "than 1000")
        )


@given(st.lists(st.tuples(st.integers(1, 9), st.sampled_from("udlr")), min_size=1, max_size=8))
def test_counts_repeat_the_next_move(parts: list[tuple[int, str]]) -> None:
    letters_only = "".join(letter * count for count, letter in parts)
    counted = understand("path " + " ".join(f"{count}{letter}" for count, letter in parts), board())
    assert counted == understand(f"path {letters_only}", board())
    assert isinstance(counted, tuple)
    assert len(counted) == sum(count for count, _ in parts)


def test_arrows_lead_left_and_right_where_the_states_are_no_grid() -> None:
    over = np.array([False, True])
    car = TabularMDP(
        np.array([[0, 0, 1], [1, 1, 1]], np.int32), np.zeros((2, 3)), over, over, 0, ("left", "coast", "right")
    )
    assert [understand(word, car) for word in ("←", "→", "c", "\x1b[C")] == [0, 2, 1, 2]
    assert understand("↑", car) == "'↑' is no path: '↑' is no move; letters: l left, c coast, r right"


@pytest.mark.parametrize(
    ("line", "judgement"),
    [
        ("+\n", Judgement(1)),
        (" - ", Judgement(-1)),
        ("--", Judgement(-2)),
        ("+++4", Judgement(3, 4)),
        ("-3", Judgement(-1, 3)),
        ("Bad 2", Judgement(-1, 2)),
        ("good", Judgement(1)),
        ("+-", None),
        ("+" * 10, None),
        ("-101", None),
        ("goodness", None),
        ("", None),
    ],
)
def test_judgements(line: str, judgement: Judgement | None) -> None:
    assert judged(line) == judgement
    assert judged(line, WORDS) == judgement


def test_the_beginning_of_a_label_is_that_move() -> None:
    assert judged("+", ("-x", "+x")) is None
    assert judged("good", ("-x", "+x")) == Judgement(1)
