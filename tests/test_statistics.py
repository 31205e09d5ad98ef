"""Intervals, scores and comparisons: cases that can be redone by hand, and the figures that the thesis prints."""

from math import inf, nan, sqrt

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.stats import mannwhitneyu, trim_mean

from lab.errors import BadInput
from lab.statistics import (
    FloatArray,
    allowed,
    compare,
    interquartile_mean,
    interval,
    mean_error,
    performance_profile,
    probability_of_improvement,
    proportion_interval,
    ranges,
    ranks,
    score,
    share_error,
    stratified_interval,
    within,
    within_errors,
)

# Smallest and largest SP [%] and HS [steps] of the printed rows of Appendix V with one advisor, by world and view.
I_FULL = ((1.0, 100.0), (91.59, 3250.7))
II_FULL = ((0.0, 100.0), (111.44, 7205.69))
II_LIMITED = ((11.0, 67.0), (7.14, 565.06))

finite = st.floats(-1e6, 1e6, allow_nan=False).map(lambda x: round(x, 3))
samples = st.lists(finite, min_size=2, max_size=8)


# A mean and its interval


def test_interval_by_hand() -> None:
    """1, 2, 3: mean 2, deviation 1, standard error 1/sqrt 3, t(.975, 2 degrees) = 4.303."""
    assert interval([1, 2, 3]) == pytest.approx((2, 2 - 4.3027 / 3**0.5, 2 + 4.3027 / 3**0.5), abs=1e-4)


@given(value=finite, n=st.integers(2, 9))
def test_interval_of_equal_values_is_that_value(value: float, n: int) -> None:
    assert interval([value] * n) == (value, value, value)


@given(values=samples)
def test_interval_is_around_the_mean(values: list[float]) -> None:
    mean, low, high = interval(values)
    assert low <= mean <= high
    assert mean == pytest.approx(np.mean(values), abs=1e-6)


@pytest.mark.parametrize("values", [[], [3.0], [1.0, nan], [1.0, inf], [[1.0, 2.0]]])
def test_interval_needs_two_finite_values(values: list[float]) -> None:
    with pytest.raises(BadInput, match="at least 2 finite values"):
        interval(values)


def test_wilson_by_hand() -> None:
    """Half of 100 with z = 1.96: 50 -+ 1.96 sqrt(.25/100 + 1.96^2/40000) / (1 + 1.96^2/100) = 50 -+ 9.62."""
    assert proportion_interval(50, 100) == pytest.approx((50, 40.38, 59.62), abs=0.01)
    assert proportion_interval(0, 10)[:2] == (0, 0)
    assert proportion_interval(10, 10)[2] == 100


@given(n=st.integers(1, 500), data=st.data())
def test_wilson_as_scipy_has_it(n: int, data: st.DataObject) -> None:
    from scipy.stats import binomtest

    successes = data.draw(st.integers(0, n))
    percent, low, high = proportion_interval(successes, n)
    expected = binomtest(successes, n).proportion_ci(method="wilson")
    assert 0 <= low <= percent <= high <= 100
    assert (low, high) == pytest.approx((100 * expected.low, 100 * expected.high), abs=1e-9)


@pytest.mark.parametrize(("successes", "n"), [(-1, 5), (6, 5), (0, 0)])
def test_proportions_that_are_none(successes: int, n: int) -> None:
    with pytest.raises(BadInput, match="successes of"):
        proportion_interval(successes, n)


# The score


@pytest.mark.parametrize(
    ("sp", "hs", "reference", "printed"),
    [
        (67, 479.36, I_FULL, 0.77),  # IA, expert, Psi .1
        (99, 292.2, I_FULL, 0.96),  # table 9.2: CCRL, expert
        (100, 96.8, I_FULL, 1.00),  # combined, expert
        (11, 593.6, I_FULL, 0.47),  # CCRL, limited skills
        (66, 3250.7, I_FULL, 0.33),  # IA, novice, Psi 1.3
        (98, 522.1, II_FULL, 0.96),  # table 9.4: IA, expert
        (36, 150.4, II_FULL, 0.68),  # combined, limited skills
        (51, 43.2, II_LIMITED, 0.83),  # table 9.5: CCRL, expert
        (34, 86.5, II_LIMITED, 0.64),  # IA, novice
    ],
)
def test_printed_scores(sp: float, hs: float, reference: tuple[tuple[float, float], ...], printed: float) -> None:
    """Printed SP are whole percents, so that a score comes out within about .01."""
    assert score(sp, hs, reference[0], reference[1]) == pytest.approx(printed, abs=0.01)


