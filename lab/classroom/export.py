"""A class or a study with people as files for statistics: two tables, a dictionary of their columns, and where they are from."""

import csv
import json
from collections.abc import Mapping, Sequence
from datetime import datetime
from io import BytesIO, StringIO
from pathlib import Path
from platform import python_version
from shlex import quote
from typing import Any

from lab.classroom.class_rows import ClassRows, Row, rows_of
from lab.classroom.export_columns import ANSWERS, LESSONS, Column, columns_of
from lab.classroom.roster import FILE as ROSTER
from lab.errors import BadInput
from lab.files import check_out, is_file, json_of, read_limited, write_whole
from lab.lazy import pyarrow
from lab.optional import require
from lab.version import __version__

FORMAT = "teaching-lab export 1"
FILE, DICTIONARY = "export.json", "dictionary.csv"
FORMULA = ("=", "+", "-", "@", "\t")  # first characters by which a spreadsheet takes a text for a formula
MOST_BYTES = 1 << 26  # of a file of an export that is read
OF_COLUMN = ("table", "name", "type", "unit", "meaning", "allowed")


def export(folder: Path, out: Path, parquet: bool = False) -> dict[str, Any]:
    """The document of the export, after the class in a folder was written to `out`: tables, dictionary and export.json.

    The same folder gives the same bytes. parquet: whether the tables are also written as Parquet. Raises BadInput for a folder
    that holds no class, for files that cannot be written, and if the library for Parquet is not installed.
    """
    if parquet:
        require("--parquet", pyarrow)
    check_out(out)
    found = rows_of(folder)
    columns = columns_of(found.asked, found.protocol)
    tables = {LESSONS: found.lessons, ANSWERS: found.answers}
    words = ["lab", "study", "export", str(folder), "--out", str(out), *["--parquet"] * parquet]
    document = _about(folder, found) | {"command": " ".join(map(quote, words))}
    files = {DICTIONARY: csv_text(OF_COLUMN, [vars(column) for column in columns]).encode()}
    for name, rows in tables.items():
        own = [column for column in columns if column.table == name]
        files[f"{name}.csv"] = csv_text([column.name for column in own], rows).encode()
        if parquet:
            files[f"{name}.parquet"] = _parquet(own, rows)
    files[FILE] = (json.dumps(document, indent=1) + "\n").encode()
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            write_whole(out / name, content)
        for name in () if parquet else tables:  # of an export before this one
            (out / f"{name}.parquet").unlink(missing_ok=True)
    except OSError as error:
        raise BadInput(f"export '{out}' (--out): {error.strerror or error}") from None
    return document | {"files": {name: str(out / name) for name in files}}


def _about(folder: Path, found: ClassRows) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "class": folder.resolve().name,
        "protocol_sha256": found.protocol_sha256,
        "lab": __version__,
        "python": python_version(),
        "participants": found.participants,
        "withdrawn": found.withdrawn,
        "lessons": sum(row["lesson"] is not None for row in found.lessons),
        "answers": len(found.answers),
    }


def csv_text(columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> str:
    """The rows as the text of a CSV file; what is not known is an empty cell.

    A text that a spreadsheet would take for a formula has an apostrophe before it.
    """
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(row.get(name)) for name in columns] for row in rows)
    return text.getvalue()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        plain = value.replace("\r\n", "\n").replace("\r", "\n")  # a lone carriage return would not be quoted
        return f"'{plain}" if plain.lstrip(" \n").startswith(FORMULA) else plain
    return json.dumps(value)


def _parquet(columns: Sequence[Column], rows: Sequence[Mapping[str, Any]]) -> bytes:
    """The rows as a Parquet file, with the meaning and the unit of each column in its schema."""
    kinds = {
        "text": pyarrow.string(),
        "list": pyarrow.string(),
        "integer": pyarrow.int64(),
        "number": pyarrow.float64(),
        "boolean": pyarrow.bool_(),
        "time": pyarrow.timestamp("ms", "UTC"),
    }
    fields = [
        pyarrow.field(column.name, kinds[column.type], metadata={"meaning": column.meaning, "unit": column.unit})
        for column in columns
    ]
    arrays = [
        pyarrow.array([_value(column, row.get(column.name)) for row in rows], field.type)
        for column, field in zip(columns, fields, strict=True)
    ]
    written = BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(arrays, schema=pyarrow.schema(fields)), written)
    return written.getvalue()


