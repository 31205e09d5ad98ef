"""Flexible job shops as text in the format of FJSPLIB: each operation lists the machines that can do it."""

from collections.abc import Sequence

from lab.tasks.cell_file import CellFile
from lab.tasks.instances.job_shop import JobShop, Operation, cell_of_shop
from lab.tasks.instances.source import MOST_OPERATIONS, InstanceRequest, Source


def read(source: Source, asked: InstanceRequest) -> CellFile:
    """The cell of a text in this format, with machines numbered from 1; raises BadInput, with file and line, for others."""
    rows = [*source.rows()]
    jobs, machines = source.shape(rows[0])
    if len(rows) != 1 + jobs:
        line = rows[-1][0] if len(rows) <= jobs else rows[1 + jobs][0]
        raise source.refusal(line, f"{jobs} rows, one for each job", f"{len(rows) - 1} rows")
    operations = [_job(source, number, line, words, machines) for number, (line, words) in enumerate(rows[1:], 1)]
    return cell_of_shop(source, JobShop(machines, operations, [line for line, _ in rows[1:]]), asked)


def _job(source: Source, job: int, line: int, words: Sequence[str], machines: int) -> list[Operation]:
    """The operations of a row, which contains their number and, for each, the number of machines and each machine's time."""
    rest = iter(words)

    def word(what: str) -> str:
        following = next(rest, None)
        if following is None:
            raise source.refusal(line, f"{what}: the row ends before it")
        return following

    what = f"how many operations job {job} has"
    operations = list[Operation]()
    for number in range(1, 1 + source.whole(word(what), line, what, 1, MOST_OPERATIONS)):
        which = f"operation {number} of job {job}"
        what = f"how many machines can do {which}"
        ways = list[tuple[int, float]]()
        for _ in range(source.whole(word(what), line, what, 1, machines)):
            at = source.whole(word(f"a machine for {which}"), line, f"a machine for {which}", 1, machines) - 1
            ways.append((at, source.time(word(f"a time of {which}"), line, f"a time of {which}")))
        operations.append(tuple(ways))
    if (more := next(rest, None)) is not None:
        raise source.refusal(line, f"the end of the row after {len(operations)} operations", more)
    return operations