def test_score_of_the_ends_and_of_arrays() -> None:
    sp, hs = np.array([0.0, 50.0, 100.0]), np.array([10.0, 20.0, 30.0])
    sp_range, hs_range = ranges(sp, hs)
    assert (sp_range, hs_range) == ((0, 100), (10, 30))
    assert score(sp, hs, sp_range, hs_range).tolist() == [0.5, 0.5, 0.5]
    assert score(100.0, 10.0, sp_range, hs_range) == 1
    assert score(0.0, 30.0, sp_range, hs_range) == 0


def test_score_where_all_are_equal() -> None:
    assert score(40.0, 7.0, (40, 40), (7, 7)) == 1
    assert score(40.0, 20.0, (40, 40), (10, 20)) == 0.5


@given(sp=st.lists(st.floats(0, 100), min_size=1, max_size=6), data=st.data())
def test_scores_of_the_combinations_lie_between_0_and_1(sp: list[float], data: st.DataObject) -> None:
    hs = data.draw(st.lists(st.floats(0, 1e4), min_size=len(sp), max_size=len(sp)))
    found = score(np.array(sp), np.array(hs), *ranges(sp, hs))
    assert ((found >= -1e-9) & (found <= 1 + 1e-9)).all()


def test_scores_that_are_none() -> None:
    with pytest.raises(BadInput, match="HS range 5 to 1 is upside down"):
        score(1.0, 1.0, (0, 1), (5, 1))
    with pytest.raises(BadInput, match="range of HS"):
        ranges([1.0], [])


# Comparisons


def spread(mean: float, squares: float, n: int = 10) -> FloatArray:
    """n evenly spaced values with this mean and this sum of squared deviations."""
    values: FloatArray = np.arange(n, dtype=np.float64) - (n - 1) / 2
    return mean + values * sqrt(squares / np.square(values).sum())


def test_the_example_of_appendix_ii() -> None:
    """Fig. II.1: three groups of ten, 423 squares within, F 93.794; Tukey keeps SRL and random together, p .111."""
    srl = 9 * 3.8658**2  # fig. II.2: its deviation
    rest = (423 - srl) / 2
    found = compare({"MC": spread(49.9, rest), "random": spread(68.8, rest), "SRL": spread(72.5, srl)})
    assert found.f == pytest.approx(93.794, abs=0.01)
    assert found.p < 0.0005
    assert found.tukey["random", "SRL"] == pytest.approx(0.111, abs=0.001)
    assert found.tukey["MC", "random"] < 0.0005
    assert found.ranks == {"SRL": "1", "random": "1", "MC": "2"}
    assert found.means == pytest.approx({"MC": 49.9, "random": 68.8, "SRL": 72.5})


def test_normality_as_the_thesis_computes_it() -> None:
    """Fig. II.2: ten values, Z = D sqrt 10 = .687, p = .732; here D is known by construction.

    Half of the values at -1, half at 1: their deviation is sqrt(10/9), and D = .5 - Phi(-sqrt .9) = .3286.
    """
    from scipy.special import kolmogorov, ndtr

    assert kolmogorov(0.687) == pytest.approx(0.732, abs=0.001)
    found = compare({"halves": [-1] * 5 + [1] * 5, "even": spread(0, 10)})
    assert found.normality["halves"] == pytest.approx(kolmogorov(10**0.5 * (0.5 - ndtr(-(0.9**0.5)))))
    even = found.normality["even"]
    assert even is not None
    assert even > 0.99


def test_levene_by_hand() -> None:
    """Deviations 1, 1, 0 and 3, 3, 0: means 2/3 and 2, F = (4 * 2/3) / (20/3 / 4) = 1.6, p = .2746."""
    assert compare({"narrow": [-1, 0, 1], "wide": [-3, 0, 3]}).levene == pytest.approx(0.2746, abs=1e-4)


