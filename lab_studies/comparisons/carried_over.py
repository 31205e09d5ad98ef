"""Transfer of learning: a policy learned on small cells of a family orders larger ones, compared with every dispatching rule."""

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from lab.sequencing.cell.objectives import MAKESPAN, cost
from lab.sequencing.methods.carried_over import Decider
from lab.sequencing.methods.carried_over_policy import CarriedPolicy
from lab.sequencing.methods.portfolio import best_known
from lab.sequencing.methods.rules import dispatch, usable
from lab.sequencing.search import gap
from lab.sequencing.simulate.run import Run
from lab.studies.charts import bars
from lab.studies.findings import Findings, Row, row, those, varying_row
from lab.studies.runner import Job, record_of
from lab.tasks.sequencing import write_policy
from lab_studies.comparisons.carried_over_families import SMALL, LargerCell, larger_cell, larger_cells, small_cells
from lab_studies.comparisons.carried_over_learning import CarriedLearning, learn_policy

ALL = "all families"
CARRIED = "carried over"
SETTINGS = CarriedLearning()
TIME_LIMIT_S = 20.0  # CP-SAT's, for each larger cell that A* does not take
REPEATS = 20  # of each run that is timed
ABOUT = (
    "Policies are linear: {features} features of a decision, with weights learned by CMA-ES from the costs of greedy runs "
    "alone, on {cells} random small cells of a family ({generations} generations). They are tested on larger cells, of which "
    "none was learned on. Nothing is searched: each decision is the one of the highest value. The best rule is the one with "
    "the lowest mean gap in the cells of a row's group themselves."
)
GAPS = (
    "Gap: above the printed value (Bilge and Ulusoy), else above what is proven: the optimum by A*, or the bound of CP-SAT "
    "after {limit:g} s. 'proven': how many references are optima, or printed as such. A run that ends in a deadlock costs ten "
    "times the longest. Speeds: CPU time on one core, features and moves together, without the tables of a cell."
)
POLICIES = "The policies stand beside this report (policy-....json): lab sequence CELL --method carried --policy FILE uses one."


@dataclass(frozen=True)
class Survey:
    """The reference of a larger cell: the best cost and the bound, and the cost, moves and CPU time [s] of each rule's run."""

    best: float
    bound: float
    rules: dict[str, float]
    moves: int
    rules_s: dict[str, float]

    @property
    def proven(self) -> bool:
        """Whether the bound is reached."""
        return gap(self.best, self.bound) == 0.0


