"""The arms of a study with people compared, measure by measure: a mixed-effects model, rank tests, and sizes of effects.

A participant's lessons of one arm count as one value, their mean. In a study within participants each of them was in several
arms, and the tests are of paired values; otherwise each was in one.
"""

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from statistics import mean, median
from typing import Any

import numpy as np
import scipy

from lab.errors import BadInput, counted, unknown
from lab.lazy import statsmodels
from lab.mdp import FloatArray
from lab.optional import require
from lab.statistics import LEVEL, interval

Row = Mapping[str, Any]
USUAL = {  # measure -> its title and its unit
    "solved": ("Solved lessons", "share"),
    "episodes_to_goal": ("Episodes until the goal was reached", "episodes"),
    "mean_steps": ("Mean steps of an episode", "steps"),
    "answers": ("Answers", "answers"),
    "seconds": ("Time of a lesson", "s"),
    "latency_median_s": ("Median time to an answer", "s"),
}
LOAD = "_mean"  # the end of a measure's name that is the mean of a questionnaire
REPEATS = 2000  # of a bootstrap
LEAST = 3  # participants of a test
ALIKE = 1e-9  # differences below this count as none
NO_SHARE = 1e-3  # of the standard deviation of the rest, below which that between participants counts as none


@dataclass(frozen=True)
class ArmValues:
    """One arm: participants with a value, and without; the mean with its 95 % interval (None for fewer than two), the median."""

    n: int
    missing: int
    mean: float | None
    ci95: tuple[float, float] | None
    median: float | None


@dataclass(frozen=True)
class PairCompared:
    """Two arms: the difference of means, second minus first, and the rank-biserial correlation, each with a 95 % interval.

    p: of Wilcoxon's signed-rank test, or of the Mann-Whitney test between participants; p_holm: with Holm's correction for all
    pairs. The correlation is 1 if all values of the second arm are above those of the first. None for too few participants.
    """

    first: str
    second: str
    n: int
    difference: float | None
    difference_ci95: tuple[float, float] | None
    correlation: float | None
    correlation_ci95: tuple[float, float] | None
    p: float | None
    p_holm: float | None = None


@dataclass(frozen=True)
class ModelTerm:
    """One coefficient of the mixed-effects model: an arm against the first one, or one place later in the order."""

    name: str
    value: float
    ci95: tuple[float, float]
    p: float


@dataclass(frozen=True)
class MixedModel:
    """A linear mixed-effects model with a random intercept for each participant.

    p: of the Wald test that all arms are alike; between_sd, within_sd: standard deviations between participants and of the rest;
    note: why the estimates are to be doubted, "" if nothing says so.
    """

    terms: list[ModelTerm]
    p: float
    between_sd: float
    within_sd: float
    note: str = ""


@dataclass(frozen=True)
class MeasureCompared:
    """One measure in all arms.

    test: the name of the test of all arms at once, with its statistic, p and effect (Kendall's W, or epsilon squared), None for
    two arms or too few participants. values: by arm and participant.
    """

    name: str
    title: str
    unit: str
    arms: dict[str, ArmValues]
    test: str | None
    statistic: float | None
    p: float | None
    effect: float | None
    pairs: list[PairCompared]
    model: MixedModel | None
    values: dict[str, dict[str, float]] = field(default_factory=dict)


def compare_arms(
    rows: Sequence[Row], measures: Sequence[str] = (), seed: int = 0, model: bool = True
) -> tuple[str, list[MeasureCompared], list[str]]:
    """(design, measures, notes): all measures of a study compared between its arms.

    rows: one a lesson of a participant, with `participant`, `arm`, `position`, `lesson` and the measures (see
    `lab.classroom.export_columns`). measures: names of columns; none: the usual ones that have values, and means of
    questionnaires. design: "within" or "between" participants. model: whether the mixed-effects model is fitted.
    Raises BadInput for rows without two arms, an unknown measure, one without numbers, and if a library is missing.
    """
    rows = [row for row in rows if row["arm"] is not None]
    firsts: dict[str, int] = {}
    for row in rows:
        firsts[row["arm"]] = min(firsts.get(row["arm"], row["lesson"]), row["lesson"])
    arms = sorted(firsts, key=lambda arm: (firsts[arm], arm))
    if len(arms) < 2:
        raise BadInput(f"{counted(len(arms), 'arm')} of a study in these rows: nothing to compare; wanted two or more")
    each = {
        row["participant"]: {other["arm"] for other in rows if other["participant"] == row["participant"]}
        for row in rows
    }
    within = any(len(own) > 1 for own in each.values())
    if model and within:
        require("mixed-effects model (--model)", statsmodels)
    compared = []
    for number, name in enumerate(_chosen(rows, measures)):
        rng = np.random.default_rng([seed, number])
        compared.append(_compared(name, rows, arms, within, rng, model))
    return "within" if within else "between", compared, [*_notes(compared, within, len(each))]


