"""Mean ranks of rules over problems, and how far two must lie apart to differ (Friedman's test with Nemenyi's distance)."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from lab.mdp import FloatArray

Cell = tuple[str, str, str]  # problem, advisor, budget


class Ranks(NamedTuple):
    """Mean ranks by rule, best first; critical: two that lie less apart are not told apart; p: that all are alike."""

    mean: dict[str, float]
    critical: float
    p: float


def ranks(scores: Mapping[str, Mapping[Cell, float]], problems: Sequence[str]) -> Ranks:
    """Ranks in each cell, 1 the highest score, ties shared; means over a problem's cells, then over problems.

    The blocks of the test are the problems: cells of one problem are not independent. Source: Demsar, JMLR 7 (2006).
    """
    from scipy.stats import friedmanchisquare, rankdata, studentized_range

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
    p = float(friedmanchisquare(*by_problem.T).pvalue) if n > 1 and k > 2 else float("nan")
    ordered = sorted(zip(rules, mean.tolist(), strict=True), key=lambda one: one[1])
    return Ranks(dict(ordered), critical, p)
