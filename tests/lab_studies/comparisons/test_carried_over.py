"""The study of policies that carry over: what it measures by hand, what it keeps, and the policies that it leaves."""

from pathlib import Path

import pytest

from lab.sequencing.methods.carried_over import Decider
from lab.sequencing.methods.carried_over_policy import CarriedPolicy
from lab.studies.findings import those
from lab.studies.runner import STORE, Job
from lab.tasks.sequencing import read_policy
from lab_studies.comparisons import carried_over as study
from lab_studies.comparisons.carried_over import (
    ALL,
    CARRIED,
    Survey,
    carried_over,
    decisions_per_s,
    rows_of,
    survey_record,
)
from lab_studies.comparisons.carried_over_families import (
    BILGE_ULUSOY,
    SHOP,
    SMALL,
    THESIS_TOASTS,
    TOAST,
    LargerCell,
    larger_cell,
)
from lab_studies.comparisons.carried_over_learning import CarriedLearning

EX11, TWENTY = LargerCell(SHOP, BILGE_ULUSOY, 0, 96.0), LargerCell(TOAST, THESIS_TOASTS, 0)
SOONEST = CarriedPolicy({"delay": -1.0})


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "SETTINGS", CarriedLearning(8, 6, 4))
    monkeypatch.setattr(study, "REPEATS", 1)
    monkeypatch.setattr(study, "larger_cells", lambda: (EX11, TWENTY))


def test_a_larger_cell_is_surveyed() -> None:
    """EX11's best value is printed; of 20 toasts the optimum is proven."""
    printed, toasts = Survey(**survey_record(EX11)), Survey(**survey_record(TWENTY))
    assert (printed.best, printed.bound, printed.proven, printed.moves) == (96.0, 96.0, True, 26)
    assert toasts.proven
    assert toasts.rules["nearest-ready"] > toasts.best
    assert not Survey(10.0, 9.0, {}, 1, {}).proven


def test_rows_by_hand() -> None:
    """What begins soonest first is nearest-ready: the same gap as the rule, with any family's name on it."""
    found = Survey(**survey_record(TWENTY))
    rows = rows_of(TOAST, THESIS_TOASTS, {TWENTY: found}, {ALL: SOONEST, TOAST: SOONEST})
    gap = 100.0 * (found.rules["nearest-ready"] / found.best - 1.0)
    best = those(rows, best_rule=True, measure="mean gap_percent")
    assert [(one["method"], one["value"]) for one in best] == [("nearest-ready", pytest.approx(gap))]
    own = those(rows, method=CARRIED, measure="mean gap_percent")
    assert [(one["learned_on"], one["value"]) for one in own] == [(TOAST, best[0]["value"]), (ALL, best[0]["value"])]
    assert {one["value"] for one in those(rows, measure="of best rule's gap_percent")} == {100.0}
    for one in those(rows, measure="decisions_per_s"):
        same = {name: one.get(name) for name in ("method", "learned_on", "best_rule")}
        assert those(rows, measure="ms_per_decision", **same)[0]["value"] == pytest.approx(1e3 / one["value"])


def test_a_hundred_thousand_decisions_a_second() -> None:
    """In the largest of the printed cells, with every feature."""
    decider = Decider(larger_cell(LargerCell(SHOP, BILGE_ULUSOY, 39, 157.0)))
    decisions_per_s([decider], SOONEST)  # compiles
    assert max(decisions_per_s([decider], SOONEST) for _ in range(5)) > 1e5


def test_it_leaves_policies_and_goes_on(tmp_path: Path, short: None, monkeypatch: pytest.MonkeyPatch) -> None:
    job = Job(sessions=4, folder=tmp_path)
    first = carried_over(job, {})
    policies = {family: read_policy(tmp_path / f"policy-{family.replace(' ', '-')}.json") for family in [*SMALL, ALL]}
    assert all(family in policy.learned_on for family, policy in policies.items())
    assert len({one["table"] for one in first.rows}) == 2
    assert [picture[:5] for picture in first.figures.values()] == [b"<?xml"]
    with (tmp_path / STORE).open("a", encoding="utf-8") as file:
        file.write('{"key": 3}\n[1]\n{"cut')
    for name in ("learn_policy", "best_known"):
        monkeypatch.setattr(study, name, lambda *_: pytest.fail("it is kept"))
    again = carried_over(job, {})
    steady = [one for one in first.rows if "gap" in one["measure"]]
    assert [one for one in again.rows if "gap" in one["measure"]] == steady


def test_another_seed_is_learned_anew(tmp_path: Path, short: None) -> None:
    rows = [carried_over(Job(sessions=4, seed=seed, folder=tmp_path), {}).rows for seed in (0, 1)]
    gaps = [[one["value"] for one in those(found, method=CARRIED, measure="mean gap_percent")] for found in rows]
    assert gaps[0] != gaps[1]
    kept = (tmp_path / STORE).read_text(encoding="utf-8")
    assert (kept.count('"learned: '), kept.count('"surveyed: ')) == (8, 2)
