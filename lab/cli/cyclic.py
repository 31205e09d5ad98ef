"""What `lab sequence --cyclic` runs."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from lab.cli import deferred
from lab.cli.lessons import lesson_seat, teacher_of
from lab.errors import BadInput

OF_A_CYCLE = ("task", "case", "toasts", "parts", "seed", "layout", "robots")


def cyclic_found(
    given: "deferred.OrderOptions", toolbox: str | None, files: dict[str, Path], parts_per_cycle: int | None
) -> dict[str, Any]:
    """The document of the shortest cycle; BadInput for options that say how an order is looked for, which a cycle is not."""
    none = asdict(deferred.OrderOptions())
    for name, value in asdict(given).items():
        if name not in OF_A_CYCLE and value != none[name]:
            said = "" if value is True else f" {value}"
            raise BadInput(
                f"--cyclic beside --{name}{said}: the shortest cycle of its parts is found and proven, by its period alone"
            )
    if "plot" in files:
        raise BadInput(f"--cyclic beside --plot {files['plot']}: a cycle has no episodes; --gantt draws it")
    if "schedule" in files:
        raise BadInput(f"--cyclic beside --schedule {files['schedule']}: a cycle has no end: --gantt draws it")
    options = deferred.LessonOptions(advisors=deferred.DEFAULT_ADVISORS, seed=given.seed)
    with lesson_seat(()) as seat, seat.progress:
        teacher = teacher_of(toolbox, options, seat)
        beside = given.beside
        wanted = deferred.CyclicOptions(
            given.case, given.toasts, given.parts, given.seed, beside.layout, beside.robots, parts_per_cycle
        )
        return deferred.cyclic_named(given.task, wanted, teacher, files)
