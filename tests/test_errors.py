"""The lab's errors: exit codes, one line, the nearest name."""

import re
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from annotated_types import Ge, Lt
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import (
    MOST_CHARACTERS,
    BadInput,
    LabError,
    WorkFailed,
    check_value,
    counted,
    listed,
    out_of_memory,
    printable,
    shortened,
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


@pytest.mark.parametrize(
    ("value", "allowed", "wanted"),
    [
        (-1, Annotated[int, Ge(0)], "a whole number, at least 0"),
        ("two", Annotated[int, Ge(0)], "a whole number, at least 0"),
        (True, int, "a whole number"),
        (2.5, int, "a whole number"),
        (float("nan"), Annotated[float, Ge(0), Lt(1)], "a number, at least 0, below 1"),
        (1, bool, "True or False"),
        (None, str, "text"),
        (3, Path, "a path"),
    ],
)
def test_a_value_of_another_type_or_outside_its_limits_is_refused(value: object, allowed: Any, wanted: str) -> None:
    with pytest.raises(BadInput, match=f"^{re.escape(f'n {value!r} (lab.f): wanted {wanted}')}$"):
        check_value("n", value, allowed, "lab.f")


def test_numbers_of_numpy_and_paths_as_text_are_allowed() -> None:
    for value, allowed in ((np.int64(3), Annotated[int, Ge(3)]), (np.float32(0.5), float), (2, float), ("x", Path)):
        check_value("n", value, allowed, "lab.f")


PRINTABLE = st.text(st.characters(exclude_categories=("C", "Z")), min_size=1)


@given(PRINTABLE, st.lists(PRINTABLE, unique=True))
def test_any_value_is_reported_in_one_line_with_what_is_known(value: str, known: list[str]) -> None:
    message = str(unknown("task", value, known, "TASK"))
    assert len(message.splitlines()) == 1
    assert f"'{shortened(value)}' (TASK)" in message
    everything = f"known: {', '.join(sorted(known)) or 'none'}"
    assert message.endswith(everything) or re.search(r" and \d+ more$|known: \d+ names?$", message)
    assert len(message) <= MOST_CHARACTERS


def test_as_many_names_as_fit_are_listed() -> None:
    names = [f"name-{number}" for number in range(1000)]
    assert listed(names[:3], 30) == "name-0, name-1, name-2"
    assert listed(names, 30) == "name-0, name-1 and 998 more"
    assert listed(["x" * 100_000], 60) == "1 name"


@given(st.text(max_size=2000), st.sampled_from([LabError, BadInput, WorkFailed]))
def test_any_message_is_one_short_line_that_keeps_its_two_ends(text: str, kind: type[LabError]) -> None:
    message = str(kind(text))
    assert message.isprintable()
    assert len(message) <= MOST_CHARACTERS
    assert message == printable(text) or (
        printable(text).startswith(message[:100]) and printable(text).endswith(message[-100:]) and " ... " in message
    )
    assert str(kind(message)) == message  # said again it stays as it is


def test_of_a_long_message_where_it_comes_from_and_what_is_allowed_stay() -> None:
    message = str(BadInput(f"{'x' * 100_000} (--gate): allowed are ccrl, never"))
    assert message.startswith("xxx")
    assert message.endswith("x (--gate): allowed are ccrl, never")


@given(st.text(max_size=500), st.integers(20, 100))
def test_a_long_value_is_shown_by_its_two_ends(text: str, most: int) -> None:
    shown = shortened(text, most)
    assert shown.isprintable()
    assert len(shown) <= most
    assert shown == printable(text) or " ... " in shown


def test_of_a_long_list_of_known_names_the_last_are_left_out_and_the_hint_stays() -> None:
    message = str(
        BadInput(
            f"{'mine/' * 20}task.toml: line 3: {unknown('task', 'toats', ['toast', *map(str, range(99))], 'TASK')}"
        )
    )
    assert "unknown task 'toats' (TASK): did you mean 'toast'? known: 0, 1, 10, " in message
    assert message.endswith(", ...")
    assert len(message) <= MOST_CHARACTERS


def test_too_little_memory_is_known_by_its_words() -> None:
    numpy = ImportError(
        "\nIMPORTANT: READ THIS\n  * The NumPy version is 2\n\nOriginal error was: x.so: failed to map segment\n"
    )
    assert str(out_of_memory(numpy)) == "there is not enough memory: Original error was: x.so: failed to map segment"
    assert str(out_of_memory(MemoryError())) == "there is not enough memory"
    outer = ValueError("no table")
    outer.__cause__ = MemoryError("of 5 GiB")
    assert isinstance(out_of_memory(outer), WorkFailed)
    assert isinstance(out_of_memory(ValueError("Maximum allowed dimension exceeded")), WorkFailed)
    assert out_of_memory(ImportError("no module named x")) is None
