"""The lab's errors: exit codes, one line, the nearest name."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import (
    MOST_CHARACTERS,
    MOST_NAMES,
    BadInput,
    LabError,
    WorkFailed,
    counted,
    out_of_memory,
    unknown,
)


@pytest.mark.parametrize(("kind", "code"), [(BadInput, 2), (WorkFailed, 1), (LabError, 1)])
def test_each_error_carries_its_exit_code(kind: type[LabError], code: int) -> None:
    assert kind("why").exit_code == code
    assert issubclass(kind, LabError)


def test_unknown_names_the_value_its_origin_the_nearest_and_all_known() -> None:
    error = unknown("advisor", "exprt", ["novice", "expert"], "--advisor")
    assert isinstance(error, BadInput)
    assert str(error) == "unknown advisor 'exprt' (--advisor): did you mean 'expert'? known: expert, novice"


def test_nothing_near_gives_no_hint() -> None:
    assert str(unknown("gate", "zzz", ["ccrl"], "--gate")) == "unknown gate 'zzz' (--gate): known: ccrl"


def test_what_cannot_be_printed_is_escaped() -> None:
    message = str(unknown("task", "a\nb\x1b[31m\udcff é", ["toast"], "TASK"))
    assert message == r"unknown task 'a\nb\x1b[31m\udcff é' (TASK): known: toast"


def test_one_is_one() -> None:
    assert [counted(n, "step") for n in (0, 1, 2)] == ["0 steps", "1 step", "2 steps"]


PRINTABLE = st.text(st.characters(exclude_categories=("C", "Z")), min_size=1)


@given(PRINTABLE, st.lists(PRINTABLE, unique=True))
def test_any_value_is_reported_in_one_line_with_all_that_is_known(value: str, known: list[str]) -> None:
    message = str(unknown("task", value, known, "TASK"))
    assert len(message.splitlines()) == 1
    assert f"'{value}' (TASK)" in message
    more = f" and {len(known) - MOST_NAMES} more" if len(known) > MOST_NAMES else ""
    assert message.endswith(f"known: {', '.join(sorted(known)[:MOST_NAMES]) or 'none'}{more}")


def test_a_message_is_no_longer_than_a_screen_and_keeps_its_two_ends() -> None:
    message = str(unknown("task", "x" * 100_000, ["toast"], "TASK"))
    assert len(message) <= MOST_CHARACTERS
    assert message.startswith("unknown task 'xxx")
    assert message.endswith("xxx' (TASK): known: toast")
    assert " more characters) ... " in message
    assert str(LabError(message)) == message  # said again it stays as it is


def test_too_little_memory_is_known_by_its_words() -> None:
    numpy = ImportError(
        "\nIMPORTANT: READ THIS\n  * The NumPy version is 2\n\nOriginal error was: x.so: failed to map segment\n"
    )
    assert str(out_of_memory(numpy)) == "there is not enough memory: Original error was: x.so: failed to map segment"
    assert str(out_of_memory(MemoryError())) == "there is not enough memory"
    outer = ValueError("no table")
    outer.__cause__ = MemoryError("of 5 GiB")
    assert isinstance(out_of_memory(outer), WorkFailed)
    assert out_of_memory(ImportError("no module named x")) is None