@given(groups=st.lists(st.lists(st.integers(-999, 999), min_size=2, max_size=8), min_size=2, max_size=4))
def test_as_scipy_has_it(groups: list[list[int]]) -> None:
    from scipy.stats import f_oneway, tukey_hsd

    arrays = [np.array(values) + np.linspace(0, 0.5, len(values)) for values in groups]  # never constant
    found = compare({str(number): array for number, array in enumerate(arrays)})
    expected = f_oneway(*arrays)
    assume(expected.statistic > 1e-6)  # scipy's own is a little below 0 for equal means, and its p then no number
    assert found.f == pytest.approx(expected.statistic, rel=1e-4, abs=1e-6)
    assert found.p == pytest.approx(expected.pvalue, rel=1e-3, abs=1e-6)
    pairs = tukey_hsd(*arrays).pvalue
    for (one, other), p in found.tukey.items():
        assert p == pytest.approx(pairs[int(one), int(other)], rel=1e-3, abs=1e-6)


def test_constant_groups() -> None:
    alike = compare({"a": [5, 5, 5], "b": [5, 5]})
    assert (alike.f, alike.p, alike.levene) == (0, 1, 1)
    assert alike.normality == {"a": None, "b": None}
    assert alike.ranks == {"a": "1", "b": "1"}
    apart = compare({"a": [5, 5, 5], "b": [6, 6], "zero": [0, 0]})
    assert np.isfinite(apart.f)
    assert apart.p < 1e-9
    assert apart.ranks == {"b": "1", "a": "2", "zero": "3"}
    assert compare({"a": [0, 0], "b": [0, 0]}).ranks == {"a": "1", "b": "1"}


def test_rounding_is_no_difference() -> None:
    assert compare({"a": [0.3] * 5, "b": [0.1 + 0.2] * 5}).ranks == {"a": "1", "b": "1"}


@given(groups=st.dictionaries(st.text(max_size=3), samples, min_size=2, max_size=4), lowest=st.booleans())
def test_whatever_is_compared(groups: dict[str, list[float]], lowest: bool) -> None:
    """No warning, probabilities are such, the best group is among the first, groups that do not differ share a rank."""
    found = compare(groups, lowest_is_best=lowest)
    probabilities = [found.p, found.levene, *found.tukey.values(), *filter(None, found.normality.values())]
    assert all(0 <= p <= 1 for p in probabilities)
    best = min if lowest else max
    assert "1" in places(found.ranks[best(found.means, key=lambda name: found.means[name])])
    for (one, other), p in found.tukey.items():
        shared = places(found.ranks[one]) & places(found.ranks[other])
        assert bool(shared) == (p >= 0.05 or found.p >= 0.05)


def places(rank: str) -> set[str]:
    """The single ranks of "2", "1-3", "1,3"."""
    low, dash, high = rank.partition("-")
    return {str(n) for n in range(int(low), int(high) + 1)} if dash else set(rank.split(","))


@pytest.mark.parametrize(("n", "k", "q"), [(1584, 6, 0.0156597394), (750, 8, 0.0692118337), (3255, 2, 3.308402e-10)])
def test_thousands_of_sessions_with_equal_means(n: int, k: int, q: float) -> None:
    """Where scipy's integral of the studentized range converges slowly, there is no warning, and p is 1."""
    groups = {str(number): spread(0, n - 1, n) for number in range(k)}  # mean square 1, standard error 1 / sqrt n
    found = compare({**groups, "0": groups["0"] + q / sqrt(n)})
    assert min(found.tukey.values()) > 0.999
    assert {*found.ranks.values()} == {"1"}


def test_unit_and_shift_do_not_matter() -> None:
    groups = {"a": [1.0, 2.0, 4.0], "b": [3.0, 5.0, 6.0]}
    one = compare(groups)
    other = compare({name: 1e9 * np.array(values) for name, values in groups.items()})
    assert (other.f, other.p, other.levene) == pytest.approx((one.f, one.p, one.levene))


def test_fewest_is_best_where_asked() -> None:
    groups = {"few": [1, 2, 1], "many": [100, 101, 99]}
    assert compare(groups).ranks == {"many": "1", "few": "2"}
    assert compare(groups, lowest_is_best=True).ranks == {"few": "1", "many": "2"}


