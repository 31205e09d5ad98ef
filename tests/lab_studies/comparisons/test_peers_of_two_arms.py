"""The study of two arms: which skills count, what is saved, and that it runs."""

import numpy as np
import pytest

from lab.studies.findings import those
from lab.studies.runner import Job
from lab_studies.comparisons import peers_of_two_arms as study
from lab_studies.comparisons.peers import ALONE, TOGETHER
from lab_studies.comparisons.peers_of_two_arms import COMPANIES, Outcome, Setting, rows_of


def test_each_pair_of_problems_counts_once() -> None:
    skills = study.skills()
    assert {"grasp at plate", "grasp at butter_buffer", "insert at toaster"} <= {*skills}
    assert "grasp at toaster" not in skills  # the same problem as at the plate, for both arms
    assert study.arms() == ["up6", "panda"]


def test_what_is_saved_is_paired_and_a_mean_over_skills() -> None:
    def values(first: float, second: float) -> np.ndarray:
        """Two sessions of two arms, the second session and the second arm 10 higher each."""
        one = np.array([first, second, 100.0, 0.0])
        return np.array([[one, one + 10.0], [one + 10.0, one + 20.0]])

    both = {Setting("a", ALONE): values(30.0, 40.0), Setting("b", ALONE): values(50.0, 60.0)}
    both |= {Setting("a", TOGETHER): values(20.0, 40.0), Setting("b", TOGETHER): values(30.0, 60.0)}
    rows = rows_of("both", ["a", "b"], TOGETHER, both)
    goal = {row["arm"]: row["value"] for row in those(rows, measure="goal_episodes")}
    saved = {row["arm"]: (row["value"], row["ci95"]) for row in those(rows, measure="saved_goal_episodes")}
    assert goal == {"up6": 30.0, "panda": 40.0}
    assert saved == {"up6": (15.0, [15.0, 15.0]), "panda": (15.0, [15.0, 15.0])}
    assert not those(rows_of("both", ["a", "b"], ALONE, both), measure="saved_goal_episodes")


def test_it_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "skills", lambda: {"insert at toaster": "insert"})
    findings = study.peers_of_two_arms(Job(sessions=2), {})
    assert {row["company"] for row in findings.rows} == {*COMPANIES}
    assert len(those(findings.rows, company=TOGETHER)) == 2 * 2 * (len(Outcome._fields) + len(study.SAVED))
    assert {row["value"] for row in those(findings.rows, company=ALONE, measure="helped_steps")} == {0.0}
    assert any(name.endswith("saved goal_episodes above 0") for name in findings.summary)
