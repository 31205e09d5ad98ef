"""SRL with a function approximator beside its table and every rival, at equal numbers of schedules, in cells held out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from time import process_time
from typing import Any

import numpy as np

from lab.errors import WorkFailed
from lab.sequencing import find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, stuck_cost
from lab.sequencing.methods.carried_over_policy import DEFAULT, CarriedPolicy
from lab.sequencing.methods.portfolio import best_known
from lab.sequencing.methods.rules import RULES
from lab.sequencing.methods.srl_linear import srl_linear
from lab.sequencing.search import SAME, Search
from lab.studies.charts import bars
from lab.studies.findings import Findings, Row, mean_row, median_row, row, share_row, those, varying_row
from lab.studies.runner import Job, record_of
from lab.tasks.sequencing import write_policy
from lab_studies.comparisons.carried_over_families import FMS, SHOP, SMALL, TOAST, manufacturing, shop, toasts
from lab_studies.comparisons.linear_updates import UPDATES

DRAWN: Mapping[str, Callable[[np.random.Generator, int, int], Cell]] = {SHOP: shop, TOAST: toasts, FMS: manufacturing}
SIZES: Mapping[str, Sequence[int]] = {TOAST: (3, 6, 12, 20), FMS: (3, 6, 12), SHOP: (3, 5, 8)}
SCHEDULES = 200  # of every method that searches
PRACTICE, LESSONS = 16, 1200  # small cells in which a family's policy is learned, and the episodes of it
REFERENCE_S = 5.0  # of CP-SAT, where A* proves nothing
SEARCHES = ("srl", "mc", "random", "srl-time", "srl-improved", "ga", "anneal", "srl-linear")
AT_ONCE = ("fifo", "carried", *(name for name in RULES if name != "earliest-due"))
SHIPPED, BEGUN, KEPT = "srl-linear, begun with carried", "srl-linear, begun with the policy", "policy of small cells"
TABLE, LINEAR = "srl", "srl-linear"
ABOUT = (
    "{cells} cells of each size, drawn by the seed of the study; settings were chosen on cells of another stream. Gap: of the "
    "best of {schedules} schedules, or of the only one, to the best order known: the proven optimum by A*, or, of the job shops, "
    "the best of all methods here and of annealing and CP-SAT in {limit:g} s ('proven': how many are proven optimal). A search "
    "that ends in deadlocks alone costs what a deadlock costs. Greedy gap: of what a learner's greedy policy does at the end."
)
POLICIES = (
    "'{kept}': for each family, srl-linear learned one policy in {practice} small cells ({lessons} episodes, each run in all of "
    "them); it decides in cells of every size without learning, and stands beside this report (policy-....json: lab sequence "
    "CELL --method policy:FILE). '{begun}' learns on from it in {schedules} schedules, '{shipped}' from the policy that ships."
)
UPDATES_NOTE = (
    "SARSA, Monte Carlo and the policy gradient learn weights of the same features step by step; they were measured to choose "
    "the way in which srl-linear learns. Seconds are CPU seconds of a session on one core, the tables of a cell included; these "
    "three are plain Python, and so are srl and mc where a state has more than 63 bits."
)


@dataclass(frozen=True)
class DrawnCell:
    """A cell of the study by its family, its number of parts, and its number there."""

    family: str
    parts: int
    number: int

    @property
    def group(self) -> str:
        """The table of the report that it belongs to."""
        return f"{self.family}: {self.parts} parts"


@dataclass(frozen=True)
class Tried:
    """The cost of a method in a cell, that of its greedy policy at the end (None: it has none), and CPU seconds."""

    cost: float
    final_cost: float | None
    seconds: float


@dataclass(frozen=True)
class CellOutcome:
    """The best cost known beside the methods, whether it is proven, and each method's result."""

    reference: float
    proven: bool
    tried: dict[str, Tried]

    @property
    def best(self) -> float:
        """The best cost known."""
        return min(self.reference, *(tried.cost for tried in self.tried.values()))


