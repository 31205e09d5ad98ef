"""Typing errors: what is near a known word is that word, unless it is a word of its own."""

from lab.words.spelling import apart, corrected, distance
from lab.words.vocabulary import known_words


def test_distances_count_swaps_once() -> None:
    assert distance("left", "left", 2) == 0
    assert distance("lfet", "left", 2) == 1
    assert distance("wal", "wall", 2) == 1
    assert distance("abcd", "wxyz", 2) == 3  # more than two


def test_typing_errors_are_corrected_and_other_words_are_not() -> None:
    known = known_words("map")
    assert corrected("rigth", known) == "right"
    assert corrected("foward", known) == "forward"
    assert corrected("light", known) is None
    assert corrected("qq", known) is None


def test_two_words_in_one_are_taken_apart() -> None:
    assert apart(["tothe", "left"], known_words("map")) == ["to", "the", "left"]
