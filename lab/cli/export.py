"""`lab export`: a run for the real robot, read back and played in physics as a check."""

from datetime import datetime
from math import degrees
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import offers
from lab.cli.options import Json
from lab.cli.output import complain, end, show
from lab.errors import WorkFailed, counted, unknown
from lab.lazy import rich


def export(
    run: Annotated[Path, typer.Argument(help="The folder of a `lab run`.")],
    to: Annotated[str, typer.Option("--format", help="{export formats}.", autocompletion=offers("export formats"))],
    positions: Annotated[
        str,
        typer.Option(
            "--positions",
            help="Kind of positions in job files: rectan, or pulse (assumed pulses of the lab's own arm).",
        ),
    ] = "rectan",
    any_arm: Annotated[
        bool, typer.Option("--any-arm", help="Write job files also for an arm of another maker than the controller's.")
    ] = False,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for the files; default: RUN/FORMAT.")] = None,
    as_json: Json = False,
) -> None:
    """Write what the robot did in a run as job files or trajectories, read them back and play them in physics."""
    if to not in deferred.FORMATS:
        raise unknown("format", to, deferred.FORMATS, "--format")
    if positions not in deferred.POSITIONS:
        raise unknown("sort of positions", positions, deferred.POSITIONS, "--positions")
    folder = out or run / to
    deferred.check_out(folder)
    program, form = deferred.Program.load(run), deferred.FORMATS[to]
    options = deferred.Options(
        "pulse" if positions == "pulse" else "rectan", datetime.now().strftime("%Y/%m/%d %H:%M"), any_arm
    )
    written = form.write(program, options)
    files = _written(written, folder)
    read = {path.name: path.read_bytes().decode("utf-8") for path in files}
    read_back = form.read(read, program.arm)
    off = deferred.deviation(program, read_back)
    for warning in form.warnings(program):
        complain(warning)
    document = {
        "task": program.carried.task,
        "arm": program.arm.name,
        "format": to,
        "files": [str(path) for path in files],
        "transfers": len(program.carried.transfers),
        "motions": off.motions,
        "moves": sum(len(command.points) for command in read_back if isinstance(command, deferred.Lines))
        if isinstance(read_back, list)
        else 0,
        "poses": off.poses,
        "max_deviation_m": off.max_m,
        "max_deviation_rad": off.max_rad,
        "deviation_at_rest_m": off.at_rest_m,
        "deviation_at_rest_rad": off.at_rest_rad,
        "run_off_target_m": off.run_off_m,
        "within_1_mm_and_1_degree": off.near_enough,
        "warnings": form.warnings(program),
    }
    show(document, as_json, _summary)
    if not off.near_enough:
        why = f"in the run it was itself up to {1000 * off.run_off_m:.1f} mm off where it was driven to"
        end(f"played in physics, the tool is more than 1 mm or 1 degree off the run's; {why}", 1)


def _written(texts: dict[str, str], folder: Path) -> list[Path]:
    """The paths of the files, after writing each atomically."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            deferred.write_whole(folder / name, text.encode("utf-8"))
    except OSError as error:
        raise WorkFailed(f"output folder '{folder}' (--out) cannot be written: {error.strerror or error}") from error
    return [folder / name for name in texts]


def _summary(document: dict[str, Any]) -> "rich.console.RenderableType":
    files = document["files"]
    worst = f"{1000 * document['max_deviation_m']:.2f} mm, {degrees(document['max_deviation_rad']):.2f} degrees"
    rest = f"{1000 * document['deviation_at_rest_m']:.2f} mm, {degrees(document['deviation_at_rest_rad']):.2f} degrees"
    lines = [
        f"{document['task']}, {document['arm']}: {counted(document['transfers'], 'transfer')} as "
        f"{counted(len(files), 'file')} in {Path(files[0]).parent}",
        f"read back and played in physics: at most {worst} off the run's tool on {counted(document['motions'], 'path')}, "
        f"{rest} at their ends",
    ]
    return rich.text.Text("\n".join(lines))
