"""The comparison of sequencers: what is asked of whom, and what rows say of sessions."""

import json
from math import nan
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from lab.sequencing.methods.exact import optimum
from lab.studies.findings import Findings
from lab.studies.runner import Job
from lab_studies.comparisons import srl_time_compared, srl_time_sessions
from lab_studies.comparisons.srl_time_compared import instances, rows_of, settings_of, srl_time_study
from lab_studies.comparisons.srl_time_sessions import (
    CAPS,
    UNBOUNDED,
    Instance,
    MethodOutcome,
    MethodSetting,
    method_outcome,
    sessions_for,
    single_sequence_methods,
)

THREE = Instance("II", 3)
RSR = Instance(order="RSR", interval_s=100.0)
RULES = ("shortest-move", "longest-remaining-work", "most-urgent-machine", "nearest-ready")


def test_what_is_sequenced() -> None:
    works = instances()
    assert [work.size for work in works] == ["few"] * 6 + ["many"] * 9 + ["order"] * 8
    assert (THREE.cell.parts, RSR.cell.parts) == (3, 3)
    assert optimum(THREE.cell).cost == 700.0  # printed
    assert optimum(RSR.cell).cost == 1205.0


def test_every_rival_is_asked() -> None:
    assert sorted(single_sequence_methods(THREE)) == sorted(("fifo", *RULES, "exact", "cp-sat"))
    assert "cp-sat" not in single_sequence_methods(RSR)  # it does not prove all of them in seconds
    asked = {(one.method, one.reward_factor) for one in settings_of(THREE) if one.episodes is not None}
    learners = {("srl", "B"), ("srl-time", None), (UNBOUNDED, None), ("random", None), ("ga", None)}
    assert asked == learners | {("srl", "A"), ("mc", None)}
    assert {one.episodes for one in settings_of(THREE)} == {None, 5, 15, 30, 60, 200}
    many = settings_of(Instance("I", 30))
    assert {(one.method, one.reward_factor) for one in many if one.episodes is not None} == learners
    assert [one.episodes for one in many if one.method == "srl"] == [200]
    assert {one.episodes for one in settings_of(RSR) if one.method == "mc"} == {50, 200, 1000}


@pytest.mark.parametrize(
    ("setting", "sessions"),
    [
        (MethodSetting(THREE, "srl", 200, "B"), 500),
        (MethodSetting(THREE, "srl-time", 200), CAPS["few"]["srl-time"]),
        (MethodSetting(THREE, "exact"), 1),
        (MethodSetting(Instance("I", 20), "srl", 200, "B"), CAPS["many"]["compiled"]),
        (MethodSetting(Instance("I", 30), "srl", 200, "B"), CAPS["many"]["readable"]),
        (MethodSetting(Instance("I", 30), "random", 200), CAPS["many"]["compiled"]),
        (MethodSetting(RSR, "srl", 200, "B"), CAPS["order"]["compiled"]),
        (MethodSetting(RSR, "ga", 200), 500),
        (MethodSetting(RSR, UNBOUNDED, 200), CAPS["order"][UNBOUNDED]),
    ],
)
def test_what_takes_long_is_tried_less_often(setting: MethodSetting, sessions: int) -> None:
    assert sessions_for(setting, 500) == sessions
    assert sessions_for(setting, 1) == 1


@pytest.mark.parametrize(
    "method", ["srl", "mc", "random", "srl-time", UNBOUNDED, "ga", "fifo", "nearest-ready", "exact", "cp-sat"]
)
def test_what_sessions_come_to(method: str) -> None:
    learns = method in srl_time_sessions.LEARNING
    setting = MethodSetting(THREE, method, 10 if learns else None, "A" if method == "srl" else None)
    found = method_outcome(setting, sessions=3, seed=1)
    assert len(found.gap) == len(found.wall_s) == (3 if learns else 1)
    assert (found.gap >= 0).all()
    assert (found.wall_s > 0).all()
    assert np.isfinite(found.final_gap).all() == (method in ("srl", "mc", "srl-time", UNBOUNDED))
    if method in ("exact", "cp-sat"):
        assert found.gap.tolist() == [0.0]
    again = method_outcome(setting, sessions=3, seed=1)
    assert again.gap.tolist() == found.gap.tolist()


