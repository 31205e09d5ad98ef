"""`lab see`: picture to grid."""

from pathlib import Path
from typing import Annotated

import typer

from lab.cli.options import Json
from lab.cli.output import complain, show


def see(
    image: Annotated[Path, typer.Argument(help="A PNG or JPEG picture from above, with round markers.")],
    grid: Annotated[str | None, typer.Option("--grid", help="Rows x columns; default: 12x12, or the task's.")] = None,
    task: Annotated[
        str | None,
        typer.Option("--task", help="The task whose camera took it; without, the whole picture is taken for the grid."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="A .png file for the picture with the grid drawn on it.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Picture to grid: find the gripper (magenta), the toaster (cyan) and the obstacles (green)."""
    from lab.look import see_picture
    from lab.view.summary import grid_summary

    seen = see_picture(image, grid, task, out)
    if task is None:
        shape = f"{len(seen['grid'])}x{len(seen['grid'][0])}"
        wrong = "of a picture from a task's camera that is wrong: give --task, such as --task toast"
        complain(f"no --task: the whole picture is taken for a grid of {shape}; {wrong}")
    show(seen, as_json, grid_summary)