def _chosen(rows: Sequence[Row], measures: Sequence[str]) -> list[str]:
    """The measures to compare. Raises BadInput for one that is no column or has no numbers."""
    columns = dict.fromkeys(name for row in rows for name in row)
    numbers = {name for name in columns if any(_number(row.get(name)) is not None for row in rows)}
    if not measures:
        return [name for name in columns if (name in USUAL or name.endswith(LOAD)) and name in numbers]
    for name in measures:
        if name not in columns:
            raise unknown("measure", name, columns, "--measure")
        if name not in numbers:
            raise BadInput(
                f"measure '{name}' (--measure): it has no numbers; with numbers: {', '.join(sorted(numbers))}"
            )
    return [*dict.fromkeys(measures)]


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, bool | int | float) and np.isfinite(value) else None


def _compared(
    name: str, rows: Sequence[Row], arms: Sequence[str], within: bool, rng: np.random.Generator, model: bool
) -> MeasureCompared:
    found: dict[tuple[str, str], list[float]] = {}
    everybody: dict[str, set[str]] = {arm: set() for arm in arms}
    places: dict[tuple[str, str], float] = {}
    for row in rows:
        key, value = (row["arm"], row["participant"]), _number(row.get(name))
        everybody[row["arm"]].add(row["participant"])
        places[key] = _number(row.get("position")) or 0.0
        if value is not None:
            found.setdefault(key, []).append(value)
    values: dict[str, dict[str, float]] = {arm: {} for arm in arms}
    for (arm, person), several in found.items():
        values[arm][person] = mean(several)
    described = {arm: _described(values[arm], len(everybody[arm])) for arm in arms}
    test, statistic, p, effect = _all_arms(values, within)
    pairs = [_pair(values, first, second, within, rng) for first, second in combinations(arms, 2)]
    title, unit = USUAL.get(name, (name.replace("_", " "), ""))
    fitted = _fitted(values, places, arms) if model and within else None
    return MeasureCompared(name, title, unit, described, test, statistic, p, effect, holm(pairs), fitted, values)


def _described(values: Mapping[str, float], everybody: int) -> ArmValues:
    numbers = [*values.values()]
    middle, low, high = interval(numbers) if len(numbers) > 1 else (numbers[0] if numbers else None, None, None)
    ends = None if low is None or high is None else (low, high)
    if ends is not None and {*numbers} <= {0.0, 1.0}:
        ends = max(0.0, ends[0]), min(1.0, ends[1])
    return ArmValues(len(numbers), everybody - len(numbers), middle, ends, median(numbers) if numbers else None)


# ---- tests ---------------------------------------------------------------------------------------------------------------


def _all_arms(
    values: Mapping[str, Mapping[str, float]], within: bool
) -> tuple[str | None, float | None, float | None, float | None]:
    """(name, statistic, p, effect) of the test of three or more arms at once."""
    if len(values) < 3:
        return None, None, None, None
    if within:
        table = _complete(values)
        if len(table) < LEAST or np.ptp(table, axis=1).max() <= ALIKE:
            return None, None, None, None
        found = scipy.stats.friedmanchisquare(*table.T)
        kendall_w = float(found.statistic) / (len(table) * (table.shape[1] - 1))
        return "Friedman", float(found.statistic), float(found.pvalue), kendall_w
    groups = [np.array([*arm.values()]) for arm in values.values()]
    n = sum(map(len, groups))
    if min(map(len, groups)) < LEAST or np.ptp(np.concatenate(groups)) <= ALIKE:
        return None, None, None, None
    found = scipy.stats.kruskal(*groups)
    return "Kruskal-Wallis", float(found.statistic), float(found.pvalue), float(found.statistic) / (n - 1)


