"""TOML text: its values, the line of each value, and the words of an error about one."""

import re
import tomllib
from bisect import bisect_right
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from lab.errors import BadInput

Loc = tuple[str | int, ...]  # the path to a value: keys of tables, and indices in arrays
Fields = Callable[[Loc], Sequence[str]]

_NO_SUCH_KEY = ("extra_forbidden", "unexpected_keyword_argument")
_WORDS = {
    "tuple_type": "Input should be a list in brackets",
    "model_type": "Input should be a table",
    "dict_type": "Input should be a table",
    "dataclass_type": "Input should be a table",
    "string_pattern_mismatch": "wanted 1 to 40 letters, digits, spaces, - and _, a letter or a digit first",
}
_MOST_SHOWN = 120  # characters of a bad value that an error shows
MOST_PARTS = 100  # parts of a dotted key: the TOML reader's time grows with their square
MOST_KEYS = 100_000  # keys and tables: more take seconds to read
MOST_VALUES = 2_500_000  # commas: enough for the obstacles of a world of 100 x 100 x 100 cells
MOST_SCANNED = 1_000_000  # characters of a text in which lines of values are looked up
_HEADER = re.compile(r"^[ \t]*\[[^\n]*\][ \t]*(?:#[^\n]*)?$", re.MULTILINE)
_MANY_DIGITS = re.compile(r"[0-9A-Fa-f](?:_?[0-9A-Fa-f]){15}")  # an integer that may be beyond 64 bits
_LONG_KEY = re.compile(rf"""(?<![\w.-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{MOST_PARTS}}}""")
_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_PLAIN = re.compile(r"[^,\]}#\n]+")  # a number, a date, true or false
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?""""{0,2}'
    r"|'''.*?''''{0,2}"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)


@dataclass(frozen=True)
class TomlText:
    """A file's text and its values. All objects of this class compare equal, so that records which refer to their text
    compare by content.
    """

    path: Path = field(compare=False)
    text: str = field(compare=False, repr=False)
    raw: dict[str, Any] = field(compare=False, repr=False)

    @classmethod
    def parsed(cls, path: Path, text: str) -> "TomlText":
        """The parsed text; raises BadInput, with file and line, when it is not TOML, or a key has too many parts."""
        if (keys := text.count("=") + len(_HEADER.findall(text))) > MOST_KEYS or text.count(",") > MOST_VALUES:
            raise BadInput(
                f"{path}: {keys} keys and tables, {text.count(',')} commas: allowed are {MOST_KEYS} and {MOST_VALUES}"
            )
        if long := _LONG_KEY.search(text):
            line = text.count("\n", 0, long.start()) + 1
            raise BadInput(f"{path}: line {line}: a key of more than {MOST_PARTS} parts")
        try:
            raw = tomllib.loads(text)
        except (
            ValueError,
            RecursionError,
        ) as error:  # besides TOMLDecodeError: numbers or nesting beyond Python's limits
            raise BadInput(f"{path}: not valid TOML: {error}") from None
        toml = cls(path, text, raw)
        if _MANY_DIGITS.search(text) and (loc := _beyond_64_bits(raw)) is not None:
            raise toml.refusal(loc, f"{'.'.join(map(str, loc))}: a whole number beyond 64 bits")
        return toml

    @cached_property
    def _lines(self) -> dict[Loc, int]:
        return lines_of(self.text[:MOST_SCANNED])

    def line(self, loc: Sequence[str | int]) -> int | None:
        """The line, from 1, of a value, or of the nearest value around it that the file has; None: there is none."""
        for end in range(len(loc), 0, -1):
            if (line := self._lines.get(tuple(loc[:end]))) is not None:
                return line
        return None

    def refusal(self, loc: Sequence[str | int], message: str) -> BadInput:
        """The error with the file, the line of the value at `loc`, and the message."""
        line = self.line(loc)
        return BadInput(f"{self.path}: {'' if line is None else f'line {line}: '}{message}")


def _beyond_64_bits(raw: dict[str, Any]) -> Loc | None:
    """The path to an integer beyond the 64 bits of TOML, which a float may not hold either; None: there is none."""
    pending: list[tuple[Loc, Any]] = [((), raw)]
    while pending:
        loc, value = pending.pop()
        if isinstance(value, dict):
            pending += [((*loc, key), held) for key, held in value.items()]
        elif isinstance(value, list):
            pending += [((*loc, number), held) for number, held in enumerate(value)]
        elif isinstance(value, int) and not -(2**63) <= value < 2**63:
            return loc
    return None


def lines_of(text: str) -> dict[Loc, int]:
    """The line, from 1, on which each table, key and array element of a TOML text begins.

    For an invalid text, only those before its first fault are returned.
    """
    scan = _Scan(text)
    with suppress(ValueError, IndexError, RecursionError):  # an error then names no line
        scan.document()
    return scan.lines


class _Scan:
    """One pass over a text; at: the present index."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0
        self.lines: dict[Loc, int] = {}
        self._ends = [place for place, character in enumerate(text) if character == "\n"]
        self._counts: dict[Loc, int] = {}  # tables in each array of tables so far

    def document(self) -> None:
        """Scans the whole text: headers of tables, and pairs in the table that the last header opened."""
        table: Loc = ()
        self._blank()
        while self.at < len(self.text):
            if self.text[self.at] == "[":
                table = self._header()
            else:
                self._pair(table)
            self._blank()

    def _header(self) -> Loc:
        line, many = self._line(), self.text.startswith("[[", self.at)
        self.at += 2 if many else 1
        keys = self._keys()
        self.at += 2 if many else 1
        loc: Loc = ()
        for number, key in enumerate(keys, 1):
            loc = (*loc, key)
            self.lines.setdefault(loc, line)
            if many and number == len(keys):
                self._counts[loc] = self._counts.get(loc, 0) + 1
            if loc in self._counts:
                loc = (*loc, self._counts[loc] - 1)
                self.lines.setdefault(loc, line)
        return loc

    def _pair(self, table: Loc) -> None:
        line, loc = self._line(), table
        for key in self._keys():
            loc = (*loc, key)
            self.lines.setdefault(loc, line)
        self.at += 1  # =
        self._value(loc)

    def _keys(self) -> list[str]:
        """The parts of a dotted key; quoted parts are parsed by the TOML reader because of their escapes."""
        keys = []
        while True:
            self._blank()
            quoted = self.text[self.at] in "\"'"
            key = self._take(_STRING if quoted else _BARE)
            keys.append(str(tomllib.loads(f"key = {key}")["key"]) if quoted else key)
            self._blank()
            if self.text[self.at] != ".":
                return keys
            self.at += 1

    def _value(self, loc: Loc) -> None:
        self._blank()
        opened = self.text[self.at]
        if opened not in "[{":
            self._take(_STRING if opened in "\"'" else _PLAIN)
            return
        self.at += 1
        number = 0
        self._blank()
        while self.text[self.at] not in "]}":
            if opened == "{":
                self._pair(loc)
            else:
                self.lines[*loc, number] = self._line()
                self._value((*loc, number))
            number += 1
            self._blank()
            if self.text[self.at] == ",":
                self.at += 1
            self._blank()
        self.at += 1

    def _blank(self) -> None:
        """Skips spaces, line breaks and comments."""
        self._take(_BLANK)

    def _take(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self.text, self.at)
        if match is None:
            raise ValueError(f"at {self.at}")
        self.at = match.end()
        return match[0]

    def _line(self) -> int:
        return bisect_right(self._ends, self.at) + 1


