"""A plain model of a shop for OR-Tools' CP-SAT, as somebody writes it in an hour; it imports nothing of the lab.

    python -m devtools.plain_model SHOP.json [SECONDS [WORKERS]]

It reads `jobs`, for each operation a table from machine to time; `due`, a time for each job, or null; `travel`, a matrix of
times between the place where jobs and vehicles begin (first) and the machines, or null; `vehicles`, their number.
"""

import json
import sys
from itertools import product
from pathlib import Path
from time import perf_counter

from ortools.sat.python import cp_model

Trip = tuple[cp_model.IntVar, cp_model.IntVar, dict[tuple[int, int], cp_model.IntVar]]  # departure, arrival, its ways


def main() -> None:
    """Print the status, the cost, its bound and the seconds of the search as one line of JSON."""
    shop, began = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")), perf_counter()
    jobs, due, travel = shop["jobs"], shop["due"], shop["travel"]
    most = sum(max(times.values()) for job in jobs for times in job)
    most += sum(map(len, jobs)) * 2 * max((max(row) for row in travel or [[0]]), default=0)
    model, ends = cp_model.CpModel(), []
    on_machine: dict[str, list[cp_model.IntervalVar]] = {}
    carried = list[Trip]()
    for job in jobs:
        end, at = model.new_constant(0), {0: model.new_constant(1)}
        for times in job:
            begin, before = model.new_int_var(0, most, ""), at
            at = {int(machine) + 1: model.new_bool_var("") for machine in times}
            model.add_exactly_one(at.values())
            if travel is None:
                model.add(begin >= end)
            else:
                depart, arrive, ways = model.new_int_var(0, most, ""), model.new_int_var(0, most, ""), {}
                for origin, target in product(before, at):
                    way = ways[origin, target] = model.new_bool_var("")
                    model.add_implication(way, before[origin])
                    model.add_implication(way, at[target])
                    model.add(arrive == depart + travel[origin][target]).only_enforce_if(way)
                model.add_exactly_one(ways.values())
                model.add(depart >= end)
                model.add(begin >= arrive)
                moved = {(origin, target): way for (origin, target), way in ways.items() if origin != target}
                carried.append((depart, arrive, moved))
            end = model.new_int_var(0, most, "")
            for machine, time in times.items():
                does = at[int(machine) + 1]
                on_machine.setdefault(machine, []).append(
                    model.new_optional_fixed_size_interval_var(begin, time, does, "")
                )
                model.add(end == begin + time).only_enforce_if(does)
        ends.append(end)
    for intervals in on_machine.values():
        model.add_no_overlap(intervals)
    if travel is not None:
        _add_vehicles(model, carried, travel, shop["vehicles"])
    if due is None:
        cost: cp_model.LinearExprT = model.new_int_var(0, most, "makespan")
        model.add_max_equality(cost, ends)
    else:
        late = [model.new_int_var(0, most, "") for _ in jobs]
        for lateness, end, until in zip(late, ends, due, strict=True):
            model.add(lateness >= end - until)
        cost = sum(late)
    model.minimize(cost)
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    solver.parameters.max_time_in_seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 60.0
    status = solver.status_name(solver.solve(model))
    outcome = {"status": status, "cost": solver.objective_value, "bound": solver.best_objective_bound}
    sys.stdout.write(json.dumps(outcome | {"seconds": perf_counter() - began}) + "\n")


def _add_vehicles(model: cp_model.CpModel, carried: list[Trip], travel: list[list[int]], vehicles: int) -> None:
    """Let each vehicle make its trips one after another, and drive empty between them."""
    arcs, out = list[tuple[int, int, cp_model.IntVar]](), list[cp_model.IntVar]()
    for number, (depart, arrive, ways) in enumerate(carried, 1):
        none = model.new_bool_var("")
        model.add_exactly_one([none, *ways.values()])
        first = model.new_bool_var("")
        for (origin, _), way in ways.items():
            model.add(depart >= travel[0][origin]).only_enforce_if(first, way)
        out.append(first)
        arcs += [(number, number, none), (0, number, first), (number, 0, model.new_bool_var(""))]
        for other, (then, _, others) in enumerate(carried, 1):
            if other != number:
                follows = model.new_bool_var("")
                arcs.append((number, other, follows))
                for ((_, target), way), ((origin, _), next_way) in product(ways.items(), others.items()):
                    model.add(then >= arrive + travel[target][origin]).only_enforce_if(follows, way, next_way)
    model.add_multiple_circuit(arcs)
    model.add(sum(out) <= vehicles)


if __name__ == "__main__":
    main()
