"""Job shops as text in Taillard's format: a block of times with a row per job, then a block of machines numbered from 1."""

from lab.tasks.cell_file import CellFile
from lab.tasks.instances.job_shop import JobShop, Operation, cell_of_shop
from lab.tasks.instances.source import MOST_OPERATIONS, InstanceRequest, Source

BLOCKS = ("times", "machines")


def read(source: Source, asked: InstanceRequest) -> CellFile:
    """The cell of a text in this format, with or without words between the blocks; raises BadInput, with file and line."""
    rows = [(line, words) for line, words in source.rows() if words[0][0].isdigit() or words[0][0] in "-+."]
    if not rows:
        raise source.refusal(1, "how many jobs and how many machines")
    jobs, machines = source.shape(rows[0])
    if len(rows) != 1 + 2 * jobs:
        line = rows[-1][0] if len(rows) <= 2 * jobs else rows[1 + 2 * jobs][0]
        raise source.refusal(line, f"{jobs} rows of times and {jobs} rows of machines", f"{len(rows) - 1} rows")
    found: list[list[Operation]] = []
    for number, (times, places) in enumerate(zip(rows[1 : 1 + jobs], rows[1 + jobs :], strict=True), 1):
        count = len(times[1])
        if count > MOST_OPERATIONS:
            raise source.refusal(times[0], f"up to {MOST_OPERATIONS} times of job {number}", f"{count} numbers")
        if len(places[1]) != count:
            raise source.refusal(
                places[0], f"{count} machines of job {number}, as many as it has times", f"{len(places[1])} numbers"
            )
        operations = list[Operation]()
        for step, (time, machine) in enumerate(zip(times[1], places[1], strict=True), 1):
            which = f"of operation {step} of job {number}"
            seconds = source.time(time, times[0], f"the time {which}")
            at = source.whole(machine, places[0], f"the machine {which}", 1, machines) - 1
            operations.append(((at, seconds),))
        found.append(operations)
    return cell_of_shop(source, JobShop(machines, found, [line for line, _ in rows[1 : 1 + jobs]]), asked)
