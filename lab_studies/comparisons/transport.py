"""Orders of work on the field's benchmark instances: every method compared with the best known and the published values."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import groupby
from math import inf
from typing import Any

from lab.errors import WorkFailed, counted, unknown
from lab.sequencing.search import SAME, gap
from lab.studies.findings import Findings, Row, row
from lab.studies.runner import Job
from lab_studies.comparisons.schedule_checker import faults
from lab_studies.comparisons.transport_entries import (
    CYCLES_SHOWN,
    CYCLIC,
    KEPT,
    Entry,
    EntryResult,
    entry_result,
    methods_for,
)
from lab_studies.comparisons.transport_figures import by_seconds, profile
from lab_studies.comparisons.transport_instances import Instance, board, cell_file, own_instances

SECONDS = 10.0
Board = Mapping[Entry, EntryResult]
MEASURES = (
    "Costs are makespans (for a cyclic order, the period) in the instance's unit of time. Best: the lowest cost that anything on "
    "this board found or that is published. Gap: above the best. Bound: the highest that anything on this board proved; an "
    "order that reaches it is a proven optimum. Without a proof, a published value or a proving method the best may be far from "
    "optimal. Seconds: the time of a method's last improvement. One seed each. JobShopLab's vehicles set out for a job only when "
    "the operation before has begun; here they may set out earlier, so that its PPO's schedules are allowed here, but those "
    "from here not always there."
)
TIMES = (
    "Each method has {seconds:g} s for an instance, by the clock, while other entries of the study run: with more time, or "
    "alone, each finds more. Methods that try sequences start ever longer sessions until the time is over; neither compiling "
    "nor building CP-SAT's model counts. Rules have one sequence. CP-SAT has six threads."
)
LEARNERS = (
    "srl and mc learn from the costs of whole sequences alone; srl-time also has a lower bound of the whole cell, and takes only "
    "cells with one robot. srl-improved learns from sequences that a short annealing has improved, to which it owes much of its "
    "result. anneal, ga and random search learn nothing; exact, cp-sat and portfolio know the cell's model."
)
CHECKED = (
    "--verify checks each kept schedule against its instance with a checker that shares no code with the simulators or the "
    "methods (lab_studies/comparisons/schedule_checker.py): every operation in its turn, on its machine, long enough, no "
    "machine, place or robot used twice at a time, and the claimed end. Of a cyclic order it checks {shown} parts."
)


def transport(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every method on every instance.

    reading: "seconds" for each method, "methods", the user's "instances" in place of all, and "verify". Raises BadInput for an
    unknown method and for instances that cannot be read, WorkFailed if "verify" finds a wrong schedule.
    """
    seconds = float(reading.get("seconds", SECONDS))
    instances = own_instances(reading["instances"]) if "instances" in reading else board()
    entries = entries_of(instances, reading.get("methods", ()), seconds, job.seed)
    results = measured(job, entries)
    notes = [MEASURES, TIMES.format(seconds=seconds), LEARNERS, CHECKED.format(shown=CYCLES_SHOWN)]
    says: Row = {}
    if reading.get("verify"):
        says["schedules that the checker found right"] = verification(results)
    rows = [line for instance, by_method in by_instance(results).items() for line in rows_of(instance, by_method)]
    rows = [*family_rows(results), *rows]
    orders = {entry: result for entry, result in results.items() if entry.method != CYCLIC}
    figures = {
        "How many instances a method solves within a gap": profile(gaps_of(orders)),
        "The mean gap, second by second": by_seconds(
            orders, {instance: least_cost(instance, by_method) for instance, by_method in by_instance(orders).items()}
        ),
    }
    refused = {(e.method, f.refused) for e, f in results.items() if f.cost is None}
    notes += [f"Left out: {method}: {why}." for method, why in sorted(refused)[:12]]
    return Findings(rows, in_short(results) | says, figures, tuple(notes))


def entries_of(instances: Sequence[Instance], methods: Sequence[str], seconds: float, seed: int) -> list[Entry]:
    """The entries of the methods that are asked for (none: all) on every instance that they may be tried on."""
    known = dict.fromkeys(method for instance in instances for method in methods_for(instance))
    for name in methods:
        if name not in known:
            raise unknown("method", name, known, "--methods")
    return [
        Entry(instance, method, seconds, seed)
        for instance in instances
        for method in methods_for(instance)
        if not methods or method in methods
    ]


def measured(job: Job, entries: Sequence[Entry]) -> dict[Entry, EntryResult]:
    """The result of every entry; the job's folder keeps them."""
    names = {_key(entry): entry for entry in entries}
    done: dict[Entry, EntryResult] = job.kept_as(
        lambda line: (names[line["entry"]], EntryResult.of_json(line["found"]))
    )
    left = [entry for entry in entries if entry not in done]
    job.progress(len(done), len(entries))
    for entry, result in job.computed(
        entry_result, left, most=1
    ):  # entries take seconds: a kill loses one in each process
        done[entry] = result
        job.keep({"entry": _key(entry), "found": asdict(result)})
        job.progress(len(done), len(entries))
    return {entry: done[entry] for entry in entries}


def _key(entry: Entry) -> str:
    return json.dumps(asdict(entry), sort_keys=True)


