"""The board's instances: those that come with the lab, each a row of board.csv, and the user's own files."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.tasks.cell_file import CellFile, order_from_word
from lab.tasks.instances import InstanceRequest, is_instance, read_instance
from lab.tasks.task_file import load_cell

FOLDER = Path(__file__).with_name("instances")
OWN = "your own"


@dataclass(frozen=True)
class Instance:
    """An instance: its family, its name, the file that holds it, and the options with which it is read.

    file: a file in `instances`, a cell that comes with the lab, or a path; case: one of the file's instances, or the order of a
    cell. printed: the published cost, in the file's unit of time; printed_is: "optimum", "best known" or "PPO".
    """

    family: str
    name: str
    file: str
    layout: str = ""
    case: str = ""
    robots: int | None = None
    printed: float | None = None
    printed_is: str = ""

    @property
    def is_cyclic(self) -> bool:
        """Whether the cost is the period of an order that repeats for ever."""
        return self.family.endswith("cyclic")


def board() -> tuple[Instance, ...]:
    """The instances that come with the lab."""
    with (FOLDER / "board.csv").open(encoding="utf-8", newline="") as file:
        return tuple(
            Instance(
                **{name: line[name] for name in ("family", "name", "file", "layout", "case", "printed_is")},
                robots=int(line["robots"]) if line["robots"] else None,
                printed=float(line["printed"]) if line["printed"] else None,
            )
            for line in csv.DictReader(file)
        )


def own_instances(paths: Sequence[Path]) -> tuple[Instance, ...]:
    """An instance for each file, also those in folders. Raises BadInput for a missing or unreadable one."""
    instances = list[Instance]()
    for path in paths:
        if not path.exists():
            raise BadInput(f"instance '{path}' (--instances): there is no such file or folder")
        files = [path] if path.is_file() else sorted(inside for inside in path.iterdir() if inside.is_file())
        instances += [Instance(OWN, file.name, str(file)) for file in files]
    for instance in instances:
        cell_file(instance)
    return tuple(instances)


@lru_cache(maxsize=256)
def cell_file(instance: Instance) -> CellFile:
    """The cell file of an instance, with its order. Raises BadInput as its reader does."""
    shipped = FOLDER / instance.file
    path = shipped if shipped.is_file() else Path(instance.file)
    if path.is_file() and is_instance(path):
        layout = FOLDER / instance.layout if instance.layout else None
        return read_instance(path, InstanceRequest(layout, instance.robots, instance.case or None))
    file = load_cell(instance.file)
    if not instance.case:
        return file
    return file.model_copy(update={"order": order_from_word(file, instance.case), "parts": None})


def cell_of(instance: Instance) -> Cell:
    """The cell of an instance. Raises BadInput as `cell_file` does."""
    return replace(cell_file(instance).cell(), due_s=None)  # only the makespan counts