def srl_linear_study(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every method in `job.sessions` cells of each size; the reading has no effect."""
    policies = {family: family_policy(family, job.seed) for family in SIZES}
    cells = [DrawnCell(*group, number) for group in groups() for number in range(job.sessions)]
    outcomes = _outcomes(job, cells)
    rows: list[Row] = []
    for family, parts in groups():
        rows += rows_of(
            [outcomes[cell] for cell in cells if (cell.family, cell.parts) == (family, parts)], family, parts
        )
    if job.folder is not None:
        for family, policy in policies.items():
            write_policy(job.folder / f"policy-{family.replace(' ', '-')}.json", policy)
    notes = (
        ABOUT.format(cells=job.sessions, schedules=SCHEDULES, limit=REFERENCE_S),
        POLICIES.format(
            kept=KEPT, begun=BEGUN, shipped=SHIPPED, practice=PRACTICE, lessons=LESSONS, schedules=SCHEDULES
        ),
        UPDATES_NOTE,
    )
    return Findings(rows, in_short(rows), {"Mean gap by family and size": picture(rows)}, notes)


def _outcomes(job: Job, cells: Sequence[DrawnCell]) -> dict[DrawnCell, CellOutcome]:
    """The outcome of each cell; the job's folder keeps them."""
    keys = {f"{cell}, {SCHEDULES} schedules, seed {job.seed}": cell for cell in cells}
    done = job.kept_as(lambda kept: (keys[kept["key"]], record_of(CellOutcome, kept["found"])))
    names = {cell: key for key, cell in keys.items()}
    job.progress(len(done), len(cells))
    for cell, outcome in job.computed(partial(cell_outcome, seed=job.seed), [one for one in cells if one not in done]):
        done[cell] = outcome
        job.keep({"key": names[cell], "found": asdict(outcome)})
        job.progress(len(done), len(cells))
    return done


def groups() -> list[tuple[str, int]]:
    """Each family with each of its sizes."""
    return [(family, parts) for family, sizes in SIZES.items() for parts in sizes]


def drawn_cell(cell: DrawnCell, seed: int) -> Cell:
    """The cell that is meant, the same every time."""
    stream = [seed, 36, [*SIZES].index(cell.family), cell.parts, cell.number]
    return DRAWN[cell.family](np.random.default_rng(stream), cell.parts, cell.parts)


@lru_cache(maxsize=8)
def family_policy(family: str, seed: int) -> CarriedPolicy:
    """The policy that srl-linear learns in small cells of a family, none of which is a cell of the study."""
    rng = np.random.default_rng([seed, 37, [*SIZES].index(family)])
    first, *others = [SMALL[family](rng) for _ in range(PRACTICE)]
    return srl_linear(first, Search(LESSONS, practice=tuple(others)), np.random.default_rng([seed, 38])).policy


def cell_outcome(drawn: DrawnCell, seed: int) -> CellOutcome:
    """What every method finds in a cell."""
    cell, learned = drawn_cell(drawn, seed), family_policy(drawn.family, seed)
    searches = {name: (name, Search(SCHEDULES)) for name in (*SEARCHES, *AT_ONCE)}
    searches[SHIPPED] = LINEAR, Search(SCHEDULES, policy=DEFAULT)
    searches[KEPT] = "carried", Search(1, policy=learned)
    searches[BEGUN] = LINEAR, Search(SCHEDULES, policy=learned)
    if not cell.serial:
        del searches["srl-time"]
    tried = {
        name: _tried(cell, partial(find_sequence, cell, *search, drawn.number)) for name, search in searches.items()
    }
    for name, update in UPDATES.items():
        tried[name] = _tried(cell, partial(update, cell, SCHEDULES, drawn.number))
    known = best_known(cell, MAKESPAN, REFERENCE_S)
    return CellOutcome(float(known.cost), bool(known.proven), tried)


def _tried(cell: Cell, find: Callable[[], Any]) -> Tried:
    began = process_time()
    try:
        found = find()
    except WorkFailed:
        return Tried(stuck_cost(cell, MAKESPAN), None, process_time() - began)
    final = getattr(found, "final_cost", None)
    return Tried(float(found.cost), None if final is None else float(final), process_time() - began)


def rows_of(outcomes: Sequence[CellOutcome], family: str, parts: int) -> list[Row]:
    """The rows of a size: gaps with intervals, shares of optima, seconds, and differences to SRL's table, cell by cell."""
    proven, rows = sum(outcome.proven for outcome in outcomes), list[Row]()
    best = np.array([outcome.best for outcome in outcomes])
    costs = {name: np.array([outcome.tried[name].cost for outcome in outcomes]) for name in outcomes[0].tried}
    for name, own in costs.items():
        named: Row = {
            "table": f"{family}: {parts} parts",
            "family": family,
            "parts": parts,
            "cells": len(outcomes),
            "proven": proven,
        }
        named["method"] = name
        rows.append(varying_row(named, "mean gap_percent", 100.0 * (own / best - 1.0)))
        if name != TABLE and len(outcomes) > 1:
            rows.append(mean_row(named, "less than srl_percent", 100.0 * (costs[TABLE] - own) / best))
        rows.append(share_row(named, "best known_percent", own <= best + SAME))
        finals = [outcome.tried[name].final_cost for outcome in outcomes]
        ends = np.array([np.nan if final is None else final for final in finals])
        if np.isfinite(ends).all():
            rows.append(varying_row(named, "greedy gap_percent", 100.0 * (ends / best - 1.0)))
        rows.append(median_row(named, "seconds", [outcome.tried[name].seconds for outcome in outcomes]))
    rule = min(RULE_NAMES, key=lambda name: float((costs[name] / best).mean()))
    rows.append(
        row(named | {"method": "best rule", "rule": rule}, "mean gap_percent", 100 * ((costs[rule] / best).mean() - 1))
    )
    return rows


RULE_NAMES = [name for name in AT_ONCE if name in RULES]
SHOWN = (TABLE, "random", LINEAR, SHIPPED, KEPT, "best rule")


def in_short(rows: Sequence[Row]) -> Row:
    """By size: the mean gaps of the table, of the linear values, of the policy without learning, and of the best rule."""
    told: Row = {}
    for table in dict.fromkeys(one["table"] for one in rows):
        gaps = {name: those(rows, table=table, method=name, measure="mean gap_percent")[0] for name in SHOWN}
        told[f"{table} [%]"] = ", ".join(f"{name} {gaps[name]['value']:.1f}" for name in SHOWN)
    return told


def picture(rows: Sequence[Row]) -> bytes:
    """Bars by size, of the methods in SHOWN."""
    tables = [*dict.fromkeys(one["table"] for one in rows)]
    lines = {
        name: [those(rows, table=table, method=name, measure="mean gap_percent")[0] for table in tables]
        for name in SHOWN
    }
    return bars([table.replace(": ", ",\n") for table in tables], lines, "mean gap [%]")