def verification(results: Board) -> str:
    """The number of schedules that the checker finds right, such as "12 of 12". Raises WorkFailed if any is wrong."""
    wrong, right = list[str](), 0
    for entry, result in results.items():
        if result.cost is None:
            continue
        said = faults_of(entry, result)
        right += not said
        wrong += [f"{entry.instance.name}, {entry.method}: {said[0]}"] if said else []
    if wrong:
        more = f", and {counted(len(wrong) - 3, 'other')}" if len(wrong) > 3 else ""
        raise WorkFailed(
            f"{counted(len(wrong), 'schedule')} of {right + len(wrong)} found wrong: {'; '.join(wrong[:3])}{more}"
        )
    return f"{right} of {right}"


def faults_of(entry: Entry, result: EntryResult) -> list[str]:
    """The faults that the checker finds in a kept schedule and in its claimed cost."""
    plain = cell_file(entry.instance).model_dump()
    if entry.method == CYCLIC:
        names = list(dict.fromkeys(plain["order"] or [product["name"] for product in plain["products"]]))
        plain |= {"parts": None, "order": [names[n % len(names)] for n in range(result.parts)]}
    elif abs(result.ends_s - (result.cost or 0.0)) > SAME:
        return [f"it ends at {result.ends_s:g}, not at {result.cost:g}"]
    try:
        return faults(
            plain,
            [
                dict.fromkeys(("product", "resource", "when")) | dict(zip(KEPT, values, strict=True))
                for values in result.schedule
            ],
            result.ends_s,
        )
    except (KeyError, TypeError, ValueError, StopIteration) as error:
        return [f"it cannot be read: {type(error).__name__}: {error}"]


# ---- rows --------------------------------------------------------------------------------------------------------------


def by_instance(results: Board) -> dict[Instance, dict[str, EntryResult]]:
    """The results by instance and method."""
    return {
        instance: {entry.method: results[entry] for entry in group}
        for instance, group in groupby(results, key=lambda entry: entry.instance)
    }


def least_cost(instance: Instance, by_method: Mapping[str, EntryResult]) -> float:
    """The least known cost of an instance, inf if none is known."""
    return min([result.cost for result in by_method.values() if result.cost is not None] + [instance.printed or inf])


def highest_bound(by_method: Mapping[str, EntryResult]) -> tuple[float, str]:
    """The highest bound and the method that proved it; 0 and "" without one."""
    return max(
        ((result.bound, result.bound_by) for result in by_method.values()), key=lambda pair: pair[0], default=(0.0, "")
    )


def rows_of(instance: Instance, by_method: Mapping[str, EntryResult]) -> list[Row]:
    """The rows of each method on an instance: its cost, its gap to the best known, and what is proven."""
    best, (bound, by) = least_cost(instance, by_method), highest_bound(by_method)
    rows: list[Row] = []
    for method, result in by_method.items():
        if result.cost is None:
            continue
        named: Row = {
            "table": instance.family,
            "instance": instance.name,
            "robots": len(cell_file(instance).cell().robots),
            "printed": instance.printed,
            "printed as": instance.printed_is or None,
            "bound": bound,
            "proven": result.cost <= bound + SAME,
            "proven by": by if result.cost <= bound + SAME else None,
            "method": method,
            "found_by": result.found_by if result.found_by != method else None,
            "seconds": round(result.trace[-1][0] if result.trace else result.wall_s, 3),
        }
        rows += [row(named, "cost", result.cost), row(named, "gap_percent", 100.0 * gap(result.cost, best))]
    return rows


def gaps_of(results: Board) -> dict[str, list[float]]:
    """By method, the gaps [%] to the best known costs of the instances that it solved."""
    gaps = dict[str, list[float]]()
    for instance, by_method in by_instance(results).items():
        for method, result in by_method.items():
            if result.cost is not None:
                gaps.setdefault(method, []).append(100.0 * gap(result.cost, least_cost(instance, by_method)))
    return gaps


def family_rows(results: Board) -> list[Row]:
    """The rows of each method and family: its mean and worst gap, and how often it found the best known and proved one."""
    rows: list[Row] = []
    families = dict.fromkeys(entry.instance.family for entry in results)
    for family in families:
        part = {entry: result for entry, result in results.items() if entry.instance.family == family}
        proofs = {
            method: sum(
                result.cost is not None and result.cost <= result.bound + SAME
                for e, result in part.items()
                if e.method == method
            )
            for method in dict.fromkeys(entry.method for entry in part)
        }
        for method, gaps in gaps_of(part).items():
            named: Row = {
                "table": f"All of {family}",
                "method": method,
                "best known found": f"{sum(gap_percent <= 100 * SAME for gap_percent in gaps)} of {len(gaps)}",
                "proven alone": f"{proofs[method]} of {len(gaps)}",
            }
            rows.append(row(named, "mean gap_percent", sum(gaps) / len(gaps)))
            rows.append(row(named, "worst gap_percent", max(gaps)))
    return rows


def in_short(results: Board) -> Row:
    """The number of instances, of proven optima, and of costs as published or better."""
    boards = by_instance(results)
    told: Row = {"instances": len(boards), "entries": len(results)}
    proven = [
        instance
        for instance, by_method in boards.items()
        if least_cost(instance, by_method) <= highest_bound(by_method)[0] + SAME
    ]
    told["optima proven here"] = len(proven)
    mine = {
        instance: min((f.cost for f in by_method.values() if f.cost is not None), default=inf)
        for instance, by_method in boards.items()
    }
    printed = [instance for instance in boards if instance.printed is not None]
    if printed:
        equal = sum(abs(mine[instance] - (instance.printed or 0.0)) <= SAME for instance in printed)
        better = [instance.name for instance in printed if mine[instance] < (instance.printed or 0.0) - SAME]
        told |= {"with a printed figure": len(printed), "as printed": equal, "better than printed": len(better)}
    return told
