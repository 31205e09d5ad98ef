"""Whom CCRL rejects: on a corridor, and the rows of a setting."""

from dataclasses import replace

import numpy as np
import pytest

from lab.learning.batch import run_sessions
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import TableAdvisor
from lab.learning.splitmix import stream
from lab.mdp import grid
from lab_studies.comparisons.rejection import Ended, Setting, advice_of, ended, endings_of, in_short, rows_of

CORRIDOR = grid((1, 6), np.zeros((1, 6), bool), (0, 0), (0, 5))
LEARNER = LearnerSettings("q", episodes=40, max_steps=50)
GATE = GateSettings(lambda_threshold=1.0, first_episode=10, budget=400, by_evidence=True)


@pytest.mark.parametrize(("advisor", "by_evidence"), [("expert", True), ("wrong", True), ("wrong", False)])
def test_how_advice_ends(advisor: str, by_evidence: bool) -> None:
    """One or two failed episodes of 50 steps are evidence enough; eight misleads are not to be had for 400 - 1 steps."""
    draw = stream(0)
    who, gate = TableAdvisor(advice_of(CORRIDOR, 0.99, advisor), draw), replace(GATE, by_evidence=by_evidence)
    found = ended(Session(CORRIDOR, LEARNER, gate, who, draw), gate.budget)
    assert found.rejected == (advisor == "wrong" and by_evidence)
    assert found.spent == (advisor == "wrong" and not by_evidence)
    assert not found.rejected or found.helped in (50, 100)


@pytest.mark.parametrize("by_evidence", [True, False])
@pytest.mark.parametrize("advisor", ["expert", "novice", "wrong"])
@pytest.mark.parametrize("budget", [60, 10**9])
def test_a_whole_session_says_how_its_advice_ended(advisor: str, by_evidence: bool, budget: int) -> None:
    """The study runs compiled sessions to their end; a session that stops there has the same figures."""
    gate, seeds = replace(GATE, by_evidence=by_evidence, budget=budget), np.arange(8, dtype=np.uint64)
    advice = advice_of(CORRIDOR, 0.99, advisor)
    stopped = []
    for draw in map(stream, seeds.tolist()):
        stopped.append(ended(Session(CORRIDOR, LEARNER, gate, TableAdvisor(advice, draw), draw), budget))
    assert endings_of(run_sessions(CORRIDOR, LEARNER, gate, advice, seeds), budget) == stopped


def test_the_rows_of_a_setting() -> None:
    setting = Setting("place", "q", "wrong", "evidence")
    rows = rows_of(setting, [Ended(True, False, 200), Ended(False, True, 500)])
    assert {row["measure"]: row["value"] for row in rows} == {
        "rejected_percent": 50.0,
        "budget_spent_percent": 50.0,
        "helped_steps": 350.0,
    }
    assert in_short(rows) == {"evidence, place, wrong: rejected [%]": "50.0 to 50.0"}
