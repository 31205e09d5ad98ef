"""Pictures as a real overhead camera would take them, with known truth beside them; and how many are read back exactly."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np

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

MOST_PICTURES = 100_000
MATS = 6  # pictures of the mat: one where it lies, the others tilted
MAT_TILT = 0.5  # [rad] about each axis, at the most
WITHIN_M = 0.018  # of its cell's middle is what is put there: a millimetre from a border, nobody can tell the cell
CUBES = (1, 6)  # stacks, at least and at most
APART_M = 0.10  # between the middles of stacks, and of the gripper
MACHINE_APART_M = 0.17  # from the machine's middle
OFF_M, OFF_RAD = 0.008, 0.02  # standard deviation of where the camera really hangs, and how it is turned
COVER_REACH = 4.8  # times a marker's radius in the picture, from its middle, are free of other markers
DRAWS = 400
INDEX = "pictures.json"


@dataclass(frozen=True)
class Placed:
    """What a picture shows: the task with its machine and stacks where they were put, and where the gripper is [m]."""

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
    """Make `count` pictures of a task's grid and some of the mat in a new folder; the record that is kept in its index.

    One camera takes them all: its lens and place are drawn from the seed. BadInput for a folder that is there already.
    """
    if not 1 <= count <= MOST_PICTURES:
        raise BadInput(f"{count} pictures (--make): allowed are 1 to {MOST_PICTURES}")
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
    """A picture (H, W, 3) of machine, stacks and gripper somewhere in the grid, and what it shows; a marker that something
    stands before is drawn anew, for nothing of it is seen.
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


# ---- the camera and its mat ----------------------------------------------------------------------------------------


def grid_station(task: Task) -> str:
    for station in task.stations:
        if station.grid is not None:
            return station.name
    raise BadInput(f"task '{task.name}' (--task): no station of it is approached through the camera's grid")


def _hung(task: Task, rng: np.random.Generator) -> Camera:
    """The task's overhead camera as somebody hung it up: not quite there, and not quite straight down."""
    assert task.camera is not None
    x, y, z = task.camera.position_m
    off, tilt, turn = rng.normal(0, OFF_M, 3), rng.normal(0, OFF_RAD / 2, 2) * z, float(rng.normal(0, OFF_RAD))
    eye = (float(x + off[0]), float(y + off[1]), float(z + off[2]))
    target = (float(eye[0] + tilt[0]), float(eye[1] + tilt[1]), 0.0)
    up = (float(-np.sin(turn)), float(np.cos(turn)), 0.0)
    pixels = task.camera.pixels
    return Camera(eye, target, up, task.camera.field_of_view_rad, pixels, pixels)


def mat_of(task: Task) -> Mat:
    """The mat that fills most of the task's overhead picture, its middle beneath the camera."""
    assert task.camera is not None
    x, y, z = task.camera.position_m
    side = 2 * z * float(np.tan(task.camera.field_of_view_rad / 2)) * 0.85
    whole = Mat()
    scale = side / whole.size_m[0]
    return Mat((x, y), marker_m=round(whole.marker_m * scale, 3), gap_m=round(whole.gap_m * scale, 3))


def _mat_picture(mat: Mat, camera: Camera, lens: Lens, number: int, rng: np.random.Generator) -> Image:
    """The mat on the table (number 0), or held up tilted, as the camera sees it."""
    from scipy.spatial.transform import Rotation

    turn, shift = camera.turn_and_shift()
    if number:
        tilt = Rotation.from_rotvec(rng.uniform(-MAT_TILT, MAT_TILT, 3)).as_matrix()
        middle = np.array([*mat.middle_m, 0.0])
        turn, shift = turn @ tilt, shift + turn @ (middle - tilt @ middle)
    return mat.photographed(lens, turn, shift)


# ---- one scene -----------------------------------------------------------------------------------------------------


def _drawn(task: Task, station: str, rng: np.random.Generator) -> Placed:
    """The machine, stacks of cubes and the gripper, each near the middle of a cell of its own, and apart."""
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
    return Placed(task.model_copy(update={"stations": stations, "obstacles": made}), layout, gripper)


def _markers(placed: Placed, station: str, grid: CameraGrid) -> list[tuple[str, tuple[float, float, float]]]:
    """Kind and middle of the upper side of each marker [m]."""
    upper = models.MARKER_THICK / 2
    x, y, z = marker_of(placed.task.station(station), grid)
    gx, gy = placed.gripper
    found = [
        ("gripper", (gx + models.MARKER_OUT, gy, grid.height_m + models.MARKER_UP + upper)),
        ("toaster", (float(x), float(y), float(z) + upper)),
    ]
    stands = zip(placed.task.obstacles, placed.layout.obstacles, strict=True)
    return found + [("obstacle", (*at, one.size[2] + MARKER_ABOVE + upper)) for one, at in stands]


def _in_sight(world: World, camera: Camera, lens: Lens, at: tuple[float, float, float]) -> bool:
    """Whether nothing stands between the camera and a marker, and it lies wholly in the picture."""
    r = models.MARKER_RADIUS
    points = [(at[0] + dx, at[1] + dy, at[2] + 0.002) for dx, dy in ((0, 0), (r, 0), (-r, 0), (0, r), (0, -r))]
    x, y, radius = _disc(camera, lens, at)
    inside = radius + 2 < min(x, y) and max(x, y) < min(lens.size) - radius - 2
    return inside and all(world.ray(camera.eye, point) is None for point in points)


def _apart(discs: list[tuple[float, float, float]]) -> bool:
    """Whether what covers a part of one marker leaves the others alone."""
    return all(hypot(x - u, y - v) > COVER_REACH * max(r, s) for (x, y, r), (u, v, s) in combinations(discs, 2))


def _disc(camera: Camera, lens: Lens, at: tuple[float, float, float]) -> tuple[float, float, float]:
    """Where the lens shows a marker, and how large [pixels]."""
    rim = np.array([at, (at[0] + models.MARKER_RADIUS, *at[1:])])
    (x, y), (u, v) = lens.projected(rim, *camera.turn_and_shift())
    return float(x), float(y), float(np.hypot(u - x, v - y))
