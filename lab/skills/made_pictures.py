"""Synthetic pictures as a real overhead camera would take them, each with its ground truth in a file beside it."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from lab.errors import BadInput, WorkFailed
from lab.files import write_whole
from lab.sim import models
from lab.sim.arms.kinematics import ToolPose
from lab.sim.camera import Camera
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import MARKER_ABOVE, Scene, marker_of
from lab.sim.world import World
from lab.skills.camera_grids import camera_view, settings_of
from lab.tasks.task import Task
from lab.tasks.task_fields import CameraGrid, Obstacle
from lab.tasks.task_file import load
from lab.vision import Image, Lens, write_picture
from lab.vision.calibration import PRINTED, Mat
from lab.vision.lens import drawn_lens, hide, spoiled

MATS = 6  # pictures of the mat: the first of it flat on the table, the others of it tilted
MAT_TILT = 0.5  # [rad] about each axis, at the most
WITHIN_M = 0.018  # largest offset from a cell's middle: a millimetre from a border, nobody can tell the cell
CUBES = (1, 6)  # least and largest number of stacks
APART_M = 0.10  # between the middles of stacks, and of the gripper
MACHINE_APART_M = 0.17  # from the machine's middle
OFF_M, OFF_RAD = 0.008, 0.02  # standard deviations of the camera's real position and rotation
COVER_REACH = 4.8  # distance from a marker to the next, in its radii: a cover over one then leaves the other alone
DRAWS = 400
INDEX = "pictures.json"


@dataclass(frozen=True)
class PicturedTask:
    """The content of a picture: the task with its machine and stacks as placed, and the gripper's position [m]."""

    task: Task
    layout: Layout
    gripper: tuple[float, float]


def make_pictures(
    task_name: str,
    count: int,
    folder: Path,
    seed: int,
    strength: float = 1.0,
    *,
    tell: Callable[[int], None] = lambda n: None,
) -> dict[str, Any]:
    """Write `count` pictures of a task's grid, and some of the mat, into a new folder; returns the record in its index.

    One camera takes them all; its lens and pose are drawn from the seed. BadInput when the folder exists already.
    """
    if count < 1:
        raise BadInput(f"{count} pictures (--make): wanted 1 or more")
    if folder.exists():
        raise BadInput(f"{folder}: it is there already: wanted a new folder for the pictures")
    task = load(task_name)
    station = grid_station(task)
    rng = np.random.default_rng([seed, 0])
    camera = _hung(task, rng)
    lens = drawn_lens(rng, camera.lens())
    mat = mat_of(task)
    folder.mkdir(parents=True)
    write_picture(folder / "mat.png", mat.printed(PRINTED))
    for number in range(MATS):
        image = spoiled(_mat_picture(mat, camera, lens, number, rng), rng, strength)
        write_picture(folder / f"mat-{number + 1}.png", image)
    for number in range(1, count + 1):
        image, truth = one_picture(task, station, camera, lens, np.random.default_rng([seed, number]), strength)
        write_picture(folder / f"{number:05}.png", image)
        write_whole(folder / f"{number:05}.json", json.dumps(truth).encode())
        tell(number)
    record = {
        "task": task_name,
        "station": station,
        "pictures": count,
        "mats": MATS,
        "seed": seed,
        "strength": strength,
    }
    write_whole(folder / INDEX, (json.dumps(record, indent=1) + "\n").encode())
    return record


def one_picture(
    task: Task, station: str, camera: Camera, lens: Lens, rng: np.random.Generator, strength: float
) -> tuple[Image, dict[str, Any]]:
    """A picture (H, W, 3) of machine, stacks and gripper somewhere in the grid, and its ground truth.

    Placements in which something hides a marker from the camera are drawn again. WorkFailed after DRAWS attempts.
    """
    for _ in range(DRAWS):
        placed = _drawn(task, station, rng)
        with World() as world:
            scene = Scene(world, placed.task, (), placed.layout)
            grid = settings_of(placed.task.station(station))
            if not scene.robot.stand(ToolPose(*placed.gripper, grid.height_m, 0.0)):
                continue
            markers = _markers(placed, station, grid)
            discs = [_disc(camera, lens, at) for _, at in markers]
            if not _apart(discs) or not all(_in_sight(world, camera, lens, at) for _, at in markers):
                continue
            image = camera.picture_through(lens, world)
        break
    else:
        raise WorkFailed(f"task '{task.name}': in {DRAWS} draws the camera never saw all markers")
    shares = [0.0] * len(markers)
    if strength > 0.0:
        image, shares = hide(image, discs, rng)
    view = camera_view(placed.task, station)
    start, goal = view.cell(placed.gripper), view.cell(placed.task.station(station).pose[:2])
    obstacles = sorted(view.cell((at[0], at[1])) for at in placed.layout.obstacles)
    truth = {
        "shape": list(grid.shape),
        "start": list(start),
        "goal": list(goal),
        "obstacles": [list(cell) for cell in obstacles],
        "markers": [
            {"kind": kind, "world_m": list(at), "pixel": list(disc[:2]), "hidden": share}
            for (kind, at), disc, share in zip(markers, discs, shares, strict=True)
        ],
    }
    return spoiled(image, rng, strength), truth


# ---- the camera and its calibration mat ------------------------------------------------------------------------------


def grid_station(task: Task) -> str:
    for station in task.stations:
        if station.grid is not None:
            return station.name
    raise BadInput(f"task '{task.name}' (--task): no station of it is approached through the camera's grid")


