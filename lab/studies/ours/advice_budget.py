"""What advice costs: success against helped steps, for every gate with and without memory, and every kind of advisor."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import hypot
from typing import Any

import numpy as np

from lab.advice.advisors import SKILL_TAUS
from lab.learning.gates import GATES
from lab.studies.findings import Findings, Row, mean_row, row, share_row, those
from lab.studies.ours.advice_budget_figures import of_ccrl, of_gates
from lab.studies.runner import Job
from lab.studies.statistics import share
from lab.studies.thesis.chapter_9 import ADVISOR, EXACT, RECONSTRUCTED
from lab.studies.thesis.chapter_9_sessions import AdviceOutcome, AdviceSetting, measured

WORLDS = ("world-1", "world-2")
WRONG, NOBODY = "wrong", "nobody"
ADVISORS = (*SKILL_TAUS, WRONG)
CCRL = ("ccrl",)
ASKING = tuple(gate for gate in GATES if gate != "never")
AGAINST = {False: "alone", True: "alone, with memory"}
TARGETS = {"expert": (99.0, 24.0), "moderate": (98.0, 60.0), "limited": (85.0, 150.0), "novice": (63.0, 10.0)}
MOST_BELOW = -2.0  # points of success that an advisor may cost against learning alone: the target

MEASURES = (
    "SP: sessions whose last episode took the shortest way. HS: helped steps, those that were asked for and followed; what is "
    "done again from memory is none. AR: episodes in which advice was asked for. Each gate is at its defaults (those of "
    "the world's file), not at the best of the thesis's grid. Full view. Wrong: takes the worst action for the best."
)
LAST = (
    "With memory nobody is asked in the last episode, whose way is what counts. Without it CCRL and the combined method do not "
    "ask there either, but the other gates may: part of their success, or failure, is the advisor's own walk."
)
OWN_MEMORY = (
    "Mind the rows 'nobody, memory': a learner that nobody advises remembers its own shortest way and practises it before the "
    "end. Much of what weak and wrong advisors seem to give with memory is the learner's own: they are to be held "
    "against these rows, and only what lies above them is the advisor's. Memory changes the learner, not only the gate."
)
WORST = (
    "worst_below_alone: the lowest success of CCRL with memory over all advisors, less that of learning alone, with Newcombe's "
    "95 % interval; any gate: over all gates, too. The lowest of many is below its true value on average. Targets: those of the "
    "project, not the thesis's."
)


def advice_budget(job: Job, reading: Mapping[str, Any]) -> Findings:
    """Every gate, advisor and world, with and without memory; advisors know the exact values unless read otherwise."""
    cells = {cell: replace(setting, **reading) for cell, setting in settings().items()}
    found = measured(job, list(cells.values()))
    outcomes = {cell: found[setting] for cell, setting in cells.items()}
    table = next(iter(cells.values())).advisor_table
    rows = [one for cell, outcome in outcomes.items() for one in rows_of(cell, outcome, table)]
    below = [one for gates in (CCRL, ASKING) for place in WORLDS for one in worst(outcomes, place, gates)]
    pictures = {
        "Success against helped steps, all gates": of_gates(rows),
        "Success against helped steps, CCRL without and with memory": of_ccrl(rows, TARGETS),
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


Asked = tuple[str, str, str, bool]  # world, gate, advisor, memory


def settings() -> dict[Asked, AdviceSetting]:
    """What is measured; nobody: the gate never asks."""
    cells: dict[Asked, AdviceSetting] = {}
    for place in WORLDS:
        for memory in (False, True):
            alone = AdviceSetting(place, memory=memory, advisor_table="exact")
            cells[place, "never", NOBODY, memory] = alone
            for gate in ASKING:
                for name in ADVISORS:
                    tau = SKILL_TAUS["expert" if name == WRONG else name]
                    cells[place, gate, name, memory] = replace(alone, gate=gate, tau=tau, wrong=name == WRONG)
    return cells


def rows_of(cell: Asked, outcome: AdviceOutcome, table: str) -> list[Row]:
    """The measures of one cell; where the project has a target it stands beside them."""
    place, gate, name, memory = cell
    named: Row = {"world": place, "view": "full", "gate": gate, "memory": memory, "advisor": name}
    if name != NOBODY:
        named |= {"tau": SKILL_TAUS.get(name, SKILL_TAUS["expert"]), "advisor_table": table}
    rows = [
        share_row(named, "SP_percent", outcome.success),
        mean_row(named, "HS_steps", outcome.helped_steps),
        mean_row(named, "AR_requests", outcome.requests),
    ]
    if (place, gate, memory) == ("world-1", "ccrl", True) and name in TARGETS:
        for one, target in zip(rows, TARGETS[name], strict=False):
            one["target"] = target
    return rows


def difference(one: AdviceOutcome, other: AdviceOutcome) -> tuple[float, float, float]:
    """How much more often one setting's sessions succeed than another's, low and high end, in points.

    Source: R. G. Newcombe, Statistics in Medicine 17 (1998), 873-890, method 10.
    """
    (percent, low, high), (than, than_low, than_high) = share(one.success), share(other.success)
    gap = percent - than
    return gap, gap - hypot(percent - low, than_high - than), gap + hypot(high - percent, than - than_low)


def worst(outcomes: Mapping[Asked, AdviceOutcome], place: str, gates: Sequence[str] = CCRL) -> list[Row]:
    """The advisor (and gate) with whom sessions with memory succeed least, against nobody, without and with memory."""
    of = {(gate, name): outcomes[place, gate, name, True] for gate in gates for name in ADVISORS}
    gate, name = min(of, key=lambda cell: of[cell].success.mean())
    rows = []
    for memory in (False, True):
        gap, low, high = difference(of[gate, name], outcomes[place, "never", NOBODY, memory])
        named = {"world": place, "view": "full", "gate": gate, "memory": True, "advisor": name}
        named |= {"over": "any gate" if len(gates) > 1 else gate, "against": AGAINST[memory]}
        rows.append(row(named, "worst_below_alone_points", gap, (low, high)))
    return rows


def in_short(rows: Sequence[Row], below: Sequence[Row]) -> Row:
    """The targets beside what was measured, nobody, the worst advisor against nobody, what memory saves."""
    value = {(one["world"], one["gate"], one["advisor"], one["memory"], one["measure"]): one["value"] for one in rows}

    def cell(place: str, gate: str, name: str, memory: bool) -> tuple[float, float]:
        return value[place, gate, name, memory, "SP_percent"], value[place, gate, name, memory, "HS_steps"]

    says: Row = {}
    for name, (sp, hs) in TARGETS.items():
        found, without = (cell("world-1", "ccrl", name, memory) for memory in (True, False))
        missed = [what for what, kept in (("success", found[0] >= sp), ("steps", found[1] <= hs)) if not kept]
        verdict = f"{' and '.join(missed)} missed" if missed else "met"
        says[f"{name}, target {_both(sp, hs)}"] = f"{_both(*found)}: {verdict} (without memory {_both(*without)})"
    for place in WORLDS:
        for memory, against in AGAINST.items():
            says[f"{place}: {against}"] = f"{value[place, 'never', NOBODY, memory, 'SP_percent']:.1f} %"
    saved = [
        1.0 - cell(place, gate, name, True)[1] / cell(place, gate, name, False)[1]
        for place in WORLDS
        for gate in ASKING
        for name in SKILL_TAUS
        if cell(place, gate, name, False)[1] > 0
    ]
    says["helped steps that memory saves, median over gates and skills [%]"] = round(100 * float(np.median(saved)), 1)
    return says | _worst_in_short(below)


def _both(success: float, helped: float) -> str:
    return f"{round(success, 1):g} % / {round(helped, 1):g} steps"


def _worst_in_short(below: Sequence[Row]) -> Row:
    lowest = min(those(below, over="ccrl", against="alone"), key=lambda one: float(one["value"]))
    says: Row = {"worst_below_alone": round(float(lowest["value"]), 1)}
    says["worst_below_alone target"] = f"at least {MOST_BELOW:g} points: {verdict(lowest)}"
    for one in below:
        low, high = one["ci95"]
        which = one["advisor"] if one["over"] == one["gate"] else f"{one['gate']}, {one['advisor']}"
        says[f"{one['world']}: worst with {one['over']} against {one['against']} [points]"] = (
            f"{one['value']:+.1f} ({low:+.1f} to {high:+.1f}): {which}"
        )
    return says


def verdict(lowest: Row) -> str:
    """Whether the worst advisor keeps to the target, as far as the interval says."""
    low, high = lowest["ci95"]
    if low >= MOST_BELOW:
        return "met, with its interval"
    return "missed" if high < MOST_BELOW else "open: the interval holds it"
