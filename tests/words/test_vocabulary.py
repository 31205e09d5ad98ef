"""The words of the grammar: each kind is one that the grammar names, and the other way round."""

import re
from pathlib import Path

from lab.words.reader import corrected, distance, kinds_of_words, known_words, other_words

GRAMMAR = Path(__file__).resolve().parents[2] / "lab" / "words" / "grammar.lark"
READ = {"NUM", "LENGTH", "NAME", "PART", "KIND", "STATION", "ACT", "ACTKIND"}  # made by the reader


def test_the_grammar_names_the_kinds_of_words_that_there_are() -> None:
    rules = re.sub("//.*", "", GRAMMAR.read_text(encoding="utf-8"))
    assert set(re.findall(r"\b[A-Z][A-Z_]*\b", rules)) | {"FILLER"} == {*kinds_of_words(), *READ}


def test_distances_count_swaps_once() -> None:
    assert distance("left", "left", 2) == 0
    assert distance("lfet", "left", 2) == 1
    assert distance("wal", "wall", 2) == 1
    assert distance("abcd", "wxyz", 2) == 3  # more than two


def test_typing_errors_are_corrected_and_other_words_are_not() -> None:
    known = known_words("map")
    frequent = frozenset({"left", "right", "forward"})
    assert corrected("rigth", known, frequent) == "right"
    assert corrected("foward", known, frequent) == "forward"
    assert corrected("night", known, frequent) is None
    assert "night" in other_words()
    assert corrected("qq", known, frequent) is None
