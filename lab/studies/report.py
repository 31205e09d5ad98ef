"""The report of a study: its rows, beside the printed values, as a self-contained HTML page and as a CSV file."""

import csv
import json
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from math import inf, isfinite
from pathlib import Path
from typing import Any

from lab import files
from lab.errors import BadInput, WorkFailed
from lab.statistics import PERCENT_POINTS, RELATIVE, allowed
from lab.studies.findings import JUDGED, Findings, counts, share_within
from lab.version import __version__
from lab.view.printed_page import printed_page

Row = Mapping[str, Any]  # settings under their names, and RESULTS; `lab_version` where another version measured it
Line = tuple[tuple[str, Any], ...]  # some settings of a row

RESULTS = ("measure", "value", "ci95", "thesis", *JUDGED, "lab_version")  # every other key of a row is a setting
COLUMNS = ("measure", "value", "ci95_low", "ci95_high", "thesis", *JUDGED, "lab_version")  # in a CSV file
WHERE_KNOWN = JUDGED[1:]  # columns that are written only if a row has them
TABLE_KEYS = (
    "table",
    "environment",
    "case",
    "world",
    "view",
    "problem",
)  # rows with equal values here are in one table
METHOD_KEYS = ("gate", "method", "name")
SYMBOLS = {"beta": "β", "tau": "τ", "lambda_threshold": "Λ", "omega": "Ω", "psi": "Ψ"}
LARGEST = 10  # differences that are listed
MARKS = {True: ("in", "✓", "inside"), False: ("out", "✗", "outside"), None: ("", "–", "nothing printed")}
SIGNS = {"within_errors": "e", "used": "u", "easy": "n"}  # shown behind a printed figure
TEMPLATE = Path(__file__).with_name("report.html")


@dataclass(frozen=True)
class TableCell:
    """A cell of a table: its text, small text behind it, whether a printed figure agrees; span: columns of a headline."""

    text: str
    kind: str = "number"
    small: str = ""
    is_interval: bool = False
    is_printed: bool = False
    within: bool | None = None
    span: int = 0


@dataclass(frozen=True)
class ReportTable:
    """A table of the page: the names of its columns and its lines."""

    caption: str
    head: Sequence[str]
    lines: Sequence[Sequence[TableCell]]

    @property
    def numbers(self) -> set[int]:
        """The columns of numbers."""
        lines = ([cell for cell in line for _ in range(max(1, cell.span))] for line in self.lines)
        return {n for line in lines for n, cell in enumerate(line) if cell.kind.startswith("number") and not cell.span}


def write_report(path: Path, title: str, name: str, found: Findings) -> None:
    """Writes the HTML page, which needs neither network nor scripts, atomically.

    Raises BadInput for a figure that is neither SVG nor PNG, WorkFailed if the file cannot be written.
    """
    text = printed_page(
        TEMPLATE,
        title=title,
        name=name,
        count=len(found.rows),
        versions=sorted({str(row.get("lab_version", __version__)) for row in found.rows} or {__version__}),
        summary=[(_name(key), _text(value)) for key, value in found.summary.items()],
        notes=found.notes,
        marks=MARKS,
        points=f"{PERCENT_POINTS:g}",
        percent=f"{100 * RELATIVE:g}",
        apart=_apart(found.rows),
        agreement=_agreement(found.rows),
        figures=[(caption, _source(caption, picture)) for caption, picture in found.figures.items()],
        largest=_largest(found.rows),
        tables=_tables(found.rows),
    )
    write_file(path, text)


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """Writes rows as CSV, atomically: all settings, then COLUMNS, with the lab's version.

    Numbers and booleans are written as in JSON, None as an empty cell, text unchanged.
    Raises BadInput for other values, WorkFailed if the file cannot be written.
    """
    settings = dict.fromkeys(key for row in rows for key in row if key not in RESULTS)
    taken = [name for name in settings if name in COLUMNS]
    if taken:
        raise BadInput(f"study rows: a setting is named '{taken[0]}', as a column of results is")
    columns = [*settings, *(name for name in COLUMNS if name not in WHERE_KNOWN or any(name in row for row in rows))]
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        low, high = row.get("ci95") or (None, None)
        results = {**row, "ci95_low": low, "ci95_high": high, "lab_version": row.get("lab_version", __version__)}
        writer.writerow([_cell(name, results.get(name)) for name in columns])
    write_file(path, text.getvalue())


