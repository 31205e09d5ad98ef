"""The tuning of AdviceBench's rules: its draws by hand, a small run, and the settings that are shipped."""

import tomllib

import pytest

from lab.errors import BadInput
from lab.learning.settings import Span
from lab.studies.runner import Job
from lab_studies.comparisons.advice_bench import tuning
from lab_studies.comparisons.advice_bench.rules import BUDGETS, RULES, SHARE, rules_of, tuned_settings
from lab_studies.comparisons.advice_bench.tuning import Place, measured, toml_of, trials_of


@pytest.mark.parametrize("rule", RULES)
def test_every_rule_has_the_same_trials_of_its_settings(rule: str) -> None:
    trials = trials_of(rule, 16, 3)
    assert trials == trials_of(rule, 16, 3)
    ranges = RULES[rule].ranges()
    assert len(trials) == (16 if ranges else 1)
    assert trials[0] == {}
    for trial in trials[1:]:
        assert {*trial} == {*ranges}
        for budget in BUDGETS:
            RULES[rule].rule(budget, trial)  # raises BadInput outside what is allowed
    for name, allowed in ranges.items():
        assert isinstance(allowed, Span)
        assert all(allowed.low * 0.99 <= trial[name] <= allowed.high * 1.01 for trial in trials[1:])


def test_each_part_of_a_range_is_drawn_once() -> None:
    shares = sorted(trial[SHARE] for trial in trials_of("correcting", 20, 0)[1:])
    assert [int((share - 0.05) / 0.05 + 0.01) for share in shares] == list(range(19))  # 0.05 to 1 in 19 parts
    assert sorted(trial["ensemble"] for trial in trials_of("uncertainty", 10, 0)[1:]) == list(range(2, 11))


def test_the_best_trial_at_each_budget_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tuning, "TRIALS", 3)
    methods = ["random", "earned-trust", "always"]
    reading = {"methods": methods, "problem": "empty", "advisors": ["expert", "contrary"]}
    found = tuning.tuning(Job(sessions=2), reading)
    values = {(one["rule"], one["budget"], one["trial"], one["measure"]): one["value"] for one in found.rows}
    assert len(values) == 2 * 2 * (3 + 3 + 1)  # always has nothing to tune
    written = tomllib.loads(found.files["tuned.toml"])
    for rule in methods:
        alone = measured(Place(rule, "empty"), 2, 0, 3, ("expert", "contrary"))
        for budget in BUDGETS:
            points, loss = ([getattr(one, name) for one in alone[budget]] for name in ("points", "loss"))
            assert [values[rule, budget, n, "points"] for n in range(len(points))] == pytest.approx(points, abs=0.01)
            assert [values[rule, budget, n, "loss"] for n in range(len(points))] == pytest.approx(loss, abs=0.01)
            if rule != "earned-trust":
                assert written.get(rule, {}).get(budget, {}) == trials_of(rule, 3, 0)[points.index(max(points))]
    both = [
        one.loss + other.loss
        for one, other in zip(
            *measured(Place("earned-trust", "empty"), 2, 0, 3, ("expert", "contrary")).values(), strict=True
        )
    ]
    least = trials_of("earned-trust", 3, 0)[both.index(min(both))]
    assert all(written.get("earned-trust", {}).get(budget, {}) == least for budget in BUDGETS)
    assert "always" not in written


def test_a_held_out_problem_is_refused() -> None:
    with pytest.raises(BadInput, match="unknown problem 'hanoi'"):
        tuning.tuning(Job(sessions=1), {"problem": "hanoi"})


def test_the_settings_that_are_shipped_are_those_of_the_rules() -> None:
    shipped = tuned_settings()
    assert {*shipped} <= {*RULES}
    for rule, budgets in shipped.items():
        for budget, settings in budgets.items():
            assert {*settings} == {*RULES[rule].ranges()}
            assert rules_of(rule)[budget] == RULES[rule].rule(budget, settings)
    assert tomllib.loads(toml_of(shipped)) == shipped


def test_windows_that_a_gate_compares_begin_after_both() -> None:
    rule = RULES["ccrl"].rule("any", {"lambda_threshold": 0.1, "omega": 3, "first_episode": 2, "window": 7}).gate
    assert rule.first_episode == 14
