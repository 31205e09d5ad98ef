"""Job shops as text in the format of JSPLIB and the OR-Library: a row per job with machine and time of each operation."""

from lab.tasks.cell_file import CellFile
from lab.tasks.instances.job_shop import JobShop, Operation, cell_of_shop
from lab.tasks.instances.source import MOST_OPERATIONS, InstanceRequest, Source


def read(source: Source, asked: InstanceRequest) -> CellFile:
    """The cell of a text in this format, with machines numbered from 0; raises BadInput, with file and line, for others."""
    rows = [*source.rows()]
    jobs, machines = source.shape(rows[0])
    line, words = rows[0]
    if len(words) > 2:
        raise source.refusal(line, "how many jobs and how many machines, and nothing else", " ".join(words))
    found: list[list[Operation]] = []
    for line, words in rows[1 : 1 + jobs]:
        if len(words) % 2 or len(words) > 2 * MOST_OPERATIONS:
            wanted = f"a machine and a time for each operation of job {len(found) + 1}, up to {MOST_OPERATIONS} pairs"
            raise source.refusal(line, wanted, f"{len(words)} numbers")
        operations = list[Operation]()
        for number, (machine, time) in enumerate(zip(words[::2], words[1::2], strict=True), 1):
            which = f"of operation {number} of job {len(found) + 1}"
            at = source.whole(machine, line, f"the machine {which}", 0, machines - 1)
            operations.append(((at, source.time(time, line, f"the time {which}")),))
        found.append(operations)
    if len(rows) != 1 + jobs:
        line = rows[-1][0] if len(rows) <= jobs else rows[1 + jobs][0]
        raise source.refusal(line, f"{jobs} rows, one for each job", f"{len(rows) - 1} rows")
    shop = JobShop(machines, found, [line for line, _ in rows[1:]])
    return cell_of_shop(source, shop, asked)
