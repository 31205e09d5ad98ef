"""Statistics of sessions: confidence intervals, the score of chapter 9, comparisons of groups, agreement with printed figures."""

import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from math import hypot, sqrt

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput

FloatArray = NDArray[np.float64]
Range = tuple[float, float]

PERCENT_POINTS = 5.0  # a percentage agrees with the printed one within this distance [points]
RELATIVE = 0.15  # any other figure agrees within this fraction of the printed one
LEVEL = 0.95  # confidence level of intervals and tests
TAIL = (1 - LEVEL) / 2
NOISE = 1e-12  # differences below this fraction of the largest value are rounding, not variation


@dataclass(frozen=True)
class Comparison:
    """The comparison of several groups.

    means: by group; f, p: of the one-way ANOVA; tukey: p by pair, in the order of the groups; normality: p by group of the
    Kolmogorov-Smirnov test, None for a constant group; levene: p of Levene's test of equal variances; ranks: by group, "1" is
    best; groups that do not differ share a rank, and "1-2" means no difference from either of two groups that do differ.
    """

    means: dict[str, float]
    f: float
    p: float
    tukey: dict[tuple[str, str], float]
    normality: dict[str, float | None]
    levene: float
    ranks: dict[str, str]


def interval(values: ArrayLike) -> tuple[float, float, float]:
    """(mean, low, high): the mean of values (n,), one per session, and the ends of its t interval, in their unit.

    Raises BadInput for fewer than two values and for values that are not finite.
    """
    sample = _sample(values, "interval")
    mean = _mean(sample)
    error = sqrt(np.square(sample - mean).sum() / (len(sample) - 1) / len(sample))
    half = _t_errors(len(sample) - 1) * error
    return mean, mean - half, mean + half


@lru_cache
def _t_errors(degrees: int) -> float:
    """The standard errors from a mean to an end of its t interval; tables have thousands of intervals with as many values."""
    return float(scipy.stats.t.isf(TAIL, degrees))


def proportion_interval(successes: int, n: int) -> tuple[float, float, float]:
    """(share, low, high) [%]: the share of successful sessions and the ends of its Wilson interval.

    Raises BadInput unless 0 <= successes <= n and n >= 1. Source: E. B. Wilson, JASA 22 (1927), 209-212.
    """
    if not 0 <= successes <= n or n < 1:
        raise BadInput(f"interval of a proportion: {successes} successes of {n}; needed: 0 <= successes <= n, n >= 1")
    z2 = float(scipy.special.ndtri(TAIL)) ** 2
    share = successes / n
    middle = (share + z2 / (2 * n)) / (1 + z2 / n)
    half = sqrt(z2 * (share * (1 - share) + z2 / (4 * n)) / n) / (1 + z2 / n)
    low = 0.0 if successes == 0 else middle - half  # the exact end of the interval, which rounding would miss
    high = 1.0 if successes == n else middle + half
    return 100 * share, 100 * low, 100 * high


def share(success: ArrayLike) -> tuple[float, float, float]:
    """The `proportion_interval` of N sessions; success: (N,) bool."""
    ended = np.asarray(success, np.bool_)
    return proportion_interval(int(ended.sum()), len(ended))


def share_error(percent: float, n: float) -> float:
    """The standard error [points] of a share [%] of n sessions.

    Two successes and two failures are added, so that shares of 0 and 100 % have an error as well.
    Source: A. Agresti, B. Coull, Am. Stat. 52 (1998), 119-126.
    """
    p = (percent / 100 * n + 2) / (n + 4)
    return 100 * sqrt(p * (1 - p) / (n + 4))


def mean_error(values: ArrayLike, n: float | None = None) -> float:
    """The standard error of the mean of values (m,), or of the mean of n values with the same standard deviation."""
    sample = _sample(values, "standard error")
    return float(np.std(sample, ddof=1)) / sqrt(n or len(sample))


