"""The arms of a study with people compared, on values that can be checked by hand."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.studies.people import PairCompared, compare_arms, correlation, holm, paired_correlation
from lab.studies.people_report import people_compared

Rows = list[dict[str, Any]]
SIX = {"a": [1, 2, 3, 4, 5, 6], "b": [2, 3, 4, 5, 6, 7], "c": [4, 4, 6, 6, 8, 8]}


def within(values: Mapping[str, Sequence[float | None]], name: str = "seconds") -> Rows:
    """Each participant in all arms, whose order turns from one to the next."""
    arms = [*values]
    return [
        {
            "participant": f"P{person}",
            "arm": arm,
            "position": (number - person) % len(arms) + 1,
            "lesson": number + 1,
            name: values[arm][person],
        }
        for person in range(len(values[arms[0]]))
        for number, arm in enumerate(arms)
    ]


def between(values: Mapping[str, Sequence[float]]) -> Rows:
    """Each participant in one arm."""
    return [
        {"participant": f"{arm}{person}", "arm": arm, "position": 1, "lesson": number + 1, "seconds": value}
        for number, (arm, numbers) in enumerate(values.items())
        for person, value in enumerate(numbers)
    ]


def test_everybody_did_better_in_the_second_arm() -> None:
    """All six differences are above 0: the least p of Wilcoxon's test is 2 / 2^6; all ranks are for it."""
    design, (measure,), _ = compare_arms(within(SIX), model=False)
    assert design == "within"
    pair = measure.pairs[0]
    assert (pair.first, pair.second, pair.n, pair.difference) == ("a", "b", 6, 1.0)
    assert (pair.correlation, pair.correlation_ci95) == (1.0, (1.0, 1.0))
    assert pair.p == pytest.approx(0.03125)
    assert pair.difference_ci95 == (1.0, 1.0)


def test_friedmans_ranks_agree_wholly() -> None:
    """The order a, b, c in all six: chi squared is n (k - 1) = 12, and Kendall's W is 1."""
    _, (measure,), _ = compare_arms(within(SIX), model=False)
    assert measure.test == "Friedman"
    assert measure.statistic == pytest.approx(12)
    assert measure.effect == pytest.approx(1)


def test_between_participants_ranks_are_compared_between_groups() -> None:
    """All of b above all of a: U = 9, and the least p of two groups of three is 2 / 20."""
    design, (measure,), _ = compare_arms(between({"a": [1, 2, 3], "b": [4, 5, 6], "c": [1, 2, 3]}))
    assert (design, measure.test, measure.model) == ("between", "Kruskal-Wallis", None)
    first, second, _ = measure.pairs
    assert (first.difference, first.correlation) == (3.0, 1.0)
    assert first.p == pytest.approx(0.1)
    assert (second.difference, second.correlation) == (0.0, 0.0)


def test_correlations_by_hand() -> None:
    assert paired_correlation(np.array([1.0, 2.0, -3.0])) == 0.0  # ranks 1 + 2 for, 3 against
    assert paired_correlation(np.array([0.0, 2.0, -1.0])) == pytest.approx(1 / 3)
    assert paired_correlation(np.zeros(3)) == 0.0
    assert correlation(np.array([2.0, 3.0]), np.array([1.0, 3.0])) == pytest.approx(0.25)  # + + = -: (2 - 1) / 4


def test_holms_correction_by_hand() -> None:
    pairs = [PairCompared("a", "b", 9, 0, None, 0, None, p) for p in (0.01, 0.04, 0.03, None)]
    assert [pair.p_holm for pair in holm(pairs)] == [
        pytest.approx(0.03),
        pytest.approx(0.06),
        pytest.approx(0.06),
        None,
    ]


def test_lessons_of_one_arm_are_one_value() -> None:
    rows = within({"a": [1, 1, 1], "b": [2, 2, 2]})
    rows += [row | {"lesson": 3, "seconds": 4} for row in rows if row["arm"] == "b"]
    _, (measure,), _ = compare_arms(rows, model=False)
    assert (measure.arms["b"].n, measure.arms["b"].mean) == (3, 3.0)