def carried_over(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of policies of each family and of all, learned on `job.sessions` small cells; the reading has no effect."""
    families = [*SMALL, ALL]
    learned = _kept_results(
        job, "learned", families, partial(_policy_record, sessions=job.sessions, seed=job.seed), _policy_of
    )
    cells = larger_cells()
    surveys = _kept_results(job, "surveyed", cells, survey_record, partial(record_of, Survey))
    rows: list[Row] = []
    for group in dict.fromkeys((cell.family, cell.group) for cell in cells):
        rows += rows_of(*group, {cell: surveys[cell] for cell in cells if (cell.family, cell.group) == group}, learned)
    if job.folder is not None:
        for family, policy in learned.items():
            write_policy(job.folder / f"policy-{family.replace(' ', '-')}.json", policy)
    weights = len(next(iter(learned.values())).vector)
    about = ABOUT.format(features=weights, cells=job.sessions, generations=SETTINGS.generations)
    return Findings(
        rows, in_short(rows), {"Mean gap by group": picture(rows)}, (about, GAPS.format(limit=TIME_LIMIT_S), POLICIES)
    )


def _kept_results(job: Job, kind: str, items: Sequence[Any], work: Any, read: Any) -> dict[Any, Any]:
    """The result of `work`, a module's function, for each item; the job's folder keeps the results."""
    names = {_key(job, kind, item): item for item in items}
    done = job.kept_as(lambda entry: (names[entry["key"]], read(entry["found"])) if entry["key"] in names else None)
    left = [item for item in items if item not in done]
    job.progress(len(done), len(items))
    for item, result in job.computed(work, left):
        done[item] = read(result)
        job.keep({"key": _key(job, kind, item), "found": result})
        job.progress(len(done), len(items))
    return {item: done[item] for item in items}


def _key(job: Job, kind: str, item: Any) -> str:
    return f"{kind}: {item}, {job.sessions} cells, seed {job.seed}" if kind == "learned" else f"{kind}: {asdict(item)}"


def _policy_record(family: str, sessions: int, seed: int) -> dict[str, Any]:
    """The learned policy of a family, as the folder keeps it."""
    said = f"{sessions} small cells: {family}; lab study run carried-over --sessions {sessions} --seed {seed}"
    policy = learn_policy(small_cells(family, sessions, seed), MAKESPAN, SETTINGS, seed, said)
    return {"weights": dict(policy.weights), "learned_on": said}


def _policy_of(held: dict[str, Any]) -> CarriedPolicy:
    return CarriedPolicy(held["weights"], MAKESPAN, held["learned_on"])


def survey_record(larger: LargerCell) -> dict[str, Any]:
    """`Survey` of a larger cell, as the folder keeps it."""
    cell, rules, rules_s, moves = larger_cell(larger), dict[str, float](), dict[str, float](), 0
    for name, rule in usable(cell).items():
        run, began = Run(cell), time.process_time()
        moves = max(moves, len(dispatch(run, rule)))
        rules_s[name] = time.process_time() - began
        rules[name] = cost(run, MAKESPAN)
    if larger.printed is not None:
        best, bound = larger.printed, larger.printed
    else:
        reference = best_known(cell, MAKESPAN, TIME_LIMIT_S)
        best, bound = reference.cost, reference.bound
    return {"best": best, "bound": bound, "rules": rules, "moves": moves, "rules_s": rules_s}


def rows_of(
    family: str, group: str, surveys: Mapping[LargerCell, Survey], learned: Mapping[str, CarriedPolicy]
) -> list[Row]:
    """The rows of a group: every rule, then every policy, that of the group's family first."""
    proven = sum(survey.proven for survey in surveys.values())
    named: Row = {"table": f"{family}: {group}", "cells": len(surveys), "proven": proven}
    gaps = {
        rule: [100.0 * gap(survey.rules[rule], survey.bound) for survey in surveys.values()]
        for rule in next(iter(surveys.values())).rules
    }
    best = min(gaps, key=lambda rule: np.mean(gaps[rule]))
    rows: list[Row] = []
    for rule, own in gaps.items():
        seconds = sum(survey.rules_s[rule] for survey in surveys.values())
        said = named | {"method": rule, "best_rule": rule == best}
        rows += _measured(said, own, sum(survey.moves for survey in surveys.values()) / max(seconds, 1e-9))
    deciders = {cell: Decider(larger_cell(cell)) for cell in surveys}
    for learned_on in sorted(learned, key=lambda name: name != family):
        weights = learned[learned_on].vector
        own = [100.0 * gap(float(deciders[o].costs(weights[None])[0]), s.bound) for o, s in surveys.items()]
        said = named | {"method": CARRIED, "learned_on": learned_on}
        rows += _measured(said, own, decisions_per_s(deciders.values(), learned[learned_on]))
        rows.append(row(said, "of best rule's gap_percent", 100.0 * float(np.mean(own) / np.mean(gaps[best]))))
    return rows


def decisions_per_s(deciders: Iterable[Decider], policy: CarriedPolicy) -> float:
    """The decisions per second that a policy takes on one core in runs of these cells."""
    made, began = 0, time.process_time()
    for decider in deciders:
        for _ in range(REPEATS):
            made += len(decider.sequence(policy.vector))
    return made / max(time.process_time() - began, 1e-9)


def _measured(named: Row, gaps: Sequence[float], rate: float) -> list[Row]:
    return [
        varying_row(named, "mean gap_percent", gaps),
        row(named, "worst gap_percent", max(gaps)),
        row(named, "decisions_per_s", rate),
        row(named, "ms_per_decision", 1e3 / rate),
    ]


def in_short(rows: Sequence[Row]) -> Row:
    """By group: the mean gap of the family's own policy, that of the best rule, and the slowest policy's speed."""
    told: Row = {}
    for table in dict.fromkeys(result["table"] for result in rows):
        own = those(rows, table=table, method=CARRIED, measure="mean gap_percent")[0]["value"]
        rule = those(rows, table=table, best_rule=True, measure="mean gap_percent")[0]
        told[f"{table} [%]"] = f"{own:.2f} carried over, {rule['value']:.2f} by {rule['method']}"
    rates = [result["value"] for result in those(rows, method=CARRIED, measure="decisions_per_s")]
    return told | {"decisions a second, the slowest": round(min(rates))}


def picture(rows: Sequence[Row]) -> bytes:
    """Bars by group: the best rule, the family's own policy, and that of all families."""
    tables = [*dict.fromkeys(result["table"] for result in rows)]
    gaps = [those(rows, table=table, measure="mean gap_percent") for table in tables]
    lines = {
        "best rule": [those(own, best_rule=True)[0] for own in gaps],
        "learned on small cells of the family": [those(own, method=CARRIED)[0] for own in gaps],
        "learned on small cells of all families": [those(own, learned_on=ALL)[0] for own in gaps],
    }
    return bars([table.split(": ")[1].replace(", ", ",\n") for table in tables], lines, "mean gap [%]")
