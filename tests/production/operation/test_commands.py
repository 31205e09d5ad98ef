"""What a typed line means, and what is said of one that means nothing."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.production.operation.commands import COMMANDS, MOST_MM, Spoken, help_lines, spoken


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("run", Spoken("run", None, "run")),
        ("  JOG   +x 10 ", Spoken("jog", (0.01, 0.0, 0.0), "jog +x 10")),
        ("jog -Z 2.5", Spoken("jog", (0.0, 0.0, -0.0025), "jog -Z 2.5")),
        ("rotate -15", Spoken("rotate", -15.0, "rotate -15")),
        ("speed max", Spoken("speed", None, "speed max")),
        ("speed 4", Spoken("speed", 4.0, "speed 4")),
        ("order 1 2, 1", Spoken("order", (1, 2, 1), "order 1 2, 1")),
        ("parts slice=2 cup=1", Spoken("parts", "slice=2,cup=1", "parts slice=2 cup=1")),
        ("move plate", Spoken("move", "plate", "move plate")),
        ("move 300 -100 450", Spoken("move", (0.3, -0.1, 0.45), "move 300 -100 450")),
        ("lead end", Spoken("lead", "end", "lead end")),
        ("learn insert at toaster", Spoken("learn", "insert at toaster", "learn insert at toaster")),
    ],
)
def test_a_line_is_understood(line: str, said: Spoken) -> None:
    assert spoken(line) == said


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("", "no command"),
        ("stpo", "did you mean 'stop'?"),
        ("run now", "run: 'now' after it: wanted nothing"),
        ("jog 10", "'10' is no direction: wanted +x, -x"),
        ("jog +x", "jog: '' is no number of mm"),
        ("jog +x -10", "allowed are 0 to 500 mm"),
        ("jog +x 1e9", "allowed are 0 to 500 mm"),
        ("jog +x nan", "jog: nan: allowed are 0 to 500 mm"),
        ("rotate 181", "allowed are -180 to 180 degrees"),
        ("speed 0", "allowed are 0.1 to 100 times real time, or max"),
        ("order", "no entries"),
        ("order 1 x", "entry 2, 'x': wanted the number of a part"),
        ("order 0", "entry 1, '0'"),
        ("parts 2", "wanted kind=number, such as slice=2,cup=1"),
        ("learn", "learn: no name after it"),
        ("move", "move: no name after it"),
        ("move 1 2 99999", "99999: allowed are -10000 to 10000 mm"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(line: str, why: str) -> None:
    with pytest.raises(BadInput) as error:
        spoken(line)
    assert why in str(error.value)
    assert "\n" not in str(error.value)


@given(st.text(max_size=60))
def test_any_line_is_a_command_or_refused(line: str) -> None:
    try:
        said = spoken(line)
    except BadInput:
        return
    assert said.word in COMMANDS
    assert spoken(said.words).argument == said.argument


@given(st.sampled_from("xyz"), st.sampled_from("+-"), st.floats(0, MOST_MM))
def test_a_jog_goes_along_one_axis(axis: str, sign: str, length_mm: float) -> None:
    way = spoken(f"jog {sign}{axis} {length_mm!r}").argument
    assert isinstance(way, tuple)
    assert sum(map(abs, way)) == pytest.approx(length_mm / 1000)
    assert way["xyz".index(axis)] == pytest.approx(float(f"{sign}1") * length_mm / 1000)


def test_help_lists_every_command() -> None:
    assert [line.split()[0] for line in help_lines()] == list(COMMANDS)
