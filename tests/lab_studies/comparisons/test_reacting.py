"""The study of policies that react: what a setting comes to, and its rows."""

import numpy as np
import pytest

from lab.studies.findings import those
from lab.studies.runner import Job
from lab_studies.comparisons import reacting as study
from lab_studies.comparisons.reacting import (
    ANEW,
    HINDSIGHT,
    LIST,
    ROLLING,
    RULE,
    Setting,
    SettingOutcome,
    reacting,
    rows_of,
    setting_outcome,
)

SETTING = Setting("toast-case-1", "TT", "exponential times")


def test_nothing_beats_hindsight() -> None:
    found = setting_outcome(SETTING, 5, 0)
    assert found.proven == 5
    for name in (LIST, RULE, ANEW, ROLLING):
        assert (found.costs[name] >= found.costs[HINDSIGHT] - 1e-6).all(), name


def test_rows() -> None:
    costs = {LIST: [110.0, 130.0], RULE: [120.0, 120.0], ANEW: [105.0, 125.0], ROLLING: [100.0, 120.0]}
    found = SettingOutcome(
        {**{n: np.array(c) for n, c in costs.items()}, HINDSIGHT: np.array([100.0, 100.0])}, "fifo", 0.01, 2
    )
    rows = rows_of(SETTING, found)
    assert [one["value"] for one in those(rows, measure="makespan_s")] == [120.0, 120.0, 115.0, 110.0, 100.0]
    assert [one["value"] for one in those(rows, measure="saved over the list_s")] == [0.0, 5.0, 10.0]
    assert those(rows, measure="over hindsight_percent", method=ROLLING)[0]["value"] == pytest.approx(10.0)
    assert {one.get("rule") for one in rows} == {None, "fifo"}


def test_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "WORKS", (("toast-case-1", "TT"),))
    monkeypatch.setattr(study, "TROUBLES", {"times 10 % off": study.TROUBLES["times 10 % off"]})
    found = reacting(Job(3), {})
    assert len(found.figures) == 1
    alike = "mean over hindsight, one robot that never breaks down [%]"
    assert {f"{name}: {alike}" for name in (LIST, RULE, ANEW, ROLLING)} < set(found.summary)


def test_several_robots_that_break_down() -> None:
    """Nothing rolls there, hindsight is a bound, and what is planned anew saves over the list."""
    found = setting_outcome(Setting("two-carriers", "BBB", study.ROBOTS), 3, 0)
    assert (set(found.costs), found.proven, found.decision_s) == ({LIST, RULE, ANEW, HINDSIGHT}, 0, None)
    assert all((costs >= found.costs[HINDSIGHT] - 1e-6).all() for costs in found.costs.values())
    assert found.costs[ANEW].mean() <= found.costs[LIST].mean()
    assert {one["method"] for one in rows_of(Setting("two-carriers", "BBB", study.ROBOTS), found)} == set(found.costs)