def finding(error: ValidationError) -> ErrorDetails:
    """The first finding of a validation; an unknown key comes before all others, which may follow from it."""
    findings = error.errors()
    return next((candidate for candidate in findings if candidate["type"] in _NO_SUCH_KEY), findings[0])


def explain(error: ValidationError, fields: Fields | None = None, raw: Any = None) -> str:
    """The first finding of a validation in one line: the field, the bad value, what is allowed, and the number of others.

    fields: returns the fields of the record at a path, to suggest a similar one. raw: the file's values, to name the station or
    part that the field belongs to.
    """
    findings, first = error.errors(), finding(error)
    loc, message = first["loc"], _WORDS.get(first["type"], first["msg"].removeprefix("Value error, "))
    if first["type"] == "missing" and loc and isinstance(loc[-1], int):
        loc, short = (
            loc[:-1],
            [other for other in findings if other["type"] == "missing" and other["loc"][:-1] == loc[:-1]],
        )
        findings = [other for other in findings if other not in short[1:]]
        message = f"wanted a list of {1 + max(int(missing['loc'][-1]) for missing in short)}"
    elif first["type"] == "too_long" and isinstance(first["input"], tuple):
        message = f"wanted a list of {first['ctx']['max_length']}"
    where = ".".join(map(str, loc)) + _whose(raw, loc)
    if first["type"] in _NO_SUCH_KEY:
        message = "there is no such key"
        known = fields(first["loc"][:-1]) if fields else []
        if near := get_close_matches(str(first["loc"][-1]), known, n=1):
            message += f", did you mean '{near[0]}'?"
    got = repr([*first["input"]] if isinstance(first["input"], tuple) else first["input"])
    got = got if len(got) <= _MOST_SHOWN else f"{got[:_MOST_SHOWN]} ..."
    shown = "" if isinstance(first["input"], dict) or not where else f" (got {got})"
    if first["type"] == "literal_error":
        near = get_close_matches(str(first["input"])[:_MOST_SHOWN], re.findall("'([^']*)'", message), n=1)
        shown += f": did you mean '{near[0]}'?" if near else ""
    more = f" (and {len(findings) - 1} more)" if len(findings) > 1 else ""
    of_whole = first["type"] == "value_error" and first["loc"][-1:] and isinstance(first["loc"][-1], int)
    return f"{where + ': ' if where and not of_whole else ''}{message}{shown}{more}"


def _whose(raw: Any, loc: Loc) -> str:
    """The name of the innermost table of an array on a path, as in " of station 'oven'"; "" when it has none."""
    name = ""
    for before, part, after in zip(("", *loc), loc, (*loc[1:], ""), strict=False):
        try:
            raw = raw[part]
        except (TypeError, LookupError):
            break
        if isinstance(part, int) and isinstance(raw, dict) and isinstance(raw.get("name"), str) and after != "name":
            name = f" of {str(before).removesuffix('s')} {raw['name'][:_MOST_SHOWN]!r}"
    return name