def _hung(task: Task, rng: np.random.Generator) -> Camera:
    """The task's overhead camera with the errors of a real mount: slightly displaced and not exactly vertical."""
    assert task.camera is not None
    x, y, z = task.camera.position_m
    off, tilt, turn = rng.normal(0, OFF_M, 3), rng.normal(0, OFF_RAD / 2, 2) * z, float(rng.normal(0, OFF_RAD))
    eye = (float(x + off[0]), float(y + off[1]), float(z + off[2]))
    target = (float(eye[0] + tilt[0]), float(eye[1] + tilt[1]), 0.0)
    up = (float(-np.sin(turn)), float(np.cos(turn)), 0.0)
    pixels = task.camera.pixels
    return Camera(eye, target, up, task.camera.field_of_view_rad, pixels, pixels)


def mat_of(task: Task) -> Mat:
    """The mat that fills most of the task's overhead picture, centred below the camera."""
    assert task.camera is not None
    x, y, z = task.camera.position_m
    side = 2 * z * float(np.tan(task.camera.field_of_view_rad / 2)) * 0.85
    whole = Mat()
    scale = side / whole.size_m[0]
    return Mat((x, y), marker_m=round(whole.marker_m * scale, 3), gap_m=round(whole.gap_m * scale, 3))


def _mat_picture(mat: Mat, camera: Camera, lens: Lens, number: int, rng: np.random.Generator) -> Image:
    """The camera's picture of the mat, flat on the table (number 0) or tilted."""
    turn, shift = camera.turn_and_shift()
    if number:
        tilt = scipy.spatial.transform.Rotation.from_rotvec(rng.uniform(-MAT_TILT, MAT_TILT, 3)).as_matrix()
        middle = np.array([*mat.middle_m, 0.0])
        turn, shift = turn @ tilt, shift + turn @ (middle - tilt @ middle)
    return mat.photographed(lens, turn, shift)


# ---- the scene of one picture ----------------------------------------------------------------------------------------


def _drawn(task: Task, station: str, rng: np.random.Generator) -> PicturedTask:
    """A random placement of machine, stacks of cubes and gripper: each near the middle of its own cell, well apart."""
    place = task.station(station)
    grid = settings_of(place)

    def somewhere() -> tuple[float, float]:
        cell = [int(rng.integers(1, count - 1)) for count in grid.shape]
        x, y = (
            o + (i + 0.5) * grid.cell_m + rng.uniform(-WITHIN_M, WITHIN_M)
            for o, i in zip(grid.origin_m, cell, strict=True)
        )
        return float(x), float(y)

    def apart(at: tuple[float, float], others: list[tuple[float, float]], far: float) -> bool:
        return all(hypot(at[0] - x, at[1] - y) >= far for x, y in others)

    machine = somewhere()
    x, y = grid.start_m
    gripper = (float(x + rng.uniform(-WITHIN_M, WITHIN_M)), float(y + rng.uniform(-WITHIN_M, WITHIN_M)))
    stacks: list[tuple[float, float]] = []
    wanted = int(rng.integers(CUBES[0], CUBES[1] + 1))
    for _ in range(DRAWS):
        at = somewhere()
        if apart(at, [*stacks, gripper], APART_M) and apart(at, [machine], MACHINE_APART_M):
            stacks.append(at)
        if len(stacks) == wanted:
            break
    if not apart(machine, [gripper], MACHINE_APART_M):
        return _drawn(task, station, rng)
    stations = tuple(
        s.model_copy(update={"pose": (*machine, place.pose[2])}) if s.name == station else s for s in task.stations
    )
    made = tuple(Obstacle(name=f"stack {n}", position_m=at) for n, at in enumerate(stacks, start=1))
    layout = Layout(tuple(stacks), ())
    return PicturedTask(task.model_copy(update={"stations": stations, "obstacles": made}), layout, gripper)


def _markers(placed: PicturedTask, station: str, grid: CameraGrid) -> list[tuple[str, tuple[float, float, float]]]:
    """Each marker's kind and the centre of its upper side (x, y, z) [m]."""
    upper = models.MARKER_THICK / 2
    x, y, z = marker_of(placed.task.station(station), grid)
    gx, gy = placed.gripper
    markers = [
        ("gripper", (gx + models.MARKER_OUT, gy, grid.height_m + models.MARKER_UP + upper)),
        ("toaster", (float(x), float(y), float(z) + upper)),
    ]
    stands = zip(placed.task.obstacles, placed.layout.obstacles, strict=True)
    return markers + [("obstacle", (*at, obstacle.size[2] + MARKER_ABOVE + upper)) for obstacle, at in stands]


def _in_sight(world: World, camera: Camera, lens: Lens, at: tuple[float, float, float]) -> bool:
    """Whether a marker lies wholly in the picture and nothing hides it from the camera."""
    r = models.MARKER_RADIUS
    points = [(at[0] + dx, at[1] + dy, at[2] + 0.002) for dx, dy in ((0, 0), (r, 0), (-r, 0), (0, r), (0, -r))]
    x, y, radius = _disc(camera, lens, at)
    inside = radius + 2 < min(x, y) and max(x, y) < min(lens.size) - radius - 2
    return inside and all(world.ray(camera.eye, point) is None for point in points)


def _apart(discs: list[tuple[float, float, float]]) -> bool:
    """Whether the markers are so far apart that a cover over one leaves the others alone."""
    return all(hypot(x - u, y - v) > COVER_REACH * max(r, s) for (x, y, r), (u, v, s) in combinations(discs, 2))


def _disc(camera: Camera, lens: Lens, at: tuple[float, float, float]) -> tuple[float, float, float]:
    """A marker's centre x, y and radius in the picture [pixels]."""
    rim = np.array([at, (at[0] + models.MARKER_RADIUS, *at[1:])])
    (x, y), (u, v) = lens.projected(rim, *camera.turn_and_shift())
    return float(x), float(y), float(np.hypot(u - x, v - y))
