"""Sentences that strangers wrote for known scenes, held against what they meant; and what is so for any text."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.words.listen import listen
from lab.words.meaning import Refusal
from lab.words.scene import Scene, scene_of

HERE = Path(__file__).parent
SCENES: dict[str, Scene] = {
    name: scene_of(record) for name, record in json.loads((HERE / "scenes.json").read_text(encoding="utf-8")).items()
}
UNDERSTOOD, MISUNDERSTOOD = 0.90, 0.01  # at least, at most; the rest is refused in words


def meant(text: str, scene: Scene) -> list[dict[str, Any]]:
    """The meaning of a sentence in its JSON form."""
    heard = listen(text, scene)
    return [heard.as_json()] if isinstance(heard, Refusal) else [intent.as_json() for intent in heard]


def sentences(name: str) -> Iterator[dict[str, Any]]:
    """The lines of a file of sentences."""
    yield from map(json.loads, (HERE / name).read_text(encoding="utf-8").splitlines())


FILES = (
    "development.jsonl",
    "development_2.jsonl",
    "development_3.jsonl",
    "development_4.jsonl",
    "development_5.jsonl",
    "own.jsonl",
)


@pytest.mark.parametrize("name", FILES)
def test_sentences_of_strangers_are_understood_or_refused(name: str) -> None:
    lines = list(sentences(name))
    heard = [(line, meant(line["say"], SCENES[line["scene"]])) for line in lines]
    wrong = [line["say"] for line, meaning in heard if meaning != line["means"]]
    false = [line["say"] for line, meaning in heard if meaning not in (line["means"], [{"refuse": True}])]
    assert len(wrong) <= (1 - UNDERSTOOD) * len(lines), wrong
    assert len(false) <= MISUNDERSTOOD * len(lines), false


@pytest.mark.parametrize(
    "text",
    [
        "don't go left", "never go left", "did you go left?", "if it is free go left", "left or right", "where is the toaster?",
        "go left 25 cm", "go left 0 steps", "a few steps left", "turn left by 90 degrees", "go to the cube", "the cube",
        "go to it", "go to the fridge", "stay two steps away from the toaster", "", "...", "left " * 200,
    ],
)  # fmt: skip
def test_what_is_not_clear_is_refused_in_one_line(text: str) -> None:
    heard = listen(text, SCENES["floor"])
    assert isinstance(heard, Refusal)
    assert heard.reason
    assert "\n" not in heard.reason


WORDS = (
    "left",
    "right",
    "two",
    "3",
    "cm",
    "until",
    "the",
    "wall",
    "cube",
    "toaster",
    "not",
    "away",
    "from",
    "around",
    "then",
    ",",
)


@settings(max_examples=40, deadline=None)
@given(
    st.text(max_size=40) | st.lists(st.sampled_from(WORDS), max_size=8).map(" ".join), st.sampled_from(sorted(SCENES))
)
def test_any_text_means_something_or_is_refused_in_one_line(text: str, name: str) -> None:
    heard = listen(text, SCENES[name])
    assert heard == listen(text, SCENES[name])
    if isinstance(heard, Refusal):
        assert heard.reason.strip()
        assert len(heard.reason.splitlines()) == 1
    else:
        assert heard


def test_a_single_word_may_be_taken_as_it_is_written() -> None:
    assert isinstance(listen("forwrds", SCENES["floor"], corrects=False), Refusal)
    assert not isinstance(listen("go forwrds", SCENES["floor"]), Refusal)
