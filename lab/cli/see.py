"""`lab see`: read a picture as a grid, calibrate a camera, and make and score pictures with ground truth."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.options import Json, Seed
from lab.cli.output import complain, show
from lab.errors import BadInput

TASK = "toast"  # default task for pictures that are made


def see(
    images: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[IMAGE]...",
            help="A PNG or JPEG picture from above, with round markers; with --calibrate several, with --score a folder.",
        ),
    ] = None,
    grid: Annotated[str | None, typer.Option("--grid", help="Rows x columns; default: 12x12, or the task's.")] = None,
    task: Annotated[
        str | None,
        typer.Option(
            "--task", help="The task whose camera took the picture; without it, the whole picture is the grid."
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            "--calibration", help="A file from --calibrate, with which the picture is undistorted before it is read."
        ),
    ] = None,
    overlay: Annotated[
        Path | None,
        typer.Option("--overlay", help="A .png file for the picture with grid, markers and parts drawn on it."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="The calibration's .json file, or the folder of --make; else as --overlay."),
    ] = None,
    calibrated: Annotated[
        bool,
        typer.Option(
            "--calibrate",
            help="Find the camera's lens and place from pictures of the mat (ArUco 4x4_50; in the first it lies on the table).",
        ),
    ] = False,
    corners: Annotated[
        str | None,
        typer.Option(
            "--corners",
            help="With --calibrate and --task: the pixels of the grid's four corners on the table, x,y x,y x,y x,y.",
        ),
    ] = None,
    make: Annotated[
        int | None,
        typer.Option(
            "--make", help="The number of pictures of a task's scenes, with ground truth, to write into --out."
        ),
    ] = None,
    score: Annotated[
        bool,
        typer.Option(
            "--score", help="Read the pictures of a folder from --make, and count those that are read exactly."
        ),
    ] = False,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Picture to grid: find the gripper (magenta), the machine's marker (cyan) and the obstacles (green)."""
    if sum((make is not None, score, calibrated)) > 1:
        raise BadInput("--make, --score and --calibrate: wanted one of them")
    if corners is not None and not calibrated:
        raise BadInput("--corners: goes with --calibrate")
    paths = images or []
    if make is not None:
        if paths or out is None:
            raise BadInput("--make: wanted no picture, and --out FOLDER")
        show(made(task or TASK, make, out, seed), as_json, deferred.pictures_summary)
        return
    if not paths or (len(paths) > 1 and not calibrated):
        raise BadInput(f"{len(paths)} pictures: wanted one, such as lab see overhead.png --task toast")
    if score:
        show(scored(paths[0], calibration), as_json, deferred.pictures_summary)
    elif calibrated:
        show(calibrate_camera(paths, task, calibration, corners, out, overlay), as_json, deferred.pictures_summary)
    else:
        seen = see_picture(paths[0], grid, task, overlay or out, calibration)
        if task is None:
            shape = f"{len(seen['grid'])}x{len(seen['grid'][0])}"
            wrong = "of a picture from a task's camera that is wrong: give --task, such as --task toast"
            complain(f"no --task: the whole picture is taken for a grid of {shape}; {wrong}")
        show(seen, as_json, deferred.grid_summary)


def made(task: str, count: int, out: Path, seed: int) -> dict[str, Any]:
    """The document of `lab see --make --json`, after making the pictures."""
    return deferred.make_pictures(task, count, out, seed) | {"files": {"folder": str(out)}}


def scored(folder: Path, calibration: Path | None) -> dict[str, Any]:
    """The document of `lab see --score --json`: how many pictures are read exactly."""
    return deferred.score_pictures(folder, _calibration(calibration))


def calibrate_camera(
    images: list[Path],
    task: str | None,
    known: Path | None,
    corners: str | None,
    out: Path | None,
    overlay: Path | None,
) -> dict[str, Any]:
    """The document of `lab see --calibrate --json`: the camera's lens and pose.

    It is computed from pictures of the mat, or from the pixels of four corners and the `known` lens or the task's.
    """
    loaded = None if task is None else deferred.load(task)
    pictures = [(str(path), deferred.read_picture(path)) for path in images]
    angle = None if loaded is None or loaded.camera is None else loaded.camera.field_of_view_rad
    if corners is None:
        calibrated = deferred.calibrate(pictures, deferred.Mat() if loaded is None else deferred.mat_of(loaded), angle)
    else:
        calibrated = _from_corners(corners, task, pictures[0][1], _calibration(known))
    files = {}
    if out is not None:
        deferred.write_calibration(out, calibrated)
        files["calibration"] = str(out)
    if overlay is not None:
        deferred.write_picture(
            overlay, deferred.drawn(pictures[0][1], calibrated, None if loaded is None else deferred.mat_of(loaded))
        )
        files["overlay"] = str(overlay)
    return calibrated.to_json() | {"files": files}


