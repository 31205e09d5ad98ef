"""Job shops of all formats as the lab's cells, with vehicles that carry the jobs or without."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pydantic import ValidationError

from lab.errors import BadInput
from lab.sequencing.cell.stations import ROBOT
from lab.tasks.cell_file import CellFile
from lab.tasks.instances.layout import TravelTimes, read_layout
from lab.tasks.instances.source import MOST_OPERATIONS, InstanceRequest, Source
from lab.tasks.toml_text import explain

IN = "in"  # the station where jobs wait in a shop without travel times
Operation = tuple[tuple[int, float], ...]  # (machine, time) for each machine that can do it


@dataclass(frozen=True)
class JobShop:
    """A job shop: jobs as lists of operations, machines by index. Each machine has one server and unlimited room.

    servers: of machines that have several. setups: machine -> (job before, job after) -> time, jobs by index. release, due: the
    times of each job; None: all are released at 0, and none is due. lines: each job's line in its file.
    """

    machines: int
    jobs: Sequence[Sequence[Operation]]
    lines: Sequence[int | None]
    servers: Mapping[int, int] = field(default_factory=dict)
    setups: Mapping[int, Mapping[tuple[int, int], float]] = field(default_factory=dict)
    release: tuple[float, ...] | None = None
    due: tuple[float, ...] | None = None


def cell_of_shop(source: Source, shop: JobShop, asked: InstanceRequest) -> CellFile:
    """The cell of a job shop; machines take the layout's names, in its order. Raises BadInput for a layout that does not fit."""
    if asked.layout is None:
        if asked.robots is not None:
            raise BadInput(f"--robots {asked.robots} beside {source.path}: it has no travel times: give --layout FILE")
        return _cell(source, shop, [f"M{number + 1}" for number in range(shop.machines)], {}, None, [])
    layout = read_layout(asked.layout, case_parts(asked.case)[1])
    return in_layout(source, shop, layout, asked.robots or 1)


def case_parts(case: str | None) -> tuple[str | None, str | None]:
    """The job set and the layout that --case names: "7:1", "EX71", or the layout alone, "1"."""
    if case is None:
        return None, None
    if ":" in case:
        jobs, _, layout = case.partition(":")
        return jobs.strip(), layout.strip()
    if case.upper().startswith("EX"):
        return case[2:-1], case[-1:]
    return None, case.strip()


def in_layout(source: Source, shop: JobShop, layout: TravelTimes, robots: int) -> CellFile:
    """The cell of a job shop in a layout, with `robots` identical vehicles that start where the jobs do."""
    if layout.start is None:
        raise Source(layout.path, "").refusal(None, "a station LU (or load, in, in-buf), where jobs and vehicles begin")
    if len(layout.machines) != shop.machines:
        names = ", ".join(layout.machines[:20])
        wanted = f"{shop.machines} machines, as {source.path} has"
        raise Source(layout.path, "").refusal(None, wanted, f"{len(layout.machines)}: {names}")
    return _cell(source, shop, layout.machines, layout.travel, layout.end, vehicles(robots, layout.start))


def vehicles(count: int, start: str) -> list[dict[str, Any]]:
    """The fields of `count` identical robots for a cell file."""
    return [{"name": ROBOT if count == 1 else f"{ROBOT} {n}", "start": start} for n in range(1, count + 1)]


def _cell(
    source: Source,
    shop: JobShop,
    machines: Sequence[str],
    travel: Mapping[str, Mapping[str, float]],
    end: str | None,
    robots: list[dict[str, Any]],
) -> CellFile:
    start = robots[0]["start"] if robots else IN
    names = [f"job{number + 1}" for number in range(len(shop.jobs))]
    used = {machine for job in shop.jobs for operation in job for machine, _ in operation}
    stations: list[dict[str, Any]] = [{"name": start, "kind": "storage", "capacity": "unlimited"}]
    for number in sorted(used):
        one: dict[str, Any] = {"name": machines[number], "kind": "machine", "capacity": "unlimited"}
        one["servers"] = shop.servers.get(number, 1)
        for (before, after), seconds in shop.setups.get(number, {}).items():
            one.setdefault("setup_s", {}).setdefault(names[before], {})[names[after]] = seconds
        stations.append(one)
    if end is not None:
        stations.append({"name": end, "kind": "storage", "capacity": "unlimited"})
    products = []
    for name, job, line in zip(names, shop.jobs, shop.lines, strict=True):
        if not 1 <= len(job) <= MOST_OPERATIONS:
            raise source.refusal(line, f"1 to {MOST_OPERATIONS} operations of a job", len(job))
        stages: list[Any] = [start]
        for operation in job:
            (first, *others) = [{"station": machines[number], "processing_s": time} for number, time in operation]
            stages.append(first | {"alternatives": others} if others else first)
        products.append({"name": name, "routes": [[*stages, *([] if end is None else [end])]]})
    kept = {station["name"] for station in stations}
    times = {a: {b: t for b, t in row.items() if b in kept and b != a} for a, row in travel.items() if a in kept}
    raw: dict[str, Any] = {
        "kind": "cell",
        "name": source.name,
        "order": names,
        "stations": stations,
        "products": products,
    }
    raw |= {"robots": robots} if len(robots) != 1 else {"robot": robots[0]}
    raw |= {"travel": times} if times else {}
    for field_name, given in (("release_s", shop.release), ("due_s", shop.due)):
        raw |= {} if given is None else {field_name: list(given)}
    return built(source, raw)


def built(source: Source, raw: Mapping[str, Any]) -> CellFile:
    """The cell file of these fields; raises BadInput, beginning with the instance's file, for an invalid cell."""
    try:
        cell_file = CellFile.model_validate(raw)
    except ValidationError as error:
        raise BadInput(f"{source.path}: {explain(error)}") from None
    try:
        cell_file.cell()
    except BadInput as error:
        raise BadInput(f"{source.path}: {error}") from None
    return cell_file
