"""Scheduling instances in public formats, read as the lab's cell files: a module per format, chosen by the file's content."""

import re
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from lab.errors import BadInput
from lab.tasks.cell_file import CellFile
from lab.tasks.instances.source import InstanceRequest, Source
from lab.tasks.instances.taillard import BLOCKS
from lab.tasks.record import MAX_SHORT_BYTES, read_text

__all__ = [
    "INSTANCES",
    "SUFFIXES",
    "InstanceFormat",
    "InstanceRequest",
    "format_of",
    "is_instance",
    "read_instance",
    "takes_case",
]

SUFFIXES = (".csv", ".dzn", ".yaml", ".yml", ".json", ".jsp", ".jssp", ".fjs")  # of files that are instances


@dataclass(frozen=True)
class InstanceFormat:
    """A format: its description, the module of this package that reads it, and the file endings that decide unclear content."""

    help: str
    module: str
    suffixes: tuple[str, ...] = ()

    def read(self, source: Source, asked: InstanceRequest) -> CellFile:
        """The cell of a file of this format; imports its module. Raises BadInput, with file and line, for a damaged file."""
        cell: CellFile = import_module(f"{__name__}.{self.module}").read(source, asked)
        return cell


INSTANCES = {
    "jsplib": InstanceFormat("job shops of JSPLIB and the OR-Library, text", "jsplib", (".jsp", ".jssp")),
    "taillard": InstanceFormat("Taillard's job shops, text: times, then machines", "taillard"),
    "fjsplib": InstanceFormat("flexible job shops of FJSPLIB, text", "fjsplib", (".fjs",)),
    "bilge-ulusoy": InstanceFormat("job sets of Bilge and Ulusoy, CSV; --case SET:LAYOUT, such as 7:1", "bilge_ulusoy"),
    "phillips-unger": InstanceFormat("tanks of a hoist line, CSV; --layout: its empty moves", "hoist"),
    "hoist": InstanceFormat("hoist lines as MiniZinc data", "dzn", (".dzn",)),
    "jobshoplab": InstanceFormat("JobShopLab's job shops with vehicles, YAML", "jobshoplab", (".yaml", ".yml")),
    "pyjobshop": InstanceFormat("PyJobShop's JSON, without breaks and deadlines", "pyjobshop", (".json",)),
}


def is_instance(path: Path) -> bool:
    """Whether an existing file is read as an instance: every file but .toml, and .txt files that begin like text grids."""
    if path.suffix != ".txt":
        return path.suffix != ".toml"
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            start = file.read(400)
    except OSError:  # reading it as a grid reports it
        return False
    return re.match(r"\s*(#[^\n]*[^\n.#SG][^\n]*\n\s*)*([0-9]|[Nn]b\b)", start) is not None


def takes_case(path: Path, asked: InstanceRequest) -> bool:
    """Whether --case names one of several instances in a file and its layouts, instead of an order of parts."""
    return asked.layout is not None or format_of(_source(path)) == "bilge-ulusoy"


def read_instance(path: Path, asked: InstanceRequest | None = None) -> CellFile:
    """The cell of an instance file of any format; raises BadInput, with file and line, for a damaged file."""
    source = _source(path)
    return INSTANCES[format_of(source)].read(source, asked or InstanceRequest())


def _source(path: Path) -> Source:
    text = read_text(path)
    if len(text) > MAX_SHORT_BYTES:
        raise BadInput(f"{path}: {len(text)} characters: an instance has up to {MAX_SHORT_BYTES}")
    return Source(path, text.removeprefix("\ufeff"))


def format_of(source: Source) -> str:
    """The format of a file by its content, or by its ending where that is unclear; raises BadInput for no known format."""
    rows = [*source.rows()]
    form_name = None if not rows else _of_text(source) or _of_numbers(source)
    if form_name is None:
        suffix = source.path.suffix.lower()
        form_name = next((name for name, form in INSTANCES.items() if suffix in form.suffixes), None)
    if form_name is None or not rows:
        line, got = (rows[0][0], " ".join(rows[0][1])) if rows else (1, None)
        raise source.refusal(line, f"an instance ({', '.join(INSTANCES)})" + ("" if rows else ": it is empty"), got)
    return form_name


def _of_text(source: Source) -> str | None:
    start = source.text.lstrip()
    if start.startswith("{"):
        return "pyjobshop"
    if re.search(r"^instance_config[ \t]*:", source.text, re.MULTILINE):
        return "jobshoplab"
    header = [word.strip().lower() for word in start.partition("\n")[0].split(",")]
    if header[:3] == ["set", "job", "operation"]:
        return "bilge-ulusoy"
    if header[:2] == ["tank", "soak_min"]:
        return "phillips-unger"
    if len(header) > 2 and ("from" in header or "after_move_into" in header):
        raise source.refusal(1, "jobs or tanks: these are travel times: give them with --layout", ",".join(header))
    if re.search(r"^[ \t]*(Ninner|numTanks|tmin|minTime)[ \t]*=", source.text, re.MULTILINE):
        return "hoist"
    return None


def _of_numbers(source: Source) -> str | None:
    """The format of a text of numbers: two blocks are Taillard's, rows of pairs JSPLIB's, a head of three FJSPLIB's."""
    rows = [*source.rows()]
    words = {row[0].lower() for _, row in rows}
    numbers = [row for _, row in rows if row[0][0].isdigit()]
    if not numbers:
        return None
    if words & {*BLOCKS} or {"nb"} & words:
        return "taillard"
    if not rows[0][1][0][0].isdigit():
        return None
    head = numbers[0]
    if source.path.suffix.lower() == ".fjs" or len(head) == 3:
        return "fjsplib"
    if len(head) == 2 and len(numbers) > 1 and head[1] == str(len(numbers[1])) and int(head[1]) > 1:
        return "taillard"
    return "jsplib"