def _value(column: Column, value: Any) -> Any:
    """A value in the type of its column, None for one that is of another type: a questionnaire's file may have been edited."""
    if value is None:
        return None
    match column.type:
        case "time":
            return datetime.fromisoformat(value)
        case "list":
            return json.dumps(value)
        case "text":
            return value if isinstance(value, str) else json.dumps(value)
        case "boolean":
            return value if isinstance(value, bool) else None
        case "integer":
            return value if isinstance(value, int) else None
        case _:
            return float(value) if isinstance(value, int | float) else None


# ---- reading -----------------------------------------------------------------------------------------------------------


def exported(folder: Path) -> tuple[dict[str, Any], list[Row]]:
    """(the document, the rows of participants' lessons) of an export, or of a class that has not been exported.

    Raises BadInput for a folder that holds neither, and for a damaged file.
    """
    if not is_file(folder / FILE):
        if not is_file(folder / ROSTER):
            raise BadInput(f"'{folder}' (DIR) holds neither an export ({FILE}) nor a class ({ROSTER})")
        found = rows_of(folder)
        return _about(folder, found), found.lessons
    kinds = {row["name"]: row["type"] for row in _csv_rows(folder / DICTIONARY, OF_COLUMN) if row["table"] == LESSONS}
    rows = _csv_rows(folder / f"{LESSONS}.csv", ("participant", "arm", "lesson"))
    try:
        document = json_of(read_limited(folder / FILE, MOST_BYTES))
        if not isinstance(document, dict) or document.get("format") != FORMAT:
            raise ValueError(f"format: '{FORMAT}' is wanted")
        if not isinstance(document.get("class"), str):
            raise ValueError("class: a name is wanted")
    except (OSError, ValueError) as error:
        raise BadInput(f"'{folder / FILE}': {error}: a file of lab study export is wanted") from None
    table = folder / f"{LESSONS}.csv"
    return document, [_typed(row, kinds, f"'{table}', line {line}") for line, row in enumerate(rows, start=2)]


def _csv_rows(path: Path, wanted: Sequence[str]) -> list[dict[str, str]]:
    """The rows of a CSV file. Raises BadInput unless it has the wanted columns, and in each row a cell of each column."""
    try:
        text = read_limited(path, MOST_BYTES).decode("utf-8")
        reader = csv.DictReader(StringIO(text, newline=""))
        rows = [*reader]
    except (OSError, ValueError, csv.Error) as error:
        raise BadInput(f"'{path}' cannot be read: {error}") from None
    if missing := [name for name in wanted if name not in (reader.fieldnames or ())]:
        raise BadInput(f"'{path}': the column '{missing[0]}' is missing: a file of lab study export is wanted")
    for line, row in enumerate(rows, start=2):
        if None in row or None in row.values():
            raise BadInput(f"'{path}', row {line}: it has other columns than the first line")
    return rows


def _typed(row: Mapping[str, str], kinds: Mapping[str, str], where: str) -> Row:
    """The values of a row by the types of their columns; an empty cell is None. Raises BadInput."""
    typed: Row = {}
    for name, cell in row.items():
        kind = kinds.get(name, "text")
        try:
            value: Any = None
            if cell:
                value = cell.removeprefix("'") if kind in ("text", "time") else json_of(cell)
        except ValueError:
            raise BadInput(f"{where}: {name} is {cell[:40]!r}: a {kind} is wanted") from None
        if value is not None and kind in ("integer", "number", "boolean") and not isinstance(value, int | float):
            raise BadInput(f"{where}: {name} is {cell[:40]!r}: a {kind} is wanted")
        typed[name] = value
    if typed["arm"] is not None and not (isinstance(typed["participant"], str) and isinstance(typed["lesson"], int)):
        raise BadInput(f"{where}: a participant and the number of a lesson are wanted beside an arm")
    return typed