def test_an_interval_of_shares_stays_between_none_and_all() -> None:
    _, (measure,), _ = compare_arms(within({"a": [0, 0, 1], "b": [1, 1, 1]}, "solved"), model=False)
    assert (measure.arms["a"].ci95, measure.arms["b"].ci95) == ((0.0, 1.0), (1.0, 1.0))


def test_who_has_no_value_is_counted_and_left_out() -> None:
    _, (measure,), notes = compare_arms(within({"a": [1, 2, 3, 4], "b": [2, None, 5, 6]}), model=False)
    assert (measure.arms["b"].n, measure.arms["b"].missing, measure.pairs[0].n) == (3, 1, 3)
    assert any("no value of seconds" in note for note in notes)


def test_the_same_seed_gives_the_same_intervals() -> None:
    rows = within({"a": [1, 2.3, 3.1, 4, 8.7, 2.2], "b": [3.3, 1.9, 9.2, 4.4, 9.9, 7.5]})
    one, same, other = (compare_arms(rows, seed=seed, model=False)[1][0].pairs[0] for seed in (0, 0, 1))
    assert one == same != other


def test_the_model_finds_the_differences_of_arms() -> None:
    """Where each participant adds a constant and there is no noise but one value, the estimates are the arms' differences."""
    pytest.importorskip("statsmodels")
    _, (measure,), _ = compare_arms(within({"a": [1, 12, 23, 4], "b": [3, 14, 25, 6.1], "c": [0, 11, 22, 3]}))
    model = measure.model
    assert model is not None
    found = {term.name: term.value for term in model.terms}
    assert found["b - a"] == pytest.approx(2, abs=0.1)
    assert found["c - a"] == pytest.approx(-1, abs=0.1)
    assert found["one place later"] == pytest.approx(0, abs=0.1)
    assert model.p < 0.001
    assert model.between_sd == pytest.approx(np.std([1, 12, 23, 4], ddof=1), rel=0.1)


def test_no_model_is_fitted_where_nothing_varies_but_the_arms() -> None:
    pytest.importorskip("statsmodels")
    _, (measure,), _ = compare_arms(within({"a": [4, 4, 4], "b": [201, 201, 201], "c": [4, 4, 4]}))
    assert measure.model is None
    assert measure.pairs[0].difference == 197


def test_the_usual_measures_are_those_that_have_values() -> None:
    rows = [row | {"tlx_mean": 5.0, "answers": None, "skill": "x", "extra": 1} for row in within(SIX)]
    assert [measure.name for measure in compare_arms(rows, model=False)[1]] == ["seconds", "tlx_mean"]
    assert [measure.name for measure in compare_arms(rows, ["extra"], model=False)[1]] == ["extra"]


@pytest.mark.parametrize(
    ("measures", "said"),
    [(["second"], "did you mean 'seconds'"), (["skill"], "measure 'skill' (--measure): it has no numbers")],
)
def test_an_unknown_measure_and_one_without_numbers_are_refused(measures: list[str], said: str) -> None:
    with pytest.raises(BadInput, match=re.escape(said)):
        compare_arms([row | {"skill": "x"} for row in within(SIX)], measures, model=False)


def test_a_class_without_arms_is_refused() -> None:
    with pytest.raises(BadInput, match="0 arms of a study in these rows"):
        compare_arms([row | {"arm": None} for row in within(SIX)])


def test_a_column_cannot_lead_out_of_the_folder_of_figures(tmp_path: Path) -> None:
    document = people_compared(within(SIX, "../../x_mean"), {"class": "c"}, tmp_path / "out", model=False)
    assert document["files"]["../../x_mean"] == str(tmp_path / "out" / "figures" / "______x_mean.svg")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out"]


def test_the_report_escapes_what_it_is_told_and_holds_its_figures(tmp_path: Path) -> None:
    rows = within({"<b>": SIX["a"], "y": SIX["b"]})
    document = people_compared(rows, {"class": "<i>", "withdrawn": 2}, tmp_path / "out", model=False)
    page = (tmp_path / "out" / "report.html").read_text()
    assert "<b>" not in page
    assert "&lt;b&gt;" in page
    assert "<i>" not in page
    assert "data:image/svg+xml" in page
    assert (tmp_path / "out" / "figures" / "seconds.svg").read_text().startswith("<?xml")
    assert (document["arms"], document["design"], document["participants"]) == (["<b>", "y"], "within", 6)
