"""The job sets of Bilge and Ulusoy (1995) as CSV (set, job, operation, machine, time); layouts come from a separate file."""

from collections.abc import Mapping
from dataclasses import replace

from lab.errors import BadInput
from lab.sequencing.cell.cell import MAX_PARTS
from lab.tasks.cell_file import CellFile
from lab.tasks.instances.job_shop import JobShop, case_parts, cell_of_shop, in_layout
from lab.tasks.instances.layout import csv_rows, read_layout
from lab.tasks.instances.source import MOST_OPERATIONS, InstanceRequest, Source

HEADER = ("set", "job", "operation", "machine", "time")
Rows = Mapping[tuple[int, int], tuple[str, float, int]]  # (job, operation) -> machine, time, line


def read(source: Source, asked: InstanceRequest) -> CellFile:
    """The cell of one job set, in one layout: --case SET:LAYOUT, such as 7:1, or EX71. BadInput, with file and line."""
    sets = _sets(source)
    which, place = case_parts(asked.case)
    if which is None and len(sets) == 1:
        which = next(iter(sets))
    if which not in sets:
        known = ", ".join([*sets][:20]) or "none"
        said = (
            "say which with --case SET:LAYOUT, such as 7:1" if which is None else f"there is no set '{which}' (--case)"
        )
        raise source.refusal(None, f"one set of jobs; the file has {known}: {said}")
    name = f"EX{which}{place or ''}" if len(sets) > 1 else source.name
    own = replace(source, path=source.path.with_name(source.path.name))
    if asked.layout is None:
        machines = sorted({machine for machine, *_ in sets[which].values()})
        return _named(cell_of_shop(own, _shop(source, sets[which], machines), asked), name)
    layout = read_layout(asked.layout, place)
    return _named(in_layout(own, _shop(source, sets[which], layout.machines), layout, asked.robots or 1), name)


def _named(file: CellFile, name: str) -> CellFile:
    return file.model_copy(update={"name": name})


def _sets(source: Source) -> dict[str, dict[tuple[int, int], tuple[str, float, int]]]:
    """The rows of each set."""
    rows = csv_rows(source)
    line, header = next(rows, (1, []))
    if tuple(word.lower() for word in header) != HEADER:
        raise source.refusal(line, ",".join(HEADER), ",".join(header))
    sets: dict[str, dict[tuple[int, int], tuple[str, float, int]]] = {}
    for line, row in rows:
        if len(row) != len(HEADER):
            raise source.refusal(line, f"{len(HEADER)} values ({','.join(HEADER)})", ",".join(row))
        job = source.whole(row[1], line, "the job", 1, MAX_PARTS)
        key = job, source.whole(row[2], line, "the operation", 1, MOST_OPERATIONS)
        own = sets.setdefault(row[0], {})
        if key in own:
            raise source.refusal(line, f"operation {key[1]} of job {job} of set {row[0]} once: this is the second")
        own[key] = row[3], source.time(row[4], line, "the time"), line
    return sets


def _shop(source: Source, rows: Rows, machines: "tuple[str, ...] | list[str]") -> JobShop:
    jobs: dict[int, dict[int, tuple[int, float]]] = {}
    lines: dict[int, int] = {}
    for (job, operation), (machine, time, line) in sorted(rows.items()):
        if machine not in machines:
            raise source.refusal(line, f"a machine of the layout ({', '.join(machines)})", machine)
        jobs.setdefault(job, {})[operation] = machines.index(machine), time
        lines.setdefault(job, line)
        if operation != len(jobs[job]):
            raise source.refusal(line, f"operation {len(jobs[job])} of job {job} before", f"{operation}")
        if job != len(jobs):
            raise BadInput(f"{source.path}: line {line}: wanted job {len(jobs)} before job {job}: it has no row")
    operations = [[(one,) for one in job.values()] for job in jobs.values()]
    return JobShop(len(machines), operations, [*lines.values()])
