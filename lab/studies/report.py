"""A study's rows as one self-contained page, with what the thesis prints beside them, and as a CSV file."""

import csv
import json
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from io import StringIO
from math import inf, isfinite
from pathlib import Path
from typing import Any

from lab import __version__, files
from lab.errors import BadInput, WorkFailed
from lab.studies.statistics import PERCENT_POINTS, RELATIVE, allowed

Row = Mapping[str, Any]  # settings under their names, and RESULTS; `lab_version` where another version measured it
Line = tuple[tuple[str, Any], ...]  # some settings of a row

RESULTS = ("measure", "value", "ci95", "thesis", "within", "lab_version")  # every other key of a row is a setting
COLUMNS = ("measure", "value", "ci95_low", "ci95_high", "thesis", "within", "lab_version")  # in a CSV file
TABLE_KEYS = ("table", "environment", "case", "world", "view")  # rows that agree in these are one table
METHOD_KEYS = ("gate", "method", "name")
SYMBOLS = {"beta": "β", "tau": "τ", "lambda_threshold": "Λ", "omega": "Ω", "psi": "Ψ"}
LARGEST = 10  # differences that are listed
MARKS = {True: ("in", "✓", "inside"), False: ("out", "✗", "outside"), None: ("", "–", "nothing printed")}

