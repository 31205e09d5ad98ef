"""What advice costs: which cells are measured, the difference to nobody, targets, pictures."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from lab.studies import STUDIES
from lab.studies.findings import Findings
from lab.studies.runner import Job, seeds_of
from lab_studies.comparisons import advice_budget
from lab_studies.comparisons.advice_budget import (
    ADVISORS,
    ASKING,
    NOBODY,
    PLACES,
    RANDOM,
    RANDOM_WORLDS,
    TARGETS,
    VIEWS,
    WORLDS,
    BudgetCell,
    difference,
    in_short,
    settings,
    worst_advisor_rows,
)
from lab_studies.thesis.chapter_9_sessions import (
    AdviceOutcome,
    AdviceSetting,
    gate_of,
    limited_view,
    sessions_of,
    world,
)

ASKED = len(ASKING) * len(ADVISORS)
CELLS = len(PLACES) * 2 + len(WORLDS) * ASKED + len(PLACES) * len(VIEWS) * ASKED  # nobody; without memory; with it
FEW = BudgetCell("world-1", "full", "ccrl", "limited", True)
TARGETS_IN_ROWS = {name: list(pair) for name, pair in TARGETS.items()}


def outcome(successes: int, sessions: int, helped: int = 0) -> AdviceOutcome:
    """So many successes; the helped steps vary by one."""
    success = np.arange(sessions) < successes
    steps = np.full(sessions, helped) + np.arange(sessions) % 2
    return AdviceOutcome(success, steps, steps)


@pytest.fixture(scope="module")
def found() -> Findings:
    """The study with three sessions a cell, in two random worlds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(advice_budget, "RANDOM_WORLDS", RANDOM_WORLDS[:2])
        return STUDIES["advice-budget"].run(Job(sessions=3), {})


@pytest.fixture(scope="module")
def outcomes() -> Mapping[BudgetCell, AdviceOutcome]:
    """Sixty of a hundred succeed everywhere but in a few cells."""
    made = dict.fromkeys(settings(), outcome(60, 100, 20))
    made[FEW] = outcome(50, 100, 9)
    made[FEW._replace(memory=False)] = outcome(1, 100, 1000)
    made[BudgetCell("world-1", "full", "never", NOBODY, True)] = outcome(90, 100)
    made[BudgetCell("world-2", "limited", "importance", "wrong", True)] = outcome(20, 100, 3)
    return made


def test_every_gate_and_advisor_is_measured_with_and_without_memory() -> None:
    cells = settings()
    assert len(cells) == CELLS
    single = [ones for cell, ones in cells.items() if cell.world != RANDOM]
    assert len({one for ones in cells.values() for one in ones}) == len(single) + 100 * (CELLS - len(single))
    for (place, view, gate, name, memory), ones in cells.items():
        assert [one.world for one in ones] == (list(RANDOM_WORLDS) if place == RANDOM else [place])
        for one in ones:
            assert (one.view, one.gate, one.memory, one.advisor_table) == (view, gate, memory, "exact")
            assert (gate == "never") == (name == NOBODY) == (one.tau is None)
            assert one.wrong == (name == "wrong")
    assert {cell.gate for cell in cells} == {
        *("ccrl", "ia", "combined", "cq", "always", "never", "random", "importance", "uncertainty")
    }


@pytest.mark.slow
def test_each_cell_has_its_measures_with_intervals(found: Findings) -> None:
    cells = [one for one in found.rows if "against" not in one]
    assert len(cells) == 3 * CELLS
    for one in cells:
        low, high = one["ci95"]
        assert low <= one["value"] <= high
        assert one["thesis"] is None
        assert one["view"] in VIEWS
        assert ("tau" in one) == ("advisor_table" in one) == (one["advisor"] != NOBODY)
    helped = {(one["advisor"], one["memory"]) for one in cells if one["measure"] == "HS_steps" and one["value"] > 0}
    assert helped == {(name, memory) for name in ADVISORS for memory in (False, True)}
    targets: dict[str, list[float]] = {}
    for one in cells:
        if "target" in one:
            assert (one["world"], one["view"], one["gate"], one["memory"]) == ("world-1", "full", "ccrl", True)
            targets.setdefault(one["advisor"], []).append(one["target"])
    assert targets == TARGETS_IN_ROWS


def test_the_control_is_said_plainly(found: Findings) -> None:
    assert any("nobody, memory" in note and "learner's own" in note for note in found.notes)
    assert "world-1: alone, with memory" in found.summary
    assert any("exact optimal values" in note for note in found.notes)


def test_the_pictures_are_drawn(found: Findings) -> None:
    assert len(found.figures) == 2
    for picture in found.figures.values():
        text = picture.decode()
        assert text.startswith("<?xml")
        for word in ("world-1", "world-2", "with memory", "wrong", "nobody, memory"):
            assert word in text
    every = found.figures["Success against helped steps, all gates"].decode()
    assert all(gate in every for gate in ASKING)