def _complete(values: Mapping[str, Mapping[str, float]]) -> FloatArray:
    """The values (participants, arms) of the participants who have one in every arm."""
    people = [person for person in next(iter(values.values())) if all(person in arm for arm in values.values())]
    return np.array([[arm[person] for arm in values.values()] for person in people]).reshape(-1, len(values))


def _pair(
    values: Mapping[str, Mapping[str, float]], first: str, second: str, within: bool, rng: np.random.Generator
) -> PairCompared:
    one, other = values[first], values[second]
    statistics: tuple[Callable[..., Any], ...]
    if within:
        table = _complete({first: one, second: other})
        samples: tuple[FloatArray, ...] = (table[:, 1] - table[:, 0],)
        n, statistics = len(table), (np.mean, paired_correlation)
    else:
        samples = np.array([*other.values()]), np.array([*one.values()])
        n, statistics = min(map(len, samples)), (_difference, correlation)
    if n < LEAST:
        return PairCompared(first, second, n, None, None, None, None, None)
    difference, ends = _bootstrapped(samples, statistics[0], rng)
    related, related_ends = _bootstrapped(samples, statistics[1], rng)
    return PairCompared(first, second, n, difference, ends, related, related_ends, _p(samples))


def _p(samples: tuple[FloatArray, ...]) -> float:
    """p of Wilcoxon's signed-rank test of differences, or of the Mann-Whitney test of two samples."""
    if len(samples) == 1:
        own = np.where(np.abs(samples[0]) <= ALIKE, 0.0, samples[0])
        return float(scipy.stats.wilcoxon(own).pvalue) if own.any() else 1.0
    return float(scipy.stats.mannwhitneyu(*samples, alternative="two-sided").pvalue)


def _difference(second: FloatArray, first: FloatArray) -> float:
    return float(np.mean(second) - np.mean(first))


def paired_correlation(differences: FloatArray) -> float:
    """The matched-pairs rank-biserial correlation of differences (n,): (sum of ranks above 0 - below 0) / sum of all.

    Differences of 0 do not count; without any others it is 0. Source: D. Kerby, Comprehensive Psychology 3 (2014).
    """
    own = differences[np.abs(differences) > ALIKE]
    ranks = scipy.stats.rankdata(np.abs(own))
    return float((ranks * np.sign(own)).sum() / ranks.sum()) if len(own) else 0.0


def correlation(second: FloatArray, first: FloatArray) -> float:
    """The rank-biserial correlation of two samples: how often a value of the second is above one of the first, minus below."""
    return float(np.sign(second[:, None] - first[None, :]).mean())


