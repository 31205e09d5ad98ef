"""srl-time compared with every rival: how often it finds the optimum, its gap, and its episodes and seconds."""

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from lab.studies.findings import Findings, Row, agreement, row, share_row, those, varying_row
from lab.studies.runner import Job
from lab_studies.comparisons.srl_time_figures import by_episodes, by_wall_time, of_orders
from lab_studies.comparisons.srl_time_sessions import (
    CAPS,
    COMPILED,
    LEARNING,
    READABLE,
    Instance,
    MethodOutcome,
    MethodSetting,
    method_outcome,
    single_sequence_methods,
)

CASES = ("I", "II", "III")
FEW = {3: (5, 15, 30, 60, 200), 4: (15, 50, 100, 400)}  # session lengths by number of toasts
MANY, MANY_EPISODES = (10, 20, 30), (200, 1000)
LONGEST_READABLE = 200  # the most episodes of SRL that is not compiled
READABLE_FROM = 30  # toasts from which SRL has too many states to be compiled
ORDERS, MEANS_S, ORDER_EPISODES = ("RSR", "SSRSR", "RRSRR", "SRRSRRSS"), (100.0, 200.0), (50, 200, 1000)
FACTORS = ("A", "B")
EXACT_TO = 1e-9  # a smaller gap, as a fraction, is due to rounding

MEASURES = (
    "SP: sessions whose best sequence is optimal; final SP: sessions whose final greedy policy is optimal. Gap: how far the best "
    "sequence is above the proven optimum. All times are means. The thesis prints none of this in this form."
)
METHODS = (
    "srl A, srl B: fig. 5.1 with both reward factors (α .05, γ .9, β 1 for 3 toasts and .5 for more; in the FMS, as in "
    "App. III, with values per next state of the stations); mc: Monte Carlo averages; ga: a genetic algorithm that begins "
    "with the dispatching rules and improves each child. srl-time starts from a lower bound of the whole model, which learners "
    "that see only episodes do not have; compare them with its row without the bound. "
    "fifo and the dispatching rules have one sequence each, exact and cp-sat prove theirs. A rule may be as good as any "
    "learner: nearest-ready's sequences are optimal in case III."
)
WALLS = (
    "Seconds are those of one session on one core, while other processes of the study run; compiling is not counted. srl, mc "
    "and random are compiled and run many sessions at once; ga is compiled and runs one after another; srl-time, the rules "
    "and exact are plain Python. srl-time's seconds include its table of lower bounds. exact proves the optimum of all these "
    "jobs in less time than 200 episodes of srl-time take: a learner is useful where there is no such proof."
)
LIMITS = (
    f"Most sessions: {CAPS['few']['srl-time']} of srl-time, with and without the bound, with few toasts; with 10 and more "
    f"{CAPS['many']['srl-time']}, and {CAPS['many'][COMPILED]} of the compiled methods; in the FMS {CAPS['order']['srl-time']} "
    f"and {CAPS['order'][COMPILED]}. SRL with {READABLE_FROM} toasts has more states than 63 bits can number and is not "
    f"compiled: {CAPS['many'][READABLE]} sessions of {LONGEST_READABLE} episodes."
)


