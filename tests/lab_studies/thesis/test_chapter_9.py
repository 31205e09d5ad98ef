"""The studies of chapter 9: pictures that are pictures, rows that a report takes, and every figure that is asked for."""

import json
import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from lab.statistics import proportion_interval
from lab.studies.findings import Findings, agreement, those
from lab.studies.report import write_report, write_rows
from lab.studies.runner import STORE, Job
from lab_studies.thesis import chapter_9, chapter_9_cells
from lab_studies.thesis.chapter_9 import (
    CHOSEN,
    OTHER_SEED,
    READINGS,
    appendix_v,
    best_scores,
    by_seed,
    figure_9_4,
    readings,
)
from lab_studies.thesis.chapter_9_cells import TABLES, appendix, table

JOB = Job(sessions=10)


@pytest.fixture
def one_world(monkeypatch: pytest.MonkeyPatch) -> None:
    """Chapter 9 with table 9.2's world and view alone, and few decay factors."""
    monkeypatch.setattr(chapter_9, "TABLES", {"table-9.2": TABLES["table-9.2"]})
    monkeypatch.setattr(chapter_9_cells, "BETAS", (0.7, 1.3))


def texts(picture: bytes) -> list[str]:
    """What stands in an SVG picture."""
    return [text.strip() for text in ElementTree.fromstring(picture).itertext() if text.strip()]


def check(found: Findings, folder: Path) -> None:
    """Whether a report takes it: pictures that can be read, rows that come back as they were."""
    for picture in found.figures.values():
        assert ElementTree.fromstring(picture).tag == "{http://www.w3.org/2000/svg}svg"
    write_report(folder / "report.html", "Title", "name", found)
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure>") == len(found.figures)
    assert f"{len(found.rows)} cells" in page
    write_rows(folder / "rows.csv", found.rows)
    assert len((folder / "rows.csv").read_text(encoding="utf-8").splitlines()) == len(found.rows) + 1
    json.dumps([found.rows, found.summary], allow_nan=False)


def test_a_table_is_drawn_with_its_ranks(tmp_path: Path) -> None:
    job = replace(JOB, folder=tmp_path)
    found = best_scores(job, {}, "table-9.2")
    assert found.rows == table(job, "table-9.2", {})
    assert found.summary == agreement(found.rows)
    assert found.summary["ranks"] == 15
    (picture,) = found.figures.values()
    assert [*found.figures] == ["table-9.2: scores and ranks"]
    words = texts(picture)
    assert {"CCRL", "IA", "combined", "expert (0.01)", "novice (1)", "all", "printed", "score"} <= {*words}
    ranks = [
        one["rank"] for gate in ("ccrl", "ia", "combined") for one in those(found.rows, measure="score", gate=gate)
    ]
    labels = [word for word in words if word in ("1", "2", "3", "1-2", "2-3", "1-3")]
    assert labels[-15:] == ranks
    check(found, tmp_path)
    assert "reconstruct" not in "".join(found.notes)  # world I is none


def test_learning_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chapter_9_cells, "BETAS", (0.7, 1.3))
    found = figure_9_4(JOB, {})
    assert (found.summary["cells"], len(found.rows)) == (2, 4)
    assert {"world-1", "world-2", "printed"} <= {*texts(*found.figures.values())}
    assert "tasks/world-2.toml, is reconstructed" in "".join(found.notes)
    check(found, tmp_path)


def test_the_appendix_is_all_worlds_and_views(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def made_up(job: Job, places: Iterable[Any], reading: Any) -> list[dict[str, Any]]:
        asked.extend([*places, reading])
        return [{"measure": "score", "within": True}]

    monkeypatch.setattr(chapter_9, "appendix", made_up)
    found = appendix_v(JOB, {"advisor_table": "exact"})
    assert asked == [*TABLES.values(), {"advisor_table": "exact"}]
    assert (found.summary["cells"], found.summary["within"]) == (1, 1)
    assert "tasks/world-2.toml, is reconstructed" in "".join(found.notes)


def test_readings_are_compared_by_their_agreement(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One of them: for each view and measure the share of the cells of world I that agree."""
    name, job = "success in any episode", replace(JOB, folder=tmp_path)
    monkeypatch.setattr(chapter_9, "READINGS", {name: READINGS[name]})
    found = readings(job, {})
    check(found, tmp_path)
    assert found.summary == {"readings": 1, "cells": 0, "within": 0}  # nothing of this is printed
    assert {one["reading"] for one in found.rows} == {name}
    cells = appendix(job, [TABLES["table-9.2"], TABLES["table-9.3"]], READINGS[name])
    expected = {}
    for view, count in (("full", 73), ("limited", 123)):
        for measure in ("SP_percent", "HS_steps", "score"):
            inside = [one["within"] for one in those(cells, view=view, measure=measure)]
            assert len(inside) == count
            expected[view, measure.split("_")[0]] = proportion_interval(sum(inside), count)
    shares = {(one["view"], one["measure"].split("_")[0]): (one["value"], *one["ci95"]) for one in found.rows}
    assert shares == expected
    assert len({*shares.values()}) > 2
    assert all(one["measure"].endswith("_percent") for one in found.rows)


def test_table_seeds_side_by_side() -> None:
    """The chosen table agrees in 90 %, of the others one in 60 and one in 75; other readings and views do not count."""
    told = {CHOSEN: 90.0, f"{OTHER_SEED}1": 60.0, f"{OTHER_SEED}2": 75.0, "exact advisor table": 10.0}
    rows = [
        {"reading": name, "view": "full", "measure": "SP_agreement_percent", "value": of} for name, of in told.items()
    ]
    rows.append({**rows[1], "view": "limited", "value": 5.0})
    name = "SP agreement in full view"
    assert by_seed(rows) == {name: "90 % with the chosen table, 60 to 75 % with 2 others"}
    assert by_seed(rows[:1]) == {}


def test_every_reading_is_one_of_settings() -> None:
    """The first is what the studies take; the others change it."""
    (first, *others) = READINGS.values()
    assert first == {}
    plain = chapter_9_cells.printed(chapter_9_cells.FILES[0])[0].setting
    changed = [replace(plain, **changes) for changes in others]
    assert len({plain, *changed}) == len(READINGS)


FIGURES = {"9.1", *(f"9.{n}" for n in range(3, 14))}  # 9.2 shows the worlds


def test_the_whole_chapter(tmp_path: Path, one_world: None) -> None:
    found = chapter_9.chapter_9(replace(JOB, folder=tmp_path), {})
    named = {number for caption in found.figures for number in re.findall(r"\b9\.\d+", caption) if "igure" in caption}
    assert named == FIGURES
    assert "table-9.2: scores and ranks" in found.figures
    check(found, tmp_path)
    cells = appendix(replace(JOB, folder=tmp_path), [TABLES["table-9.2"]], {})
    assert found.rows[: len(cells)] == cells
    assert agreement(found.rows).items() <= found.summary.items()
    assert re.fullmatch(r"\d+ of 15 as printed \(\d+\.\d by chance\)", found.summary["table-9.2 ranks"])
    keys = [json.loads(line)["key"] for line in (tmp_path / STORE).read_text(encoding="utf-8").splitlines()]
    assert len(keys) == len({*keys}) > 80  # cells that several need are run once
