"""A person's commands for a takeover: what lines mean, and how the tool then moves."""

from math import pi, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.cloning.takeover_command import TakeoverCommand, command_of
from lab.errors import BadInput


@pytest.mark.parametrize(
    ("text", "moved", "close"),
    [
        ("", (0, 0, 0, 0), None),
        ("wait", (0, 0, 0, 0), None),
        ("ahead", (0.03, 0, 0, 0), None),
        ("back 4.5, left 1; up 2", (-0.045, 0.01, 0.02, 0), None),
        ("AHEAD 4 down 2 close", (0.04, 0, -0.02, 0), True),
        ("right 1 right 1", (0, -0.02, 0, 0), None),
        ("turn-left", (0, 0, 0, radians(10)), None),
        ("turn-right 90 open", (0, 0, 0, -pi / 2), False),
    ],
)
def test_a_line_says_how_far(text: str, moved: tuple[float, ...], close: bool | None) -> None:
    command = command_of(text)
    assert command.moved == pytest.approx(moved)
    assert (command.close, command.by_teacher) == (close, False)


def test_the_teacher_does_it_alone() -> None:
    assert command_of(" teacher ").by_teacher
    with pytest.raises(BadInput, match="unknown word 'teacher'"):
        command_of("ahead 3 teacher")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("ahed 3", "did you mean 'ahead'"),
        ("3", "'3'"),
        ("ahead 31", "0 to 30 cm"),
        ("turn-left 91", "degrees"),
        ("ahead -3", "-3"),
    ],
)
def test_other_lines_are_refused(text: str, told: str) -> None:
    with pytest.raises(BadInput, match=told):
        command_of(text)


def test_the_way_is_in_the_axes_of_the_tool() -> None:
    ahead = TakeoverCommand((0.1, 0.0, 0.0, 0.0))
    assert ahead.velocity(0.0, 1.0) == pytest.approx([0.1, 0.0, 0.0, 0.0])
    assert ahead.velocity(pi / 2, 1.0) == pytest.approx([0.0, 0.1, 0.0, 0.0])
    left_and_turn = TakeoverCommand((0.0, 0.1, -0.2, 0.5))
    assert left_and_turn.velocity(pi, 2.0) == pytest.approx([0.0, -0.05, -0.1, 0.25])


@given(st.text(max_size=60))
def test_any_line_is_a_command_or_refused_in_one_line(text: str) -> None:
    try:
        command_of(text)
    except BadInput as error:
        assert "\n" not in str(error)  # noqa: PT017