STYLE = """
body { margin: 0 auto; padding: 1em; max-width: 76em; font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff; }
h1 { font-size: 1.5em; margin: .2em 0; } h2 { font-size: 1.15em; margin: 1.6em 0 .4em; }
dl { display: grid; grid-template-columns: max-content auto; gap: .1em 1em; } dd { margin: 0; }
.wide { overflow-x: auto; margin: .6em 0 1.2em; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .2em 0; }
th, td { padding: .15em .6em; text-align: left; border-bottom: 1px solid #ddd; white-space: nowrap; }
thead th { border-bottom: 2px solid #888; vertical-align: bottom; }
.number { text-align: right; } td.text { white-space: normal; min-width: 12em; }
small { color: #595959; } small.interval { display: inline-block; min-width: 7.5em; }
.in { background: #dcecf6; color: #004b77; } .out { background: #fbe3d6; color: #8a3b00; }
figure { margin: 1em 0; } figure img { max-width: 100%; height: auto; } figcaption { color: #444; }
@media print, (max-width: 45em) { small.interval { display: block; min-width: 0; } th, td { padding: .1em .35em; } }
@media print {
  body { font-size: 8.5pt; max-width: none; padding: 0; } .wide { overflow: visible; } tr, figure { break-inside: avoid; }
  .in, .out { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
"""
PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>{style}</style>
</head>
<body>
{body}
</body>
</html>
"""


def write_report(
    path: Path,
    title: str,
    study_name: str,
    rows: Sequence[Row],
    summary: Mapping[str, Any],
    figures: Mapping[str, bytes],
    notes: Sequence[str] = (),
) -> None:
    """Write one HTML file that needs neither network nor scripts; beside `path` first, then renamed.

    rows: settings and RESULTS, as `lab study run --json` gives them; figures: caption -> SVG or PNG; notes: paragraphs.
    Raises BadInput for a figure of another kind, WorkFailed when the file cannot be written.
    """
    versions = escape(", ".join(sorted({str(row.get("lab_version", __version__)) for row in rows} or {__version__})))
    parts = [
        f"<h1>{escape(title)}</h1>",
        f"<p>Study <code>{escape(study_name)}</code>, {len(rows)} cells, measured with Teaching Lab {versions}.</p>",
        _summary(summary),
        *(f"<p>{escape(note)}</p>" for note in notes),
        *_agreement(rows),
        *(_figure(caption, picture) for caption, picture in figures.items()),
        *_largest(rows),
        *_tables(rows),
    ]
    _write_whole(path, PAGE.format(title=escape(title), style=STYLE, body="\n".join(parts)))


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """Write rows as CSV: all settings, then COLUMNS with the lab's version; beside `path` first, then renamed.

    Numbers and true/false as in JSON, None as nothing, text as it is.
    Raises BadInput for a value that is none of these, WorkFailed when the file cannot be written.
    """
    settings = dict.fromkeys(key for row in rows for key in row if key not in RESULTS)
    taken = [name for name in settings if name in COLUMNS]
    if taken:
        raise BadInput(f"study rows: a setting is named '{taken[0]}', as a column of results is")
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*settings, *COLUMNS])
    for row in rows:
        low, high = row.get("ci95") or (None, None)
        results = {**row, "ci95_low": low, "ci95_high": high, "lab_version": row.get("lab_version", __version__)}
        writer.writerow([_cell(name, results.get(name)) for name in (*settings, *COLUMNS)])
    _write_whole(path, text.getvalue())


def _cell(name: str, value: Any) -> str:
    """A value as the text of a CSV cell."""
    plain = value.item() if hasattr(value, "item") else value  # numpy's numbers
    if plain is None or isinstance(plain, str):
        return plain or ""
    if not isinstance(plain, int | float) or not isfinite(plain):
        raise BadInput(f"study rows: {name} = {value!r}; allowed: text, finite numbers, true, false, null")
    return json.dumps(plain)


def _write_whole(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        files.write_whole(path, text.encode(errors="backslashreplace"))
    except OSError as error:
        raise WorkFailed(f"study report '{path}' cannot be written: {error.strerror or error}") from None


def _summary(summary: Mapping[str, Any]) -> str:
    return "<dl>" + "".join(f"<dt>{_name(key)}</dt><dd>{_text(value)}</dd>" for key, value in summary.items()) + "</dl>"


def _agreement(rows: Sequence[Row]) -> list[str]:
    """How many cells agree with the thesis: one line a table and method, one column a measure."""
    compared = [row for row in rows if row.get("within") is not None]
    if not compared:
        return ["<p>The thesis prints nothing to compare these cells with.</p>"]
    measures = [*dict.fromkeys(row["measure"] for row in compared)]
    keys = [key for key in (*TABLE_KEYS, *METHOD_KEYS) if any(row.get(key) is not None for row in compared)]
    groups: dict[Line, list[Row]] = {}
    for row in compared:
        groups.setdefault(_settings(row, keys), []).append(row)
    total = [f'<th colspan="{len(keys)}">all</th>'] if keys else []
    lines = [[*(f"<td>{_text(v)}</td>" for _, v in line), *_shares(group, measures)] for line, group in groups.items()]
    head = [*map(_name, keys), *map(_measure, measures), "all"]
    rule = f"within {PERCENT_POINTS:g} points (percentages) or {100 * RELATIVE:g} % (others) of it"
    return [
        "<h2>Cells that agree with the thesis</h2>",
        f"<p>{_mark(True)} inside: the 95 % interval holds the printed figure, or the measured one lies {rule}. "
        f"{_mark(False)} outside. {_mark(None)} nothing printed.</p>",
        _table("", head, [*(lines if keys else []), total + _shares(compared, measures)]),
    ]


def _shares(rows: Sequence[Row], measures: Sequence[str]) -> list[str]:
    """Cells "3 of 4, 75 %" for each measure and for all."""
    cells = []
    for group in [*([row for row in rows if row["measure"] == measure] for measure in measures), rows]:
        inside = sum(bool(row["within"]) for row in group)
        share = f"{inside} of {len(group)} <small>{100 * inside / len(group):.0f} %</small>" if group else "–"
        cells.append(f'<td class="number">{share}</td>')
    return cells


def _largest(rows: Sequence[Row]) -> list[str]:
    """The differences from print that are the largest beside what is allowed."""
    compared = [row for row in rows if _known(row.get("value")) and _known(row.get("thesis"))]
    worst = sorted(compared, key=_excess, reverse=True)[:LARGEST]
    lines = [
        [
            f'<td class="text">{_words(_settings(row))}</td>',
            f"<td>{_measure(row['measure'])}</td>",
            *_result(row, True),
            f'<td class="number">{"+" if row["value"] > row["thesis"] else ""}{_number(row["value"] - row["thesis"])}</td>',
            f'<td class="number">{_number(_excess(row))}</td>',
        ]
        for row in worst
        if row["value"] != row["thesis"]
    ]
    head = ["cell", "measure", "measured", "printed", "difference", "times what is allowed"]
    return ["<h2>Largest differences</h2>", _table("", head, lines)] if lines else []


def _excess(row: Row) -> float:
    difference, room = abs(row["value"] - row["thesis"]), allowed(row["thesis"], row["measure"])
    return difference / room if room else inf if difference else 0.0


def _tables(rows: Sequence[Row]) -> list[str]:
    """All cells: a table for each world and view (or case), a line for each combination of the other settings."""
    tables: dict[Line, list[Row]] = {}
    for row in rows:
        tables.setdefault(_settings(row, [key for key in TABLE_KEYS if row.get(key) is not None]), []).append(row)
    return ["<h2>All cells</h2>", *(_all_cells(place, group) for place, group in tables.items())] if tables else []


def _all_cells(place: Line, rows: Sequence[Row]) -> str:
    """One table; settings that never vary in it stand in its caption."""
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
        [f"<td>{_text(value)}</td>" for name, value in line if name in varying]
        + [cell for measure, printed in measures.items() for cell in _result(cells.get(measure, {}), printed)]
        for (line, _), cells in lines.items()
    ]
    return _table(_words(fixed), head, body)


def _result(row: Row, printed: bool) -> list[str]:
    """The measured value with its interval and, if wanted, the printed one with its mark."""
    value, ends = row.get("value"), row.get("ci95")
    interval = f' <small class="interval">{_number(ends[0])} to {_number(ends[1])}</small>' if ends else ""
    cells = [f'<td class="number">{_number(value)}{interval}</td>' if row else "<td></td>"]
    if printed and _known(row.get("thesis")):
        kind = MARKS[row.get("within")][0]
        cells.append(f'<td class="number {kind}">{row["thesis"]:.10g} {_mark(row.get("within"))}</td>')
    elif printed:
        cells.append('<td class="number">–</td>' if row else "<td></td>")
    return cells


def _settings(row: Row, names: Iterable[str] | None = None) -> Line:
    wanted = [key for key, value in row.items() if key not in RESULTS and value is not None] if names is None else names
    return tuple((name, row.get(name)) for name in wanted)


def _table(caption: str, head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A table of cells that are HTML already, `<td>` or `<th>`; wide ones scroll on a narrow screen."""
    numbers = {n for line in lines for n, cell in enumerate(line, len(head) - len(line)) if "number" in cell[:20]}
    columns = "".join(f'<th scope="col"{" class=number" * (n in numbers)}>{name}</th>' for n, name in enumerate(head))
    body = "\n".join(f"<tr>{''.join(line)}</tr>" for line in lines)
    above = f"<caption>{caption}</caption>" if caption else ""
    return f'<div class="wide"><table>{above}<thead><tr>{columns}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'


