"""The words of sentences: what the file of words says, and the kinds that the grammar names."""

import re
from pathlib import Path

from lab.words.vocabulary import READ, Phrases, as_read, known_words, other_words, phrases, rows

GRAMMAR = Path(__file__).resolve().parents[2] / "lab" / "words" / "grammar.lark"
SLOTS = {"dir", "side", "amount", "until", "thing", "part", "station", "work", "numbered"}
KINDS = {*rows("common"), *rows("map"), *rows("order"), *READ}


def test_the_grammar_and_the_clauses_name_kinds_of_words_that_there_are() -> None:
    rules = re.sub("//.*", "", GRAMMAR.read_text(encoding="utf-8"))
    assert set(re.findall(r"\b[A-Z][A-Z_]*\b", rules)) <= KINDS
    assert {kind for kinds in rows("clauses").values() for kind in kinds} <= KINDS | SLOTS


def test_alternatives_in_brackets_are_phrases_of_their_own() -> None:
    known: Phrases = phrases("map")
    words = as_read("please stay away from the toaster")
    assert words == ("stay", "away", "from", "toaster")
    assert known.longest(words, 0) == (3, "AVOID")
    assert known.longest(as_read("toaster"), 0) == (0, "")


def test_a_word_of_a_scene_is_not_another_one_with_a_typing_error() -> None:
    assert not known_words("map") & other_words() & {"left", "right", "forward", "toward"}
    assert "light" in other_words()
