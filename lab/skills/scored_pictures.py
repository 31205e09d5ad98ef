"""Scores of picture reading: how many of the pictures from `made_pictures` are read exactly; and parts in a picture."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import hypot
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import Field, ValidationError

from lab.errors import BadInput, LabError
from lab.files import read_limited
from lab.sim.camera import seen_corners
from lab.sim.scene.scene_check import places_of
from lab.skills.camera_grids import camera_view
from lab.skills.made_pictures import INDEX, mat_of
from lab.tasks.record import Record
from lab.tasks.task import Task
from lab.tasks.task_file import load
from lab.vision import Image, View, read_picture, see
from lab.vision.calibration import Calibration, calibrate
from lab.vision.part_outline import Outlined, find_part

Cell = tuple[int, ...]
Kept = TypeVar("Kept", bound=Record)


class TruthOfMarker(Record):
    """A marker's ground truth: its kind, position [m], pixel, and the share of it that is hidden, 0 to 1."""

    kind: str
    world_m: tuple[float, float, float]
    pixel: tuple[float, float]
    hidden: float


class Truth(Record):
    """A picture's ground truth, as `made_pictures` writes it."""

    shape: Cell
    start: Cell
    goal: Cell
    obstacles: list[Cell]
    markers: list[TruthOfMarker]


class PicturesIndex(Record):
    """The index of a folder of pictures, as `made_pictures` writes it."""

    task: str
    station: str
    pictures: Annotated[int, Field(ge=1)]
    mats: Annotated[int, Field(ge=1, le=100)]
    seed: int
    strength: float


PART_REACH_M, PART_REACH_RAD = 0.03, 0.2  # search range around a station's spots


def calibrated_view(task: Task, station: str, calibration: Calibration) -> View:
    """The mapping from a calibrated camera's undistorted picture to a station's grid."""
    return replace(camera_view(task, station), pixel_from_world=calibration.pixel_from_world)


def score_pictures(
    folder: Path, calibration: Calibration | None = None, *, tell: Callable[[int], None] = lambda n: None
) -> dict[str, Any]:
    """The scores of reading every picture of a folder that `make_pictures` made, against its ground truth.

    The camera is calibrated with the folder's pictures of the mat unless a calibration is given. A grid is exact when
    start, goal and obstacles are all right and nothing else is seen. Marker errors are in metres, the calibration's
    residual in pixels. Raises BadInput for a folder without an index.
    """
    index = _read(PicturesIndex, folder / INDEX)
    task, count = load(index.task), index.pictures
    if index.station not in [station.name for station in task.stations if station.grid is not None]:
        raise BadInput(f"{folder / INDEX}: station '{index.station}' of '{index.task}' has no grid")
    if calibration is None:
        names = [folder / f"mat-{number + 1}.png" for number in range(index.mats)]
        calibration = calibrate([(str(name), read_picture(name)) for name in names], mat_of(task))
    view, lens = calibrated_view(task, index.station, calibration), calibration.lens
    wrong: list[dict[str, str]] = []
    errors: list[float] = []
    for number, image, truth in _kept(folder, count):
        reason, off = _compared(lens.straightened(image), view, truth)
        errors += off
        if reason:
            wrong.append({"picture": f"{number:05}.png", "reason": reason})
        tell(number)
    exact = count - len(wrong)
    return {
        "pictures": count,
        "exact": exact,
        "exact_percent": 100.0 * exact / count,
        "marker_mean_m": float(np.mean(errors)) if errors else None,
        "marker_max_m": float(np.max(errors)) if errors else None,
        "calibration_residual_px": calibration.residual_px,
        "wrong": wrong,
    }


def _kept(folder: Path, count: int) -> Iterator[tuple[int, Image, Truth]]:
    for number in range(1, count + 1):
        yield number, read_picture(folder / f"{number:05}.png"), _read(Truth, folder / f"{number:05}.json")


def _read(kind: type[Kept], path: Path) -> Kept:
    """The record of a file that `lab see --make` wrote. Raises BadInput when it cannot be read or is another file."""
    try:
        return kind.model_validate_json(read_limited(path))
    except OSError as error:
        raise BadInput(
            f"{path}: cannot be read: {error.strerror or error}: wanted what `lab see --make` wrote"
        ) from None
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise BadInput(f"{path}: {where}: {first['msg']}: wanted what `lab see --make` wrote") from None


def _compared(straight: Image, view: View, truth: Truth) -> tuple[str, list[float]]:
    """The difference between the grid read and the truth, "" for none; and the error of each marker [m]."""
    try:
        seen = see(straight, view)
    except LabError as error:
        return str(error), []
    off: list[float] = []
    for marker in truth.markers:
        dx, dy = view.offsets_m.get(marker.kind, (0.0, 0.0))
        x, y = marker.world_m[0] + dx, marker.world_m[1] + dy
        alike = [hypot(m.world_m[0] - x, m.world_m[1] - y) for m in seen.markers if m.kind == marker.kind]
        if not alike:
            return f"no marker '{marker.kind}' is seen", off
        off.append(min(alike))
    record, is_so = seen.to_json(), truth.model_dump(mode="json")
    different = [name for name in ("start", "goal", "obstacles") if record[name] != is_so[name]]
    return "; ".join(f"{name} {record[name]}, is {is_so[name]}" for name in different), off


def parts_seen(task: Task, image: Image, view: View) -> list[dict[str, Any]]:
    """The parts seen on stations' spots in an undistorted overhead picture.

    Each is a record of `kind`, `station`, `world_m` [m], `yaw_rad` [rad] and `outline_px` [pixels].
    """
    places, seen_parts = places_of(task), []
    height, width = image.shape[:2]
    for station in task.stations:
        for kind in {kind.name: kind for kind in places.kinds_at(station.name) if kind.rider is None}.values():
            colours = np.array([look.rgba[:3] for look in kind.shape.looks])
            for spot in places.spots(station, kind.name):
                foot = places.raised(kind.name, station, spot)
                part = Outlined(seen_corners(kind.shape), foot.z, not kind.grip.period, view.pixel_from_world, colours)
                near = np.array([foot.x, foot.y, foot.yaw])
                outline = part.outlines(near[None])[0, :, :2]
                if outline.min() < 0 or (outline.max(axis=0) > (width - 1, height - 1)).any():
                    continue
                if seen := find_part(image, part, near, PART_REACH_M, PART_REACH_RAD):
                    at = {"kind": kind.name, "station": station.name, "world_m": [seen.x, seen.y], "yaw_rad": seen.yaw}
                    seen_parts.append(at | {"outline_px": seen.outline.round(2).tolist()})
    return seen_parts
