"""Mean ranks of rules over problems, and the distance from which two differ (Friedman's test, Nemenyi's critical difference)."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from lab.mdp import FloatArray

Cell = tuple[str, str, str]  # problem, advisor, budget


class Ranks(NamedTuple):
    """Mean ranks by rule, best first.

    critical: two ranks that differ by less are not told apart. p: of the hypothesis that all rules are alike, None for one
    problem or two rules. beaten: by rule, the p of the hypothesis that our rule scores no more than it (Wilcoxon's signed
    ranks over problems, Holm's correction).
    """

    mean: dict[str, float]
    critical: float
    p: float | None
    beaten: dict[str, float]


def ranks(scores: Mapping[str, Mapping[Cell, float]], problems: Sequence[str], ours: str) -> Ranks:
    """Mean ranks: 1 is the highest score in a cell, ties share; means are over a problem's cells, then over problems.

    The blocks of the test are the problems, as cells of one problem are not independent. Source: Demsar, JMLR 7 (2006).
    """
    from scipy.stats import friedmanchisquare, rankdata, studentized_range, wilcoxon

    rules = list(scores)
    cells = [cell for cell in scores[rules[0]] if cell[0] in problems]
    table = np.array([rankdata([-scores[rule][cell] for rule in rules]) for cell in cells])
    by_problem: FloatArray = np.array(
        [
            table[[cell[0] == problem for cell in cells]].mean(axis=0)
            for problem in dict.fromkeys(cell[0] for cell in cells)
        ]
    )
    mean, (n, k) = by_problem.mean(axis=0), by_problem.shape
    critical = float(studentized_range.ppf(0.95, k, np.inf) / np.sqrt(2.0) * np.sqrt(k * (k + 1) / (6.0 * n)))
    p = float(friedmanchisquare(*by_problem.T).pvalue) if n > 1 and k > 2 else None
    ordered = sorted(zip(rules, mean.tolist(), strict=True), key=lambda pair: pair[1])
    means = {
        rule: np.array(
            [np.mean([scores_of_rule[cell] for cell in cells if cell[0] == name]) for name in dict.fromkeys(problems)]
        )
        for rule, scores_of_rule in scores.items()
    }
    others = [rule for rule in rules if rule != ours] if ours in means else []
    single = {
        rule: 1.0  # the test is not defined where nothing differs
        if (means[ours] == means[rule]).all()
        else float(wilcoxon(means[ours], means[rule], alternative="greater").pvalue)
        for rule in others
    }
    return Ranks(dict(ordered), critical, p, holm(single))


def holm(single: Mapping[str, float]) -> dict[str, float]:
    """The p values corrected for their number (Holm 1979)."""
    corrected, least = {}, 0.0
    for number, (name, p) in enumerate(sorted(single.items(), key=lambda pair: pair[1])):
        least = max(least, min(1.0, p * (len(single) - number)))
        corrected[name] = least
    return corrected