def _figure(caption: str, picture: bytes) -> str:
    start = picture[:200].lstrip()
    kind = "png" if start.startswith(b"\x89PNG") else "svg+xml" if start.startswith((b"<?xml", b"<svg")) else None
    if kind is None:
        raise BadInput(f"figure '{caption}' of a study's report is neither SVG nor PNG")
    source = f"data:image/{kind};base64,{b64encode(picture).decode()}"
    words = escape(caption)
    return f'<figure><img src="{source}" alt="{words}"><figcaption>{words}</figcaption></figure>'


def _mark(within: bool | None) -> str:
    kind, sign, says = MARKS[within]
    return f'<b class="{kind}" role="img" aria-label="{says}" title="{says}">{sign}</b>'


def _name(key: str) -> str:
    return escape(SYMBOLS.get(key, key.replace("_", " ")))


def _measure(measure: str) -> str:
    """ "SP_percent" as "SP [%]"."""
    name, _, unit = measure.partition("_")
    return escape(f"{name} [{'%' if unit == 'percent' else unit.replace('_', ' ')}]" if unit else name)


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return escape(f"{value:.10g}" if isinstance(value, float) else str(value))


def _words(settings: Iterable[tuple[str, Any]]) -> str:
    return ", ".join(f"{_name(name)}&nbsp;{_text(value)}" for name, value in settings)


def _known(value: Any) -> bool:
    return value is not None and isfinite(value)


def _number(value: float | None) -> str:
    """A measured number for reading, with two to four digits."""
    if value is None or not isfinite(value):
        return "–" if value != inf else "∞"
    size = abs(value)
    form = ".0f" if size >= 1000 else ".1f" if size >= 10 else ".2f" if size >= 0.1 or not size else ".2g"
    return f"{value:{form}}".replace("-", "−")
