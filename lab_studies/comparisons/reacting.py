"""Random times: a fixed list, policies that react, and the best order in hindsight, compared in the same episodes."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance, Episode, drawn_seed
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.rollout import by_rule, replan
from lab.sequencing.methods.rules import usable
from lab.sequencing.simulate.cell_arrays import Floats
from lab.sequencing.simulate.several import replicate
from lab.studies.charts import bars
from lab.studies.findings import Findings, Row, mean_row, row, those
from lab.studies.runner import Job
from lab.tasks.cell_file import order_from_word
from lab.tasks.task_file import load_cell
from lab_studies.comparisons.hindsight import in_hindsight
from lab_studies.comparisons.rolling import FUTURES, rolling

ROBOTS = "robots break down"
WORKS = (
    *(("toast-case-1", "TTTT"), ("toast-case-2", "TTTT"), ("toast-case-3", "TTTT"), ("fms", "RSRSR")),
    ("two-carriers", "BBBB"),
)
TROUBLES = {
    "times 10 % off": Chance("normal"),
    "exponential times": Chance("exponential"),
    "breakdowns": Chance("normal", breaks_every_s=300.0, repair_s=60.0),
    "late parts": Chance("normal", late_s=60.0),
    ROBOTS: Chance("normal", robot_breaks_every_s=300.0, robot_repair_s=60.0),
}
LIST, RULE, ANEW, ROLLING, HINDSIGHT = "the list as it is", "best rule", "planned anew", "rolling", "best in hindsight"
ABOUT = (
    "Makespans in {episodes} random episodes, the same ones for all; intervals are 95 % intervals of the mean. The list is "
    "the proven optimum by the mean times, which is never changed. Best rule: of all dispatching rules, asked at "
    "every decision, the one with the least mean here. Planned anew: by rollout with mean times, at every decision; "
    "with several robots at every event, beginning with the list. Rolling, for one robot: "
    "each decision is tried in {futures} futures drawn from what can be known, followed by the list and by every rule. "
    "Best in hindsight: the optimum with all times known (a bound if it was not proven), "
    "which no policy can beat; if robots break down, a bound without breakdowns."
)
KINDS = (
    "Times 10 % off: processing times are normal with a standard deviation of a tenth of the mean (thesis 7.6). "
    "Breakdowns: in addition, a machine works for 300 s between two of them on average, and is repaired for 60 s. Late "
    "parts: in addition, each part comes 60 s late on average; parts of the FMS, which arrive one after another, are never "
    "late. Robots break down: in addition, a robot is in order for 300 s on average, at work or not, and then stops "
    "where it is, with what it holds, for 60 s."
)
LIMITS = (
    "Rolling decisions are for one robot: their futures are compiled for decisions that follow one another in time, and have "
    "no breakdowns of the robot, which delay all decisions alike. Machines break down only while they work."
)


@dataclass(frozen=True)
class Setting:
    """A cell with an order, and a trouble of TROUBLES."""

    cell: str
    order: str
    trouble: str


@dataclass(frozen=True)
class SettingOutcome:
    """The makespans in each episode [s], by policy, and the best rule.

    decision_s: the time of a rolling decision [s], None without any; proven: the number of proven optima in hindsight.
    """

    costs: Mapping[str, Floats]
    rule: str
    decision_s: float | None
    proven: int


def reacting(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every cell with every trouble; the reading has no effect."""
    settings = [Setting(cell, order, trouble) for cell, order in WORKS for trouble in TROUBLES]
    outcomes = job.each(partial(setting_outcome, episodes=job.sessions, seed=job.seed), settings)
    rows = [line for setting in settings for line in rows_of(setting, outcomes[setting])]
    figures = {f"{cell}, {order}": _picture(rows, cell) for cell, order in WORKS}
    alike = [(result["table"], result["trouble"]) for result in those(rows, measure="makespan_s", method=ROLLING)]
    alike = [pair for pair in alike if pair[1] != ROBOTS]  # hindsight is only a bound there
    says: Row = {}
    for name in (LIST, RULE, ANEW, ROLLING) if alike else ():
        over = those(rows, measure="over hindsight_percent", method=name)
        mean = np.mean([result["value"] for result in over if (result["table"], result["trouble"]) in alike])
        says[f"{name}: mean over hindsight, one robot that never breaks down [%]"] = round(float(mean), 2)
    took_s = [outcome.decision_s for outcome in outcomes.values() if outcome.decision_s is not None]
    says["milliseconds a rolling decision"] = round(1e3 * float(np.mean(took_s)), 1) if took_s else None
    notes = (ABOUT.format(episodes=job.sessions, futures=FUTURES), KINDS, LIMITS)
    return Findings(rows, says, figures, notes)


def setting_outcome(setting: Setting, episodes: int, seed: int) -> SettingOutcome:
    """The makespans of all policies in the same episodes of a setting."""
    file = load_cell(setting.cell)
    cell, chance = file.cell(order_from_word(file, setting.order)), TROUBLES[setting.trouble]
    planned = optimum(cell).sequence if cell.serial else cp_sat(cell).sequence
    costs = {LIST: replicate(cell, planned, chance, episodes, seed)}
    rules = {name: replicate(cell, by_rule(rule), chance, episodes, seed) for name, rule in usable(cell).items()}
    rule = min(rules, key=lambda name: float(rules[name].mean()))
    costs |= {RULE: rules[rule], ANEW: replicate(cell, replan(planned=planned), chance, episodes, seed)}
    decision_s = None
    if cell.serial:
        policy = rolling(planned, chance, seed)
        replicate(cell, policy, chance, 1, seed)  # compiles
        began_s = perf_counter()
        costs[ROLLING] = replicate(cell, policy, chance, episodes, seed)
        decision_s = (perf_counter() - began_s) / episodes / len(planned)
    costs[HINDSIGHT], proven = _hindsight(cell, chance, episodes, seed)
    return SettingOutcome(costs, rule, decision_s, proven)


def _hindsight(cell: Cell, chance: Chance, episodes: int, seed: int) -> tuple[Floats, int]:
    rng = np.random.default_rng(seed)  # the episodes of `replicate`
    hindsights = [in_hindsight(cell, Episode(cell, chance, drawn_seed(rng))) for _ in range(episodes)]
    return np.array([hindsight.cost for hindsight in hindsights]), sum(hindsight.proven for hindsight in hindsights)


def rows_of(setting: Setting, outcome: SettingOutcome) -> list[Row]:
    """The mean makespan of each policy, what it saves compared with the list, and how far it is above hindsight."""
    rows: list[Row] = []
    least = float(outcome.costs[HINDSIGHT].mean())
    for name, costs in outcome.costs.items():
        named: Row = {"table": setting.cell, "order": setting.order, "trouble": setting.trouble, "method": name}
        if name == RULE:
            named["rule"] = outcome.rule
        rows.append(mean_row(named, "makespan_s", costs))
        if name not in (LIST, HINDSIGHT):
            rows.append(mean_row(named, "saved over the list_s", outcome.costs[LIST] - costs))
        rows.append(row(named, "over hindsight_percent", 100.0 * (float(costs.mean()) / least - 1.0)))
    return rows


def _picture(rows: list[Row], cell: str) -> bytes:
    """A picture with bars of the mean makespans, by trouble."""
    lines = {
        name: [those(rows, table=cell, trouble=trouble, method=name, measure="makespan_s")[0] for trouble in TROUBLES]
        for name in (LIST, RULE, ANEW, ROLLING, HINDSIGHT)
        if those(rows, table=cell, method=name)
    }
    return bars([*TROUBLES], lines, "mean makespan [s]")
