"""Schedules in files of other programs, CSV or JSON: rows of parts that are processed at stations or carried by vehicles."""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from difflib import get_close_matches
from json import JSONDecodeError
from math import isfinite
from pathlib import Path
from typing import Any

from lab.errors import BadInput, printable, shortened
from lab.files import json_of, read_limited
from lab.sequencing.cell.schedule import KINDS, Kind
from lab.tasks.instances.source import Source, json_line

MOST_BYTES = 32 << 20
MOST = {"row": 20_000, "part": 1000, "station": 200, "vehicle": 100}
MOST_DEEP = 50  # the deepest nesting of a JSON document
MOST_TIME_S = 1e8  # three years
WORDS: Mapping[str, tuple[str, ...]] = {  # field -> names of its column or key, of which the first one present counts
    "part": ("part", "job", "workpiece", "item", "lot", "order", "task"),
    "station": ("station", "machine", "workstation", "workcenter", "workcentre", "resource", "id"),
    "start": ("start", "begin"),
    "end": ("end", "finish", "completion", "stop"),
    "duration": ("duration", "processing", "length"),
    "vehicle": ("vehicle", "robot", "arm", "agv", "amr", "transport", "transporter", "carrier", "crane", "hoist"),
    "origin": ("origin", "from", "source", "pickup"),
    "target": ("target", "to", "destination", "dropoff"),
    "kind": ("operation", "kind", "type", "activity"),
    "when": ("when",),
    "present": ("present",),
    "x": ("x",),
    "y": ("y",),
}
UNITS = {"ms": 0.001, "s": 1.0, "sec": 1.0, "seconds": 1.0, "min": 60.0, "minutes": 60.0, "h": 3600.0, "hours": 3600.0}
_KNOWN = frozenset(word for words in WORDS.values() for word in words)
_UNIT = re.compile(rf"[\s_(\[]+({'|'.join(UNITS)})[\])]?$")
_ARMS = ("robot", "arm")


@dataclass(frozen=True)
class TimedRow:
    """A part in a station, or with a vehicle, from `start_s` to `end_s`; part: None for a row without one, such as maintenance.

    vehicle: None: the part is in the station `origin`, which equals `target`. origin, target: from where to where a vehicle
    drives; None where the row does not say it.
    """

    part: str | None
    kind: Kind
    vehicle: str | None
    origin: str | None
    target: str | None
    start_s: float
    end_s: float


@dataclass(frozen=True)
class ScheduleTable:
    """The content of schedule files: rows by start, the planned rows where others were measured, and positions of stations.

    has_arm: whether there is a single carrier and it is called a robot or an arm.
    """

    rows: tuple[TimedRow, ...]
    planned: tuple[TimedRow, ...] = ()
    places_m: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    has_arm: bool = False


@dataclass(frozen=True)
class _Record:
    """One record of a file: values by the word of their column or key, the units of times, and the place in the file."""

    source: Source
    values: Mapping[str, Any]
    units: Mapping[str, float]
    way: tuple[str | int, ...] | int  # the path in a JSON document, or the line

    def word(self, name: str) -> str | None:
        """The word under which the record has a value for a field; None: it has none."""
        return next((word for word in WORDS[name] if self.values.get(word) not in (None, "")), None)

    def refusal(self, wanted: str, got: object = None) -> BadInput:
        """The error for a value that is not as expected, with file and line."""
        line = self.way if isinstance(self.way, int) else json_line(self.source.text, self.way)
        return self.source.refusal(line, wanted, None if got is None else printable(str(got)))

    def names(self, name: str) -> list[str]:
        """The names in a field; a bare number gets the field's word before it, such as "machine 3"."""
        word = self.word(name)
        if word is None:
            return []
        value = self.values[word]
        texts = [" ".join(str(text).split()) for text in (value if isinstance(value, list) else [value])]
        return [shortened(f"{word} {one}" if one.isdigit() else one, 40) for one in texts]

    def name(self, field_name: str) -> str | None:
        return next(iter(self.names(field_name)), None)

    def number(self, name: str, least: float = 0.0) -> float | None:
        """The value of a field: a number from `least` converted from its unit, or seconds since 1970 for a date."""
        word = self.word(name)
        if word is None:
            return None
        value = self.values[word]
        try:
            number = float(value) * self.units.get(word, 1.0)
        except (TypeError, ValueError, OverflowError):
            try:
                date = datetime.fromisoformat(str(value))
                return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()
            except ValueError:
                number = float("nan")
        if isinstance(value, bool) or not isfinite(number) or not least <= number <= MOST_TIME_S:
            dated = ", or a date such as 2026-05-04T06:30" if name in ("start", "end") else ""
            raise self.refusal(f"a number from {least:g} to {MOST_TIME_S:g} as '{word}'{dated}", value)
        return number

    @property
    def dated(self) -> bool:
        """Whether the record's start is a date."""
        value = self.values.get(self.word("start") or "")
        return isinstance(value, str) and bool(re.match(r"\s*\d{4}-?\d\d-?\d\d", value)) and not _is_number(value)

    @property
    def timed(self) -> bool:
        return self.word("start") is not None or self.word("end") is not None


