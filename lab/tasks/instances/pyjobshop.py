"""Reads and writes job shops without robots as PyJobShop's JSON (`ProblemData.to_json`). Source: pyjobshop 0.0.9."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise
from math import prod
from typing import Any

from lab.errors import BadInput
from lab.sequencing.cell.cell import MAX_PARTS
from lab.tasks.cell_fields import CellProduct
from lab.tasks.cell_file import CellFile
from lab.tasks.instances.job_shop import JobShop, Operation, cell_of_shop
from lab.tasks.instances.source import MOST_MACHINES, MOST_OPERATIONS, MOST_TIME, InstanceRequest, Source, json_line

NEVER = 2**25  # PyJobShop's value for no deadline; larger values count as none, too
LISTS = {"jobs": MAX_PARTS, "resources": MOST_MACHINES, "tasks": 20_000, "modes": 200_000}
READ = ("end_before_start", "setup_times")  # the constraints that the lab supports
PLAIN: Mapping[str, Mapping[str, Any]] = {  # fields that must have their default values, for each list
    "jobs": {"weight": 1},
    "resources": {"breaks": [], "no_idle": False},
    "tasks": {"earliest_start": 0, "earliest_end": 0, "allow_idle": False, "allow_breaks": False, "optional": False},
}


@dataclass(frozen=True)
class _Json:
    """A value of a JSON document with the path to it; its line is looked up only for an error."""

    source: Source
    value: Any
    way: tuple[str | int, ...] = ()

    def refusal(self, wanted: str, got: object = None) -> BadInput:
        where = ".".join(str(part) for part in self.way)
        return self.source.refusal(json_line(self.source.text, self.way), f"{wanted} as '{where}'", got)

    def get(self, key: str, default: Any = None) -> "_Json":
        """The value under a key of this mapping, or the default."""
        if not isinstance(self.value, dict):
            raise self.refusal("a mapping", json.dumps(self.value))
        return _Json(self.source, self.value.get(key, default), (*self.way, key))

    def each(self, most: int) -> "list[_Json]":
        """The elements of this list."""
        if not isinstance(self.value, list) or len(self.value) > most:
            got = f"{len(self.value)} of them" if isinstance(self.value, list) else json.dumps(self.value)
            raise self.refusal(f"a list of up to {most}", got)
        return [_Json(self.source, value, (*self.way, number)) for number, value in enumerate(self.value)]

    def whole(self, most: int, least: int = 0) -> int:
        """The value as an integer from `least` to `most`."""
        if not isinstance(self.value, int) or isinstance(self.value, bool) or not least <= self.value <= most:
            raise self.refusal(f"a whole number from {least} to {most}", json.dumps(self.value))
        return self.value


def read(source: Source, asked: InstanceRequest) -> CellFile:
    """The cell of such a document; raises BadInput, with file and line, for a damaged one and for unsupported features."""
    try:
        raw = json.loads(source.text)
    except json.JSONDecodeError as error:
        got = source.text[error.pos : error.pos + 10].split("\n")[0]
        raise source.refusal(error.lineno, f"JSON: {error.msg}", got) from None
    except (ValueError, RecursionError):  # numbers or nests beyond Python's limits
        raise source.refusal(None, "JSON with numbers and nests of a sensible size") from None
    document = _Json(source, raw)
    jobs, resources, tasks, modes = (document.get(name, []).each(most) for name, most in LISTS.items())
    if not jobs:
        raise source.refusal(None, "at least one of 'jobs' in a document of PyJobShop's")
    _check_plain(document, {"jobs": jobs, "resources": resources, "tasks": tasks})
    ways = _ways(tasks, modes, len(resources))
    orders = _orders(document, jobs, tasks)
    servers = {number: _servers(resource) for number, resource in enumerate(resources)}
    due = [job.get("due_date") for job in jobs]
    if any(due_date.value is None for due_date in due) and not all(due_date.value is None for due_date in due):
        none = next(due_date for due_date in due if due_date.value is None)
        raise none.refusal("a due date, as other jobs have one,", "null")
    shop = JobShop(
        len(resources),
        [[ways[task] for task in order] for order in orders],
        [None] * len(jobs),
        servers,
        _setups(document, orders, len(resources)),
        _unless_none([job.get("release_date", 0).whole(int(MOST_TIME)) for job in jobs], 0),
        _unless_none([None if due_date.value is None else due_date.whole(int(MOST_TIME)) for due_date in due], None),
    )
    return cell_of_shop(source, shop, asked)


def _unless_none(values: Sequence[Any], none: Any) -> tuple[float, ...] | None:
    return None if all(value == none for value in values) else tuple(float(value) for value in values)


def _check_plain(document: _Json, lists: Mapping[str, Sequence[_Json]]) -> None:
    """Raises BadInput for features that the lab does not support."""
    for name, plain in PLAIN.items():
        for item in lists[name]:
            for key, value in plain.items():
                if (given := item.get(key, value)).value != value:
                    raise given.refusal(
                        f"{json.dumps(value)}, all that the lab's cells can have,", json.dumps(given.value)
                    )
    late = [job.get("deadline", NEVER) for job in lists["jobs"]]
    late += [task.get(key, NEVER) for task in lists["tasks"] for key in ("latest_start", "latest_end")]
    for given in late:
        if given.whole(2**62) < NEVER:
            raise given.refusal("no deadline, which the lab's cells do not have,", json.dumps(given.value))
    constraints = document.get("constraints", {})
    for name, value in constraints.value.items() if isinstance(constraints.value, dict) else ():
        if value and name not in READ:
            raise constraints.get(name).refusal(f"no constraints but {' and '.join(READ)}", name)
    objective = document.get("objective", {})
    for name, weight in objective.value.items() if isinstance(objective.value, dict) else ():
        if weight and name != "weight_makespan":
            raise objective.get(name).refusal("the makespan alone, so 0", json.dumps(weight))


def _servers(resource: _Json) -> int:
    kind = resource.get("type", "machine")
    if kind.value == "machine":
        return 1
    if kind.value == "renewable":
        return resource.get("capacity").whole(1000, 1)
    raise kind.refusal("'machine' or 'renewable'", json.dumps(kind.value))


def _ways(tasks: Sequence[_Json], modes: Sequence[_Json], resources: int) -> list[Operation]:
    """The machines that can do each task, with their times."""
    choices_of: list[list[tuple[int, float]]] = [[] for _ in tasks]
    for mode in modes:
        used, demands = mode.get("resources", []), mode.get("demands", [])
        if len(used.each(resources)) != 1:
            raise used.refusal("one resource", json.dumps(used.value))
        if any(demand.value not in (0, 1) for demand in demands.each(1)):
            raise demands.refusal("a demand of 0 or 1", json.dumps(demands.value))
        task = mode.get("task").whole(len(tasks) - 1)
        machine = used.each(1)[0].whole(resources - 1)
        choices_of[task].append((machine, float(mode.get("duration").whole(int(MOST_TIME)))))
    for place, machines in zip(tasks, choices_of, strict=True):
        if not machines:
            raise place.refusal("a mode of this task: there is none")
    return [tuple(choices) for choices in choices_of]


def _orders(document: _Json, jobs: Sequence[_Json], tasks: Sequence[_Json]) -> list[list[int]]:
    """The tasks of each job in the order that the constraints `end_before_start` determine."""
    after: dict[int, set[int]] = {}
    for constraint in document.get("constraints", {}).get("end_before_start", []).each(LISTS["modes"]):
        if (delay := constraint.get("delay", 0)).value != 0:
            raise delay.refusal("no delay, so 0,", json.dumps(delay.value))
        first, then = (constraint.get(name).whole(len(tasks) - 1) for name in ("task1", "task2"))
        after.setdefault(first, set()).add(then)
    seen: set[int] = set()
    orders: list[list[int]] = []
    for job in jobs:
        own = [number.whole(len(tasks) - 1) for number in job.get("tasks", []).each(MOST_OPERATIONS)]
        if len({*own}) < len(own) or seen & {*own} or not own:
            raise job.get("tasks").refusal("tasks of this job's own, each once", json.dumps(job.get("tasks").value))
        seen |= {*own}
        reach = {task: _reached(after, task) & {*own} for task in own}
        orders.append(sorted(own, key=lambda task: -len(reach[task])))
        for first, then in pairwise(orders[-1]):
            if then not in reach[first]:
                raise job.refusal(f"tasks one after the other (end_before_start): {first} and {then} have no order")
        if any(first in reach[first] for first in own):
            raise job.refusal("tasks one after the other (end_before_start): they go in a circle")
    where = {task: number for number, order in enumerate(orders) for task in order}
    for first, thens in after.items():
        for then in thens:
            if where.get(first) != where.get(then):
                raise document.get("constraints").refusal(
                    f"no order between tasks {first} and {then} of different jobs"
                )
    if len(seen) != len(tasks):
        raise document.get("tasks").refusal("tasks that all belong to jobs", f"{len(tasks) - len(seen)} that do not")
    return orders


def _reached(after: Mapping[int, set[int]], task: int) -> set[int]:
    """All tasks that must follow a task."""
    following: set[int] = set()
    ahead = [*after.get(task, ())]
    while ahead:
        if (one := ahead.pop()) not in following:
            following.add(one)
            ahead += after.get(one, ())
    return following


def _setups(document: _Json, orders: Sequence[Sequence[int]], machines: int) -> dict[int, dict[tuple[int, int], float]]:
    """The setup times of each machine: (job before, job after) -> time; a job has a single task on such a machine."""
    job_of = {task: number for number, order in enumerate(orders) for task in order}
    setups: dict[int, dict[tuple[int, int], float]] = {}
    for setup in document.get("constraints", {}).get("setup_times", []).each(LISTS["modes"]):
        machine = setup.get("machine").whole(machines - 1)
        first, then = (setup.get(name).whole(len(job_of) - 1) for name in ("task1", "task2"))
        before, after = job_of[first], job_of[then]
        seconds = float(setup.get("duration").whole(int(MOST_TIME)))
        if setups.setdefault(machine, {}).get((before, after), seconds) != seconds:
            raise setup.refusal(f"one setup time from job {before} to job {after} on a machine", f"{seconds:g}, too")
        if first != then:
            setups[machine][before, after] = seconds
    return {machine: times for machine, times in setups.items() if any(times.values())}


def write(file: CellFile) -> str:
    """The document of a cell without a robot; raises BadInput for features that PyJobShop does not support."""
    return json.dumps(_document(file), indent=2) + "\n"


def _document(file: CellFile) -> dict[str, Any]:
    _check_written(file)
    order = file.ordered()
    machines = [station for station in file.stations if station.kind == "machine"]
    index = {station.name: number for number, station in enumerate(machines)}
    own = {station.name: station.processing_s or 0.0 for station in machines}
    products = {product.name: _operations(product, index, own) for product in file.products}
    jobs, tasks, modes = list[dict[str, Any]](), list[dict[str, Any]](), list[dict[str, Any]]()
    follow: list[dict[str, int]] = []
    on_machine: dict[int, list[tuple[str, int]]] = {}
    for number, name in enumerate(order):
        first = len(tasks)
        for operation in products[name]:
            for machine, time in operation:
                demand = 0 if machines[machine].servers == 1 else 1
                modes.append(
                    {"task": len(tasks), "resources": [machine], "duration": _whole(time), "demands": [demand]}
                )
                on_machine.setdefault(machine, []).append((name, len(tasks)))
            tasks.append({"job": number})
        numbers = [*range(first, len(tasks))]
        job: dict[str, Any] = {"tasks": numbers, "name": f"{name} {number + 1}"}
        job |= {} if file.release_s is None else {"release_date": _whole(file.release_s[number])}
        job |= {} if file.due_s is None else {"due_date": _whole(file.due_s[number])}
        jobs.append(job)
        follow += [{"task1": a, "task2": b, "delay": 0} for a, b in pairwise(numbers)]
    resources: list[dict[str, Any]] = []
    for station in machines:
        kind = {"type": "machine"} if station.servers == 1 else {"type": "renewable", "capacity": station.servers}
        resources.append(kind | {"name": station.name})
    setups = [
        {"machine": index[station.name], "task1": task, "task2": two, "duration": _whole(station.setup_s[a][b])}
        for station in machines
        for a, task in on_machine.get(index[station.name], ())
        for b, two in on_machine[index[station.name]]
        if task != two and station.setup_s.get(a, {}).get(b)
    ]
    constraints = {"end_before_start": follow, "setup_times": setups}
    document = {"jobs": jobs, "resources": resources, "tasks": tasks, "modes": modes}
    return document | {"constraints": constraints, "objective": {"weight_makespan": 1}}


def _check_written(file: CellFile) -> None:
    """Raises BadInput for features that PyJobShop does not support."""
    where = f"cell '{file.name}' as PyJobShop's JSON"
    if file.built_robots:
        raise BadInput(f"{where}: it has {len(file.built_robots)} robots: only cells without a robot (robots = [])")
    if file.arrivals is not None or file.due_factor is not None:
        raise BadInput(f"{where}: arrivals or due_factor: wanted times, release_s and due_s")
    for station in file.stations:
        if station.setup_s and station.servers != 1:
            raise BadInput(f"{where}: station '{station.name}' has setups and {station.servers} servers: wanted 1")
        if station.at_most_s is not None:
            raise BadInput(f"{where}: station '{station.name}' has at_most_s: PyJobShop has no such limit")
    for product in file.products:
        stages = [way for route in product.routes for stage in route for way in (stage, *stage.alternatives)]
        if any(stage.at_most_s is not None for stage in stages):
            raise BadInput(f"{where}: product '{product.name}' has at_most_s: PyJobShop has no such limit")


def _operations(product: CellProduct, index: Mapping[str, int], own: Mapping[str, float]) -> list[Operation]:
    """The machines that can do each step of a product, with times; raises BadInput unless its routes are all combinations of
    a choice of machine at each step."""
    stages = [
        [
            tuple(
                (w.station, own[w.station] if w.processing_s is None else w.processing_s) for w in (s, *s.alternatives)
            )
            for s in route[1:]
        ]
        for route in product.routes
    ]
    steps = [[*dict.fromkeys(chain(*ways))] for ways in zip(*stages, strict=False)]
    alike = len({len(route) for route in stages}) == 1 and prod(map(len, steps)) == len({*map(tuple, stages)})
    if len(stages) > 1 and not (alike and all(len(ways) == 1 for route in stages for ways in route)):
        raise BadInput(
            f"product '{product.name}' as PyJobShop's JSON: its routes must differ in the machine of each step only"
        )
    return [tuple((index[name], time) for name, time in step) for step in steps]


def _whole(seconds: float) -> int:
    if seconds != int(seconds):
        raise BadInput(f"a time of {seconds:g} s as PyJobShop's JSON: it counts in whole numbers")
    return int(seconds)