def _bootstrapped(
    samples: tuple[FloatArray, ...], statistic: Any, rng: np.random.Generator
) -> tuple[float, tuple[float, float]]:
    """A statistic of samples and its percentile bootstrap interval; participants are drawn anew, with replacement."""
    value = float(statistic(*samples))
    drawn = [
        statistic(*(sample[rng.integers(len(sample), size=len(sample))] for sample in samples)) for _ in range(REPEATS)
    ]
    low, high = np.quantile(drawn, ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
    return value, (float(low), float(high))


def holm(pairs: Sequence[PairCompared]) -> list[PairCompared]:
    """The pairs with Holm's correction of their p. Source: S. Holm, Scand. J. Stat. 6 (1979), 65-70."""
    known = sorted((pair.p, number) for number, pair in enumerate(pairs) if pair.p is not None)
    corrected: dict[int, float] = {}
    highest = 0.0
    for place, (p, number) in enumerate(known):
        highest = corrected[number] = min(1.0, max(highest, p * (len(known) - place)))
    return [PairCompared(**{**vars(pair), "p_holm": corrected.get(number)}) for number, pair in enumerate(pairs)]


# ---- the model -----------------------------------------------------------------------------------------------------------


def _fitted(
    values: Mapping[str, Mapping[str, float]], places: Mapping[tuple[str, str], float], arms: Sequence[str]
) -> MixedModel | None:
    """The mixed-effects model of a measure, with the order as a covariate where it varies; None for too few values."""
    keys = [(arm, person) for arm in arms for person in values[arm]]
    y = np.array([values[arm][person] for arm, person in keys])
    present = [arm for arm in arms if values[arm]]
    people = {person for _, person in keys}
    if len(people) < LEAST or len(present) < 2 or np.ptp(y) <= ALIKE or len(y) <= len(present) + 1:
        return None
    place = np.array([places[key] for key in keys])
    columns = {"all": np.ones(len(y))}
    columns |= {f"{arm} - {present[0]}": np.array([float(key[0] == arm) for key in keys]) for arm in present[1:]}
    if np.ptp(place) > 0:
        columns["one place later"] = place - place.mean()
    x = np.stack([*columns.values()], axis=1)
    if np.linalg.matrix_rank(x) < x.shape[1]:
        return None
    scale = float(np.std(y))
    if np.abs(y - x @ np.linalg.lstsq(x, y)[0]).max() <= ALIKE * scale:  # nothing varies but the arms
        return None
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            model = statsmodels.regression.mixed_linear_model.MixedLM(
                y / scale, x, groups=[person for _, person in keys]
            )
            fit = model.fit(reml=True)
            if not fit.converged:
                fit = model.fit(reml=True, method="powell")
            ends = fit.conf_int(1 - LEVEL)
            tested = fit.wald_test(np.eye(len(fit.params))[1 : len(present)], scalar=True)
        except (np.linalg.LinAlgError, ValueError):  # a variance that cannot be told from 0
            return None
    terms = [
        ModelTerm(
            name,
            scale * float(fit.params[n]),
            (scale * float(ends[n][0]), scale * float(ends[n][1])),
            float(fit.pvalues[n]),
        )
        for n, name in enumerate(columns)
        if n
    ]
    known = [number for term in terms for number in (term.value, *term.ci95, term.p)]
    if not np.isfinite([*known, float(tested.pvalue), float(fit.scale), np.asarray(fit.cov_re)[0, 0]]).all():
        return None
    between = scale * float(np.sqrt(max(0.0, np.asarray(fit.cov_re)[0, 0])))
    notes = [] if fit.converged else ["it did not converge: its p and intervals are not to be trusted"]
    if between <= NO_SHARE * scale * float(np.sqrt(fit.scale)):
        notes.append("participants do not differ beyond the rest")
    elif any("boundary" in str(one.message) for one in told):
        notes.append("the estimates may lie on the boundary of what is possible")
    return MixedModel(terms, float(tested.pvalue), between, scale * float(np.sqrt(fit.scale)), "; ".join(notes))


def _notes(compared: Sequence[MeasureCompared], within: bool, people: int) -> Iterator[str]:
    """What a reader has to know of the numbers."""
    if within:
        yield (
            "Within participants: Friedman's test of those who have a value in every arm, and Wilcoxon's signed-rank test of "
            "each pair of arms."
        )
        if any(measure.model is not None for measure in compared):
            yield (
                "The mixed-effects model is linear, with a random intercept for each participant; its terms are the arms and the "
                "place in the participant's order."
            )
        if people < 6:
            least = 2 / 2**people
            yield f"Only {counted(people, 'participant')}: Wilcoxon's p cannot be below {least:.2g}, whatever the values are."
    else:
        yield "Between participants: the Kruskal-Wallis test of all arms, and the Mann-Whitney test of each pair of them."
    yield (
        "p of pairs is corrected by Holm's method within a measure, not for the number of measures. Intervals are of 95 %: of "
        f"means by Student's t, of differences and correlations by {REPEATS} bootstrap samples of participants."
    )
    if any(measure.name == "solved" and measure.model is not None for measure in compared):
        yield "Solved lessons are shares; the model takes them as numbers (a linear probability model)."
    if missing := [measure.name for measure in compared if any(arm.missing for arm in measure.arms.values())]:
        yield (
            f"Some participants have no value of {', '.join(missing)}: they are left out there, which favours an arm if they "
            "are those who did badly in it."
        )
