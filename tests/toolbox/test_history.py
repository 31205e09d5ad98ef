"""The log of a name: what is read of it, and what was in use before."""

import json
from typing import Any

import pytest

from lab.errors import BadInput
from lab.toolbox.versions import event, in_use_before, line_of, read_events, success_percents


def put(digits: str) -> dict[str, Any]:
    return {"what": "learned", "hash": digits, "in_use": True}


def test_what_is_written_is_read_and_damaged_lines_are_numbered() -> None:
    lines = [
        line_of(event("used", runs=2)),
        b"",
        b'{"time": "now"',
        b"[1]",
        b'{"time": 1, "what": "x"}',
        b"\xff",
        b"[" * 9999,
        b'{"time": "", "what": "", "x": NaN}',
    ]
    events, damaged = read_events(lines)
    assert [(read["what"], read["runs"]) for read in events] == [("used", 2)]
    assert damaged == [3, 4, 5, 6, 7, 8]
    for fact in (float("nan"), object()):
        with pytest.raises(BadInput, match="log entry 'used'"):
            line_of(event("used", fact=fact))


def test_the_last_evaluation_of_a_version_counts() -> None:
    told = [
        ("evaluated", "a", 50),
        ("evaluated", "b", 90.5),
        ("used", "a", 1),
        ("evaluated", "a", 75),
        ("evaluated", "c", "?"),
    ]
    lines = [line_of(event(what, hash=digits, success_percent=value)) for what, digits, value in told]
    assert success_percents([*lines, b'{"evaluated"']) == {"a": 75.0, "b": 90.5}


@pytest.mark.parametrize(
    ("events", "current", "before"),
    [
        ([], None, []),
        ([], "a", []),
        ([put("a"), put("b"), put("c")], "c", ["b", "a"]),
        ([put("a"), put("a"), put("b")], "b", ["a"]),
        ([put("a"), put("b") | {"in_use": False}], "a", []),
        ([put("a"), put("b"), put("a")], "a", ["b", "a"]),
        ([put("a"), put("b"), put("a"), {"what": "rolled back", "hash": "b"}], "b", ["a"]),
        ([{"what": "rolled back", "hash": "b"}], "b", []),  # of a log whose beginning is lost
        ([put("a")], "b", ["a"]),  # a crash came before the log was written
        ([put("a"), put("b"), {"what": "removed", "hash": "b"}], None, ["b", "a"]),
    ],
)
def test_what_was_in_use_before(events: list[dict[str, Any]], current: str | None, before: list[str]) -> None:
    assert in_use_before(events, current) == before
    assert in_use_before(json.loads(json.dumps(events)), current) == before