def srl_time_study(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every method with few and many toasts, and with orders of the FMS; the reading has no effect."""
    works = instances()
    settings = [setting for work in works for setting in settings_of(work)]
    longest_first = sorted(settings, key=lambda setting: -(setting.work.cell.parts * (setting.episodes or 0)))
    outcomes = job.each(partial(method_outcome, sessions=job.sessions, seed=job.seed), longest_first)
    rows = [result for setting in settings for result in rows_of(setting, outcomes[setting])]
    pictures = {
        "Sessions that find the optimum, by their length (bands: 95 % intervals)": by_episodes(rows, "SP_percent"),
        "Sessions whose greedy policy at the end is the optimum": by_episodes(rows, "final_SP_percent"),
        "Many toasts: gap to the optimum by the seconds of a session, a line a case": by_wall_time(rows),
        "FMS: gap to the optimum by session length (bands: 95 % intervals)": of_orders(rows),
    }
    return Findings(rows, agreement(rows) | in_short(rows), pictures, (MEASURES, METHODS, WALLS, LIMITS))


def instances() -> list[Instance]:
    """All instances."""
    toasts = [Instance(case, number) for number, case in product((*FEW, *MANY), CASES)]
    return toasts + [Instance(order=order, interval_s=mean_s) for order, mean_s in product(ORDERS, MEANS_S)]


def settings_of(work: Instance) -> list[MethodSetting]:
    """Every method with an instance, at every session length."""
    lengths = ORDER_EPISODES if work.order is not None else FEW.get(work.toasts or 0, MANY_EPISODES)
    settings = []
    for method in LEARNING:
        if work.size == "many" and method == "mc":
            continue  # no better than srl there, and as slow
        for factor in _factors(work, method):
            settings += [
                MethodSetting(work, method, episodes, factor)
                for episodes in lengths
                if method != "srl" or (work.toasts or 0) < READABLE_FROM or episodes <= LONGEST_READABLE
            ]
    return settings + [MethodSetting(work, method) for method in single_sequence_methods(work)]


def _factors(work: Instance, method: str) -> tuple[str | None, ...]:
    if method != "srl":
        return (None,)
    return FACTORS if work.size == "few" else ("B",)


def rows_of(setting: MethodSetting, outcome: MethodOutcome) -> list[Row]:
    """Success, gap and seconds of a setting."""
    named, rows = _described(setting, len(outcome.gap)), []
    for measure, gaps in (("SP_percent", outcome.gap), ("final_SP_percent", outcome.final_gap)):
        if np.isfinite(gaps).all():
            percent = share_row(named, measure, gaps <= EXACT_TO)
            rows.append(percent if setting.method in LEARNING else row(named, measure, percent["value"]))
    rows.append(varying_row(named, "gap_percent", 100.0 * np.maximum(outcome.gap, 0.0)))
    return [*rows, varying_row(named, "wall_s", outcome.wall_s)]


def _described(setting: MethodSetting, sessions: int) -> Row:
    work = setting.work
    table = "FMS" if work.order is not None else f"{work.toasts} toasts"
    named: Row = {
        "table": table,
        "case": work.case,
        "toasts": work.toasts,
        "order": work.order,
        "interval_s": work.interval_s,
        "method": setting.method,
        "reward_factor": setting.reward_factor,
        "episodes": setting.episodes,
        "sessions": sessions,
    }
    return {name: value for name, value in named.items() if value is not None}


def in_short(rows: Sequence[Row]) -> Row:
    """The least success of srl-time, and the mean gaps of all methods in the longest sessions, by table."""
    says: Row = {}
    for table, longest in _longest(those(rows, method="srl-time")):
        longest_rows = those(rows, method="srl-time", table=table, measure="SP_percent", episodes=longest)
        says[f"srl-time, {table}: least SP in {longest} episodes [%]"] = round(
            min(result["value"] for result in longest_rows), 1
        )
    for table, longest in _longest(rows):
        for method in LEARNING:
            if longest_rows := those(rows, method=method, table=table, measure="gap_percent", episodes=longest):
                mean = float(np.mean([result["value"] for result in longest_rows]))
                says[f"{method}, {table}: mean gap in {longest} episodes [%]"] = round(mean, 2)
    proofs = [result["value"] for result in those(rows, method="exact", measure="wall_s")]
    return says | {"exact: longest proof [s]": round(max(proofs), 2)}


def _longest(rows: Iterable[Row]) -> list[tuple[str, int]]:
    longest: dict[str, int] = {}
    for result in rows:
        if "episodes" in result:
            longest[result["table"]] = max(longest.get(result["table"], 0), result["episodes"])
    return list(longest.items())