def read_schedule(paths: Sequence[Path]) -> ScheduleTable:
    """The schedule in the first file, with positions of stations or PyJobShop's problem from the other files.

    Times are seconds; dates count from the first one. Raises BadInput, with file and line, for a file that cannot be read, a
    missing column, an invalid value, and more rows, parts or stations than MOST allows.
    """
    records, problems = list[_Record](), list[Any]()
    for path in paths:
        source = _source(path)
        if path.suffix.lower() == ".json" or source.text.lstrip()[:1] in ("{", "["):
            records += _of_json(source, problems)
        else:
            records += _of_csv(source)
    places = {name: at for record in records for name, at in _place(record)}
    timed = [
        record for record in records if record.timed and str(record.values.get("present", True)).lower() != "false"
    ]
    carrying = [record for record in timed if record.word("station") or record.word("vehicle")]
    if not carrying:
        raise _nothing(_source(paths[0]), timed)
    _check_count("row", carrying, paths[0])
    told = [row for record in carrying for row in _rows(record, problems[0] if problems else None)]
    dates = {record.dated for record in carrying}
    if len(dates) > 1:
        odd = next(record for record in carrying if record.dated != carrying[0].dated)
        raise odd.refusal("all times to be numbers or all to be dates", odd.values.get(odd.word("start") or ""))
    first_s = min(row.start_s for _, row in told) if True in dates else 0.0
    if (last_s := max(row.end_s for _, row in told) - first_s) > MOST_TIME_S:
        raise BadInput(f"schedule '{paths[0]}': it lasts {last_s:g} s: at most {MOST_TIME_S:g} s are shown")
    rows = sorted(
        ((when, replace(row, start_s=row.start_s - first_s, end_s=row.end_s - first_s)) for when, row in told),
        key=lambda row: (row[1].start_s, row[1].end_s),
    )
    measured = tuple(row for when, row in rows if when != "planned")
    planned = tuple(row for when, row in rows if when == "planned")
    vehicles = {row.vehicle for _, row in rows if row.vehicle}
    for kind, names in (
        ("part", {row.part for _, row in rows if row.part}),
        ("station", {name for _, row in rows for name in (row.origin, row.target) if name}),
        ("vehicle", vehicles),
    ):
        _check_count(kind, names, paths[0])
    arms = len(vehicles) == 1 and all((record.word("vehicle") or "robot") in _ARMS for record in carrying)
    return ScheduleTable(measured or planned, planned if measured else (), places, arms)


def _source(path: Path) -> Source:
    try:
        return Source(path, read_limited(path, MOST_BYTES).decode("utf-8-sig"))
    except OSError as error:
        raise BadInput(f"schedule '{path}' cannot be read: {error.strerror or error}") from None
    except ValueError:
        raise BadInput(f"schedule '{path}' is no text: wanted a table (.csv) or a .json file") from None


def _check_count(kind: str, found: Any, path: Path) -> None:
    if len(found) > MOST[kind]:
        raise BadInput(f"schedule '{path}': {len(found)} {kind}s: at most {MOST[kind]} are shown")


def _nothing(source: Source, timed: Sequence[_Record]) -> BadInput:
    """The error for a file in which no row has both a station or vehicle and times."""
    words = sorted({word for record in timed for word in record.values})
    what = "a machine" if timed else "a start and an end"
    there = f", not only {', '.join(words)}" if words else ""
    keys = list(dict.fromkeys(re.findall(r'"([^"\n]{1,30})"\s*:', source.text)))[:100]
    known = [word for name in ("start", "end", "station") for word in WORDS[name]]
    near = [
        (key, close[0]) for key in keys if _word(key)[0] not in _KNOWN and (close := get_close_matches(key, known, 1))
    ]
    hint = f"; did you mean '{near[0][1]}' by '{near[0][0]}'?" if near else ""
    return source.refusal(
        None, f"rows with a part, a station or vehicle, a start and an end: none has {what}{there}{hint}"
    )


