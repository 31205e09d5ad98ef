"""`lab export`: a run for the real robot, read back and played in physics as a check, or as a dataset for learning."""

from contextlib import ExitStack
from datetime import datetime
from math import degrees
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import offers
from lab.cli.options import Json
from lab.cli.output import complain, end, show
from lab.errors import BadInput, WorkFailed, counted, unknown
from lab.lazy import rich

PIXELS = 128  # width of the pictures in a dataset


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
    fps: Annotated[int, typer.Option("--fps", min=1, max=240, help="Steps a second of a dataset.")] = 30,
    pictures: Annotated[
        int | None,
        typer.Option(
            "--pictures",
            min=0,
            max=2048,
            help=f"Width of the overhead camera's pictures in a dataset; 0: none; default: {PIXELS}, if there are any.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for the files, a new one for a dataset; default: RUN/FORMAT.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write what the robot did in a run as job files or trajectories, which are read back and played, or as a dataset."""
    if to not in deferred.FORMATS:
        raise unknown("format", to, deferred.FORMATS, "--format")
    if positions not in deferred.POSITIONS:
        raise unknown("sort of positions", positions, deferred.POSITIONS, "--positions")
    folder = out or run / to
    deferred.check_out(folder)
    program, date = deferred.Program.load(run), datetime.now().strftime("%Y/%m/%d %H:%M")
    options = deferred.Options("pulse" if positions == "pulse" else "rectan", date, any_arm, fps)
    form = deferred.FORMATS[to]
    if isinstance(form, deferred.DatasetFormat):
        _export_dataset(form, run, program, options, pictures, folder, as_json)
        return
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


def _export_dataset(
    form: "deferred.DatasetFormat",
    run: Path,
    program: "deferred.Program",
    options: "deferred.Options",
    pictures: int | None,
    folder: Path,
    as_json: bool,
) -> None:
    """Write a run as a dataset, read it back and compare it; exit 1 if it is not equal."""
    kept = deferred.is_run(run)
    by_hand_s = deferred.by_hand_s(run) if kept else ()
    with ExitStack() as stack:
        film = None
        if pictures != 0:
            try:
                if not kept:
                    raise BadInput(f"'{run}' (RUN): no journal in it")
                film = stack.enter_context(deferred.RunFilm(run, pictures or PIXELS))
            except BadInput as error:
                if pictures is not None:
                    raise
                complain(f"{error}: the dataset has no pictures")
        record = deferred.RunRecord(film, by_hand_s)
        form.write(program, options, record, folder)
        checked = form.check(program, options, record, folder)
    document = {
        "task": program.carried.task,
        "arm": program.arm.name,
        "format": next(name for name, own in deferred.FORMATS.items() if own is form),
        "folder": str(folder),
        "episodes": checked.episodes,
        "steps": checked.steps,
        "fps": options.fps,
        "corrected_steps": checked.corrected_steps,
        "pictures": film is not None,
        "picture_deviation": checked.picture_off,
        "equal": not checked.faults,
        "faults": list(checked.faults),
    }
    show(document, as_json, _dataset_summary)
    if checked.faults:
        end(f"read back, the dataset is not what the run was: {checked.faults[0]}", 1)


def _dataset_summary(document: dict[str, Any]) -> "rich.console.RenderableType":
    camera = (
        f"first pictures of its episodes at most {document['picture_deviation']:.1f} of 255 off on average"
        if document["pictures"]
        else "no pictures"
    )
    lines = [
        f"{document['task']}, {document['arm']}: {counted(document['episodes'], 'episode')}, "
        f"{counted(document['steps'], 'step')} at {document['fps']} a second, "
        f"{document['corrected_steps']} of them by hand, in {document['folder']}",
        f"read back: {'states, actions and tasks equal' if document['equal'] else 'not equal'}; {camera}",
    ]
    return rich.text.Text("\n".join(lines))


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
