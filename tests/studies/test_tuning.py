"""Tuning: the same result however it is run, gone on with, paired on seeds that were not seen, and what is refused."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lab
from lab.errors import BadInput
from lab.learning.settings import RANGES, SETTINGS, USUAL, Span
from lab.studies.compared import ComparedSessions
from lab.studies.findings import Findings, those
from lab.studies.runner import STORE, Job
from lab.studies.tuning import FILE, Tuning, costs, settings_text, tuned
from lab.tasks.grid_world import from_rows

WORLD = from_rows("S..\n.#.\n..G", "small", "test")
SHORT = Tuning(WORLD, "moderate", {"episodes": 40}, ("alpha", "beta"), 10)


def rows(found: Findings) -> list[Any]:
    return [found.rows, {key: value for key, value in found.summary.items() if key != "files"}]


def test_every_range_lies_in_what_is_allowed_and_holds_the_default() -> None:
    for name, allowed in RANGES.items():
        default = SETTINGS[name].default
        if isinstance(allowed, Span):
            assert allowed.low <= default <= allowed.high, name
            assert isinstance(allowed.low, int) == isinstance(default, int), name
        else:
            assert not allowed or default in allowed, name
    assert {*USUAL} <= {*RANGES}
    given = {
        "budget",
        "episodes",
        "max_steps",
        "count_start",
        "tilings",
        "start_value",
    }  # of the problem, not of its learner
    assert {*SETTINGS} - {*RANGES} == given


def test_an_unsolved_session_costs_the_limit_as_a_whole() -> None:
    zeros = np.zeros(2)
    solved, five, none = np.array([True, False]), np.full(2, 5.0), np.zeros(2, bool)
    found = ComparedSessions(
        zeros, solved, five, zeros, zeros, zeros, zeros, none, zeros, zeros, zeros, zeros, zeros, False
    )
    assert costs(found, 201).tolist() == [5.0, 201.0]


def test_the_same_with_more_workers_and_when_it_goes_on(tmp_path: Path) -> None:
    pytest.importorskip("optuna")
    whole = tuned(SHORT, Job(9, 0, 1, folder=tmp_path / "whole"))
    assert rows(tuned(SHORT, Job(9, 0, 2))) == rows(whole)
    lines = (tmp_path / "whole" / STORE).read_text().splitlines()
    (tmp_path / "part").mkdir()
    (tmp_path / "part" / STORE).write_text("\n".join(lines[:10]) + "\n" + lines[10][:30])
    again = Job(9, 0, 1, folder=tmp_path / "part")
    assert rows(tuned(SHORT, again)) == rows(whole)
    before = (tmp_path / "part" / STORE).read_bytes()
    tuned(SHORT, again)
    assert (tmp_path / "part" / STORE).read_bytes() == before  # nothing is run twice
    more = tuned(replace(SHORT, trials=11), again)
    assert len(those(more.rows, measure="cost", setting=None)) == 11 + 2


def test_the_gain_is_paired_and_the_settings_are_those_of_a_task_file(tmp_path: Path) -> None:
    pytest.importorskip("optuna")
    found = tuned(SHORT, Job(9, 0, 1, folder=tmp_path))
    own, best = those(found.rows, measure="cost", trial=None)
    (gain,) = those(found.rows, measure="gain")
    assert gain["value"] == pytest.approx(own["value"] - best["value"])
    assert gain["ci95"][0] <= gain["value"] <= gain["ci95"][1]
    written = tomllib.loads((tmp_path / FILE).read_text())
    assert written == {"learner": {"episodes": 40, **{name: found.summary[name] for name in ("alpha", "beta")}}}
    assert {"Cost of each trial, and the best so far"} <= {*found.figures}


def test_a_sub_task_has_its_own_tables() -> None:
    told = settings_text(Tuning("insert", held={"gate": "ia"}, over=["psi"]), {"psi": 0.25})
    assert tomllib.loads(told) == {"subtasks": {"insert": {"gate": {"gate": "ia", "psi": 0.25}}}}


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"over": ["alfa"]}, r"unknown setting to tune 'alfa' \(--over\): did you mean 'alpha'"),
        ({"over": ["alpha", "alpha"]}, "named twice"),
        ({"over": ["gate"], "gate": "ia"}, "held at a value"),
        ({"over": []}, "wanted one or more"),
        ({"trials": 0}, r"trials 0 \(.*at least 1"),
        ({"advisor": "exprt"}, "unknown advisor 'exprt'"),
        ({"alpha": 2.0, "over": ["beta"]}, "LearnerSettings.alpha = 2.0"),
    ],
)
def test_what_cannot_be_tuned(wrong: dict[str, Any], why: str) -> None:
    with pytest.raises(BadInput, match=why):
        lab.tune(WORLD, **wrong)