def test_advisors_may_know_a_learned_table(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(advice_budget, "ASKING", ("ccrl",))
    monkeypatch.setattr(advice_budget, "RANDOM_WORLDS", RANDOM_WORLDS[:1])
    learned = STUDIES["advice-budget"].run(Job(sessions=2), {"advisor_table": "learned"})
    tables = {one["advisor_table"] for one in learned.rows if "advisor_table" in one}
    assert tables == {"learned"}
    assert any("1000 episodes that begin anywhere" in note for note in learned.notes)


def test_the_difference_of_two_shares_has_newcombes_interval() -> None:
    # the paper's first example: 56 of 70 against 48 of 80
    gap, low, high = difference(outcome(56, 70), outcome(48, 80))
    np.testing.assert_allclose([gap, low, high], [20.0, 5.24, 33.39], atol=0.01)
    back = difference(outcome(48, 80), outcome(56, 70))
    np.testing.assert_allclose(back, [-gap, -high, -low])


def test_the_worst_advisor_is_held_against_nobody(outcomes: Mapping[BudgetCell, AdviceOutcome]) -> None:
    alone, kept = worst_advisor_rows(outcomes, "world-1", "full")
    assert (alone["advisor"], kept["advisor"]) == ("limited", "limited")
    assert (alone["against"], kept["against"]) == ("alone", "alone, with memory")
    np.testing.assert_allclose([alone["value"], kept["value"]], [-10.0, -40.0])
    assert kept["ci95"][1] < 0 < alone["ci95"][1]
    any_gate = worst_advisor_rows(outcomes, "world-2", "limited", ASKING)[0]
    assert (any_gate["gate"], any_gate["advisor"], any_gate["over"]) == ("importance", "wrong", "any gate")


def test_targets_are_met_or_missed(outcomes: Mapping[BudgetCell, AdviceOutcome]) -> None:
    rows = [one for cell, made in outcomes.items() for one in advice_budget.rows_of(cell, made, "exact")]
    below = [one for gates in (("ccrl",), ASKING) for one in worst_advisor_rows(outcomes, "world-1", "full", gates)]
    says = in_short(rows, below)
    assert (
        says["limited, target 85 % / 150 steps"]
        == "50 % / 9.5 steps: success missed (without memory 1 % / 1000.5 steps)"
    )
    assert says["world-1: alone"] == "60.0 %"
    assert says["worst_below_alone"] == -10.0
    assert says["worst_below_alone target"] == "at least -2 points: open: the interval contains it"
    assert says["worst_below_alone_with_memory"] == -40.0
    assert says["worst_below_alone_with_memory target"] == "at least -2 points: missed"
    better = dict(outcomes) | {FEW: outcome(85, 100, 149)}
    rows = [one for cell, made in better.items() for one in advice_budget.rows_of(cell, made, "exact")]
    assert ": met (" in in_short(rows, below)["limited, target 85 % / 150 steps"]


@pytest.mark.parametrize(
    ("ends", "says"),
    [
        ((-1.9, 5.0), "met, with its interval"),
        ((-9.0, -2.1), "missed"),
        ((-3.0, 1.0), "open: the interval contains it"),
    ],
)
def test_a_verdict_needs_its_interval(ends: tuple[float, float], says: str) -> None:
    row: dict[str, Any] = {"ci95": list(ends)}
    assert advice_budget.verdict(row) == says


def test_settings_without_memory_have_the_chances_that_they_had_before_there_was_memory() -> None:
    before = AdviceSetting("world-1", gate="ia", tau=0.1, psi=1.0)
    assert seeds_of(before, 2, 0).tolist() == [11525729318082079017, 15845727360063292613]
    assert before.key(500, 0) == "ef37888d1e5603bb50306c3f"
    other = AdviceSetting("world-1", gate="ia", tau=0.1, psi=1.0, memory=True)
    assert other.key(500, 0) != before.key(500, 0)
    assert seeds_of(other, 2, 0).tolist() != seeds_of(before, 2, 0).tolist()


def test_a_setting_says_whether_advice_is_remembered() -> None:
    gate = world("world-1").gate
    assert gate_of(AdviceSetting("world-1", gate="ccrl", memory=True), gate).memory
    assert not gate_of(AdviceSetting("world-1", gate="ccrl"), gate).memory


def test_the_random_worlds_share_the_sessions_and_have_a_limited_view() -> None:
    ones = settings()[BudgetCell(RANDOM, "limited", "always", "expert", True)][:3]
    joined = advice_budget._joined(ones, 2, 0)
    parts = [sessions_of(one, 2, 0) for one in ones]
    assert joined.success.tolist() == [one for part in parts for one in part.success.tolist()]
    assert joined.helped_steps.tolist() == [one for part in parts for one in part.helped_steps.tolist()]
    seen = limited_view(world(RANDOM_WORLDS[0])).reshape(10, 10, 10)
    assert seen[2:8, 2:8, 2:8].all()
    assert seen.sum() == 6**3
    np.testing.assert_array_equal(limited_view(world("world-1")), world("world-1").region())


def test_a_wrong_advisor_never_leads_to_the_goal() -> None:
    wrong = AdviceSetting("world-1", gate="always", tau=0.01, wrong=True, advisor_table="exact")
    assert not sessions_of(wrong, 5, 0).success.any()
    assert sessions_of(AdviceSetting("world-1", gate="always", tau=0.01, advisor_table="exact"), 5, 0).success.all()
