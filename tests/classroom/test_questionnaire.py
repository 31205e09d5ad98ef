"""The items of a questionnaire, and which answers they take."""

from typing import Any

import pytest
from pydantic import ValidationError

from lab.classroom.questionnaire import SHIPPED, QuestionItem, checked_answers
from lab.errors import BadInput

LIKERT = QuestionItem(name="l", kind="likert", text="L", points=7)
SCALE = QuestionItem(name="s", kind="scale", text="S", lowest=-10, highest=10, step=5)
CHOICE = QuestionItem(name="c", kind="choice", text="C", options=("x", "y"))
TEXT = QuestionItem(name="t", kind="text", text="T", most=3, required=False)


@pytest.mark.parametrize(
    ("item", "allowed", "refused"),
    [
        (LIKERT, [1, 7], [0, 8, 3.0, "3", True, None, []]),
        (SCALE, [-10, 0, 10], [-11, 3, 15, 5.0, "5", False, {}]),
        (CHOICE, ["x", "y"], ["z", "", 0, None, ["x"]]),
        (TEXT, ["", "abc", "<b>"], ["abcd", 3, None]),
    ],
)
def test_which_answers_an_item_takes(item: QuestionItem, allowed: list[Any], refused: list[Any]) -> None:
    assert [item.checked(value) for value in allowed] == allowed
    for value in refused:
        with pytest.raises(BadInput, match="allowed is"):
            item.checked(value)


def test_answers_come_in_the_order_of_items_and_none_is_missing() -> None:
    items = (LIKERT, SCALE, CHOICE, TEXT)
    assert [*checked_answers(items, {"c": "x", "s": 5, "l": 1, "t": " "})] == ["l", "s", "c"]
    for given, said in (({"l": 1, "s": 5}, "'C' is not answered"), ({"l": 1, "s": 5, "c": "x", "z": 1}, "no item 'z'")):
        with pytest.raises(BadInput, match=said):
            checked_answers(items, given)


def test_what_is_kept_of_a_text_can_be_read_again() -> None:
    assert TEXT.checked("a\ud800") == "a?"


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"kind": "likert", "options": ("x", "y")}, "takes points, labels"),
        ({"kind": "likert", "labels": ("low", "middle", "high")}, "wanted 2, for the ends, or 5"),
        ({"kind": "scale", "step": 7}, "multiple of step 7"),
        ({"kind": "scale", "lowest": 5, "highest": 5}, "highest 5"),
        ({"kind": "choice"}, "two or more"),
        ({"kind": "choice", "options": ("x", "x")}, "each of them once"),
        ({"kind": "text", "points": 3}, "takes most"),
    ],
)
def test_an_item_of_two_minds_is_refused(fields: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        QuestionItem(name="q", text="Q", **fields)


def test_the_raw_tlx_has_six_scales_of_21_steps() -> None:
    items = SHIPPED["nasa-tlx"]
    assert [item.name for item in items] == ["mental", "physical", "temporal", "performance", "effort", "frustration"]
    assert {item.range_ for item in items} == {(0, 100, 5)}
    assert items[3].labels == ("perfect", "failure")
