"""Scenes that differ from a task's own by one change: cubes or stations moved, cubes added or taken away, another seed."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin
from zlib import crc32

import numpy as np

from lab.errors import BadInput
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import in_grid
from lab.skills.prepared_scene import Prepared, prepare
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import Obstacle

NEAREST_M, FARTHEST_M = 0.01, 0.10  # the least and the largest distance that a body is moved
TURN_RAD = 0.15  # the largest turn of a moved station; every second one is turned
HIGHEST = 7  # the most cubes of an added stack
SEEN = 3  # the cubes of each stack in the camera's grid, where all stacks must have one height
MAX_DRAWS = 50  # the most draws for a scene that can be surveyed


@dataclass(frozen=True)
class Scene:
    """One changed scene: its kind of change, its number within the kind, and the study's seed."""

    kind: str
    number: int
    seed: int


@dataclass(frozen=True)
class Changed:
    """A changed task, the seed that lays it out, and the change in words."""

    task: Task
    seed: int
    words: str


def with_fixed_obstacles(task: Task, layout: Layout) -> Task:
    """The task with its obstacles fixed where they were laid out."""
    stand = zip(task.obstacles, layout.obstacles, strict=True)
    return task.changed(obstacles=tuple(o.model_copy(update={"position_m": p, "area": (0.0, 0.0)}) for o, p in stand))


def survey_of_scene(scene: Scene, task: Task, layout: Layout, seed: int, order: Order) -> tuple[Prepared, str, int]:
    """The survey of a changed scene, the change in words, and the number of earlier draws that could not be surveyed.

    task, layout, seed: those of the scene that is changed. Raises BadInput if no draw can be surveyed.
    """
    rng = np.random.default_rng([scene.seed, crc32(scene.kind.encode()), scene.number])
    for refused in range(MAX_DRAWS):
        try:
            changed = KINDS[scene.kind](task, layout, seed, rng)
            return prepare(changed.task, order, changed.seed), changed.words, refused
        except (BadInput, ValueError) as error:
            last = error
    raise BadInput(f"{scene.kind}, scene {scene.number}: none of {MAX_DRAWS} draws can be surveyed; the last: {last}")


def _seen(task: Task, place: tuple[float, float]) -> bool:
    """Whether a point (x, y) [m] lies in a grid that the camera looks at."""
    return any(in_grid(station.grid, place) for station in task.stations if station.grid is not None)


def _shift(rng: np.random.Generator) -> tuple[float, float, float]:
    """A random shift in the plane: x, y and its length [m]."""
    far, angle = rng.uniform(NEAREST_M, FARTHEST_M), rng.uniform(0, 2 * pi)
    return far * cos(angle), far * sin(angle), far


def _cubes_moved(task: Task, layout: Layout, seed: int, rng: np.random.Generator) -> Changed:
    obstacles, which = [*with_fixed_obstacles(task, layout).obstacles], int(rng.integers(len(task.obstacles)))
    moved, (dx, dy, far) = obstacles[which], _shift(rng)
    x, y = moved.position_m
    obstacles[which] = moved.model_copy(update={"position_m": (x + dx, y + dy)})
    return Changed(task.changed(obstacles=tuple(obstacles)), seed, f"'{moved.name}' moved {100 * far:.1f} cm")


def _station_moved(task: Task, layout: Layout, seed: int, rng: np.random.Generator) -> Changed:
    stations, which = [*task.stations], int(rng.integers(len(task.stations)))
    moved, (dx, dy, far) = stations[which], _shift(rng)
    turn = rng.uniform(-TURN_RAD, TURN_RAD) if rng.random() < 0.5 else 0.0
    x, y, yaw = moved.pose
    stations[which] = moved.model_copy(update={"pose": (x + dx, y + dy, yaw + turn)})
    words = f"'{moved.name}' moved {100 * far:.1f} cm" + (f", turned {np.degrees(turn):.0f} degrees" if turn else "")
    return Changed(with_fixed_obstacles(task, layout).changed(stations=tuple(stations)), seed, words)


def _cubes_added(task: Task, layout: Layout, seed: int, rng: np.random.Generator) -> Changed:
    xs, ys = zip(*(station.pose[:2] for station in task.stations), strict=True)
    x, y = float(rng.uniform(min(xs), max(xs))), float(rng.uniform(min(ys), max(ys)))
    cubes = SEEN if _seen(task, (x, y)) else int(rng.integers(1, HIGHEST + 1))
    added = Obstacle(name="cubes added", position_m=(x, y), cubes=cubes)
    obstacles = (*with_fixed_obstacles(task, layout).obstacles, added)
    return Changed(task.changed(obstacles=obstacles), seed, f"{cubes} cubes added at ({x:.2f}, {y:.2f}) m")


def _cubes_taken(task: Task, layout: Layout, seed: int, rng: np.random.Generator) -> Changed:
    obstacles, which = [*with_fixed_obstacles(task, layout).obstacles], int(rng.integers(len(task.obstacles)))
    lower = obstacles[which]
    seen = _seen(task, lower.position_m)
    taken = lower.cubes if seen else int(rng.integers(1, lower.cubes + 1))
    left = [lower.model_copy(update={"cubes": lower.cubes - taken})] if taken < lower.cubes else []
    obstacles[which : which + 1] = left
    return Changed(task.changed(obstacles=tuple(obstacles)), seed, f"{taken} cubes of '{lower.name}' taken away")


def _another_seed(task: Task, layout: Layout, seed: int, rng: np.random.Generator) -> Changed:
    other = int(rng.integers(1, 1_000_000))
    return Changed(task, other, f"seed {other}")


KINDS: dict[str, Callable[[Task, Layout, int, np.random.Generator], Changed]] = {
    "cubes moved": _cubes_moved,
    "station moved": _station_moved,
    "cubes added": _cubes_added,
    "cubes taken away": _cubes_taken,
    "another seed": _another_seed,
}