def _place(record: _Record) -> Iterator[tuple[str, tuple[float, float]]]:
    x, y, name = record.number("x", -MOST_TIME_S), record.number("y", -MOST_TIME_S), record.name("station")
    if x is not None and y is not None and name is not None:
        yield name, (x, y)


def _rows(record: _Record, problem: "Mapping[str, Any] | None") -> Iterator[tuple[str, TimedRow]]:
    """The rows of a record, one for each of its stations, each with its kind: "planned", "measured" or ""."""
    start_s, end_s, lasts_s = record.number("start"), record.number("end"), record.number("duration")
    if start_s is None and end_s is not None and lasts_s is not None:
        start_s = end_s - lasts_s
    if end_s is None and start_s is not None and lasts_s is not None:
        end_s = start_s + lasts_s
    if start_s is None or end_s is None:
        lacks = "a start" if start_s is None else "an end or a duration"
        raise record.refusal(f"{lacks} in every row")
    if end_s < start_s:
        raise record.refusal(f"an end that is not before the start, {start_s:g} s", f"{end_s:g} s")
    part, stations = record.name("part"), record.names("station")
    if problem is not None and "mode" in record.values and not isinstance(record.way, int):
        part, stations = _of_problem(problem, record)
    word = str(record.values.get(record.word("kind") or "", "")).strip().lower()
    vehicle, origin = record.name("vehicle"), record.name("origin")
    if word == "transport" and vehicle is None and stations:
        vehicle, stations = stations[0], []
    when = str(record.values.get("when", "")).strip().lower()
    if vehicle is not None:
        kind: Kind = word if word in KINDS else "carry" if part else "empty"
        if kind == "carry" and part is None:
            raise record.refusal("a part in a row that says 'carry', or 'empty' in its place")
        start = origin or next(iter(stations), None)
        yield when, TimedRow(part, kind, vehicle, start, record.name("target"), start_s, end_s)
        return
    kind = word if word in KINDS else "process" if part else "service"
    for station in stations:
        yield when, TimedRow(part, kind, None, station, station, start_s, end_s)


def _of_problem(problem: Mapping[str, Any], record: _Record) -> tuple[str | None, list[str]]:
    """The names of the job and the resources of a task in a solution, from PyJobShop's problem."""

    def called(what: str, number: Any) -> str:
        known = problem[what]
        if not isinstance(number, int) or not 0 <= number < len(known):
            raise record.refusal(f"one of the problem's {len(known)} {what}", number)
        name = known[number].get("name") if isinstance(known[number], dict) else None
        return shortened(str(name), 40) if name else f"{what[:-1]} {number}"

    number = record.values.get("task")
    task = called("tasks", number)
    told = problem["tasks"][number]
    job = told.get("job") if isinstance(told, dict) else None
    numbers = record.values.get("resource")
    resources = numbers if isinstance(numbers, list) else [numbers]
    return task if job is None else called("jobs", job), [called("resources", resource) for resource in resources]


# ---- Records of CSV files and of JSON files ---------------------------------------------------------------------------


def _of_csv(source: Source) -> list[_Record]:
    lines = [(number, line) for number, line in enumerate(source.text.splitlines(), 1) if line.strip()]
    lines = [(number, line) for number, line in lines if not line.startswith("#")]
    if not lines:
        raise source.refusal(None, "a header such as part,station,start,end, and rows below it: it is empty")
    head = lines[0][1]
    comma = max((",", ";", "\t"), key=head.count)
    columns = next(csv.reader([head], delimiter=comma))
    words = [_word(column) for column in columns]
    there = {word for word, _ in words}
    if not (there & {"x", "y"}):
        _check_columns(source, lines[0][0], columns, there)
    units = {word: unit for word, unit in words if unit is not None}
    records = []
    for number, line in lines[1:]:
        cells = next(csv.reader([line], delimiter=comma))
        if len(cells) != len(columns):
            raise source.refusal(number, f"{len(columns)} values, as the header has", f"{len(cells)}: {line}")
        values: dict[str, Any] = {}
        for (word, _), cell in zip(words, cells, strict=True):
            text = cell.strip()
            decimal = comma != "," and re.fullmatch(r"-?\d+,\d+", text)
            values.setdefault(word, text.replace(",", ".") if decimal else text)
        records.append(_Record(source, values, units, number))
    return records


