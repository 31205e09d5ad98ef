"""The studies of chapter 7: each gives rows, a summary, pictures and remarks that can be written and read back."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from lab.statistics import compare
from lab.studies.findings import JUDGED, Findings, agreement, row, those
from lab.studies.report import write_report, write_rows
from lab.studies.runner import Job
from lab_studies.thesis import chapter_7
from lab_studies.thesis import chapter_7_figures as figures
from lab_studies.thesis.chapter_7 import (
    best_results,
    deviation,
    readings,
    summary,
    table_iv_1,
    table_iv_2,
)
from lab_studies.thesis.chapter_7_cells import (
    DECAY_FACTORS,
    READINGS,
    SESSION_LENGTHS,
    Measured,
    PrintedFigure,
    SequencingSetting,
    printed,
    short_name,
)

JOB = Job(sessions=10)
LENGTHS, CELLS = 4, 4 * 4 * 3 * 2  # of sessions in some_printed, and its cells: methods, cases and environments


def some_printed(file: str) -> tuple[PrintedFigure, ...]:
    """The shortest and the longest sessions only, by number of toasts; all of table IV.1."""
    return tuple(
        cell
        for cell in printed(file)
        if file == DECAY_FACTORS or cell.setting.episodes in {3: (15, 60), 4: (50, 400)}[cell.setting.toasts]
    )


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """The printed tables are shorter here."""
    monkeypatch.setattr(chapter_7, "printed", some_printed)


def check(found: Findings, folder: Path) -> None:
    """What `lab study run` does with findings: JSON, a CSV file that reads the same, a page, SVG pictures."""
    json.dumps([found.rows, found.summary], allow_nan=False)
    write_rows(folder / "rows.csv", found.rows)
    assert len((folder / "rows.csv").read_text(encoding="utf-8").splitlines()) == len(found.rows) + 1
    write_report(folder / "report.html", "title", "name", found)
    for picture in found.figures.values():
        assert ElementTree.fromstring(picture).tag.endswith("svg")
    assert all(found.notes)


def printed_rows(found: Findings) -> list[dict[str, Any]]:
    return [one for one in found.rows if one["thesis"] is not None]


# ---- the tables ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("case", "table"), [("I", "Table 7.4"), ("II", "Table 7.5"), ("III", "Table 7.6")])
def test_a_table_of_three_methods(tmp_path: Path, case: str, table: str) -> None:
    found = best_results(JOB, {}, case)
    check(found, tmp_path)
    cells = printed_rows(found)
    assert len(cells) == 3 * LENGTHS * 2 == found.summary["cells"]
    assert {(one["table"], one["case"], one["reading"]) for one in cells} == {(table, case, "listing")}
    names = {" ".join(filter(None, (one["method"], one.get("reward_factor")))) for one in cells}
    assert names == {"srl B", "mc", "random"}
    tests = [one for one in found.rows if one["table"] == f"{table}: tests"]
    assert len(cells) + len(tests) == len(found.rows)
    assert [one["measure"] for one in tests] == ["ANOVA_p", "Tukey_p", "Tukey_p", "Tukey_p"] * 8
    assert len(found.figures) == 4
    for picture in found.figures.values():
        assert {"SRL, type B", "Monte Carlo", "random search", "printed"} <= {*_texts(picture)}
    assert any("Levene's test finds unequal variances in" in note for note in found.notes)


def test_the_example_of_appendix_ii() -> None:
    """Case I, 30 episodes, 1000 sessions as in the thesis: Monte Carlo is worst, and F varies that much between seeds."""
    wanted = [
        SequencingSetting("I", 3, "srl", 30, reward_factor="B", beta=1.0),
        SequencingSetting("I", 3, "mc", 30, beta=1.0),
    ]
    test = Measured(Job(1000), [*wanted, SequencingSetting("I", 3, "random", 30)])
    found = test.compared([*test.outcomes])
    assert 30 < found.f < 300  # 93.8 printed
    assert found.ranks["srl B"] == "1" < found.ranks["mc"] == max(found.ranks.values())
    same = SequencingSetting("I", 3, "", 30)
    (note,) = chapter_7.examples(
        {same: found, SequencingSetting("I", 3, "", 35): found, SequencingSetting("I", 4, "", 30): found}
    )
    assert f"here F = {found.f:.1f}, srl B {found.means['srl B']:.1f} %, mc" in note


def _texts(picture: bytes) -> Iterator[str]:
    return (text.strip() for text in ElementTree.fromstring(picture).itertext())


def test_ranks_and_shades_are_those_of_the_tests() -> None:
    """Shaded is what is significantly better than another method, and than which none is."""
    job = Job(sessions=60)
    found = best_results(job, {}, "I")
    cells = [c for c in some_printed(SESSION_LENGTHS) if c.setting.case == "I"]
    settings = [c.setting for c in cells if c.setting.reward_factor != "A"]
    measured = Measured(job, settings)
    shaded = set()
    for environment, toasts, episodes in {(s.environment, s.toasts, s.episodes) for s in settings}:
        group = [s for s in settings if (s.environment, s.toasts, s.episodes) == (environment, toasts, episodes)]
        values = {short_name(setting): measured.replicated(setting) for setting in group}
        expected = compare(values, lowest_is_best=environment == "stochastic")
        rows = those(found.rows, environment=environment, toasts=toasts, episodes=episodes)
        ranked = {
            " ".join(filter(None, (one["method"], one.get("reward_factor")))): one for one in rows if "rank" in one
        }
        assert {name: one["rank"] for name, one in ranked.items()} == expected.ranks
        sign = 1 if environment == "stochastic" else -1
        differ = [pair for pair, p in expected.tukey.items() if p < 0.05] if expected.p < 0.05 else []
        pairs = [sorted(pair, key=lambda name: sign * expected.means[name]) for pair in differ]
        best = {better for better, _ in pairs} - {worse for _, worse in pairs}
        assert {name for name, one in ranked.items() if one["shaded"]} == best
        shaded |= {one["shaded"] for one in ranked.values()}
        p = {one["method"]: one["value"] for one in rows if one["measure"] == "Tukey_p"}
        assert p == {f"{one} - {other}": value for (one, other), value in expected.tukey.items()}
    assert shaded == {True, False}


def test_beta(tmp_path: Path) -> None:
    """Printed are SP and CE of what type A gives; type B stands beside, and the sessions that end optimal."""
    found = table_iv_1(Job(sessions=40), {})
    check(found, tmp_path)
    cells = printed_rows(found)
    assert [(one["case"], one["beta"], one["measure"], one["reward_factor"]) for one in cells] == [
        (case, beta, measure, "A")
        for case in ("I", "II", "III")
        for beta in (1.0, 1.2, 1.5, 1.7)
        for measure in ("SP_percent", "CE_episode")
    ]
    assert {one["measure"] for one in found.rows} == {"SP_percent", "CE_episode", "final_percent"}
    assert len(found.rows) == 3 * len(cells)
    for case in ("I", "II", "III"):
        ends = {one["beta"]: one["value"] for one in those(cells, case=case, measure="CE_episode")}
        assert ends[1.0] > ends[1.7] + 30
    both = [one for one in found.rows if one["reward_factor"] == "B" and one["measure"] == "SP_percent"]
    assert min(one["value"] for one in both) > 90
    assert {"case I", "case III", "printed"} <= {*_texts(*found.figures.values())}


def test_reward_factors(tmp_path: Path) -> None:
    found = table_iv_2(JOB, {})
    check(found, tmp_path)
    cells = printed_rows(found)
    assert len(cells) == CELLS // 2
    assert {one["reward_factor"] for one in cells} == {"A", "B"}
    assert [*found.figures] == [*figures.OF_FACTORS]
    assert {one["method"] for one in found.rows if one["measure"] == "Tukey_p"} == {"srl B - srl A"}


def test_another_reading_changes_all_settings() -> None:
    found = table_iv_2(JOB, {"reading": "no phantoms"})
    assert {one["reading"] for one in found.rows} == {"no phantoms"}
    assert [one["value"] for one in found.rows] != [one["value"] for one in table_iv_2(JOB, {}).rows]


# ---- the chapter --------------------------------------------------------------------------------------------------


def test_the_whole_chapter(tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    found = chapter_7.chapter_7(Job(sessions=10, progress=lambda *both: told.append(both)), {})
    check(found, tmp_path)
    assert told[-1] == (CELLS + 24, CELLS + 24)  # each setting once; 24: table IV.1 with both reward factors
    numbers = {number for caption in found.figures for number in re.findall(r"\b7\.\d+", caption)}
    assert numbers == {f"7.{n}" for n in range(3, 13)}
    cells = printed_rows(found)
    assert len(cells) == CELLS + 24 == found.summary["cells"]
    named = [json.dumps({name: one[name] for name in one if name not in _RESULTS}, sort_keys=True) for one in cells]
    pairs = {(name, one["measure"]) for name, one in zip(named, cells, strict=True)}
    assert len(pairs) == len(cells)
    values = {(_key(one), one["measure"]): one["value"] for one in cells}
    for one in printed_rows(best_results(JOB, {}, "III")):
        assert values[_key(one), one["measure"]] == one["value"]


_RESULTS = ("measure", "value", "ci95", "thesis", *JUDGED, "rank", "shaded", "table")


def _key(one: dict[str, Any]) -> str:
    return json.dumps({name: one[name] for name in one if name not in _RESULTS}, sort_keys=True)


def test_readings_are_compared_by_their_distance(tmp_path: Path) -> None:
    """Without phantoms SRL is far from print, with them near; another reading of Monte Carlo does not touch SRL."""
    found = readings(Job(sessions=100), {})
    check(found, tmp_path)
    assert found.summary["readings"] == len(READINGS) == len({one["reading"] for one in found.rows})
    assert len(found.rows) == len(READINGS) * 2 * 4 * 2
    off = {
        (one["reading"], one["toasts"], one["method"], one.get("reward_factor")): one["value"]
        for one in found.rows
        if one["measure"] == "off_points"
    }
    for toasts in (3, 4):
        assert off["no phantoms", toasts, "srl", "B"] > 30
        assert off["listing", toasts, "srl", "B"] < 8
    assert all(one["ci95"] is None and one["thesis"] is None for one in found.rows)
    assert len(found.figures) == 2


# ---- how far off ----------------------------------------------------------------------------------------------------


def made_up(value: float, ends: tuple[float, float], thesis: float, **more: Any) -> dict[str, Any]:
    return row({"table": "Table 7.4", "toasts": 3, **more}, "SP_percent", value, ends, thesis)


def test_distances_by_hand() -> None:
    """Off by 3 and 1. Intervals of 1.96 either side: a standard error of 1, with as many sessions in the thesis sqrt(2)."""
    rows = [made_up(50, (48.04, 51.96), 53), made_up(60, (58.04, 61.96), 59)]
    assert deviation(rows, 1000) == pytest.approx((2, np.sqrt(2 / np.pi) * np.sqrt(2)))
    four = [{**one, "toasts": 4} for one in rows]  # 300 sessions in the thesis
    assert deviation(four, 900) == pytest.approx((2, np.sqrt(2 / np.pi) * 2))
    decay = [{**one, "table": "Table IV.1"} for one in rows]  # 100 sessions
    assert deviation(decay, 300) == pytest.approx((2, np.sqrt(2 / np.pi) * 2))


def test_a_summary_by_hand() -> None:
    rows = [made_up(50, (48.04, 51.96), 53), made_up(60, (58.04, 61.96), 89), made_up(60, (58.04, 61.96), 59, toasts=4)]
    nothing_printed = row({"table": "Table 7.4: tests", "toasts": 3}, "ANOVA_p", 0.5, None, None)
    found = summary([*rows, nothing_printed], 1000)
    assert found.items() >= agreement(rows).items()
    assert (found["cells"], found["within"]) == (3, 2)
    assert found["Table 7.4, 3 toasts: SP_percent"] == "off by 16.0 (1.1 by chance)"
    assert found["Table 7.4, 4 toasts: SP_percent"] == "off by 1.0 (1.7 by chance)"
