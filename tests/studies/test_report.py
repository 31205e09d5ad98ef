"""A study's page and its CSV file: complete, escaped, self-contained, and read back as they were."""

import csv
import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab import __version__
from lab.errors import BadInput, WorkFailed
from lab.studies import report
from lab.studies.findings import Findings
from lab.studies.report import write_report, write_rows

if TYPE_CHECKING:
    from playwright.sync_api import Page

PNG = b"\x89PNG\r\n\x1a\n"
SVG = b'<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>'
VOID = {"meta", "link", "img"}


def row(
    measure: str, value: float | None, thesis: float | None, within: bool | None, **settings: Any
) -> dict[str, Any]:
    ci95 = None if value is None else [value - 1, value + 1]
    return {**settings, "measure": measure, "value": value, "ci95": ci95, "thesis": thesis, "within": within}


EXPERT = {"world": "I", "view": "full", "gate": "ia", "tau": 0.01, "psi": 0.7}
NOVICE = {"world": "I", "view": "full", "gate": "ia", "tau": 1, "psi": 0.7}
COMBINED = {"world": "II", "view": "full", "gate": "combined", "tau": 1, "omega": 1}
ROWS = [
    row("SP_percent", 97.0, 98, True, **EXPERT),
    row("HS_steps", 250.0, 268.62, True, **EXPERT),
    row("SP_percent", 40.0, 61, False, **NOVICE),
    row("HS_steps", 2600.0, 2642.53, True, **NOVICE),
    row("SP_percent", 38.0, None, None, **COMBINED),
]


