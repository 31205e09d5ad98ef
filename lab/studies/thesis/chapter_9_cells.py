"""Chapter 9 again: tables 9.2-9.5 and Appendix V cell by cell, the sweep of beta, and the figures."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from lab.studies.runner import Job, Outcome, Setting, world
from lab.studies.statistics import Comparison, Range, compare, interval, proportion_interval, ranges, score, within

Row = dict[str, Any]
View = Literal["full", "limited"]
FloatArray = NDArray[np.float64]

PRINTED = Path(__file__).parent / "printed"
FILES = ("appendix-v.csv", "tables-9.2-9.5.csv")
GATES = {"CCRL": "ccrl", "IA": "ia", "combined": "combined"}
WORLDS = {"I": "world-1", "II": "world-2"}
TABLES: dict[str, tuple[str, View]] = {
    "table-9.2": ("world-1", "full"),
    "table-9.3": ("world-1", "limited"),
    "table-9.4": ("world-2", "full"),
    "table-9.5": ("world-2", "limited"),
}
TAUS = (0.01, 0.1, 0.3, 1.0)
BETAS = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5)
BEST_BETA = {"world-1": (1.3, 63.0), "world-2": (0.7, 37.0)}  # section 9.9.1: beta, success percentage
REPLICATIONS = 5  # section 9.8: five of 100 sessions each

Parameters = tuple[str, str, float | None, int | None, float | None]  # view, gate, Lambda, Omega, Psi


@dataclass(frozen=True)
class Cell:
    """One printed line: a setting, or (average) the mean over the four advisors of one combination of parameters."""

    setting: Setting
    average: bool
    sp: float
    hs: float
    score: float
    rank: str | None = None

    @property
    def parameters(self) -> Parameters:
        """What the lines of one combination have in common."""
        s = self.setting
        return s.view, s.gate, s.lambda_threshold, s.omega, s.psi


@cache
def printed(file: str) -> tuple[Cell, ...]:
    """The lines of a printed table, in its order."""
    with (PRINTED / file).open(encoding="utf-8") as table:
        return tuple(_cell(line) for line in csv.DictReader(table))


def _cell(line: dict[str, str]) -> Cell:
    def number(name: str) -> float | None:
        return float(line[name]) if line[name] else None

    omega, average = number("Omega"), line["advisor_tau"] == "all"
    setting = Setting(
        world=WORLDS[line["world"]],
        view=cast(View, line["view"]),
        gate=GATES[line["method"]],
        tau=None if average else float(line["advisor_tau"]),
        lambda_threshold=number("Lambda"),
        omega=None if omega is None else int(omega),
        psi=number("Psi") if "Psi" in line else None,
    )
    sp, hs, points = (float(line[name]) for name in ("SP_percent", "HS_steps", "score"))
    return Cell(setting, average, sp, hs, points, line.get("rank"))


def _is_at(cell: Cell, place: str, view: View) -> bool:
    return (cell.setting.world, cell.setting.view) == (place, view)


class Grid:
    """All printed combinations of one world and view, measured; `reading`: changes to all settings."""

    def __init__(self, job: Job, place: str, view: View, reading: Mapping[str, Any]):
        self.reading = reading
        self.cells, self.best = ([c for c in printed(file) if _is_at(c, place, view)] for file in FILES)
        settings = [setting for cell in (*self.cells, *self.best) for setting in self._settings(cell)]
        self.outcomes = job.run(settings)  # one combination of table 9.3 is not in Appendix V
        sp = [_percent(outcome) for outcome in self.outcomes.values()]
        hs = [float(outcome.helped_steps.mean()) for outcome in self.outcomes.values()]
        self.sp_range, self.hs_range = ranges(sp, hs)

    def _asked(self, setting: Setting) -> Setting:
        return replace(setting, **self.reading)

    def _settings(self, cell: Cell) -> list[Setting]:
        taus = TAUS if cell.average else [cell.setting.tau]
        return [self._asked(replace(cell.setting, tau=tau)) for tau in taus]

    def of(self, cell: Cell) -> list[Outcome]:
        """The outcome of a cell, or those of its four advisors (some of which the scan of the thesis does not show)."""
        return [self.outcomes[setting] for setting in self._settings(cell)]

    def scores(self, cell: Cell) -> FloatArray:
        """The score of each of five replications, averaged over the cell's advisors; eq. 9.4."""
        scores = [_replicated_scores(outcome, self.sp_range, self.hs_range) for outcome in self.of(cell)]
        means: FloatArray = np.mean(scores, axis=0)
        return means

    def rows(self, cell: Cell) -> list[Row]:
        """SP, HS and score of a cell beside the printed ones; for CCRL its requests, which are not printed."""
        outcomes, setting = self.of(cell), self._asked(cell.setting)
        named = describe(setting, "all" if cell.average else setting.tau)
        if len(outcomes) == 1:
            share, low, high = proportion_interval(int(outcomes[0].success.sum()), len(outcomes[0].success))
        else:
            share, low, high = interval(np.mean([100.0 * outcome.success for outcome in outcomes], axis=0))
        helped = interval(np.mean([outcome.helped_steps for outcome in outcomes], axis=0))
        rows = [
            row(named, "SP_percent", share, (low, high), cell.sp),
            row(named, "HS_steps", helped[0], helped[1:], cell.hs),
            row(named, "score", *_interval(self.scores(cell)), cell.score),
        ]
        if setting.gate == "ccrl":
            asked = interval(np.mean([outcome.requests for outcome in outcomes], axis=0))
            rows.append(row(named, "AR_requests", asked[0], asked[1:], None))
        return rows