def _check_columns(source: Source, line: int, columns: Sequence[str], there: set[str]) -> None:
    """Raises BadInput, with the most similar word, when a required column is missing."""
    for group in (("start",), ("end", "duration"), ("station", "vehicle")):
        known = [word for name in group for word in WORDS[name]]
        if there & set(known):
            continue
        free = [(column, _word(column)[0]) for column in columns if _word(column)[0] not in _KNOWN]
        near = [(column, close[0]) for column, word in free if (close := get_close_matches(word, known, n=1))]
        hint = f"; did you mean '{near[0][1]}' by '{shortened(near[0][0], 40)}'?" if near else ";"
        wanted = ", ".join(word for name in group for word in WORDS[name][:4])
        shown = shortened(", ".join(columns))
        raise BadInput(f"{source.path}: line {line}: no column among '{shown}' is a {group[0]}{hint} known: {wanted}")


def _of_json(source: Source, problems: list[Any]) -> list[_Record]:
    try:
        document = json_of(source.text)
    except JSONDecodeError as error:
        raise source.refusal(error.lineno, f"JSON: {error.msg}") from None
    except ValueError as error:
        raise source.refusal(None, f"JSON that can be read: {error}") from None
    return list(_walk(source, document, (), {}, problems))


def _walk(
    source: Source, value: Any, way: tuple[str | int, ...], around: Mapping[str, Any], problems: list[Any]
) -> Iterator[_Record]:
    """Every mapping with times, or with a position, in the order of the document.

    around: values that a mapping inherits from those around it, by word: a mapping below "jobs" belongs to the job named there.
    """
    if len(way) > MOST_DEEP:
        raise source.refusal(None, f"JSON in which nothing is more than {MOST_DEEP} deep")
    if isinstance(value, list):
        word = _word(str(way[-1]))[0] if way else ""
        for number, item in enumerate(value):
            own = next((item[key] for key in ("id", "name") if isinstance(item, dict) and item.get(key)), number)
            inside = {**around, word: own} if word in _KNOWN else around
            yield from _walk(source, item, (*way, number), inside, problems)
        return
    if not isinstance(value, dict):
        return
    if all(isinstance(value.get(key), list) for key in ("jobs", "tasks", "resources", "modes")):
        problems.append(value)  # PyJobShop's ProblemData
        return
    values, units = dict(around), dict[str, float]()
    for key, item in value.items():
        word, unit = _word(key)
        plain = item["time"] if isinstance(item, dict) and set(item) == {"time"} else item
        scalars = isinstance(plain, list) and all(isinstance(each, str | int) for each in plain)
        if scalars or not isinstance(plain, list | dict):
            values[word] = plain
            units |= {} if unit is None else {word: unit}
    records = [
        record
        for key, item in value.items()
        for record in _walk(source, item, (*way, key), _inside(way, key, around), problems)
    ]
    if len(way) > 1 and _word(str(way[-2]))[0] in _KNOWN and isinstance(way[-1], int):
        values.pop("id", None)  # the name of a part, machine or vehicle in its list, see `around`
    own = _Record(source, values, units, way)
    if (own.timed and not any(record.timed for record in records)) or (own.word("x") and own.word("y")):
        yield own
    yield from records


def _inside(way: tuple[str | int, ...], key: str, around: Mapping[str, Any]) -> Mapping[str, Any]:
    """The inherited values below a key: below "machines": {"M1": ...} they hold the machine M1."""
    word = _word(str(way[-1]))[0] if way and isinstance(way[-1], str) else ""
    return {**around, word: key} if word in _KNOWN else around


def _word(column: str) -> tuple[str, float | None]:
    """The word of a column or key, and the unit in its name [s]: "Start time [min]" gives "start" and 60."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", column.strip()).lower()
    unit = _UNIT.search(text)
    plain = re.sub(r"[\W_]", "", text[: unit.start()] if unit else text)
    for end in ("", "id", "name", "time", "date", "at", "s"):
        if plain.endswith(end) and (stem := plain.removesuffix(end)) in _KNOWN:
            return stem, UNITS[unit[1]] if unit else None
    return plain, UNITS[unit[1]] if unit else None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
