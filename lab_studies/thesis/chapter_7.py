"""The studies of chapter 7: their cells, pictures and notes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import pi, sqrt
from typing import Any

import numpy as np

from lab.statistics import Comparison
from lab.studies.findings import Findings, Row, agreement, marked, row
from lab.studies.runner import Job
from lab_studies.thesis import appendix_4
from lab_studies.thesis import chapter_7_figures as figures
from lab_studies.thesis.chapter_7_cells import (
    DECAY_FACTORS,
    READINGS,
    SESSION_LENGTHS,
    Measured,
    PrintedFigure,
    SequencingSetting,
    describe,
    printed,
    printed_sessions,
    short_name,
)
from lab_studies.thesis.used_to_choose import DECAY_TABLE, SAYS_7

Comparisons = dict[SequencingSetting, Comparison]
Changes = Mapping[str, Any]  # to all settings: {"reading": "figure 5.1"}
TABLES = {"I": "Table 7.4", "II": "Table 7.5", "III": "Table 7.6"}
FACTOR_TABLE = "Table IV.2"
SIGNIFICANT = 0.05
EXAMPLE = "F = 93.8, srl B 72.5 %, random 68.8 %, mc 49.9 %"

SYMBOLS = (
    "SP: sessions that find the optimum; BR: the mean best time of a session with random processing times (10 %); CE: the "
    "first episode from which the time stays the same; final: sessions whose last episode takes the optimum's time. "
    "β: episode n explores with probability 1/n^β. srl A, srl B: SRL with a reward factor of type A, type B; mc: Monte Carlo."
)
READ_AS = (
    "The reading 'listing' does what the listings of App. VI do, which differs from fig. 5.1: values are kept per next state; "
    "the robot may choose a next state to which the toast cannot go now, or a toast that has to stay; Monte Carlo keeps the "
    "value of the last episode instead of an average. SRL's printed lead over Monte Carlo and random search is due to that: "
    "see the study readings-7. Fig. 5.1 as printed is the method srl of lab sequence."
)
HOW_MANY = (
    "The thesis ran 10 replications of 100 sessions for three toasts, of 30 for four, and 100 sessions for table IV.1. Here "
    "the sessions of a cell are split into ten replications, too. 'off by': the mean distance from the printed values, and in "
    "brackets its expectation from the sampling errors of both if the reading were exact; as times that are 15 % off count as "
    "agreeing, this distance says more."
)
SHADED = (
    "Ranks are Tukey's (95 %) among the methods at one session length, after an F-test; shaded: significantly better than "
    "another method, as in the grey cells of the printed tables."
)
FACTORS = (
    "Type A is 1 / (T - T* + a) + b: for three toasts with the listing's a = 5 s and b = .8; for four toasts none are printed, "
    "and a = 10 s, b = .95 were chosen because they come nearest to table IV.2. In case III the printed times of type A with "
    "three toasts are those of random search here, not SRL's, which is probably a wrong row in the thesis."
)
DISTANCES = (
    "Case I with certain times: 'off' is the mean distance from the printed values over the session lengths of one line of "
    "tables 7.4 and IV.2, in points of SP; 'chance' is its expectation from the sampling errors alone. In fig. 5.1 no state is "
    "banned, either."
)
DECAY = (
    "The thesis does not say which reward factor table IV.1 has. Type A gives its values; with type B practically every session "
    "finds the optimum at every β, but with β = 1 many do not end with it."
)


def best_results(job: Job, changes: Changes, case: str) -> Findings:
    """The results of one of the tables 7.4-7.6: three methods by session length in a case."""
    cells = _of_case(_changed(printed(SESSION_LENGTHS), changes), case)
    table = TABLES[case]
    rows, comparisons = _compared(Measured(job, [cell.setting for cell in cells]), cells, table)
    pictures = figures.length_pictures(rows, figures.of_case(case, table))
    notes = (SYMBOLS, READ_AS, SHADED, HOW_MANY, _assumptions([*comparisons.values()]), *examples(comparisons))
    return _findings(rows, job, pictures, notes)


def table_iv_1(job: Job, changes: Changes) -> Findings:
    """The results of table IV.1 and fig. 7.5, by beta."""
    rows = _decay_rows(Measured(job, _decay_settings(changes)), changes)
    pictures = {"Figure 7.5: SP and CE by beta": figures.beta_picture(rows)}
    return _findings(rows, job, pictures, (SYMBOLS, READ_AS, DECAY, SAYS_7, HOW_MANY))


def table_iv_2(job: Job, changes: Changes) -> Findings:
    """The results of table IV.2 and figs. 7.7 and 7.8, by reward factor."""
    cells = _changed([cell for cell in printed(SESSION_LENGTHS) if cell.setting.method == "srl"], changes)
    rows, _ = _compared(Measured(job, [cell.setting for cell in cells]), cells, FACTOR_TABLE)
    pictures = figures.length_pictures(rows, {name: figures.COMPARED[name] for name in figures.OF_FACTORS})
    return _findings(rows, job, pictures, (SYMBOLS, READ_AS, FACTORS, SAYS_7, SHADED, HOW_MANY))


def chapter_7(job: Job, changes: Changes) -> Findings:
    """The results of all tables and of figures 7.3 to 7.12 and IV.1 to IV.3; each cell is measured once."""
    cells = _changed(printed(SESSION_LENGTHS), changes)
    measured = Measured(job, [*(cell.setting for cell in cells), *_decay_settings(changes)])
    rows = _decay_rows(measured, changes)
    pictures = figures.session_pictures(job.seed) | {"Figure 7.5: SP and CE by beta": figures.beta_picture(rows)}
    for case, table in TABLES.items():
        rows += _compared(measured, _of_case(cells, case), table)[0]
    factors = _compared(measured, [cell for cell in cells if cell.setting.method == "srl"], FACTOR_TABLE)[0]
    pictures |= figures.length_pictures([*rows, *factors], figures.COMPARED) | appendix_4.pictures()
    rows += [result for result in factors if result.get("reward_factor") != "B"]  # type B stands in the other tables
    notes = (SYMBOLS, READ_AS, FACTORS, DECAY, SAYS_7, SHADED, HOW_MANY)
    return _findings(rows, job, pictures, notes)


def readings(job: Job, changes: Changes) -> Findings:
    """The success percentages of case I in tables 7.4 and IV.2 under several readings of SRL and Monte Carlo."""
    shown = [cell for cell in printed(SESSION_LENGTHS) if cell.measure == "SP_percent" and cell.setting.case == "I"]
    asked = [cell for name in READINGS for cell in _changed(shown, {**changes, "reading": name})]
    measured = Measured(job, [cell.setting for cell in asked])
    groups: dict[SequencingSetting, list[Row]] = {}
    for cell in asked:
        same = replace(cell.setting, episodes=0)
        groups.setdefault(same, []).append(measured.row("Table 7.4", cell.setting, cell.measure, cell.value))
    rows: list[Row] = []
    for same, group in groups.items():
        off, chance = deviation(group, job.sessions)
        named = {key: value for key, value in describe(same).items() if key not in ("episodes", "beta")}
        rows += [row(named, "off_points", off), row(named, "chance_points", chance)]
    notes = (DISTANCES, SYMBOLS, READ_AS)
    counts = {"readings": len(READINGS), "cells": 0, "within": 0}
    return Findings(rows, counts, figures.readings(rows), notes)


def _findings(rows: list[Row], job: Job, pictures: Mapping[str, bytes], notes: tuple[str, ...]) -> Findings:
    told = marked(rows)
    return Findings(told, summary(told, job.sessions), pictures, notes)


def _of_case(cells: Sequence[PrintedFigure], case: str) -> list[PrintedFigure]:
    return [cell for cell in cells if cell.setting.case == case and cell.setting.reward_factor != "A"]


def _changed(cells: Sequence[PrintedFigure], changes: Changes) -> list[PrintedFigure]:
    return [replace(cell, setting=replace(cell.setting, **changes)) for cell in cells]


def _decay_settings(changes: Changes) -> list[SequencingSetting]:
    settings = [cell.setting for cell in _changed(printed(DECAY_FACTORS), changes)]
    return [*settings, *(replace(setting, reward_factor="B") for setting in settings)]


def _decay_rows(measured: Measured, changes: Changes) -> list[Row]:
    """The rows of table IV.1, and the same with type B, which is not printed; both with the sessions that end optimal."""
    rows = []
    for factor in ("A", "B"):
        for cell in _changed(printed(DECAY_FACTORS), changes):
            setting = replace(cell.setting, reward_factor=factor)
            rows.append(measured.row(DECAY_TABLE, setting, cell.measure, cell.value if factor == "A" else None))
            if cell.measure == "SP_percent":
                rows.append(measured.row(DECAY_TABLE, setting, "final_percent", None))
    return rows


def _compared(measured: Measured, cells: Sequence[PrintedFigure], table: str) -> tuple[list[Row], Comparisons]:
    """The rows of these cells with their ranks at each session length, then those of the tests; and the comparisons."""
    groups: dict[SequencingSetting, list[SequencingSetting]] = {}
    for cell in cells:
        groups.setdefault(_length(cell.setting), []).append(cell.setting)
    comparisons = {same: measured.compared(settings) for same, settings in groups.items()}
    rows = []
    for cell in cells:
        ranks, name = comparisons[_length(cell.setting)].ranks, short_name(cell.setting)
        beaten = any(rank[0] != "1" for rank in ranks.values())
        more = {"rank": ranks[name], "shaded": ranks[name] == "1" and beaten}
        rows.append(measured.row(table, cell.setting, cell.measure, cell.value, **more))
    rows += [result for same, test in comparisons.items() for result in _tests(f"{table}: tests", same, test)]
    return rows, comparisons


def _length(setting: SequencingSetting) -> SequencingSetting:
    """What the settings that are compared have in common."""
    return replace(setting, method="", reward_factor=None, beta=None)


def _tests(table: str, same: SequencingSetting, comparison: Comparison) -> list[Row]:
    """The rows of the p values behind the ranks at one session length (Appendix II)."""
    named = {"table": table} | {name: value for name, value in describe(same).items() if name != "method"}
    pairs = [({**named, "method": f"{first} - {second}"}, p) for (first, second), p in comparison.tukey.items()]
    return [row(named, "ANOVA_p", comparison.p), *(row(pair, "Tukey_p", p) for pair, p in pairs)]


def _assumptions(comparisons: Sequence[Comparison]) -> str:
    """The sentence on the comparisons that do not meet the assumptions of the F-test (Appendix II)."""
    unequal = sum(comparison.levene < SIGNIFICANT for comparison in comparisons)
    tested = [p for comparison in comparisons for p in comparison.normality.values() if p is not None]
    skewed = sum(p < SIGNIFICANT for p in tested)
    return (
        f"The assumptions of the F-test, tested as in Appendix II: Levene's test finds unequal variances in {unequal} of "
        f"{len(comparisons)} comparisons, the Kolmogorov-Smirnov test no normal distribution in {skewed} of {len(tested)} groups."
    )


def examples(comparisons: Mapping[SequencingSetting, Comparison]) -> list[str]:
    """The sentence that compares our test with the example of Appendix II, if that is among these."""
    return [
        f"Appendix II's example (case I, 3 toasts, 30 episodes): {EXAMPLE} printed; here F = {test.f:.1f}, "
        + ", ".join(f"{name} {mean:.1f} %" for name, mean in test.means.items())
        for same, test in comparisons.items()
        if (same.case, same.toasts, same.episodes, same.environment) == ("I", 3, 30, "deterministic")
    ]


def deviation(rows: Sequence[Row], sessions: int) -> tuple[float, float]:
    """The mean distance of rows, each measured with so many sessions, from the printed values, and its expectation by chance.

    By chance: both values have the standard error of their sessions, and a normal error is sqrt(2/pi) standard errors on
    average. Rounding of the printed values is left out.
    """
    off, chance = [], []
    for result in rows:
        theirs = printed_sessions(result["table"], result["toasts"])
        error = (result["ci95"][1] - result["ci95"][0]) / 2 / 1.96
        off.append(abs(result["value"] - result["thesis"]))
        chance.append(sqrt(2 / pi) * error * sqrt(1 + sessions / theirs))
    return float(np.mean(off)), float(np.mean(chance))


def summary(rows: Sequence[Row], sessions: int) -> Row:
    """The number of cells that agree with the printed values, and their distance, by table, toasts and measure."""
    groups: dict[str, list[Row]] = {}
    for result in rows:
        if result["thesis"] is not None:
            groups.setdefault(f"{result['table']}, {result['toasts']} toasts: {result['measure']}", []).append(result)
    off = {}
    for name, group in groups.items():
        mean, chance = deviation(group, sessions)
        off[name] = f"off by {mean:.1f} ({chance:.1f} by chance)"
    return agreement(rows) | off
