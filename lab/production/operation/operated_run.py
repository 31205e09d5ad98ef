"""A run by hand, put together for whoever operates it, and what is kept of it."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lab.production.composer import Conditions
from lab.production.controls import Controls
from lab.production.operation.commands import COMMANDS
from lab.production.operation.desk import Desk
from lab.production.operation.operation import Operation
from lab.production.report import write_files
from lab.production.run import remember
from lab.production.run_journal import RunEnded, RunJournal
from lab.production.run_options import RunOptions
from lab.tasks.task import Task
from lab.teaching.teacher import Teacher


def operating_desk(
    options: RunOptions,
    task: Task,
    teacher: Teacher,
    journal: RunJournal,
    viewer: Any = None,
    *,
    speed: float | None = None,
    attended: bool = True,
    words: Sequence[str] = tuple(COMMANDS),
) -> Desk:
    """The desk of a run by hand, which repeats first what its journal has; `Desk.serve` lays the scene out.

    viewer: the live page that shows the scene. speed: simulated seconds per second of real time, None: unlimited. attended,
    words: see `Desk`. Raises BadInput for parts that the task does not have.
    """
    conditions = Conditions(1.0, viewer, Controls(speed), journal, fault_seed=options.faults)
    order = task.ordered(options.toasts, options.parts)
    operation = Operation(task, order, options.seed, teacher, conditions)
    return Desk(operation, attended=attended, known=journal.known, words=words)


def kept_operation(operation: Operation, folder: Path) -> dict[str, Any]:
    """The document of what was done, after writing the files of the run, if there was one."""
    scene, report = operation.scene, operation.report()
    document = {
        "task": scene.task.name,
        "seed": scene.seed,
        "parts": {kind: scene.order.count(kind) for kind in dict.fromkeys(scene.order)},
        "success": False,
        "delivered": 0,
        "failure": None,
        "files": {},
    }
    if report is not None and report.outcome.schedule.robot:
        write_files(report, folder)
        if not report.outcome.interrupted:
            remember(report, scene.teacher)
            scene.journal.tell(RunEnded(len(report.outcome.delivered), report.outcome.failure or ""))
    if report is not None:
        document |= report.to_json()
    said = {"commands": [asdict(done) for done in operation.done], "demonstrations": scene.demonstrations}
    return document | said | {"status": operation.now().to_json()}