def _interval(values: FloatArray) -> tuple[float, tuple[float, float]]:
    mean, low, high = interval(values)
    return mean, (low, high)


def _percent(outcome: Outcome) -> float:
    return 100.0 * float(outcome.success.mean())


def _replicated_scores(outcome: Outcome, sp_range: Range, hs_range: Range) -> FloatArray:
    sp = np.array([100.0 * part.mean() for part in np.array_split(outcome.success, REPLICATIONS)])
    hs = np.array([part.mean() for part in np.array_split(outcome.helped_steps, REPLICATIONS)])
    return score(sp, hs, sp_range, hs_range)


def describe(setting: Setting, tau: float | str | None = None) -> Row:
    """A setting under the names that rows use, only what applies to it; `tau` is its own unless said otherwise."""
    own = {"tau": setting.tau if tau is None else tau, "beta": setting.beta}
    if setting.beta is None:
        own["beta"] = world(setting.world).learner.beta
    names = ("world", "view", "gate", "tau", "lambda_threshold", "omega", "psi", "beta")
    said = {name: own.get(name, getattr(setting, name)) for name in names}
    if said["tau"] is not None:
        said["advisor_table"] = setting.advisor_table
    return {name: value for name, value in said.items() if value is not None}


def row(named: Row, measure: str, value: float, ci: Sequence[float] | None, thesis: float | None) -> Row:
    """One row of a study: its settings, the measured value with its interval, the printed one, whether they agree."""
    ends = None if ci is None else [float(ci[0]), float(ci[1])]
    agrees = None if thesis is None else within(value, ends, thesis, measure)
    return {**named, "measure": measure, "value": float(value), "ci95": ends, "thesis": thesis, "within": agrees}


def appendix(job: Job, places: Iterable[tuple[str, View]], reading: Mapping[str, Any]) -> list[Row]:
    """Every line of Appendix V for these worlds and views."""
    rows: list[Row] = []
    for place, view in places:
        grid = Grid(job, place, view, reading)
        for cell in grid.cells:
            rows += grid.rows(cell)
    return rows


def table(job: Job, name: str, reading: Mapping[str, Any]) -> list[Row]:
    """One of the tables 9.2-9.5: the printed best combinations, with our ranks of the methods for each advisor."""
    place, view = TABLES[name]
    grid = Grid(job, place, view, reading)
    rows: list[Row] = []
    tests: list[Row] = []
    for tau in (*TAUS, None):
        chosen = [cell for cell in grid.best if cell.setting.tau == tau]
        found = compare({cell.setting.gate: grid.scores(cell) for cell in chosen})
        for cell in chosen:
            ranked = {"rank": found.ranks[cell.setting.gate], "thesis_rank": cell.rank}
            rows += [{**one, **ranked} for one in grid.rows(cell)]
        about = {"table": "comparison of scores", "world": place, "view": view, "tau": "all" if tau is None else tau}
        tests += _tests(about, found)
    return rows + tests


def _tests(named: Row, found: Comparison) -> list[Row]:
    """The tests behind the ranks: their p values (Appendix II)."""
    rows = [row(named, "ANOVA_p", found.p, None, None), row(named, "Levene_p", found.levene, None, None)]
    for (one, other), p in found.tukey.items():
        rows.append(row({**named, "gate": f"{one} - {other}"}, "Tukey_p", p, None, None))
    normal = [(gate, p) for gate, p in found.normality.items() if p is not None]
    return rows + [row({**named, "gate": gate}, "KS_p", p, None, None) for gate, p in normal]


def by_beta(job: Job, places: Iterable[str] = ("world-1", "world-2")) -> list[Row]:
    """Learning alone with several decay factors: fig. 9.4 and the two figures that section 9.9.1 names."""
    settings = [Setting(place, beta=beta) for place in places for beta in BETAS]
    rows = []
    for setting, outcome in job.run(settings).items():
        share, low, high = proportion_interval(int(outcome.success.sum()), len(outcome.success))
        best, percent = BEST_BETA[setting.world]
        named = {"table": "Figure 9.4", **describe(setting)}
        rows.append(row(named, "SP_percent", share, (low, high), percent if setting.beta == best else None))
    return rows


def agreement(rows: Sequence[Row]) -> Row:
    """How many cells have a printed figure and how many lie within its bounds, in all and by measure."""
    compared = [one for one in rows if one["within"] is not None]
    summary: Row = {"cells": len(compared), "within": sum(one["within"] for one in compared)}
    for measure in dict.fromkeys(one["measure"] for one in compared):
        of = [one["within"] for one in compared if one["measure"] == measure]
        summary[f"{measure} cells"], summary[f"{measure} within"] = len(of), sum(of)
    ranked = [one for one in rows if one["measure"] == "score" and one.get("thesis_rank")]
    if ranked:
        summary["ranks"] = len(ranked)
        summary["ranks as printed"] = sum(one["rank"] == one["thesis_rank"] for one in ranked)
    return summary
