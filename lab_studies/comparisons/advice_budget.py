"""The cost of advice: success against helped steps, for every gate with and without memory, and every kind of advisor."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from math import hypot
from typing import Any, Literal, NamedTuple

import numpy as np

from lab.advice.advisors import SKILL_TAUS
from lab.learning.gates import GATES
from lab.statistics import share
from lab.studies.findings import Findings, Row, mean_row, row, share_row, those
from lab.studies.runner import Job
from lab_studies.comparisons.advice_budget_figures import ccrl_picture, gates_picture
from lab_studies.thesis.chapter_9 import ADVISOR, EXACT, RECONSTRUCTED
from lab_studies.thesis.chapter_9_sessions import AdviceOutcome, AdviceSetting, measured, sessions_of

WORLDS = ("world-1", "world-2")
RANDOM = "random"
RANDOM_WORLDS = tuple(f"random:10x10x10:0.06:{seed}" for seed in range(100))
PLACES = (*WORLDS, RANDOM)
VIEWS: tuple[Literal["full", "limited"], ...] = ("full", "limited")
WRONG, NOBODY = "wrong", "nobody"
ADVISORS = (*SKILL_TAUS, WRONG)
CCRL = ("ccrl",)
ASKING = tuple(
    gate for gate, known in GATES.items() if gate != "never" and not (known.compiled and known.compiled.weighs)
)
AGAINST = {False: "alone", True: "alone, with memory"}  # learning without advice, by memory
TARGETS = {"expert": (99.0, 24.0), "moderate": (98.0, 60.0), "limited": (85.0, 150.0), "novice": (63.0, 10.0)}
MOST_BELOW = -2.0  # the target: points of success that an advisor may cost compared with learning alone

MEASURES = (
    "SP: sessions whose last episode took the shortest path. HS: helped steps, in which advice was asked for and followed; "
    "steps repeated from memory do not count. AR: episodes in which advice was asked for. Each gate has its default settings "
    "(those of the world's file), not the best of the thesis's grid. Wrong: an advisor that takes the worst action for the "
    f"best. World 'random': {len(RANDOM_WORLDS)} random worlds from {RANDOM_WORLDS[0]} on, which share the sessions; there a "
    "limited view is the middle half of each axis. Without memory, advice is measured with full view in worlds I and II only, "
    "and learning alone everywhere."
)
LAST = (
    "With memory nobody is asked in the last 15 % of the episodes, and in the last one, whose path counts, the learner takes "
    "the moves of the highest value. Without memory its choice is still random in the last episode, in world II in about every "
    "fifth; CCRL and the combined method do not ask there either, but other gates may, so that part of their success or "
    "failure is the advisor's."
)
OWN_MEMORY = (
    "Mind the rows 'nobody, memory': a learner without advice remembers all of its own moves, and practises the shortest path "
    "through them before the end. Much of what weak and wrong advisors seem to give with memory is the learner's own; compare "
    "them with these rows, as only what lies above them is the advisor's. Memory changes the learner, not only the gate."
)
WORST = (
    "worst_below_alone: the lowest success with memory over all advisors, with CCRL or with any gate, minus that of learning "
    "alone, without and with memory, with Newcombe's 95 % interval. The lowest of many is below its true value on average. "
    "Targets are the project's, not the thesis's."
)


def advice_budget(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every gate, advisor and world, with and without memory; the reading changes all settings.

    Advisors know the exact values unless the reading says otherwise.
    """
    cells = {cell: tuple(replace(setting, **reading) for setting in group) for cell, group in settings().items()}
    outcomes = _outcomes(job, cells)
    table = next(iter(cells.values()))[0].advisor_table
    rows = [result for cell, outcome in outcomes.items() for result in rows_of(cell, outcome, table)]
    below = [
        result
        for gates in (CCRL, ASKING)
        for place in PLACES
        for view in VIEWS
        for result in worst_advisor_rows(outcomes, place, view, gates)
    ]
    shown = [result for result in rows if result["world"] in WORLDS and result["view"] == "full"]
    pictures = {
        "Success against helped steps, all gates": gates_picture(shown),
        "Success against helped steps, CCRL without and with memory": ccrl_picture(shown, TARGETS),
    }
    notes = (
        MEASURES,
        LAST,
        OWN_MEMORY,
        WORST,
        EXACT.split(";")[0] + "." if table == "exact" else ADVISOR,
        RECONSTRUCTED,
    )
    return Findings(rows + below, in_short(rows, below), pictures, notes)