@pytest.mark.parametrize(
    ("groups", "says"),
    [
        ({}, "comparison of nothing"),
        ({"a": [1, 2]}, "comparison of a: at least two groups"),
        ({"a": [1, 2], "b": [1]}, "group 'b'"),
        ({"a": [1, 2], "b": [1, nan]}, "group 'b'"),
    ],
)
def test_comparisons_that_are_none(groups: dict[str, list[float]], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        compare(groups)


@pytest.mark.parametrize(
    ("order", "differ", "expected"),
    [  # as tables 9.2-9.5 rank their three methods
        (["combined", "IA", "CCRL"], ["combined IA", "combined CCRL", "IA CCRL"], "1 2 3"),  # 9.2, all levels
        (["combined", "CCRL", "IA"], ["combined CCRL", "combined IA"], "1 2 2"),  # 9.2, expert
        (["combined", "CCRL", "IA"], ["combined IA", "CCRL IA"], "1 1 2"),  # 9.3, limited skills
        (["IA", "combined", "CCRL"], [], "1 1 1"),  # 9.3, moderately expert
        (["combined", "CCRL", "IA"], ["combined IA"], "1 1-2 2"),  # 9.5, all levels: printed "1,2"
        (["a", "b", "c"], ["b c", "b a"], "1 2 1"),  # unequal sizes: the ends are alike, the middle is not
        (["a", "b", "c", "d"], ["a b", "a c", "b d"], "1 2 2-3 1,3"),
    ],
)
def test_ranks(order: list[str], differ: list[str], expected: str) -> None:
    pairs = [(pair.split()[0], pair.split()[1]) for pair in differ]
    assert ranks(order, pairs) == dict(zip(order, expected.split(), strict=True))


@pytest.mark.parametrize(
    ("means", "printed"),
    [
        ({"CCRL": 0.96, "IA": 0.96, "combined": 1.00}, {"CCRL": "2", "IA": "2", "combined": "1"}),  # 9.2, expert
        ({"CCRL": 0.47, "IA": 0.87, "combined": 0.81}, {"CCRL": "3", "IA": "1", "combined": "2"}),  # limited skills
        ({"CCRL": 0.72, "IA": 0.69, "combined": 0.74}, {"CCRL": "1-2", "IA": "2", "combined": "1"}),  # 9.5, all
        ({"CCRL": 0.69, "IA": 0.62, "combined": 0.72}, {"CCRL": "1", "IA": "2", "combined": "1"}),  # 9.3, limited
    ],
)
def test_printed_scores_get_the_printed_ranks(means: dict[str, float], printed: dict[str, str]) -> None:
    """Five replications with a deviation of .0195: the honest difference is 3.77 * .0195 / sqrt 5 = .033."""
    found = compare({name: spread(mean, 4 * 0.0195**2, 5) for name, mean in means.items()})
    assert found.ranks == printed


# Agreement with print


@pytest.mark.parametrize(
    ("value", "ci", "thesis", "measure", "expected"),
    [
        (68, (66, 70), 63, "SP_percent", True),  # five points
        (68.1, (66, 70), 63, "SP_percent", False),
        (70, (62, 78), 63, "SP_percent", True),  # the interval holds it
        (115, None, 100, "HS_steps", True),  # 15 percent of the printed figure
        (115.1, None, 100, "HS_steps", False),
        (1.0, None, 0.85, "score", False),
        (0.85, None, 1.0, "score", True),  # although 1 - .85 > .15 in floats
        (0, None, 0, "HS_steps", True),
        (0.1, (0.05, 0.2), 0, "HS_steps", False),
        (5, None, 0, "SP_percent", True),
    ],
)
def test_within(value: float, ci: tuple[float, float] | None, thesis: float, measure: str, expected: bool) -> None:
    assert within(value, ci, thesis, measure) is expected


def test_allowed() -> None:
    assert allowed(63, "SP_percent") == 5
    assert allowed(-200, "BR_s") == pytest.approx(30)


def test_standard_errors_by_hand() -> None:
    """Of 96 sessions half, and 4 more: 50 / 10 points; none of 96: 2 of 100. 1 and 3: a deviation of sqrt(2)."""
    assert share_error(50, 96) == pytest.approx(5.0)
    assert [share_error(percent, 96) for percent in (0, 100)] == pytest.approx([1.4, 1.4])
    assert mean_error([1.0, 3.0]) == pytest.approx(1.0)
    assert mean_error([1.0, 3.0], 8) == pytest.approx(0.5)


def test_within_both_errors() -> None:
    """Errors of 3 and 4 make 5, and 1.96 of these 9.8."""
    assert [within_errors(50, thesis, (3, 4)) for thesis in (59.7, 59.9, 40.3)] == [True, False, True]
    assert within_errors(1.0, 1.0, (0, 0))


# Aggregates over tasks


def test_an_interquartile_mean_by_hand() -> None:
    """Of 0, 1, 2, 3, 100 one is left out at each end: (1 + 2 + 3) / 3."""
    assert interquartile_mean([[3.0, 1.0], [100.0, 0.0]]) == 2.0  # the middle two of four
    assert interquartile_mean([0.0, 100.0, 1.0, 3.0, 2.0]) == 2.0
    with pytest.raises(BadInput, match="interquartile mean"):
        interquartile_mean([1.0, 2.0, 3.0])


@given(st.lists(finite, min_size=4, max_size=40))
def test_an_interquartile_mean_is_scipys_trimmed_mean(values: list[float]) -> None:
    assert interquartile_mean(values) == pytest.approx(trim_mean(values, 0.25), abs=1e-6)


def test_a_profile_by_hand() -> None:
    assert performance_profile([[1.0, 2.0], [3.0, 4.0]], [0.0, 2.0, 4.0]).tolist() == [1.0, 0.5, 0.0]


def test_a_chance_of_improvement_by_hand() -> None:
    """Task 1: 1, 3 against 2, 3: one of four pairs is above, one is a tie, so 3/8; task 2: always above."""
    assert probability_of_improvement([[1.0, 9.0], [3.0, 9.0]], [[2.0, 0.0], [3.0, 0.0]]) == (3 / 8 + 1) / 2
    with pytest.raises(BadInput, match=r"shapes \(1, 2\) and \(1, 1\)"):
        probability_of_improvement([[1.0, 2.0]], [[1.0]])


@given(st.lists(finite, min_size=2, max_size=9), st.lists(finite, min_size=2, max_size=9))
def test_a_chance_of_improvement_is_mann_and_whitneys(own: list[float], other: list[float]) -> None:
    found = probability_of_improvement(np.array(own)[:, None], np.array(other)[:, None])
    assert found == pytest.approx(mannwhitneyu(own, other).statistic / (len(own) * len(other)))


def test_a_stratified_interval_draws_within_tasks() -> None:
    """Task 1 always gives 0 and task 2 always 10: drawn within tasks, the mean is 5 in every sample."""
    table = np.tile([0.0, 10.0], (6, 1))
    assert stratified_interval(table, np.mean, seed=1, repeats=50) == (5.0, 5.0, 5.0)
    with pytest.raises(BadInput, match=r"shape \(6,\)"):
        stratified_interval(table[:, 0], np.mean, seed=1)


def test_tasks_of_one_stratum_are_drawn_together() -> None:
    """Two tasks whose runs add up to 10: drawn together, the mean is 5 in every sample, apart it is not."""
    table = np.array([[0.0, 10.0], [10.0, 0.0], [3.0, 7.0]])
    assert stratified_interval(table, np.mean, seed=1, repeats=50, strata=[0, 0]) == (5.0, 5.0, 5.0)
    assert stratified_interval(table, np.mean, seed=1, repeats=50)[1] < 4.0
    with pytest.raises(BadInput, match=r"strata of shape \(1,\): wanted one for each of 2 tasks"):
        stratified_interval(table, np.mean, seed=1, strata=[0])


def test_a_stratified_interval_covers_the_truth() -> None:
    """Of 200 intervals of 95 % for the mean of 20 runs of a normal, between 86 and 100 % cover it (binomial, 1 in 10^5)."""
    rng = np.random.default_rng(5)
    tables = rng.normal(size=(200, 20, 2))
    found = [stratified_interval(table, np.mean, seed, 300) for seed, table in enumerate(tables)]
    assert 0.86 <= np.mean([low <= 0.0 <= high for _, low, high in found]) <= 1.0
    assert stratified_interval(tables[0], np.mean, 0, 300) == found[0]
