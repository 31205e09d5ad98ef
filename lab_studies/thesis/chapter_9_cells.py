"""Chapter 9 again: tables 9.2-9.5 and Appendix V cell by cell, and the sweep of beta."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal, cast

import numpy as np

from lab.advice.advisors import SKILL_TAUS
from lab.mdp import FloatArray
from lab.statistics import Comparison, Range, compare, part_means, ranges, score
from lab.studies.findings import Row, marked, mean_row, row, share_row
from lab.studies.runner import Job
from lab_studies.thesis import printed_lines
from lab_studies.thesis.chapter_9_sessions import AdviceOutcome, AdviceSetting, learner_of, measured
from lab_studies.thesis.used_to_choose import ALL_ADVISORS, is_used

View = Literal["full", "limited"]

FILES = ("appendix-v.csv", "tables-9.2-9.5.csv")
GATES = {"CCRL": "ccrl", "IA": "ia", "combined": "combined"}
WORLDS = {"I": "world-1", "II": "world-2"}
TABLES: dict[str, tuple[str, View]] = {
    "table-9.2": ("world-1", "full"),
    "table-9.3": ("world-1", "limited"),
    "table-9.4": ("world-2", "full"),
    "table-9.5": ("world-2", "limited"),
}
TAUS = tuple(SKILL_TAUS.values())
BETAS = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5)
BEST_BETA = {"world-1": (1.3, 63.0), "world-2": (0.7, 37.0)}  # section 9.9.1: beta, success percentage
REPLICATIONS, PRINTED_SESSIONS = 5, 500  # section 9.8: five of 100 sessions each


@dataclass(frozen=True)
class PrintedLine:
    """One printed line: of a setting, or (average) the mean over the four advisors with the same parameters."""

    setting: AdviceSetting
    average: bool
    sp: float
    hs: float
    score: float
    rank: str | None = None


@cache
def printed(file: str) -> tuple[PrintedLine, ...]:
    """The lines of a printed table, in its order."""
    return tuple(map(_cell, printed_lines(file)))


def _cell(line: dict[str, str]) -> PrintedLine:
    def number(name: str) -> float | None:
        return float(line[name]) if line[name] else None

    omega, average = number("Omega"), line["advisor_tau"] == "all"
    setting = AdviceSetting(
        world=WORLDS[line["world"]],
        view=cast(View, line["view"]),
        gate=GATES[line["method"]],
        tau=None if average else float(line["advisor_tau"]),
        lambda_threshold=number("Lambda"),
        omega=None if omega is None else int(omega),
        psi=number("Psi") if "Psi" in line else None,
    )
    sp, hs, points = (float(line[name]) for name in ("SP_percent", "HS_steps", "score"))
    return PrintedLine(setting, average, sp, hs, points, line.get("rank"))


def _is_at(cell: PrintedLine, place: str, view: View) -> bool:
    return (cell.setting.world, cell.setting.view) == (place, view)


class Grid:
    """All printed combinations of one world and view, measured. reading: changes to all settings."""

    def __init__(self, job: Job, place: str, view: View, reading: Mapping[str, Any]):
        self.reading = reading
        self.cells, self.best = ([c for c in printed(file) if _is_at(c, place, view)] for file in FILES)
        settings = [setting for cell in (*self.cells, *self.best) for setting in self.settings_of(cell)]
        self.outcomes = measured(job, settings)  # one combination of table 9.3 is not in Appendix V
        sp = [100.0 * float(outcome.success.mean()) for outcome in self.outcomes.values()]
        hs = [float(outcome.helped_steps.mean()) for outcome in self.outcomes.values()]
        self.sp_range, self.hs_range = ranges(sp, hs)

    def _asked(self, setting: AdviceSetting) -> AdviceSetting:
        return replace(setting, **self.reading)

    def settings_of(self, cell: PrintedLine) -> list[AdviceSetting]:
        """The setting of a cell, or those of its four advisors if it is their mean."""
        taus = TAUS if cell.average else [cell.setting.tau]
        return [self._asked(replace(cell.setting, tau=tau)) for tau in taus]

    def of(self, cell: PrintedLine) -> list[AdviceOutcome]:
        """The outcome of a cell, or those of its four advisors (the scan of the thesis does not show all of them)."""
        return [self.outcomes[setting] for setting in self.settings_of(cell)]

    def scores(self, cell: PrintedLine) -> FloatArray:
        """The scores (5,) of the replications, averaged over the cell's advisors; eq. 9.4."""
        scores = [_replicated_scores(outcome, self.sp_range, self.hs_range) for outcome in self.of(cell)]
        means: FloatArray = np.mean(scores, axis=0)
        return means

    def rows(self, cell: PrintedLine) -> list[Row]:
        """The rows of SP, HS and score of a cell with the printed values; for CCRL also its requests, which are not printed."""
        outcomes, setting = self.of(cell), self._asked(cell.setting)
        named = describe(setting, ALL_ADVISORS if cell.average else setting.tau)
        if len(outcomes) == 1:
            succeeded = share_row(named, "SP_percent", outcomes[0].success, cell.sp, PRINTED_SESSIONS)
        else:
            means = np.mean([100.0 * outcome.success for outcome in outcomes], axis=0)
            succeeded = mean_row(named, "SP_percent", means, cell.sp, PRINTED_SESSIONS)
        helped = np.mean([outcome.helped_steps for outcome in outcomes], axis=0)
        rows = [
            succeeded,
            mean_row(named, "HS_steps", helped, cell.hs, PRINTED_SESSIONS),
            mean_row(named, "score", self.scores(cell), cell.score, REPLICATIONS * PRINTED_SESSIONS / len(helped)),
        ]
        rows = [result | {"used": is_used(setting.world, named["tau"])} for result in rows]
        if setting.gate == "ccrl":
            asked = np.mean([outcome.requests for outcome in outcomes], axis=0)
            rows.append(mean_row(named, "AR_requests", asked))
        return rows


