"""CSV files of travel times: a matrix with the stations' names, or rows of from, to, time; one layout or several."""

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from lab.tasks.instances.source import Source
from lab.tasks.record import read_text

STARTS = ("lu", "l/u", "load", "in", "in-buf", "input", "depot")  # names of the station where parts start
ENDS = ("out", "out-buf", "output", "unload")
FROM = ("from", "origin", "after_move_into")
TO = ("to", "target", "to_remove_from")
_MOST_ROWS = 100_000


@dataclass(frozen=True)
class TravelTimes:
    """Travel times of a vehicle: from -> to -> time. `names` are the stations in the file's order."""

    path: Path
    names: tuple[str, ...]
    travel: Mapping[str, Mapping[str, float]]

    @property
    def start(self) -> str | None:
        """The station where parts and vehicles start; None: no station has such a name."""
        return next((name for name in self.names if name.lower() in STARTS), None)

    @property
    def end(self) -> str | None:
        """The station to which finished parts are brought; None: there is none."""
        return next((name for name in self.names if name.lower() in ENDS), None)

    @property
    def machines(self) -> tuple[str, ...]:
        """All other stations."""
        return tuple(name for name in self.names if name not in (self.start, self.end))


def csv_rows(source: Source) -> Iterator[tuple[int, list[str]]]:
    """The non-empty rows of a CSV file with their lines, values stripped of spaces; raises BadInput for invalid CSV."""
    reader = csv.reader(StringIO(source.text), strict=True)
    try:
        for count, row in enumerate(reader):
            if count > _MOST_ROWS:
                raise source.refusal(reader.line_num, f"up to {_MOST_ROWS} rows")
            if any(values := [value.strip() for value in row]):
                yield reader.line_num, values
    except csv.Error as error:
        raise source.refusal(reader.line_num, f"CSV: {error}") from None


def read_layout(path: Path, case: str | None = None) -> TravelTimes:
    """The travel times of a file; case: the name of one of several layouts. Raises BadInput, with file and line."""
    source = Source(path, read_text(path))
    rows = csv_rows(source)
    line, header = next(rows, (1, []))
    words = [word.lower() for word in header]
    if words[-3:-2] and words[-3] in FROM and words[-2] in TO:
        travel = _listed(source, rows, header, case)
    elif len(words) > 2 and not words[0].replace(".", "").isdigit():
        travel = _matrix(source, rows, header[1:], line)
    else:
        wanted = "from,to,time or layout,from,to,time, or the stations' names over a matrix of times"
        raise source.refusal(line, wanted, ",".join(header))
    names = tuple(dict.fromkeys(name for origin, row in travel.items() for name in (origin, *row)))
    if not names:
        raise source.refusal(None, "travel times: there is none")
    return TravelTimes(path, names, travel)


def _listed(
    source: Source, rows: Iterator[tuple[int, list[str]]], header: list[str], case: str | None
) -> dict[str, dict[str, float]]:
    """The times of rows of from, to, time, with the layout in a first column if the header has one."""
    layouts: dict[str, dict[str, dict[str, float]]] = {}
    for line, row in rows:
        if len(row) != len(header):
            raise source.refusal(line, f"{len(header)} values ({','.join(header)})", ",".join(row))
        travel = layouts.setdefault(row[0] if len(header) > 3 else "", {})
        origin, target, word = row[-3:]
        if target in travel.get(origin, {}):
            raise source.refusal(line, f"one time from '{origin}' to '{target}': this is the second")
        travel.setdefault(origin, {})[target] = source.time(word, line, f"the time from '{origin}' to '{target}'")
    if len(header) == 3:
        return layouts.get("", {})
    if case is None and len(layouts) == 1:
        return next(iter(layouts.values()))
    if case not in layouts:
        known = ", ".join([*layouts][:20]) or "none"
        said = "say which with --case SET:LAYOUT" if case is None else f"there is no layout '{case}' (--case)"
        raise source.refusal(None, f"one layout; the file has {known}: {said}")
    return layouts[case]


def _matrix(
    source: Source, rows: Iterator[tuple[int, list[str]]], names: list[str], line: int
) -> dict[str, dict[str, float]]:
    """The times of a matrix with a row per station, which begins with its name; an empty field is a forbidden move."""
    if len(set(names)) < len(names) or "" in names:
        raise source.refusal(line, "a name for each column, each once", ",".join(names))
    travel: dict[str, dict[str, float]] = {}
    for line, row in rows:
        if row[0] not in names or row[0] in travel:
            raise source.refusal(line, f"a row for each of {', '.join(names[:20])}", row[0])
        if len(row) != len(names) + 1:
            raise source.refusal(line, f"{len(names)} times after '{row[0]}'", f"{len(row) - 1} of them")
        travel[row[0]] = {
            name: source.time(word, line, f"the time from '{row[0]}' to '{name}'")
            for name, word in zip(names, row[1:], strict=True)
            if word
        }
    if missing := [name for name in names if name not in travel]:
        raise source.refusal(line, f"a row of times from '{missing[0]}': the file ends before it")
    return travel
