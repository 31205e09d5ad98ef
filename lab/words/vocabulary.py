"""The words of sentences, from `vocabulary.txt`: phrases with their kinds, and the units of length.

Names of objects, parts and stations come from the scene (lab/words/names.py), numbers and lengths from lab/words/reader.py.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files

LENGTHS: Mapping[str, float] = {
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 0.1),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters", "cms", "centi", "centis"), 1.0),
    **dict.fromkeys(("dm", "decimetre", "decimetres", "decimeter", "decimeters"), 10.0),
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters", "mtr"), 100.0),
    **dict.fromkeys(("inch", "inches"), 2.54),
}  # in cm
UNITS_AND_TEENS = (
    *("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"),
    *("thirteen", "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen"),
)
TENS = {
    "twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60, "seventy": 70, "eighty": 80, "ninety": 90,
}  # fmt: skip
NUMBERS = {**{word: n for n, word in enumerate(UNITS_AND_TEENS)}, **TENS, "fourty": 40, "dozen": 12, "hundred": 100}
TIMES = {"twice": 2, "thrice": 3}
AMOUNTS = ("couple", "pair", "half", "quarter", "quarters", "of", "a", "point")
ORDINALS = {
    "first": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5, "sixth": 6, "seventh": 7, "eighth": 8, "ninth": 9,
    "tenth": 10, "1st": 1, "2nd": 2, "3rd": 3, **{f"{n}th": n for n in range(4, 13)},
}  # fmt: skip

READ = (
    "COMMA",
    "DOT",
    "NUM",
    "ONE",
    "LENGTH",
    "NAME",
    "PART",
    "KIND",
    "STATION",
    "ACT",
    "ACTKIND",
    "ORDINAL",
    "THATIS",
)
"""The kinds that the reader finds without the file."""

Form = tuple["str | tuple[Form, ...]", ...]  # a phrase: words, and choices of forms


@cache
def rows(section: str) -> Mapping[str, tuple[str, ...]]:
    """Kind of word -> its phrases in a section of the file, as they are written there."""
    found: dict[str, tuple[str, ...]] = {}
    text = files("lab.words").joinpath("vocabulary.txt").read_text(encoding="utf-8")
    text = re.sub(r"\n  +", " ", re.sub(r"(?m)^#.*\n", "", text))
    within = ""
    for line in text.splitlines():
        if line.startswith("["):
            within = line.strip("[]")
        elif line and within == section:
            kind, _, listed = line.partition(": ")
            found[kind] = tuple(phrase.strip() for phrase in listed.split(","))
    return found


@cache
def skipped() -> frozenset[str]:
    """The words that are left out before phrases are looked for."""
    return frozenset(rows("common")["SKIPPED"])


def as_read(phrase: str) -> tuple[str, ...]:
    """The words of a phrase as the reader has them: numbers in digits, and without words that are left out."""
    return tuple(str(NUMBERS.get(word, word)) for word in phrase.split() if word not in skipped())


class Phrases:
    """The phrases of scenes whose own words are in a section, "map" or "order", by their first words."""

    def __init__(self, section: str) -> None:
        self._by_word: dict[str, list[tuple[Form, str]]] = {}
        self.words: set[str] = set()
        for name in ("common", section):
            for kind, listed in rows(name).items():
                for phrase in listed if kind != "SKIPPED" else ():
                    form = _form(re.findall(r"[()|]|[^()|\s]+", phrase))
                    self.words |= _words(form)
                    for word in _first(form):
                        self._by_word.setdefault(word, []).append((form, kind))

    def longest(self, words: Sequence[str], at: int) -> tuple[int, str]:
        """The end and the kind of the longest phrase that begins at a word, (at, "") for none; the section's own come first."""
        best = (at, "")
        for form, kind in self._by_word.get(words[at], ()):
            end = max(_ends(form, words, at), default=at)
            if end >= best[0] and end > at:
                best = (end, kind)
        return best


def _form(parts: list[str]) -> Form:
    """The form of a phrase up to the end of its group; takes what it reads."""
    items: list[str | tuple[Form, ...]] = []
    while parts and parts[0] not in ")|":
        word = parts.pop(0)
        if word == "(":
            choices = [_form(parts)]
            while parts.pop(0) == "|":
                choices.append(_form(parts))
            items.append(tuple(choices))
        else:
            items += as_read(word)
    return tuple(items)


def _ends(form: Form, words: Sequence[str], at: int) -> set[int]:
    """Where the words of a form may end that begin at a word."""
    ends = {at}
    for item in form:
        if isinstance(item, str):
            ends = {end + 1 for end in ends if end < len(words) and words[end] == item}
        else:
            ends = {after for end in ends for choice in item for after in _ends(choice, words, end)}
        if not ends:
            break
    return ends


def _first(form: Form) -> set[str]:
    """The words with which a form may begin."""
    found: set[str] = set()
    for item in form:
        if isinstance(item, str):
            return found | {item}
        found |= {word for choice in item for word in _first(choice)}
        if not any(map(_may_be_empty, item)):
            return found
    return found


def _may_be_empty(form: Form) -> bool:
    return all(not isinstance(item, str) and any(map(_may_be_empty, item)) for item in form)


def _words(form: Form) -> set[str]:
    found = set[str]()
    for item in form:
        found |= {item} if isinstance(item, str) else {word for choice in item for word in _words(choice)}
    return found


@cache
def phrases(section: str) -> Phrases:
    """The phrases of scenes whose own words are in a section, read once."""
    return Phrases(section)


@cache
def known_words(section: str) -> frozenset[str]:
    """The single words of scenes whose own words are in a section."""
    return frozenset({*phrases(section).words, *NUMBERS, *TIMES, *ORDINALS, *LENGTHS, *skipped(), *AMOUNTS})


@cache
def clause_kinds(name: str) -> tuple[str, ...]:
    """The kinds of words that may stand in a clause, by its name in the file."""
    return rows("clauses")[name]


@cache
def other_words() -> frozenset[str]:
    """The English words that are near a known one and are not that word with a typing error."""
    return frozenset(word for listed in rows("other").values() for row in listed for word in row.split())


@cache
def frequent_words() -> frozenset[str]:
    """The words that are likeliest to be meant by a word with a typing error."""
    return frozenset(word for row in rows("frequent")["WORDS"] for word in row.split())
