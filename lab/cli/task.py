"""`lab task`: list, show, convert, create and check task files."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.options import Json, Seed
from lab.cli.output import end, show, write, write_json
from lab.errors import BadInput, LabError, counted


def task_list(as_json: Json = False) -> None:
    """The tasks, the cells for lab sequence and the grid worlds that ship."""
    kinds = deferred.shipped()
    rows = [{"name": name, "kind": kind} for name, kind in kinds.items()]
    show({"tasks": list(kinds), "kinds": kinds}, as_json, lambda _: deferred.table_of(rows, ("name", "kind")))


def task_show(task: str, as_json: Json = False) -> None:
    """The text of a task file, of a task, a cell or a world: copy it, change it, use it."""
    text, document = deferred.describe(task)
    if as_json:
        write_json(document)
    else:
        write(text)


def task_schema(
    kind: Annotated[
        str,
        typer.Argument(
            help="The kind of files: task, cell or world.",
            autocompletion=lambda: ["task", "cell", "world"],
            metavar="[KIND]",
        ),
    ] = "task",
    out: Annotated[
        Path | None,
        typer.Option("--out", help="The .json file to write, or, as a page to read, the .md file; default: shown."),
    ] = None,
    as_json: Json = False,
) -> None:
    """The keys that a task, cell or world file may have, as a JSON Schema that editors complete with, or as a page.

    An editor with a TOML extension (Even Better TOML, taplo) reads the schema where the first line of a file says
    #:schema FILE.
    """
    schema = deferred.schema_of(kind)
    if out is None:
        write_json(schema)
        return
    if out.suffix not in (".json", ".md"):
        raise BadInput(f"file '{out}' (--out): wanted one that ends with .json or .md")
    deferred.write_text(
        out, deferred.page_of(kind) if out.suffix == ".md" else json.dumps(schema, indent=2, ensure_ascii=False) + "\n"
    )
    hint = "" if out.suffix == ".md" else f"; as the first line of a {kind} file: #:schema {out}"
    show({"file": str(out), "kind": kind}, as_json, lambda d: f"{d['file']}: the keys of a {kind} file{hint}")


def task_convert(
    file: Annotated[str, typer.Argument(help="An instance file ({instances}), or a cell.")],
    layout: Annotated[
        Path | None, typer.Option("--layout", help="A CSV of travel times, a matrix or rows of from,to,time.")
    ] = None,
    robots: Annotated[
        int | None, typer.Option("--robots", min=1, max=50, help="How many robots carry parts, all alike; default: 1.")
    ] = None,
    case: Annotated[
        str | None,
        typer.Option("--case", help="The case of job sets and layouts as CSV: SET:LAYOUT, such as 7:1, or EX71."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="The .toml file to write, or, without a robot, PyJobShop's .json; default: shown."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Read an instance in a common format, and write it as the lab's own cell file (TOML), or as PyJobShop's JSON."""
    cell_file = deferred.load_cell_beside(file, deferred.InstanceAsked(layout, robots, case))
    if out is not None and out.suffix not in (".toml", ".json"):
        raise BadInput(f"file '{out}' (--out): wanted one that ends with .toml or .json")
    text = (
        deferred.pyjobshop.write(cell_file)
        if out is not None and out.suffix == ".json"
        else deferred.toml_of(cell_file)
    )
    if out is not None:
        deferred.write_text(out, text)
    parts, robots_there = len(cell_file.ordered()), len(cell_file.built_robots)
    document = {
        "file": None if out is None else str(out),
        "name": cell_file.name,
        "parts": parts,
        "robots": robots_there,
    }
    if as_json or out is not None:
        what = f"{counted(parts, 'part')}, {counted(robots_there, 'robot')}"
        show(document | {"text": text}, as_json, lambda d: f"{d['file']}: {d['name']}, {what}")
    else:
        write(text)


def task_random(
    shape: Annotated[str, typer.Argument(help="Cells along 2 or 3 axes, each 1 to 100: 12x12, 10x10x10.")],
    out: Annotated[Path, typer.Option("--out", help="The .toml file to write.")],
    density: Annotated[float, typer.Option("--density", help="The share of cells that are obstacles, 0 to 0.6.")] = 0.1,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Write a random grid world as a task file; a path always leads from its start to its goal."""

    def told(d: dict[str, Any]) -> str:
        return (
            f"{d['file']}: {counted(d['obstacles'], 'obstacle')}, the shortest path takes "
            f"{counted(d['optimal_steps'], 'move')} (seed {seed})"
        )

    show(deferred.write_random(shape, density, seed, out), as_json, told)


def task_check(
    file: str,
    toasts: Annotated[
        int | None,
        typer.Option(
            "--toasts",
            "-n",
            help="How many parts of the first kind, 1 to 50. Of a cell: parts, 1 to 200. Default: as it says.",
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot",
            help="A .png or .svg file for the cell from above: reach, stations, obstacles, and what blocks which cells.",
        ),
    ] = None,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Check a task file: its text, its reach, and that every sub-task, or the world, has a path. Exit 2 if not.

    A cell is checked for whether its order can be made. With --json the document is printed in both cases; the picture of a
    task that can be read is drawn in both cases, with the faults marked.
    """
    task = None if plot is None else _to_draw(file, plot)
    errors, warnings = deferred.check_task(file, toasts, seed)
    files = {}
    if task is not None and plot is not None:
        deferred.draw_cell(deferred.outline(task, toasts, seed, errors[0] if errors else ""), plot)
        files["plot"] = str(plot)
    if as_json or not errors:
        document = {"valid": not errors, "errors": errors, "warnings": warnings, "files": files}
        show(document, as_json, lambda _: "\n".join([f"{file} is sound", *(f"mind: {slip}" for slip in warnings)]))
    if errors:
        end(errors[0], 2)


def _to_draw(file: str, plot: Path) -> "deferred.Task | None":
    """The task to draw, None when it cannot be read; BadInput for a cell or a world, and for a bad path of the picture."""
    deferred.check_picture(plot)
    try:
        loaded = deferred.load_any(file)
    except LabError:  # which the check reports
        return None
    if not isinstance(loaded, deferred.Task):
        instead = f"lab sequence {file} --gantt {plot}" if isinstance(loaded, deferred.CellFile) else f"lab view {file}"
        raise BadInput(f"--plot draws the cell of a task from above, and {file} is none: see {instead}")
    return loaded
