"""The cycle of a cell or of a task that needs the least time a part: what `lab sequence --cyclic` does."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

from lab.errors import BadInput, LabError
from lab.production.cyclic_order import check_parts, cycle_document, mix_of
from lab.production.durations import untimed
from lab.production.order import check_order
from lab.production.taught import teach_all
from lab.sequencing.cell.cell import MAX_PARTS, Cell
from lab.sequencing.cyclic.cycle import Cycle
from lab.sequencing.cyclic.several import best_rhythm
from lab.sequencing.cyclic.unrolled import of_parts, steady, unrolled
from lab.sequencing.methods.exact import optimum
from lab.skills.prepared_scene import prepare
from lab.tasks.cell_file import CellFile, order_from_word, toast_case
from lab.tasks.grid_world import GridWorld
from lab.tasks.instances import InstanceRequest
from lab.tasks.task import Task
from lab.tasks.task_file import load_beside
from lab.teaching.events import PhaseBegan
from lab.teaching.teacher import Teacher
from lab.view.canvas import check_picture
from lab.view.gantt import cycle_gantt

SHOWN_PERIODS = 3
FEWEST_CYCLES = 6  # parts of the finite order that is shown for comparison: enough to fill the line
MAX_EXPANDED = 50_000  # states, for the best finite order


@dataclass(frozen=True)
class CyclicOptions:
    """The options of a cycle: its parts, as `lab sequence` names an order, the most parts per cycle, and the seed;
    see `InstanceRequest`."""

    case: str | None = None
    toasts: int | None = None
    parts: str | None = None
    seed: int = 0
    layout: Path | None = None
    robots: int | None = None
    parts_per_cycle: int | None = None


def cyclic_named(name: str, wanted: CyclicOptions, teacher: Teacher, files: dict[str, Path]) -> dict[str, Any]:
    """The document of `lab sequence --cyclic` on a cell file, or on a task over durations measured in simulation.

    Without a named order one part enters in a cycle or, of several products, the smallest mix of the file's order; or a
    multiple of that, up to parts_per_cycle parts (see `best_rhythm`). If the parts are named and parts_per_cycle is not given,
    exactly these enter. Raises BadInput for a cell without a cycle, and WorkFailed if none was found.
    """

    for path in files.values():
        check_picture(path)
    case = wanted.case
    if case is not None and name == "toast":
        name, case = toast_case(case), None
    loaded, case = load_beside(name, InstanceRequest(wanted.layout, wanted.robots, case))
    if isinstance(loaded, GridWorld):
        raise BadInput(f"{name}: it is a world, there is nothing to sequence: learn it with lab teach {name}")
    mix, own = _mix(loaded, case, wanted)
    named = (case, wanted.toasts, wanted.parts) != (None, None, None)
    parts = len(mix) if named and wanted.parts_per_cycle is None else wanted.parts_per_cycle
    if parts is not None:
        check_parts(parts, mix, cyclic=True)
    if isinstance(loaded, Task):
        check_order(untimed(loaded, mix), None, mix_of(mix))
    most = max(FEWEST_CYCLES, ceil(own / len(mix))) * len(mix)
    cell = _largest(lambda parts: _cell(loaded, mix, parts, teacher), most, len(mix))
    teacher.tell(PhaseBegan("sequence", 1))
    rhythm = best_rhythm(cell, mix, parts, wanted.seed)
    document = {"task": loaded.name, "seed": wanted.seed} | cycle_document(rhythm)
    document["finite"] = _finite(rhythm.cycle, cell)
    if "gantt" in files:
        cycle_gantt(steady(rhythm.cycle, SHOWN_PERIODS), files["gantt"])
    return document | {"files": {name: str(path) for name, path in files.items()}}


def _mix(loaded: CellFile | Task, case: str | None, wanted: CyclicOptions) -> tuple[tuple[str, ...], int]:
    """The products that enter in a cycle, and the number of parts that the file orders."""
    if isinstance(loaded, CellFile):
        if wanted.parts is not None:
            raise BadInput(f"--parts {wanted.parts}: '{loaded.name}' is a cell: give its cycle with --case or --toasts")
        if case is not None and wanted.toasts is not None:
            raise BadInput(f"--case {case} and --toasts {wanted.toasts}: a cycle is one or the other")
        own = loaded.ordered()
        asked = order_from_word(loaded, case) if case is not None else wanted.toasts
        return (loaded.ordered(asked) if asked is not None else mix_of(own)), len(own)
    if case is not None:
        raise BadInput(
            f"case '{case}' (--case): task '{loaded.name}' has none; toast has I, II and III, a cell its orders"
        )
    own = loaded.ordered()
    if wanted.toasts is None and wanted.parts is None:
        return mix_of(own), len(own)
    return tuple(loaded.ordered(wanted.toasts, wanted.parts)), len(own)


def _cell(loaded: CellFile | Task, mix: Sequence[str], parts: int, teacher: Teacher) -> Cell:
    """The cell for a number of parts that fills whole cycles."""
    if isinstance(loaded, CellFile):
        return of_parts(loaded.cell([mix[number % len(mix)] for number in range(parts)]), mix, parts)
    counts = {name: count * parts // len(mix) for name, count in Counter(mix).items()}
    order = loaded.order(None, counts)
    return teach_all(prepare(loaded, order, teacher.seed), teacher).cell


def _largest(make: Callable[[int], Cell], most: int, step: int) -> Cell:
    """The cell for the largest number of whole cycles that it has room for."""
    for parts in range(min(most, MAX_PARTS // step * step), step, -step):
        try:
            return make(parts)
        except BadInput:
            continue
    return make(step)


def _finite(cycle: Cycle, cell: Cell) -> dict[str, Any]:
    """The cost of the cycle for the cell's parts beside that of the best order; None for a missing one, with the reason."""
    parts = cell.parts
    document: dict[str, Any] = {"parts": parts, "why_not": None}
    names = ("cyclic_makespan_s", "cyclic_sequence", "waits_on_purpose", "best_s", "best_per_part_s", "best_proven")
    document |= dict.fromkeys(names)
    try:
        made = unrolled(cycle, cell)
        document["cyclic_makespan_s"], document["cyclic_sequence"] = made.schedule.makespan_s, list(made.sequence)
        document["waits_on_purpose"] = made.waits
        best = optimum(cell, MAX_EXPANDED)
        document["best_s"], document["best_proven"] = best.cost, best.proven
        document["best_per_part_s"] = best.cost / parts
    except LabError as error:
        document["why_not"] = str(error)
    return document
