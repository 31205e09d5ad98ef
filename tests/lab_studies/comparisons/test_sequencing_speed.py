"""The speed of the sequencers: what is measured, and what is said of it; how fast they are is not judged here."""

import json
from math import inf

import pytest

from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.rules import first_come
from lab.sequencing.simulate.follow import simulate
from lab.studies.findings import those
from lab.studies.runner import Job
from lab_studies.comparisons import sequencing_speed as speed_study
from lab_studies.comparisons.sequencing_speed import RATE, SECONDS, sequencing_speed
from lab_studies.thesis.chapter_7_cells import robot_cell


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
    """In a millionth of a second CP-SAT has what it began with."""
    monkeypatch.setattr(speed_study, "CP_SAT_LIMIT_S", 1e-6)
    cell = robot_cell("I", speed_study.MANY)
    first = simulate(cell, first_come(cell)).makespan_s
    (one,) = those(speed_study.solved_rows("I", 0), measure="gap_percent")
    assert one["value"] == pytest.approx(100.0 * optimum(cell).gap(first))
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