def _from_corners(
    corners: str, task: str | None, image: "deferred.Image", known: "deferred.Calibration | None"
) -> "deferred.Calibration":
    number = r"-?\d+(?:\.\d+)?"
    if not re.fullmatch(rf"\s*{number},{number}(?:\s+{number},{number}){{3}}\s*", corners):
        raise BadInput(
            f"'{corners[:80]}' (--corners): wanted the pixels of four corners, such as 60,580 580,580 580,60 60,60"
        )
    if task is None:
        raise BadInput("--corners: goes with --task, which says where the grid's corners are on the table")
    pixels = [(float(x), float(y)) for x, y in (pair.split(",") for pair in corners.split())]
    height, width = image.shape[:2]
    view, angle = _camera(task, height, None)
    (x, y), (i, j) = view.origin_m, view.shape
    a, b = i * view.cell_m, j * view.cell_m
    lens = deferred.pinhole((width, height), angle) if known is None else known.lens
    return deferred.from_corners(lens, pixels, [(x, y), (x + a, y), (x + a, y + b), (x, y + b)])


def _calibration(path: Path | None) -> "deferred.Calibration | None":
    return None if path is None else deferred.read_calibration(path)


def see_picture(
    image: Path, grid: str | None, task: str | None, out: Path | None, calibration: Path | None = None
) -> dict[str, Any]:
    """The document of `lab see --json`: a picture's markers as a grid.

    With a task, the grid is that of its overhead camera, whose lens and pose a calibration corrects; without one, the whole
    picture is the grid, 12 x 12 unless `grid` is given. If the picture is drawn, parts are searched for as well.
    """
    shape = _shape(grid)
    picture = deferred.read_picture(image)
    camera, known = None, _calibration(calibration)
    if known is not None:
        if task is None:
            raise BadInput("--calibration: goes with --task, which says where the grid is on the table")
        picture = known.lens.straightened(picture)
    if task is not None:
        height, width = picture.shape[:2]
        if height != width:
            raise BadInput(f"{image}: {width} x {height} pixels: the task's camera takes square pictures")
        camera, _ = _camera(task, height, None if grid is None else shape)
        if known is not None:
            camera = replace(camera, pixel_from_world=known.pixel_from_world)
    seen = deferred.see(picture, camera, shape=shape, where=str(image))
    parts = (
        deferred.parts_seen(deferred.load(task), picture, camera)
        if out is not None and task is not None and camera is not None
        else []
    )
    if out is not None:
        deferred.write_picture(out, deferred.draw(picture, seen, [part["outline_px"] for part in parts]))
    return seen.to_json() | {"parts": parts, "files": {} if out is None else {"picture": str(out)}}


def _shape(grid: str | None) -> tuple[int, int]:
    match = re.fullmatch(r"([1-9]\d{0,2})x([1-9]\d{0,2})", "12x12" if grid is None else grid)
    if match is None:
        raise BadInput(f"grid '{grid}' (--grid): wanted ROWSxCOLUMNS, each 1 to 999, such as 12x12")
    return int(match[1]), int(match[2])


def _camera(task: str, pixels: int, wanted: tuple[int, int] | None) -> "tuple[deferred.View, float]":
    """The view of a task's camera, for pictures of `pixels` width and height, and its field of view [rad].

    Raises BadInput when the requested grid has another shape.
    """
    loaded = deferred.load(task)
    station = next((station.name for station in loaded.stations if station.grid is not None), None)
    if station is None or loaded.camera is None:
        raise BadInput(f"task '{task}' (--task): no station of it is approached through the camera's grid")
    camera = deferred.camera_view(loaded, station, pixels)
    if wanted is not None and wanted != camera.shape:
        own, other = (f"{shape[0]}x{shape[1]}" for shape in (camera.shape, wanted))
        raise BadInput(f"grid '{other}' (--grid): the grid of the task's camera is {own}; leave --grid away")
    return camera, loaded.camera.field_of_view_rad