def score(sp: ArrayLike, hs: ArrayLike, sp_range: Range, hs_range: Range) -> FloatArray:
    """The score of combinations: 1 for the highest success percentage and the fewest helped steps, 0 for the opposite.

    sp [%], hs [steps]: numbers or arrays of one shape; sp_range, hs_range: (low, high) over all combinations, from `ranges` or
    from the printed ones (then a score may lie outside [0, 1]). In a range of width 0 every value counts as the best.
    Raises BadInput for a range whose low end is above its high end. Source: thesis eq. 9.4.
    """
    for name, (low, high) in (("SP", sp_range), ("HS", hs_range)):
        if not low <= high:
            raise BadInput(f"score: the {name} range {low} to {high} is upside down")
    sp_span, hs_span = sp_range[1] - sp_range[0], hs_range[1] - hs_range[0]
    sp_part = 1 + (np.asarray(sp, np.float64) - sp_range[1]) / (sp_span or np.inf)
    hs_part = 1 + (hs_range[0] - np.asarray(hs, np.float64)) / (hs_span or np.inf)
    return np.asarray(0.5 * sp_part + 0.5 * hs_part)


def ranges(sp: ArrayLike, hs: ArrayLike) -> tuple[Range, Range]:
    """The (lowest, highest) SP [%] and HS [steps] over all combinations of one world and view, for `score`.

    Raises BadInput for empty arrays and for values that are not finite.
    """
    percents, steps = _sample(sp, "range of SP", 1), _sample(hs, "range of HS", 1)
    return (float(percents.min()), float(percents.max())), (float(steps.min()), float(steps.max()))


# ---- aggregates over tasks --------------------------------------------------------------------------------------------


def interquartile_mean(scores: ArrayLike) -> float:
    """The mean of the middle half of scores (runs, tasks), all of them together.

    Of n scores the n // 4 lowest and as many of the highest are left out. Raises BadInput for fewer than four scores and for
    scores that are not finite. Source: Agarwal et al., Deep reinforcement learning at the edge of the statistical precipice,
    NeurIPS 2021.
    """
    sample = _sample(np.ravel(scores), "interquartile mean", 4)
    cut = len(sample) // 4
    return float(np.partition(sample, (cut, len(sample) - cut - 1))[cut : len(sample) - cut].mean())


def stratified_interval(
    scores: ArrayLike,
    statistic: Callable[[FloatArray], float],
    seed: int,
    repeats: int = 2000,
    strata: ArrayLike | None = None,
) -> tuple[float, float, float]:
    """(value, low, high): a statistic of scores (runs, tasks) and its percentile bootstrap interval.

    The runs of each task are drawn anew, with replacement; tasks are not. strata: (tasks,), the stratum of each task, by default
    one each; tasks of the same stratum are drawn together, as run n of each has the same seed. Raises BadInput for scores that
    are no such table, and for another number of strata. Source: Agarwal et al. 2021.
    """
    table = np.asarray(scores, np.float64)
    if table.ndim != 2 or table.shape[0] < 2 or not table.shape[1]:
        raise BadInput(f"scores of shape {table.shape}: wanted at least two runs of at least one task, (runs, tasks)")
    rng, (runs, tasks) = np.random.default_rng(seed), table.shape
    own = np.arange(tasks) if strata is None else np.asarray(strata)
    if own.shape != (tasks,):
        raise BadInput(f"strata of shape {own.shape}: wanted one for each of {tasks} tasks")
    number = np.unique(own, return_inverse=True)[1]
    several = int(number.max()) + 1
    drawn = [
        statistic(table[rng.integers(runs, size=(runs, several))[:, number], np.arange(tasks)]) for _ in range(repeats)
    ]
    low, high = np.quantile(drawn, (TAIL, 1 - TAIL))
    return statistic(table), float(low), float(high)


def performance_profile(scores: ArrayLike, thresholds: ArrayLike) -> FloatArray:
    """The share of all runs that score above each threshold (n,), for scores (runs, tasks). Source: Agarwal et al. 2021."""
    above = np.ravel(np.asarray(scores, np.float64))[:, None] > np.asarray(thresholds, np.float64)[None, :]
    shares: FloatArray = above.mean(axis=0)
    return shares


