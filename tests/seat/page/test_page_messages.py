"""What pages may say, and who has the seat."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.seat.page.page_messages import (
    MAX_CHARS,
    MOST_MOVES,
    Chair,
    LayerChoice,
    Message,
    Pace,
    PageAnswer,
    PageCommand,
    Refused,
    Wish,
    understood,
)


@pytest.mark.parametrize(
    ("message", "meant"),
    [
        ({"answer": {"question": 3, "action": 0}}, PageAnswer(3, 0)),
        ({"answer": {"question": 3, "word": "skip"}}, PageAnswer(3, None, "skip")),
        ({"answer": {"question": 3, "word": "undo"}}, PageAnswer(3, None, "undo")),
        ({"answer": {"question": 3, "word": "+"}}, PageAnswer(3, None, "+")),
        ({"answer": {"question": 3, "path": [3, 1, 3]}}, PageAnswer(3, 3, path=(3, 1, 3))),
        ({"answer": {"question": 3, "path": [0] * MOST_MOVES}}, PageAnswer(3, 0, path=(0,) * MOST_MOVES)),
        ({"replay": "step"}, Pace("step")),
        ({"command": "jog +x 10"}, PageCommand("jog +x 10")),
        ({"seat": "take"}, Wish("take")),
        ({"seat": "give"}, Wish("give")),
        ({"layer": 4}, LayerChoice(4)),
        ({"layer": None}, LayerChoice(None)),
    ],
)
def test_what_a_page_says_is_understood(message: object, meant: object) -> None:
    assert understood(json.dumps(message)) == meant


@pytest.mark.parametrize(
    "message",
    [
        "",
        "no json",
        "[]",
        "null",
        "NaN",
        "{}",
        '{"seat": "throne"}',
        '{"seat": "take", "layer": 1}',
        '{"layer": 1.5}',
        '{"layer": true}',
        '{"answer": {"question": 1}}',
        '{"answer": {"question": 1, "action": "0"}}',
        '{"answer": {"question": 1, "action": true}}',
        '{"answer": {"question": true, "action": 0}}',
        '{"answer": {"question": 1, "word": "rm -rf"}}',
        '{"answer": {"question": 1, "action": 0, "word": "skip"}}',
        '{"answer": {"question": 1, "action": 0}, "more": 1}',
        '{"answer": {"question": 1, "path": []}}',
        '{"answer": {"question": 1, "path": [0, true]}}',
        '{"answer": {"question": 1, "path": [0], "action": 0}}',
        json.dumps({"answer": {"question": 1, "path": [0] * (MOST_MOVES + 1)}}),
        '{"replay": "backwards"}',
        '{"replay": "step", "seat": "take"}',
        '{"command": ""}',
        '{"command": " "}',
        '{"command": 3}',
        '{"command": "stop\\n"}',
        '{"command": "stop", "seat": "take"}',
        "[" * MAX_CHARS,
        '{"layer": ' + "1" * MAX_CHARS + "}",
        b'{"layer": 1}',
    ],
)
def test_anything_else_is_refused_in_a_line(message: str | bytes) -> None:
    with pytest.raises(Refused) as refused:
        understood(message)
    assert 10 < len(str(refused.value)) < 100


@given(st.text() | st.binary() | st.recursive(st.none() | st.integers() | st.text(), st.lists).map(json.dumps))
def test_nothing_else_can_come_of_a_message(message: str | bytes) -> None:
    try:
        assert isinstance(understood(message), Message)
    except Refused:
        return


@given(st.text() | st.sampled_from(["stop", "jog +x 10", "\u2028", "\x00stop", " "]))
def test_a_command_is_one_printable_line(words: str) -> None:
    try:
        meant = understood(json.dumps({"command": words}))
    except Refused:
        assert not words.strip() or not words.isprintable() or len(words) > MAX_CHARS // 8
    else:
        assert meant == PageCommand(words)


def test_the_first_page_has_the_seat() -> None:
    chair = Chair()
    chair.joined(1)
    chair.joined(2)
    assert chair.view(1) == {"seat": True, "free": False, "pages": 2}
    assert chair.view(2) == {"seat": False, "free": False, "pages": 2}


def test_the_seat_is_free_when_its_page_has_gone_and_the_next_to_come_has_it() -> None:
    chair = Chair([1, 2], 1)
    chair.left(1)
    assert chair.view(2) == {"seat": False, "free": True, "pages": 1}
    chair.joined(3)
    assert chair.holder == 3


def test_a_page_takes_the_seat_only_when_it_is_free() -> None:
    chair = Chair([1, 2], 1)
    with pytest.raises(Refused, match="has to hand over first"):
        chair.wish(2, Wish("take"))
    chair.wish(1, Wish("give"))
    with pytest.raises(Refused, match="does not answer"):
        chair.wish(1, Wish("give"))
    chair.wish(2, Wish("take"))
    chair.wish(2, Wish("take"))
    assert chair.holder == 2
