"""The study of teachers in Mountain Car: the rules by hand, what is counted, and its rows."""

from pathlib import Path

import numpy as np
import pytest

from lab.studies import carried_out, checked
from lab.studies.runner import Job
from lab_studies.comparisons import mountain_car as study
from lab_studies.comparisons import tiles_speed as speeds
from lab_studies.comparisons.mountain_car import RULES, STUDENTS, TEACHERS, Outcome, Setting, episodes_to_solve, rows_of

#                 values, own, last here, span       early, importance, correcting, predictive
CASES = [
    (((-5.0, -4.0, -2.0), 0, None, 2.0), (True, True, True, True)),  # a wide span, and a mistake, where it never was
    (((-5.0, -4.0, -2.0), 0, 2, 2.0), (True, True, True, False)),  # it did right here before: no mistake is expected
    (((-5.0, -4.0, -2.0), 2, 1, 2.0), (True, True, False, True)),  # it announces the right move, and did another before
    (((-5.0, -4.0, -2.0), 0, None, 3.5), (True, False, False, False)),  # the moves lie too close together
]


@pytest.mark.parametrize(("given", "speak"), CASES)
def test_when_each_teacher_speaks(
    given: tuple[tuple[float, ...], int, int | None, float], speak: tuple[bool, ...]
) -> None:
    assert tuple(rule(*given) for rule in TEACHERS.values()) == speak


def test_solved_by_the_last_hundred_episodes() -> None:
    steps = np.full(300, 201)
    assert episodes_to_solve(steps) == 300
    steps[150:] = 100  # ten of 201 and ninety of 100 make 110.1: nine are few enough
    assert episodes_to_solve(steps) == 150 + 91
    assert episodes_to_solve(np.full(300, 110)) == 100


def test_what_a_rule_saves() -> None:
    two = {
        Setting("sober", rule): Outcome(np.full((2, 300), steps), np.array([0, 4]), np.array([True, False]))
        for rule, steps in (("nobody", 120), ("early", 110))
    }
    rows = rows_of(Setting("sober", "early"), two[Setting("sober", "early")], two)
    found = {one["measure"]: one["value"] for one in rows}
    assert found == {
        "mean_steps": 110.0,
        "first_100": 110.0,
        "episodes_to_solve": 100.0,
        "solved_percent": 50.0,
        "helped_steps": 2.0,
        "saved_steps": 10.0,
    }


@pytest.mark.slow
def test_the_study_has_all_rules_and_says_what_differs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "EPISODES", 10)
    job = Job(sessions=2)
    document = carried_out(checked("mountain-car", job, {}), "mountain-car", job, tmp_path)
    assert {(one["student"], one["rule"]) for one in document["rows"]} == {(s, r) for s in STUDENTS for r in RULES}
    helped = {
        (one["student"], one["rule"]): one["value"] for one in document["rows"] if one["measure"] == "helped_steps"
    }
    assert helped["sober", "nobody"] == 0.0
    assert 900.0 < helped["sober", "early"] <= 1000.0  # ten ways of its teacher
    assert any("Torrey and Taylor" in note for note in document["notes"])


@pytest.mark.slow
def test_speeds_are_of_all_ways_to_make_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speeds, "EPISODES", 20)
    monkeypatch.setattr(speeds, "READABLE_EPISODES", 2)
    found = speeds.tiles_speed(Job(sessions=2), {})
    rates = {one["name"]: one["value"] for one in found.rows}
    assert list(rates) == ["kernel", "session", "session through gymnasium", "gymnasium alone"]
    assert rates["kernel"] > 3 * max(rate for name, rate in rates.items() if name != "kernel")