def probability_of_improvement(scores: ArrayLike, other: ArrayLike) -> float:
    """The chance that a run scores above one of another method in the same task, mean over tasks; a tie counts half.

    scores, other: (runs, tasks), with as many tasks. Raises BadInput otherwise. Source: Agarwal et al. 2021.
    """
    own, theirs = np.asarray(scores, np.float64), np.asarray(other, np.float64)
    if own.ndim != 2 or theirs.ndim != 2 or own.shape[1] != theirs.shape[1]:
        raise BadInput(f"scores of shapes {own.shape} and {theirs.shape}: wanted (runs, tasks) with as many tasks")
    tasks = []
    for mine, other_runs in zip(own.T, theirs.T, strict=True):  # one by one: all pairs of all tasks are much memory
        differences = mine[:, None] - other_runs[None, :]
        tasks.append((differences > 0).mean() + 0.5 * (differences == 0).mean())
    return float(np.mean(tasks))


def part_means(values: ArrayLike, parts: int) -> FloatArray:
    """The means (parts,) of the `parts` replications that the sessions are split into."""
    return np.array([part.mean() for part in np.array_split(np.asarray(values), parts)])


def compare(groups: Mapping[str, ArrayLike], lowest_is_best: bool = False) -> Comparison:
    """One-way ANOVA, Tukey's HSD, the tests of their assumptions, and ranks; groups: name -> values (n,).

    Ranks follow Tukey's test, which counts only after a significant F-test; group sizes may differ (Tukey-Kramer).
    Differences below rounding (`NOISE`) do not count, so F stays finite even for constant groups.
    Normality is tested as in SPSS, which is lenient: with the sample's own mean and deviation and the asymptotic distribution.
    Raises BadInput for fewer than two groups, fewer than two values in one, and values that are not finite.
    Source: thesis, Appendix II; tables 9.2-9.5.
    """
    if len(groups) < 2:
        raise BadInput(f"comparison of {', '.join(groups) or 'nothing'}: at least two groups are needed")
    samples = {name: _sample(values, f"comparison, group '{name}'") for name, values in groups.items()}
    means = {name: _mean(sample) for name, sample in samples.items()}
    unit = max(float(np.abs(sample).max()) for sample in samples.values()) or 1.0
    scaled = {name: sample / unit for name, sample in samples.items()}  # no test here depends on the unit
    f, p, mean_square = _anova(list(scaled.values()))
    tukey = _tukey(scaled, mean_square)
    differ = [pair for pair, pair_p in tukey.items() if pair_p < 2 * TAIL] if p < 2 * TAIL else []
    order = sorted(means, key=lambda name: means[name], reverse=not lowest_is_best)
    return Comparison(
        means=means,
        f=f,
        p=p,
        tukey=tukey,
        normality={name: _normality(sample) for name, sample in scaled.items()},
        levene=_anova([np.abs(sample - _mean(sample)) for sample in scaled.values()])[1],
        ranks=ranks(order, differ),
    )


def ranks(order: Sequence[str], differ: Collection[tuple[str, str]]) -> dict[str, str]:
    """The ranks by group, given the groups from best to worst (`order`) and the pairs that differ significantly.

    Each maximal set of groups without a differing pair is a rank; a group in several sets has all their ranks: "1-2" or "1,3".
    Source: thesis tables 9.2-9.5; the sets are found as in H.-P. Piepho, J. Comput. Graph. Stat. 13 (2004), 456-466.
    """
    alike = [frozenset(order)]
    for pair in differ:
        parts = {
            part for whole in alike for part in ([whole - {name} for name in pair] if {*pair} <= whole else [whole])
        }
        alike = [part for part in parts if not any(part < other for other in parts)]
    alike.sort(key=lambda part: [place for place, name in enumerate(order) if name in part])
    numbers = {name: [number for number, part in enumerate(alike, start=1) if name in part] for name in order}
    return {
        name: f"{n[0]}-{n[-1]}" if len(n) > 1 and n[-1] - n[0] == len(n) - 1 else ",".join(map(str, n))
        for name, n in numbers.items()
    }