class Reader(HTMLParser):
    """What a page holds: its tables as rows of cell texts, its links, and whether every element is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.tables: list[list[list[str]]] = []
        self.sources: list[str] = []
        self.tags: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.sources += [str(value) for name, value in attrs if name in ("src", "href")]
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if {"td", "th"} & {*self.open}:
            self.tables[-1][-1][-1] += data


def page(tmp_path: Path, rows: list[dict[str, Any]], figures: dict[str, bytes] | None = None) -> tuple[str, Reader]:
    path = tmp_path / "report.html"
    found = Findings(rows, {"cells": len(rows), "within": 3}, figures or {}, ("A note.",))
    write_report(path, "Advice", "table-9.2", found)
    text = path.read_text(encoding="utf-8")
    reader = Reader()
    reader.feed(text)
    assert reader.open == []
    return text, reader


def test_shares_of_cells_that_agree(tmp_path: Path) -> None:
    _, reader = page(tmp_path, ROWS)
    assert reader.tables[0] == [
        ["world", "view", "gate", "SP [%]", "HS [steps]", "all"],
        ["I", "full", "ia", "1 of 2 50 %", "2 of 2 100 %", "3 of 4 75 %"],
        ["all", "1 of 2 50 %", "2 of 2 100 %", "3 of 4 75 %"],
    ]


def test_agreement_counted_apart(tmp_path: Path) -> None:
    """One cell was used to choose, one not, one is easy; each printed figure says so, and a file has the columns."""
    told: list[dict[str, Any]] = [
        {"within_errors": True, "used": True, "easy": False},
        {"within_errors": False, "used": False, "easy": False},
        {"used": True, "easy": True},
    ]
    rows = [one | more for one, more in zip(ROWS, told, strict=False)]
    text, reader = page(tmp_path, rows)
    assert reader.tables[0] == [
        ["cells", "by the rule", "within both sampling errors"],
        ["not used", "1 of 1 agree", "0 of 1 agree"],
        ["used to choose", "1 of 1 agree", "1 of 1 agree"],
        ["easy", "0 of 1 agree", "0 of 0 agree"],
    ]
    shown = [cell for table in reader.tables[3:] for line in table for cell in line]
    assert {"98 e u ✓", "268.62 ✓", "61 u n ✗"} <= {*shown}
    assert "<b>u</b> the printed one was used to choose" in text
    write_rows(tmp_path / "rows.csv", rows)
    assert [one["used"] for one in read(tmp_path / "rows.csv")] == ["true", "false", "true"]


def test_the_largest_differences_come_first(tmp_path: Path) -> None:
    """21 points are 4.2 times 5; 18.62 of 40.3 allowed steps; 42.53 of 396.4; 1 of 5 points."""
    _, reader = page(tmp_path, ROWS)
    head, *lines = reader.tables[1]
    assert head[-2:] == ["difference", "times what is allowed"]
    assert [line[-2:] for line in lines] == [["−21.0", "4.20"], ["−18.6", "0.46"], ["−1.00", "0.20"], ["−42.5", "0.11"]]
    assert lines[0][0] == "world\xa0I, view\xa0full, gate\xa0ia, τ\xa01, Ψ\xa00.7"


def test_no_more_than_ten_differences(tmp_path: Path) -> None:
    rows = [row("HS_steps", float(n), 100, n > 85, tau=n) for n in range(80, 120)]
    _, reader = page(tmp_path, rows)
    assert len(reader.tables[1]) == 11
    assert reader.tables[1][1][0] == "τ\xa080"


def test_every_cell_stands_in_its_table(tmp_path: Path) -> None:
    text, reader = page(tmp_path, ROWS)
    assert reader.tables[2:] == [
        [
            ["τ", "SP [%]", "printed", "HS [steps]", "printed"],
            ["0.01", "97.0 96.0 to 98.0", "98 ✓", "250.0 249.0 to 251.0", "268.62 ✓"],
            ["1", "40.0 39.0 to 41.0", "61 ✗", "2600 2599 to 2601", "2642.53 ✓"],
        ],
        [["SP [%]"], ["38.0 37.0 to 39.0"]],
    ]
    assert "<caption>world\xa0I, view\xa0full, gate\xa0ia, Ψ\xa00.7</caption>" in text
    assert "<caption>world\xa0II, view\xa0full, gate\xa0combined, τ\xa01, Ω\xa01</caption>" in text


def test_a_cell_measured_twice_gets_two_lines(tmp_path: Path) -> None:
    _, reader = page(tmp_path, [row("SP_percent", float(n), None, None, tau=1) for n in (20, 30)])
    assert reader.tables[-1] == [["SP [%]"], ["20.0 19.0 to 21.0"], ["30.0 29.0 to 31.0"]]


def test_cells_without_a_value(tmp_path: Path) -> None:
    _, reader = page(
        tmp_path, [row("CE_episode", None, 83.8, None, beta=1), row("CE_episode", 60.0, None, None, beta=2)]
    )
    assert reader.tables[-1][1:] == [["1", "–", "83.8 –"], ["2", "60.0 59.0 to 61.0", "–"]]


def test_nothing_printed_and_nothing_at_all(tmp_path: Path) -> None:
    text, _ = page(tmp_path, [row("SP_percent", 50.0, None, None)])
    assert "prints nothing to compare" in text
    _, reader = page(tmp_path, [])
    assert reader.tables == []


def test_printed_zero(tmp_path: Path) -> None:
    """No difference from a printed 0 steps is allowed; none is not listed."""
    rows = [row("HS_steps", 2.0, 0, False, tau=1), row("HS_steps", 0.0, 0, True, tau=2)]
    _, reader = page(tmp_path, rows)
    assert [line[-1] for line in reader.tables[1][1:]] == ["∞"]


def test_marks_are_signs_too(tmp_path: Path) -> None:
    text, _ = page(tmp_path, ROWS)
    assert text.count('aria-label="outside"') == text.count("✗") == 3  # in the key, the differences, the table
    assert 'class="number out">61 ' in text


def test_everything_is_escaped(tmp_path: Path) -> None:
    """Text that looks like HTML stays text, wherever it stands."""
    bad = "<script>'\"&"
    path = tmp_path / "report.html"
    rows = [row(bad, 1.0, 2, False, **{bad: bad, "world": bad, "lab_version": bad})]
    write_report(path, bad, bad, Findings(rows, {bad: bad}, {bad: SVG}, (bad,)))
    text, reader = path.read_text(encoding="utf-8"), Reader()
    reader.feed(text)
    assert "script" not in reader.tags
    assert text.count("&lt;script&gt;&#39;&#34;&amp;") > 10
    assert "<script" not in text


def test_figures_are_embedded(tmp_path: Path) -> None:
    _, reader = page(tmp_path, ROWS, {"Fig. 9.4": SVG, "Fig. 9.5": b'<?xml version="1.0"?>' + SVG, "a PNG": PNG})
    kinds = [source.partition(",")[0] for source in reader.sources]
    assert kinds == ["data:", *["data:image/svg+xml;base64"] * 2, "data:image/png;base64"]
    with pytest.raises(BadInput, match=r"'photo' of a study's report is neither SVG nor PNG"):
        page(tmp_path, ROWS, {"photo": b"\xff\xd8\xff"})


def test_nothing_is_fetched(tmp_path: Path) -> None:
    text, reader = page(tmp_path, ROWS, {"a figure": SVG})
    assert all(source.startswith("data:") for source in reader.sources)
    assert not re.search(r"https?:|@import|url\(|<script", text)
    assert "default-src 'none'" in text


def test_it_says_which_version_measured(tmp_path: Path) -> None:
    text, _ = page(tmp_path, [ROWS[0], {**ROWS[1], "lab_version": "0.0.9"}])
    assert f"measured with Teaching Lab 0.0.9, {__version__}." in text


def test_it_shows_in_a_narrow_browser(tmp_path: Path, browser_page: "Page") -> None:
    """320 pixels wide, without scripts: the page itself never scrolls sideways, its tables do; the figure is drawn."""
    from lab.studies.charts import bars

    page(
        tmp_path,
        ROWS,
        {"bars": bars(["a", "b"], {"x": [row("SP_percent", value, None, None) for value in (1.0, 2.0)]}, "y")},
    )
    browser_page.goto((tmp_path / "report.html").as_uri())
    assert browser_page.evaluate("document.documentElement.scrollWidth") <= 320
    assert browser_page.evaluate("document.querySelector('img').naturalWidth") > 100


# Rows as a file

names = st.from_regex(r"[a-z][a-z_0-9]{0,8}", fullmatch=True).filter(
    lambda s: s not in (*report.COLUMNS, *report.RESULTS)
)
numbers = st.floats(allow_nan=False, allow_infinity=False) | st.integers()
plain = (
    st.text().filter(lambda text: "\r" not in text)
    | numbers
    | st.booleans()
    | st.sampled_from(["1", "0.5", "true", "null", "I", "", "NaN", 'a,b\n"c"'])
)
results = st.fixed_dictionaries(
    {
        "measure": st.sampled_from(["SP_percent", "score"]),
        "value": st.none() | numbers,
        "ci95": st.none() | st.lists(numbers, min_size=2, max_size=2),
        "thesis": st.none() | numbers,
        "within": st.none() | st.booleans(),
        "lab_version": st.just(__version__),
    }
)


def read(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@given(rows=st.lists(st.builds(lambda settings, found: settings | found, st.dictionaries(names, plain), results)))
def test_any_reader_of_csv_finds_what_was_written(tmp_path_factory: pytest.TempPathFactory, rows: list[Any]) -> None:
    path = tmp_path_factory.mktemp("rows") / "rows.csv"
    write_rows(path, rows)
    for found, written in zip(read(path), rows, strict=True):
        low, high = written["ci95"] or (None, None)
        expected = dict.fromkeys(found) | {**written, "ci95_low": low, "ci95_high": high}
        del expected["ci95"]
        assert found.keys() == expected.keys()
        for name, value in expected.items():
            text = value if isinstance(value, str) else "" if value is None else json.dumps(value)
            assert found[name] == text


def test_text_that_looks_like_a_number_is_not_quoted_twice(tmp_path: Path) -> None:
    """`rank` is text, "1" or "1-2", and read back as such by any reader."""
    write_rows(tmp_path / "rows.csv", [row("score", 0.9, None, None, rank=rank) for rank in ("1", "1-2", "1,3")])
    assert [one["rank"] for one in read(tmp_path / "rows.csv")] == ["1", "1-2", "1,3"]


def test_a_file_to_read(tmp_path: Path) -> None:
    write_rows(tmp_path / "rows.csv", [*ROWS[:1], {**ROWS[4], "case": "1", "value": np.float64(38.5)}])
    assert (tmp_path / "rows.csv").read_text(encoding="utf-8").splitlines() == [
        "world,view,gate,tau,psi,omega,case,measure,value,ci95_low,ci95_high,thesis,within,lab_version",
        f"I,full,ia,0.01,0.7,,,SP_percent,97.0,96.0,98.0,98,true,{__version__}",
        f"II,full,combined,1,,1,1,SP_percent,38.5,37.0,39.0,,,{__version__}",
    ]


@pytest.mark.parametrize("value", [float("nan"), float("inf"), [1, 2], {}, "a\rb"])
def test_values_that_no_cell_holds(tmp_path: Path, value: Any) -> None:
    with pytest.raises(BadInput, match="tau = "):
        write_rows(tmp_path / "rows.csv", [row("score", 1.0, None, None, tau=value)])
    assert not list(tmp_path.iterdir())


def test_a_setting_named_as_a_result(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="named 'ci95_low'"):
        write_rows(tmp_path / "rows.csv", [row("score", 1.0, None, None, ci95_low=2)])


# Both are written whole

WRITERS: dict[str, Callable[[Path], None]] = {
    "report": lambda path: write_report(path, "Advice", "table-9.2", Findings(ROWS, {})),
    "rows": lambda path: write_rows(path, ROWS),
}


@pytest.mark.parametrize("name", WRITERS)
def test_same_rows_same_bytes_and_nothing_beside(tmp_path: Path, name: str) -> None:
    WRITERS[name](tmp_path / "new" / "one")
    WRITERS[name](tmp_path / "new" / "two")
    assert (tmp_path / "new" / "one").read_bytes() == (tmp_path / "new" / "two").read_bytes()
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["one", "two"]


@pytest.mark.parametrize("name", WRITERS)
def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    (tmp_path / "file").write_text("old")
    monkeypatch.setattr("lab.files.os.replace", full)
    with pytest.raises(WorkFailed, match="No space left"):
        WRITERS[name](tmp_path / "file")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "old"


@pytest.mark.parametrize("name", WRITERS)
def test_a_place_that_cannot_be_written(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(WorkFailed, match="cannot be written"):
        WRITERS[name](tmp_path / "file" / "report")