def _cell(name: str, value: Any) -> str:
    """A value as the text of a CSV cell."""
    plain = value.item() if hasattr(value, "item") else value  # numpy's numbers
    if plain is None or (isinstance(plain, str) and "\r" not in plain):  # a carriage return would not be quoted
        return plain or ""
    if not isinstance(plain, int | float) or not isfinite(plain):
        raise BadInput(f"study rows: {name} = {value!r}; allowed: plain text, finite numbers, true, false, null")
    return json.dumps(plain)


def write_file(path: Path, text: str) -> None:
    """Writes a file of a study and creates its folder. Raises WorkFailed if it cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        files.write_whole(path, text.encode(errors="backslashreplace"))
    except OSError as error:
        raise WorkFailed(f"study report '{path}' cannot be written: {error.strerror or error}") from None


def _apart(rows: Sequence[Row]) -> ReportTable | None:
    """The table of agreement by both rules, for rows used to choose settings, for other rows, and for easy ones."""
    parts = counts([dict(row) for row in rows if row.get("within") is not None])
    lines = [
        [TableCell(name, ""), *(TableCell(share_within(of, judged)) for judged in ("within", "within_errors"))]
        for name, of in parts.items()
        if of
    ]
    return ReportTable("", ["cells", "by the rule", "within both sampling errors"], lines) if lines else None


def _agreement(rows: Sequence[Row]) -> ReportTable | None:
    """The table of how many rows agree with the thesis: a line per table and method, a column per measure."""
    compared = [row for row in rows if row.get("within") is not None]
    if not compared:
        return None
    measures = [*dict.fromkeys(row["measure"] for row in compared)]
    keys = [key for key in (*TABLE_KEYS, *METHOD_KEYS) if any(row.get(key) is not None for row in compared)]
    groups: dict[Line, list[Row]] = {}
    for row in compared:
        groups.setdefault(_settings(row, keys), []).append(row)
    lines = [[*_texts(line), *_shares(group, measures)] for line, group in groups.items() if keys]
    total = [TableCell("all", span=len(keys))] if keys else []
    return ReportTable(
        "", [*map(_name, keys), *map(_measure, measures), "all"], [*lines, total + _shares(compared, measures)]
    )


def _shares(rows: Sequence[Row], measures: Sequence[str]) -> list[TableCell]:
    """Cells "3 of 4, 75 %" for each measure and for all."""
    cells = []
    for group in [*([row for row in rows if row["measure"] == measure] for measure in measures), rows]:
        inside = sum(bool(row["within"]) for row in group)
        share_within = f"{100 * inside / len(group):.0f} %" if group else ""
        cells.append(TableCell(f"{inside} of {len(group)}" if group else "–", small=share_within))
    return cells


def _largest(rows: Sequence[Row]) -> ReportTable:
    """The table of the largest differences from printed values, relative to what is allowed."""
    compared = [row for row in rows if _known(row.get("value")) and _known(row.get("thesis"))]
    lines = [
        [
            TableCell(_words(_settings(row)), "text"),
            TableCell(_measure(row["measure"]), ""),
            *_result(row, True),
            TableCell(("+" if row["value"] > row["thesis"] else "") + _number(row["value"] - row["thesis"])),
            TableCell(_number(_excess(row))),
        ]
        for row in sorted(compared, key=_excess, reverse=True)[:LARGEST]
        if row["value"] != row["thesis"]
    ]
    return ReportTable("", ["cell", "measure", "measured", "printed", "difference", "times what is allowed"], lines)


def _excess(row: Row) -> float:
    difference, room = abs(row["value"] - row["thesis"]), allowed(row["thesis"], row["measure"])
    return difference / room if room else inf if difference else 0.0


def _tables(rows: Sequence[Row]) -> list[ReportTable]:
    """The tables of all rows: one for each world and view (or case), with a line per combination of the other settings."""
    tables: dict[Line, list[Row]] = {}
    for row in rows:
        tables.setdefault(_settings(row, [key for key in TABLE_KEYS if row.get(key) is not None]), []).append(row)
    return [_all_cells(place, group) for place, group in tables.items()]


def _all_cells(place: Line, rows: Sequence[Row]) -> ReportTable:
    """One table; its caption names the settings that do not vary in it."""
    names = dict.fromkeys(key for row in rows for key, _ in _settings(row) if key not in TABLE_KEYS)
    varying = [name for name in names if len({_text(row.get(name)) for row in rows}) > 1]
    measures = dict.fromkeys((row["measure"] for row in rows), False)
    lines: dict[tuple[Line, int], dict[str, Row]] = {}
    for row in rows:
        line, repeat = _settings(row, names), 0
        while row["measure"] in lines.setdefault((line, repeat), {}):
            repeat += 1
        lines[line, repeat][row["measure"]] = row
        measures[row["measure"]] |= row.get("thesis") is not None
    fixed = [*place, *((name, rows[0].get(name)) for name in names if name not in varying)]
    head = [*map(_name, varying)]
    for measure, printed in measures.items():
        head += [_measure(measure), "printed"] if printed else [_measure(measure)]
    body = [
        [
            *_texts((name, value) for name, value in line if name in varying),
            *(cell for measure, printed in measures.items() for cell in _result(cells.get(measure, {}), printed)),
        ]
        for (line, _), cells in lines.items()
    ]
    return ReportTable(_words(fixed), head, body)


def _result(row: Row, printed: bool) -> list[TableCell]:
    """The measured value with its interval and, if wanted, the printed one with its mark."""
    if not row:
        return [TableCell("", "")] * (1 + printed)
    value, ends, thesis, within = (row.get(name) for name in ("value", "ci95", "thesis", "within"))
    interval = f"{_number(ends[0])} to {_number(ends[1])}" if ends else ""
    cells = [TableCell(_number(value), small=interval, is_interval=True)]
    if printed and thesis is not None and isfinite(thesis):
        cells.append(
            TableCell(f"{thesis:.10g}", f"number {MARKS[within][0]}", _signs(row), is_printed=True, within=within)
        )
    elif printed:
        cells.append(TableCell("–"))
    return cells


def _signs(row: Row) -> str:
    """Letters for further judgements of a printed figure, see report.html."""
    return " ".join(sign for name, sign in SIGNS.items() if row.get(name))


def _settings(row: Row, names: Iterable[str] | None = None) -> Line:
    wanted = [key for key, value in row.items() if key not in RESULTS and value is not None] if names is None else names
    return tuple((name, row.get(name)) for name in wanted)


def _source(caption: str, picture: bytes) -> str:
    """A picture as a data URL."""
    start = picture[:200].lstrip()
    kind = "png" if start.startswith(b"\x89PNG") else "svg+xml" if start.startswith((b"<?xml", b"<svg")) else None
    if kind is None:
        raise BadInput(f"figure '{caption}' of a study's report is neither SVG nor PNG")
    return f"data:image/{kind};base64,{b64encode(picture).decode()}"


def _name(key: str) -> str:
    return SYMBOLS.get(key, key.replace("_", " "))


def _measure(measure: str) -> str:
    """ "SP_percent" as "SP [%]"."""
    name, _, unit = measure.partition("_")
    return f"{name} [{'%' if unit == 'percent' else unit.replace('_', ' ')}]" if unit else name


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def _texts(line: Iterable[tuple[str, Any]]) -> list[TableCell]:
    return [TableCell(_text(value), "") for _, value in line]


def _words(settings: Iterable[tuple[str, Any]]) -> str:
    return ", ".join(f"{_name(name)}\xa0{_text(value)}" for name, value in settings)


def _known(value: Any) -> bool:
    return value is not None and isfinite(value)


def _number(value: float | None) -> str:
    """A measured number as text with two to four digits."""
    if value is None or not isfinite(value):
        return "–" if value != inf else "∞"
    size = abs(value)
    form = ".0f" if size >= 1000 else ".1f" if size >= 10 else ".2f" if size >= 0.1 or not size else ".2g"
    return f"{value:{form}}".replace("-", "−")
