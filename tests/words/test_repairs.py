"""Sentences that correct themselves, and steps that are named in another order than they are to be done."""

import pytest

from lab.words.listen import listen
from lab.words.meaning import Go, Refusal
from lab.words.scene import GridScene

BARE = GridScene(("left", "right", "backward", "forward"), robot=(5, 5), cell_cm=10)


def steps(text: str) -> str:
    """The steps of a sentence, as "left 2, forward 1"; "" if it is refused."""
    heard = listen(text, BARE)
    if isinstance(heard, Refusal):
        return ""
    return ", ".join(f"{leg.direction} {leg.steps}" for go in heard if isinstance(go, Go) for leg in go.legs)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("two left, no wait, I mean three left", "left 3"),
        ("three left, sorry, right", "right 3"),
        ("left 4, no, 5", "left 5"),
        ("not left but right, three steps", "right 3"),
        ("up 2, then left 3, scratch that, right 1", "right 1"),
        ("sorry, two left", "left 2"),
        ("left 2, but first up 1", "forward 1, left 2"),
        ("up 2 before going left 1", "forward 2, left 1"),
        ("up 2 after going left 1", "left 1, forward 2"),
        ("before you go left 1, go up 2", "forward 2, left 1"),
        ("right 1, and don't go left", "right 1"),
        ("don't go left", ""),
        ("you went left", ""),
        ("should I go left?", ""),
        ("going left was wrong", ""),
        ("left 2 or right 2", ""),
        ("if it is free go left", ""),
        ("-2 left", ""),
        ("at least 2 left", ""),
    ],
)
def test_a_sentence_means_what_it_says_last(text: str, meant: str) -> None:
    assert steps(text) == meant