def _replicated_scores(outcome: AdviceOutcome, sp_range: Range, hs_range: Range) -> FloatArray:
    sp, hs = part_means(outcome.success, REPLICATIONS), part_means(outcome.helped_steps, REPLICATIONS)
    return score(100.0 * sp, hs, sp_range, hs_range)


def describe(setting: AdviceSetting, tau: float | str | None = None) -> Row:
    """The fields of a setting that apply to it, as in rows; tau: in place of its own."""
    own = {"tau": setting.tau if tau is None else tau, "beta": learner_of(setting).beta}
    names = ("world", "view", "gate", "tau", "lambda_threshold", "omega", "psi", "beta")
    named = {name: own.get(name, getattr(setting, name)) for name in names}
    if named["tau"] is not None:
        named["advisor_table"] = setting.advisor_table
    return {name: value for name, value in named.items() if value is not None}


def appendix(job: Job, places: Iterable[tuple[str, View]], reading: Mapping[str, Any]) -> list[Row]:
    """The rows of every line of Appendix V for these worlds and views."""
    grids = (Grid(job, place, view, reading) for place, view in places)
    return marked(result for grid in grids for cell in grid.cells for result in grid.rows(cell))


def table(job: Job, name: str, reading: Mapping[str, Any]) -> list[Row]:
    """The rows of one of the tables 9.2-9.5: the printed best combinations, with our ranks of the methods by advisor."""
    place, view = TABLES[name]
    grid = Grid(job, place, view, reading)
    rows: list[Row] = []
    tests: list[Row] = []
    for tau in (*TAUS, None):
        chosen = [cell for cell in grid.best if cell.setting.tau == tau]
        comparison = compare({cell.setting.gate: grid.scores(cell) for cell in chosen})
        for cell in chosen:
            ranked = {"rank": comparison.ranks[cell.setting.gate], "thesis_rank": cell.rank}
            rows += [{**result, **ranked} for result in grid.rows(cell)]
        about = {
            "table": "comparison of scores",
            "world": place,
            "view": view,
            "tau": ALL_ADVISORS if tau is None else tau,
        }
        tests += _tests(about, comparison)
    return marked(rows) + tests


def _tests(named: Row, comparison: Comparison) -> list[Row]:
    """The rows of the p values behind the ranks (Appendix II)."""
    rows = [row(named, "ANOVA_p", comparison.p), row(named, "Levene_p", comparison.levene)]
    rows += [
        row({**named, "gate": f"{first} - {second}"}, "Tukey_p", p) for (first, second), p in comparison.tukey.items()
    ]
    return rows + [row({**named, "gate": gate}, "KS_p", p) for gate, p in comparison.normality.items() if p is not None]


def beta_rows(job: Job) -> list[Row]:
    """The rows of learning alone with several decay factors: fig. 9.4 and the two values that section 9.9.1 names."""
    settings = [AdviceSetting(place, beta=beta) for place in BEST_BETA for beta in BETAS]
    rows = []
    for setting, outcome in measured(job, settings).items():
        best, percent = BEST_BETA[setting.world]
        named = {"table": "Figure 9.4", **describe(setting)}
        if setting.beta == best:
            result = share_row(named, "SP_percent", outcome.success, percent, PRINTED_SESSIONS)
            rows.append(result | {"used": is_used(setting.world, None)})
        else:
            rows.append(share_row(named, "SP_percent", outcome.success))
    return marked(rows)
