"""The study of linear values: its cells, its rows by hand, and one small run."""

from pathlib import Path

import pytest

from lab.studies.findings import those
from lab.studies.runner import Job
from lab.tasks.sequencing import read_policy
from lab_studies.comparisons import srl_linear as study
from lab_studies.comparisons.carried_over_families import FMS, SHOP, TOAST
from lab_studies.comparisons.srl_linear import (
    AT_ONCE,
    SIZES,
    CellOutcome,
    DrawnCell,
    Tried,
    drawn_cell,
    rows_of,
    srl_linear_study,
)


def test_cells_are_drawn_by_the_seed_and_have_their_size() -> None:
    for family in (TOAST, FMS, SHOP):
        one, again, other, later = (
            drawn_cell(DrawnCell(family, 5, number), seed) for number, seed in ((0, 1), (0, 1), (1, 1), (0, 2))
        )
        assert {cell.parts for cell in (one, again, other, later)} == {5}
        assert repr(one) == repr(again)
        assert len({repr(cell) for cell in (one, other, later)}) == 3


def test_rows_by_hand() -> None:
    """Two cells; the best order known is the proven optimum of 100 s, and one of 200 s that a method found alone."""
    own = {name: Tried(150.0, None, 1.0) for name in AT_ONCE} | {"srl": Tried(120.0, 130.0, 2.0)}
    first = CellOutcome(100.0, True, own | {"srl-linear": Tried(100.0, 110.0, 1.0)})
    second = CellOutcome(
        210.0, False, {name: Tried(300.0, 300.0, 4.0) for name in own} | {"srl-linear": Tried(200, 220, 3.0)}
    )
    rows = rows_of([first, second], TOAST, 3)
    values = {
        (one["method"], one["measure"]): one["value"]
        for one in rows
        if one["method"] in ("srl", "srl-linear", "best rule")
    }
    assert values["srl-linear", "mean gap_percent"] == 0.0
    assert values["srl-linear", "greedy gap_percent"] == pytest.approx(10.0)
    assert values["srl-linear", "best known_percent"] == 100.0
    assert values["srl-linear", "seconds"] == 2.0
    assert values["srl", "mean gap_percent"] == pytest.approx((20 + 50) / 2)
    assert values["srl-linear", "less than srl_percent"] == pytest.approx((20 + 50) / 2)
    assert values["best rule", "mean gap_percent"] == pytest.approx(50.0)
    assert {one["proven"] for one in rows} == {1}


def test_a_small_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("SIZES", {TOAST: (3,)}), ("SCHEDULES", 15), ("PRACTICE", 2), ("LESSONS", 24)):
        monkeypatch.setattr(study, name, value)
    study.family_policy.cache_clear()
    assert SIZES != study.SIZES
    findings = srl_linear_study(Job(sessions=2, seed=3, folder=tmp_path), {})
    study.family_policy.cache_clear()
    gaps = those(findings.rows, measure="mean gap_percent")
    assert {one["method"] for one in gaps} >= {
        "srl",
        "mc",
        "random",
        "srl-linear",
        study.KEPT,
        study.BEGUN,
        "best rule",
    }
    assert all(one["value"] >= 0.0 and one["proven"] == 2 for one in gaps)
    assert read_policy(tmp_path / "policy-toast-cells.json").learned_on == ""
    assert [picture[:5] for picture in findings.figures.values()] == [b"<?xml"]