def allowed(thesis: float, measure: str) -> float:
    """The distance from a printed figure within which a value agrees: 5 points for `..._percent`, otherwise 15 % of it."""
    return PERCENT_POINTS if measure.endswith("_percent") else RELATIVE * abs(thesis)


def within(value: float, ci: Sequence[float] | None, thesis: float, measure: str) -> bool:
    """Whether a measured value agrees with the printed one: `ci` (low, high) contains that, or both are within `allowed`.

    Without an interval only the distance counts.
    """
    if ci is not None and ci[0] <= thesis <= ci[1]:
        return True
    return bool(abs(value - thesis) <= allowed(thesis, measure) + NOISE * max(abs(value), abs(thesis)))


def within_errors(value: float, thesis: float, errors: tuple[float, float]) -> bool:
    """Whether the standard errors of a measured and a printed value explain their difference, at the 95 % level.

    The rounding of the printed figure is not taken into account.
    """
    tolerance = -float(scipy.special.ndtri(TAIL)) * hypot(*errors)
    return bool(abs(value - thesis) <= tolerance + NOISE * max(abs(value), abs(thesis)))


def _sample(values: ArrayLike, what: str, at_least: int = 2) -> FloatArray:
    """The values as an array (n,). Raises BadInput, which begins with `what`, unless there are enough finite ones."""
    sample = np.asarray(values, dtype=np.float64)
    if sample.ndim != 1 or len(sample) < at_least or not np.isfinite(sample).all():
        raise BadInput(f"{what}: shape {sample.shape}; needed: at least {at_least} finite values in one row")
    return sample


def _mean(sample: FloatArray) -> float:
    """The mean, exact when all values are equal."""
    return float(sample[0] + (sample - sample[0]).mean())


def _anova(samples: Sequence[FloatArray]) -> tuple[float, float, float]:
    """F, p and the mean square within groups; samples (n,) are scaled so that the largest value is about 1."""
    sizes, means = np.array([len(sample) for sample in samples]), np.array([_mean(sample) for sample in samples])
    grand = means[0] + np.average(means - means[0], weights=sizes)
    between_df, within_df = len(samples) - 1, int(sizes.sum()) - len(samples)
    between = float((sizes * np.square(means - grand)).sum()) / between_df
    squares = sum(float(np.square(sample - mean).sum()) for sample, mean in zip(samples, means, strict=True))
    mean_square = max(squares / within_df, NOISE**2)
    f = between / mean_square
    return f, float(scipy.stats.f.sf(f, between_df, within_df)), mean_square


def _tukey(samples: Mapping[str, FloatArray], mean_square: float) -> dict[tuple[str, str], float]:
    """p by pair, from the studentized range with the harmonic mean of both sizes (Tukey-Kramer).

    For thousands of values and nearly equal means scipy warns that its integral converges slowly; its p, 1, is right.
    """
    df = sum(map(len, samples.values())) - len(samples)
    p_values = {}
    for first, second in combinations(samples, 2):
        error = sqrt(mean_square / 2 * (1 / len(samples[first]) + 1 / len(samples[second])))
        q = abs(_mean(samples[first]) - _mean(samples[second])) / error
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", scipy.integrate.IntegrationWarning)
            p_values[first, second] = float(scipy.stats.studentized_range.sf(q, len(samples), df))
    return p_values


def _normality(sample: FloatArray) -> float | None:
    """p of the Kolmogorov-Smirnov test of a sample (n,) against the normal distribution of its mean and deviation."""
    deviation = float(np.std(sample, ddof=1))
    if deviation <= NOISE:
        return None
    expected = scipy.special.ndtr((np.sort(sample) - sample.mean()) / deviation)
    n = len(sample)
    steps = np.arange(n + 1) / n
    distance = max(float((steps[1:] - expected).max()), float((expected - steps[:-1]).max()))
    return float(scipy.special.kolmogorov(sqrt(n) * distance))
