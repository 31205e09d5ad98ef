"""`lab see`: picture to grid."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lab.cli.options import Json
from lab.cli.output import complain, show
from lab.errors import BadInput

if TYPE_CHECKING:
    from lab.vision import View


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
    """Picture to grid: find the gripper (magenta), the machine's marker (cyan) and the obstacles (green)."""
    from lab.view.summary import grid_summary

    seen = see_picture(image, grid, task, out)
    if task is None:
        shape = f"{len(seen['grid'])}x{len(seen['grid'][0])}"
        wrong = "of a picture from a task's camera that is wrong: give --task, such as --task toast"
        complain(f"no --task: the whole picture is taken for a grid of {shape}; {wrong}")
    show(seen, as_json, grid_summary)


def see_picture(image: Path, grid: str | None, task: str | None, out: Path | None) -> dict[str, Any]:
    """A picture's markers as a grid, the document of `lab see --json`.

    With a task the grid is the one of its overhead camera; without, the frame is the grid, 12 x 12 unless `grid` says so.
    """
    from lab.vision import draw, read_picture, see, write_picture

    shape = _shape(grid)
    picture = read_picture(image)
    camera = None
    if task is not None:
        height, width = picture.shape[:2]
        if height != width:
            raise BadInput(f"{image}: {width} x {height} pixels: the task's camera takes square pictures")
        camera = _camera(task, height, None if grid is None else shape)
    seen = see(picture, camera, shape=shape, where=str(image))
    if out is not None:
        write_picture(out, draw(picture, seen))
    return seen.to_json() | {"files": {} if out is None else {"picture": str(out)}}


def _shape(grid: str | None) -> tuple[int, int]:
    match = re.fullmatch(r"([1-9]\d{0,2})x([1-9]\d{0,2})", "12x12" if grid is None else grid)
    if match is None:
        raise BadInput(f"grid '{grid}' (--grid): wanted ROWSxCOLUMNS, each 1 to 999, such as 12x12")
    return int(match[1]), int(match[2])


def _camera(task: str, pixels: int, wanted: tuple[int, int] | None) -> "View":
    """How a task's camera with so many pixels a side sees its grid; BadInput when a grid of another shape is wanted."""
    from lab.skills.camera_grids import camera_view
    from lab.tasks.task_file import load

    loaded = load(task)
    station = next((station.name for station in loaded.stations if station.grid is not None), None)
    if station is None:
        raise BadInput(f"task '{task}' (--task): no station of it is approached through the camera's grid")
    camera = camera_view(loaded, station, pixels)
    if wanted is not None and wanted != camera.shape:
        own, other = (f"{shape[0]}x{shape[1]}" for shape in (camera.shape, wanted))
        raise BadInput(f"grid '{other}' (--grid): the grid of the task's camera is {own}; leave --grid away")
    return camera
