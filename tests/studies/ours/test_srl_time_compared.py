"""The comparison of sequencers: what is asked of whom, what rows say of sessions, and the speed study beside it."""

import json
from math import inf, nan
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from lab.sequencing.methods.exact import optimum
from lab.studies.findings import Findings
from lab.studies.ours import sequencing_speed as speed_study
from lab.studies.ours import srl_time_compared, srl_time_sessions
from lab.studies.ours.sequencing_speed import RATE, SECONDS, sequencing_speed
from lab.studies.ours.srl_time_compared import rows_of, settings_of, srl_time_study, works_of
from lab.studies.ours.srl_time_sessions import CAPS, Instance, MethodOutcome, MethodSetting, sessions_for, single, tried
from lab.studies.runner import Job
from lab.studies.thesis.chapter_7_cells import robot_cell

THREE = Instance("II", 3)
RSR = Instance(order="RSR", interval_s=100.0)
RULES = ("shortest-move", "longest-remaining-work", "most-urgent-machine", "nearest-ready")


def test_what_is_sequenced() -> None:
    works = works_of()
    assert [work.size for work in works] == ["few"] * 6 + ["many"] * 9 + ["order"] * 8
    assert (THREE.cell.parts, RSR.cell.parts) == (3, 3)
    assert optimum(THREE.cell).cost == 700.0  # printed
    assert optimum(RSR.cell).cost == 1205.0


def test_every_rival_is_asked() -> None:
    assert sorted(single(THREE)) == sorted(("fifo", *RULES, "exact", "cp-sat"))
    assert "cp-sat" not in single(RSR)  # it does not prove all of them in seconds
    asked = {(one.method, one.reward_factor) for one in settings_of(THREE) if one.episodes is not None}
    learners = {("srl", "B"), ("srl-time", None), ("random", None), ("ga", None)}
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
        (MethodSetting(RSR, "ga", 200), CAPS["order"]["ga"]),
    ],
)
def test_what_takes_long_is_tried_less_often(setting: MethodSetting, sessions: int) -> None:
    assert sessions_for(setting, 500) == sessions
    assert sessions_for(setting, 1) == 1


@pytest.mark.parametrize(
    "method", ["srl", "mc", "random", "srl-time", "ga", "fifo", "nearest-ready", "exact", "cp-sat"]
)
def test_what_sessions_come_to(method: str) -> None:
    learns = method in srl_time_sessions.LEARNING
    setting = MethodSetting(THREE, method, 10 if learns else None, "A" if method == "srl" else None)
    found = tried(setting, sessions=3, seed=1)
    assert len(found.gap) == len(found.wall_s) == (3 if learns else 1)
    assert (found.gap >= 0).all()
    assert (found.wall_s > 0).all()
    assert np.isfinite(found.final_gap).all() == (method in ("srl", "mc", "srl-time"))
    if method in ("exact", "cp-sat"):
        assert found.gap.tolist() == [0.0]
    again = tried(setting, sessions=3, seed=1)
    assert again.gap.tolist() == found.gap.tolist()


def test_seeds_are_those_of_the_study() -> None:
    gaps = [
        tried(MethodSetting(Instance("II", 10), "random", 5), sessions=4, seed=seed).gap.tolist() for seed in (0, 1)
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


def test_the_cells_have_room_for_a_hundred() -> None:
    for case in speed_study.CASES:
        assert robot_cell(case, 100).parts == 100
    assert optimum(robot_cell("III", 3)).cost == 995.0  # printed


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Jobs that are done at once; what is measured is real."""
    changes = {
        "CASES": ("I", "II"),
        "EPISODES": 20,
        "TOASTS": 3,
        "PROVEN": (3,),
        "MANY": 8,
        "MANY_EPISODES": 40,
        "CP_SAT_LIMIT_S": 1.0,
        "REPEATS": 2,
    }
    for name, value in changes.items():
        monkeypatch.setattr(speed_study, name, value)


@pytest.mark.usefixtures("small")
def test_speeds_are_measured_in_one_run() -> None:
    told: list[tuple[int, int]] = []
    found = sequencing_speed(Job(sessions=10, progress=lambda *both: told.append(both)), {})
    rates = [one for one in found.rows if one["measure"] == RATE]
    assert [one["name"] for one in rates] == ["srl, compiled", "random, compiled", "srl, readable"]
    for one in found.rows:
        assert one["value"] >= 0
        assert (one["thesis"], one["within"]) == (None, None)
        if one["ci95"] is not None:
            assert one["ci95"][0] <= one["value"] <= one["ci95"][1]
    assert [one["case"] for one in found.rows if one["name"] == "exact"] == ["I", "II"]
    assert [one["value"] for one in found.rows if one["measure"] == "near_percent"] == [100.0, 100.0]
    ratio = found.summary["compiled to readable SRL"]
    assert ratio == pytest.approx(rates[0]["value"] / rates[2]["value"], abs=0.06)
    assert told == [(n, 9) for n in range(10)]
    json.dumps(found.rows, allow_nan=False)


@pytest.mark.usefixtures("small")
def test_what_was_not_reached_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed_study, "CP_SAT_LIMIT_S", 1e-6)
    found = sequencing_speed(Job(sessions=10), {})
    missed = [f"CP-SAT found no sequence for 8 toasts in case {case} within 1e-06 s." for case in ("I", "II")]
    assert [*found.notes[-2:]] == missed
    assert "cp-sat" not in {one["name"] for one in found.rows}
    rows = speed_study.rows_of_near("I", [0.5, inf])
    assert [(one["measure"], one["value"]) for one in rows] == [("near_percent", 50.0)]
    rows = speed_study.rows_of_near("I", [0.5, 0.7, 0.1])
    assert [(one["measure"], one["value"], one["ci95"]) for one in rows] == [
        ("near_percent", 100.0, None),
        (SECONDS, 0.5, [0.1, 0.7]),
    ]


def test_ratios_are_of_what_was_measured() -> None:
    """SRL 40 times as fast compiled; CP-SAT was not near after 10 s where srl-time took .5 s, in case II it was."""
    rates = [{"value": value} for value in (80.0, 120.0, 2.0)]
    learned = [{"case": case, "measure": SECONDS, "value": 0.5} for case in ("I", "II", "III")]
    solved = [
        {"case": case, "measure": measure, "value": value}
        for case, gap in (("I", 12.0), ("II", 0.5))
        for measure, value in (("gap_percent", gap), (SECONDS, 10.0))
    ]
    assert speed_study.ratios(rates, learned, solved) == {
        "compiled to readable SRL": 40.0,
        "random search to SRL, both compiled": 1.5,
        "CP-SAT's seconds to srl-time's, case I, at least": 20,
        "CP-SAT's seconds to srl-time's, case II, at least": None,
        "CP-SAT's seconds to srl-time's, case III, at least": None,
    }