def test_seeds_are_those_of_the_study() -> None:
    gaps = [
        method_outcome(MethodSetting(Instance("II", 10), "random", 5), sessions=4, seed=seed).gap.tolist()
        for seed in (0, 1)
    ]
    assert gaps[0] != gaps[1]
    assert len({*gaps[0]}) > 1


def test_rows_of_a_setting() -> None:
    """Two sessions: one finds the optimum, neither ends with it; gaps of 0 and 10 %, 1 and 3 seconds."""
    found = MethodOutcome(np.array([0.0, 0.1]), np.array([0.2, 0.1]), np.array([1.0, 3.0]))
    rows = rows_of(MethodSetting(THREE, "srl", 30, "B"), found)
    named = {"table": "3 toasts", "case": "II", "toasts": 3, "method": "srl", "reward_factor": "B", "episodes": 30}
    for one in rows:
        assert one.items() >= {**named, "sessions": 2, "thesis": None, "within": None}.items()
    assert {one["measure"]: one["value"] for one in rows} == pytest.approx(
        {"SP_percent": 50.0, "final_SP_percent": 0.0, "gap_percent": 5.0, "wall_s": 2.0}
    )
    assert all(one["ci95"][0] <= one["value"] <= one["ci95"][1] for one in rows)


def test_rows_of_one_sequence_have_no_interval() -> None:
    rows = rows_of(MethodSetting(RSR, "fifo"), MethodOutcome(np.array([0.25]), np.array([nan]), np.array([0.1])))
    assert {one["measure"]: (one["value"], one["ci95"]) for one in rows} == {
        "SP_percent": (0.0, None),
        "gap_percent": (25.0, None),
        "wall_s": (0.1, None),
    }
    assert rows[0].items() >= {"table": "FMS", "order": "RSR", "interval_s": 100.0, "method": "fifo"}.items()
    assert "episodes" not in rows[0]


@pytest.fixture(scope="module")
def found() -> Findings:
    with pytest.MonkeyPatch.context() as patch:
        changes: dict[str, Any] = {
            "CASES": ("II",),
            "FEW": {3: (5, 15), 4: (15,)},
            "MANY": (10,),
            "MANY_EPISODES": (20, 40),
            "ORDERS": ("RSR",),
            "ORDER_EPISODES": (20, 40),
        }
        for name, value in changes.items():
            patch.setattr(srl_time_compared, name, value)
        return srl_time_study(Job(sessions=2, seed=0), {})


def test_the_study_has_every_row(found: Findings) -> None:
    keys = [
        tuple(
            one.get(name) for name in ("table", "case", "interval_s", "method", "reward_factor", "episodes", "measure")
        )
        for one in found.rows
    ]
    assert len({*keys}) == len(keys)
    assert {key[0] for key in keys} == {"3 toasts", "4 toasts", "10 toasts", "FMS"}
    for one in found.rows:
        if one["method"] == "exact" and one["measure"] == "gap_percent":
            assert one["value"] == 0.0
        if one["measure"] == "gap_percent":
            assert one["value"] >= 0.0
    json.dumps(found.rows, allow_nan=False)
    assert found.summary["cells"] == 0
    assert found.summary["srl-time, 3 toasts: least SP in 15 episodes [%]"] == 100.0
    assert "ga, FMS: mean gap in 40 episodes [%]" in found.summary
    proofs = [one["value"] for one in found.rows if (one["method"], one["measure"]) == ("exact", "wall_s")]
    assert found.summary["exact: longest proof [s]"] == pytest.approx(max(proofs), abs=0.006)


def test_pictures_of_the_comparison(found: Findings) -> None:
    assert len(found.figures) == 4
    for caption, picture in found.figures.items():
        text = "".join(ElementTree.fromstring(picture).itertext())
        assert "srl-time" in text, caption
        assert ("FIFO" in text) == ("Sessions" not in caption)
