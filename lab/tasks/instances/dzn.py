"""A reader of MiniZinc data (.dzn), as far as instances need it: numbers, lists and matrices, with lines; and hoist lines.

The names are those of public hoist models: Ninner, tmin, tmax, f, e (Wallace and Yorke-Smith 2020; MiniZinc challenge 2020), or
numTanks, minTime, maxTime, full, empty (Rodosek and Wallace 1998; the older MiniZinc and AMPL examples).
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from lab.tasks.cell_file import CellFile
from lab.tasks.instances.hoist import LOAD, PARTS, UNLOAD, HoistLine, cell_of_line
from lab.tasks.instances.source import MOST_MACHINES, InstanceRequest, Source

NO_MOST = 9999  # the value in these files for a stay without limit
NAMES = {  # quantity -> its names in the files
    "tanks": ("Ninner", "numTanks"),
    "least": ("tmin", "minTime"),
    "most": ("tmax", "maxTime"),
    "full": ("f", "full"),
    "empty": ("e", "empty"),
    "hoists": ("Hoists",),
    "copies": ("Multiplier",),
    "capacity": ("Capacity",),
    "parts": ("numJobs", "J"),
}
_TOKEN = re.compile(
    r"(?P<skip>[ \t\r]+|%[^\n]*|/\*.*?\*/)|(?P<break>\n)|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<to>\.\.)"
    r"|(?P<number>-?[0-9]+(?:\.[0-9]+)?)|(?P<string>\"[^\"\n]*\")|(?P<mark>\[\||\|\]|[\[\]|,;=(){}])",
    re.DOTALL,
)


class Token(NamedTuple):
    """A word of a file, and its line."""

    text: str
    line: int
    kind: str


@dataclass(frozen=True)
class Value:
    """The value of a name: its numbers as words, row by row for a matrix, and the line where it begins."""

    rows: tuple[tuple[Token, ...], ...]
    line: int
    single: bool = False


def tokens(source: Source) -> Iterator[Token]:
    """The words of a text; raises BadInput, with line, for an invalid character."""
    at, line = 0, 1
    while at < len(source.text):
        match = _TOKEN.match(source.text, at)
        if match is None:
            raise source.refusal(line, "MiniZinc data (name = value;)", source.text[at : at + 10].split("\n")[0])
        kind = match.lastgroup or ""
        if kind not in ("skip", "break"):
            yield Token(match[0], line, kind)
        line += match[0].count("\n")
        at = match.end()


def values(source: Source) -> dict[str, Value]:
    """The value of each name; sets and strings are skipped. Raises BadInput, with line, for invalid MiniZinc data."""
    words, by_name = [*tokens(source)], dict[str, Value]()
    end, at = Token("the end of the file", words[-1].line if words else 1, "end"), 0
    while at < len(words):
        name, equals = words[at], words[at + 1] if at + 1 < len(words) else end
        if name.kind != "name":
            raise source.refusal(name.line, "a name", name.text)
        if equals.text != "=":
            raise source.refusal(equals.line, f"'=' after '{name.text}'", equals.text)
        stop = next((n for n in range(at + 2, len(words)) if words[n].text in (";", "=")), len(words))
        if stop < len(words) and words[stop].text == "=":
            raise source.refusal(words[stop].line, f"';' after the value of '{name.text}'", words[stop].text)
        if name.text in by_name:
            raise source.refusal(name.line, f"'{name.text}' once: this is the second", name.text)
        by_name[name.text] = _value(source, name, words[at + 2 : stop])
        at = stop + 1
    return by_name


def _value(source: Source, name: Token, words: list[Token]) -> Value:
    """The value in some words: a number, a list [..], a matrix [|..|..|], or either within arrayNd(sets, ..)."""
    if not words:
        raise source.refusal(name.line, f"a value of '{name.text}'")
    if re.fullmatch(r"array[1-6]d", words[0].text):
        opened = next((n for n, word in enumerate(words) if word.text in ("[", "[|")), len(words))
        if words[-1].text != ")" or opened == len(words):
            raise source.refusal(words[-1].line, f"{words[0].text}(sets, [..])", words[-1].text)
        words = words[opened:-1]
    first, last = words[0], words[-1]
    if len(words) == 1:
        return Value((tuple(words),), first.line, single=True)
    closing = {"[": "]", "[|": "|]", "{": "}"}.get(first.text)
    if closing is None:
        return Value((tuple(words),), first.line)  # for example a set, 1..12
    if last.text != closing:
        raise source.refusal(last.line, f"'{closing}' at the end of '{name.text}'", last.text)
    rows, row = list[tuple[Token, ...]](), list[Token]()
    for word in words[1:-1]:
        if word.text == "|":
            rows.append(tuple(row))
            row = []
        elif word.text != ",":
            if word.kind not in ("number", "name", "string", "to"):
                raise source.refusal(word.line, f"a number in '{name.text}'", word.text)
            row.append(word)
    rows += [tuple(row)] if row or not rows else []
    return Value(tuple(rows), first.line)


def read(source: Source, asked: InstanceRequest) -> CellFile:
    """The cell of a hoist line; BadInput, with file and line, for data without one, for several hoists and copied tanks."""
    data = _Data(source, values(source))
    tanks = data.count("tanks", None, MOST_MACHINES)
    for what in ("hoists", "copies"):
        data.count(what, 1, 1)
    capacity, parts = data.count("capacity", 1, 100), data.count("parts", PARTS, 100)
    least, full = data.times("least", tanks), data.times("full", tanks + 1)
    most = [None if time >= NO_MOST else time for time in data.times("most", tanks)]
    for number, (low, high) in enumerate(zip(least, most, strict=True), 1):
        if high is not None and high < low:
            raise source.refusal(data.line("most"), f"a most time of tank {number} of at least {low:g}", f"{high:g}")
    names = [LOAD, *(f"tank-{number}" for number in range(1, tanks + 1))]
    empty = dict[str, dict[str, float]]()
    rows = data.matrix("empty", tanks + 1)
    for at, (name, row) in enumerate(zip([*names[1:], UNLOAD], rows, strict=True)):
        empty[name] = {target: time for target, time in zip(names, row, strict=True) if target != name}
        if at < tanks:
            empty[name].pop(name, None)
    return cell_of_line(source, HoistLine(names[1:], least, most, full, empty, capacity, parts), asked)


@dataclass(frozen=True)
class _Data:
    """The values of a hoist line's names."""

    source: Source
    found: Mapping[str, Value]

    def _value(self, what: str) -> tuple[str, Value] | None:
        return next(((name, self.found[name]) for name in NAMES[what] if name in self.found), None)

    def line(self, what: str) -> int | None:
        """The line where a value begins."""
        named_value = self._value(what)
        return None if named_value is None else named_value[1].line

    def count(self, what: str, default: int | None, most: int) -> int:
        """The value as an integer from 1 to `most`; default None: it is required."""
        named_value = self._value(what)
        if named_value is None:
            if default is None:
                raise self.source.refusal(None, f"a value of '{NAMES[what][0]}': there is none")
            return default
        name, value = named_value
        if not value.single:
            raise self.source.refusal(value.line, f"one number as '{name}'", " ".join(w.text for w in value.rows[0]))
        return self.source.whole(value.rows[0][0].text, value.line, f"'{name}'", 1, most)

    def times(self, what: str, count: int) -> list[float]:
        """The value as `count` times in one row."""
        return self._numbers(what, count)[1]

    def matrix(self, what: str, count: int) -> list[list[float]]:
        """The value as a square matrix of times, which may be written as one list."""
        value, times = self._numbers(what, count * count)
        if len(value.rows) > 1:
            for row in value.rows:
                if len(row) != count:
                    line = row[0].line if row else value.line
                    raise self.source.refusal(line, f"{count} times in each row of '{what}'", f"{len(row)}")
        return [times[count * n : count * (n + 1)] for n in range(count)]

    def _numbers(self, what: str, count: int) -> tuple[Value, list[float]]:
        named_value = self._value(what)
        if named_value is None:
            raise self.source.refusal(None, f"a value of '{' or '.join(NAMES[what])}': there is none")
        name, value = named_value
        words = [word for row in value.rows for word in row]
        if len(words) != count or value.single:
            raise self.source.refusal(value.line, f"{count} times as '{name}'", f"{len(words)}")
        return value, [
            float(NO_MOST) if word.text == "INF" else self.source.time(word.text, word.line, f"a time in '{name}'")
            for word in words
        ]
