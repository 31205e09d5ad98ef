"""Aggregates of AdviceBench over problems, as rliable defines them: interquartile means, performance profiles, improvement.

Source: Agarwal et al., Deep reinforcement learning at the edge of the statistical precipice, NeurIPS 2021.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from lab.mdp import FloatArray
from lab.statistics import interquartile_mean, performance_profile, probability_of_improvement, stratified_interval
from lab_studies.comparisons.advice_bench.rules import BUDGETS, NOBODY
from lab_studies.comparisons.advice_bench.sessions import Case, Outcome, Outcomes

RETURN, GREEDY = "return while advised", "greedy policy"
SCORES = {RETURN: "points", GREEDY: "greedy"}  # the field of `Outcome` by headline score
REPEATS = 500  # of the bootstrap
THRESHOLDS = np.linspace(-20.0, 100.0, 121)
COLUMNS = ("problems", "score", "rule", "interquartile_mean", "ci95_low", "ci95_high", "improvement", "mean_rank", "p")


class Table(NamedTuple):
    """A rule's scores (runs, cells): the sessions in all cells (problem, advisor, budget); strata (cells,): the problems."""

    scores: FloatArray
    strata: FloatArray


class Aggregate(NamedTuple):
    """A rule's interquartile mean (value, low, high); the chance that ours scores above it, None for ours; its profile."""

    iqm: tuple[float, float, float]
    improvement: float | None
    profile: FloatArray


def table_of(
    outcomes: Mapping[Case, Outcomes], rule: str, score: str, problems: Sequence[str], advisors: Sequence[str]
) -> Table:
    """The scores of a rule in all cells; nobody's sessions stand in each cell of their problem.

    Of problems with more sessions than others, as those with random moves, as many count, spread evenly over their instances.
    """
    columns: list[FloatArray] = []
    strata = []
    for number, name in enumerate(problems):
        for advisor in advisors:
            for budget in BUDGETS:
                outcome: Outcome
                alone = rule == NOBODY
                outcome = (
                    outcomes[Case(name, None)][NOBODY, "any"] if alone else outcomes[Case(name, advisor)][rule, budget]
                )
                columns.append(getattr(outcome, SCORES[score]))
                strata.append(number)
    runs = min(map(len, columns))
    counted = [column[np.arange(runs) * len(column) // runs] for column in columns]
    return Table(np.array(counted).T, np.array(strata, np.float64))


def aggregates(tables: Mapping[str, Table], ours: str, seed: int) -> dict[str, Aggregate]:
    """The aggregates by rule; seed: of the bootstrap. All cells of a problem are drawn together, as they share their seeds."""
    return {
        rule: Aggregate(
            stratified_interval(table.scores, interquartile_mean, seed, REPEATS, table.strata),
            probability_of_improvement(tables[ours].scores, table.scores) if ours in tables and rule != ours else None,
            performance_profile(table.scores, THRESHOLDS),
        )
        for rule, table in tables.items()
    }