class BudgetCell(NamedTuple):
    """A cell of the study: world, view of the advisor (full for nobody), gate, advisor and memory."""

    world: str
    view: Literal["full", "limited"]
    gate: str
    advisor: str
    memory: bool


def settings() -> dict[BudgetCell, tuple[AdviceSetting, ...]]:
    """The measured settings by cell, one for each of its worlds; for nobody, the gate never asks."""
    cells: dict[BudgetCell, tuple[AdviceSetting, ...]] = {}
    for place in PLACES:
        worlds = RANDOM_WORLDS if place == RANDOM else (place,)
        for memory in (False, True):
            alone = [AdviceSetting(world, memory=memory, advisor_table="exact") for world in worlds]
            cells[BudgetCell(place, "full", "never", NOBODY, memory)] = tuple(alone)
            for view in VIEWS if memory else ("full",) if place in WORLDS else ():
                for gate in ASKING:
                    for name in ADVISORS:
                        tau = SKILL_TAUS["expert" if name == WRONG else name]
                        cells[BudgetCell(place, view, gate, name, memory)] = tuple(
                            replace(setting, view=view, gate=gate, tau=tau, wrong=name == WRONG) for setting in alone
                        )
    return cells


def _outcomes(job: Job, cells: Mapping[BudgetCell, tuple[AdviceSetting, ...]]) -> dict[BudgetCell, AdviceOutcome]:
    """The outcome of each cell; those of one world are kept in the job's folder."""
    single = {cell: group[0] for cell, group in cells.items() if cell.world != RANDOM}
    outcomes = measured(job, list(single.values()))
    share = max(1, job.sessions // len(RANDOM_WORLDS))
    joined = job.each(
        partial(_joined, sessions=share, seed=job.seed), [cells[cell] for cell in cells if cell not in single]
    )
    return {cell: outcomes[single[cell]] if cell in single else joined[group] for cell, group in cells.items()}


def _joined(group: tuple[AdviceSetting, ...], sessions: int, seed: int) -> AdviceOutcome:
    """The outcome of `sessions` sessions of each setting, joined."""
    parts = [sessions_of(setting, sessions, seed) for setting in group]
    return AdviceOutcome(
        *(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(AdviceOutcome))
    )


def rows_of(cell: BudgetCell, outcome: AdviceOutcome, table: str) -> list[Row]:
    """The measures of one cell, with the project's target if there is one."""
    named: Row = {
        "world": cell.world,
        "view": cell.view,
        "gate": cell.gate,
        "memory": cell.memory,
        "advisor": cell.advisor,
    }
    if cell.advisor != NOBODY:
        named |= {"tau": SKILL_TAUS.get(cell.advisor, SKILL_TAUS["expert"]), "advisor_table": table}
    rows = [
        share_row(named, "SP_percent", outcome.success),
        mean_row(named, "HS_steps", outcome.helped_steps),
        mean_row(named, "AR_requests", outcome.requests),
    ]
    if cell == BudgetCell("world-1", "full", "ccrl", cell.advisor, True) and cell.advisor in TARGETS:
        for result, target in zip(rows, TARGETS[cell.advisor], strict=False):
            result["target"] = target
    return rows


def difference(outcome: AdviceOutcome, other: AdviceOutcome) -> tuple[float, float, float]:
    """The difference of two settings' success rates, and the low and the high end of its interval, in percentage points.

    Source: R. G. Newcombe, Statistics in Medicine 17 (1998), 873-890, method 10.
    """
    (percent, low, high), (than, than_low, than_high) = share(outcome.success), share(other.success)
    gap = percent - than
    return gap, gap - hypot(percent - low, than_high - than), gap + hypot(high - percent, than - than_low)


def worst_advisor_rows(
    outcomes: Mapping[BudgetCell, AdviceOutcome],
    place: str,
    view: Literal["full", "limited"],
    gates: Sequence[str] = CCRL,
) -> list[Row]:
    """Rows of the advisor and gate with the least success with memory, compared with nobody without and with memory."""
    cells = [BudgetCell(place, view, gate, name, True) for gate in gates for name in ADVISORS]
    lowest = min(cells, key=lambda cell: float(outcomes[cell].success.mean()))
    rows = []
    for memory in (False, True):
        gap, low, high = difference(outcomes[lowest], outcomes[BudgetCell(place, "full", "never", NOBODY, memory)])
        named: Row = {
            **lowest._asdict(),
            "over": "any gate" if len(gates) > 1 else lowest.gate,
            "against": AGAINST[memory],
        }
        rows.append(row(named, "worst_below_alone_points", gap, (low, high)))
    return rows


def in_short(rows: Sequence[Row], below: Sequence[Row]) -> Row:
    """The targets and what was measured, success alone, the worst advisor against that, and what memory saves."""
    names = ("world", "view", "gate", "advisor", "memory", "measure")
    value = {tuple(result[name] for name in names): result["value"] for result in rows}

    def cell(place: str, gate: str, name: str, memory: bool) -> tuple[float, float]:
        cell = (place, "full", gate, name, memory)
        return value[*cell, "SP_percent"], value[*cell, "HS_steps"]

    says: Row = {}
    for name, (sp, hs) in TARGETS.items():
        remembering, without = (cell("world-1", "ccrl", name, memory) for memory in (True, False))
        missed = [
            what for what, kept in (("success", remembering[0] >= sp), ("steps", remembering[1] <= hs)) if not kept
        ]
        verdict = f"{' and '.join(missed)} missed" if missed else "met"
        says[f"{name}, target {_in_units(sp, hs)}"] = (
            f"{_in_units(*remembering)}: {verdict} (without memory {_in_units(*without)})"
        )
    for place in PLACES:
        for memory, against in AGAINST.items():
            says[f"{place}: {against}"] = f"{cell(place, 'never', NOBODY, memory)[0]:.1f} %"
    saved = [
        1.0 - cell(place, gate, name, True)[1] / cell(place, gate, name, False)[1]
        for place in WORLDS
        for gate in ASKING
        for name in SKILL_TAUS
        if cell(place, gate, name, False)[1] > 0
    ]
    says["helped steps that memory saves, median over gates and skills [%]"] = round(100 * float(np.median(saved)), 1)
    return says | _worst_in_short(below)


def _in_units(success: float, helped: float) -> str:
    return f"{round(success, 1):g} % / {round(helped, 1):g} steps"


def _worst_in_short(below: Sequence[Row]) -> Row:
    says: Row = {}
    for memory, against in AGAINST.items():
        lowest = min(those(below, against=against), key=lambda result: float(result["value"]))
        name = "worst_below_alone_with_memory" if memory else "worst_below_alone"
        says[name] = round(float(lowest["value"]), 1)
        says[f"{name} target"] = f"at least {MOST_BELOW:g} points: {verdict(lowest)}"
    for result in below:
        low, high = result["ci95"]
        which = result["advisor"] if result["over"] == result["gate"] else f"{result['gate']}, {result['advisor']}"
        place = f"{result['world']}, {result['view']} view"
        says[f"{place}: worst with {result['over']} against {result['against']} [points]"] = (
            f"{result['value']:+.1f} ({low:+.1f} to {high:+.1f}): {which}"
        )
    return says


def verdict(lowest: Row) -> str:
    """Whether the worst advisor meets the target, as far as the interval says."""
    low, high = lowest["ci95"]
    if low >= MOST_BELOW:
        return "met, with its interval"
    return "missed" if high < MOST_BELOW else "open: the interval contains it"
