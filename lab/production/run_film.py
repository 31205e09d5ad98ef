"""A kept run seen again: its overhead camera's pictures, drawn from its frames, and when a person moved its arm."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.audit.tracks import FILE, read_tracks
from lab.errors import BadInput
from lab.production.operation.commands import COMMANDS
from lab.production.run_journal import Commanded, Met, Moved, Stopped, read_run
from lab.production.run_options import kept_task
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.world import TIME_STEP, World
from lab.skills.camera_grids import overhead_camera
from lab.vision import Image

STILL = 1e-5  # [m], and of a quaternion: a body that moved less is drawn where it was
LEARNED = ("grasp", "execute")  # commands that a learned skill carries out, not the operator's hand

Array = NDArray[np.float64]


def by_hand_s(folder: Path) -> tuple[tuple[float, float], ...]:
    """From when until when [s] a person moved the arm by hand (jog, rotate, move, open, close, home, lead) in a kept run.

    Such a command lasts until the next line of the journal, because the scene stands still between two commands.
    """
    _, entries, _ = read_run(folder, "RUN")
    timed = [entry for entry in entries if isinstance(entry, Commanded | Stopped | Moved | Met)]
    ends = [later.step for later in timed[1:]] + [2**53]
    spans = []
    for entry, end in zip(timed, ends, strict=True):
        if isinstance(entry, Commanded) and not entry.refused:
            word = entry.words.partition(" ")[0]
            if word in COMMANDS and COMMANDS[word].how == "by hand" and word not in LEARNED and end > entry.step:
                spans.append((entry.step * TIME_STEP, end * TIME_STEP))
    return tuple(spans)


class RunFilm:
    """The pictures of a kept run's overhead camera; use it as a context manager.

    All bodies, the arm's links among them, are drawn where the run's frames have them, ten a second; between two frames they
    move evenly. The finish that machines leave on parts is not drawn.
    """

    def __init__(self, folder: Path, pixels: int) -> None:
        """pixels: the pictures' width. Raises BadInput for a task without a camera, or a run without frames."""
        options, task = kept_task(folder, "RUN")
        if task.camera is None:
            raise BadInput(f"--pictures {pixels}: task '{task.name}' has no [camera]: wanted --pictures 0")
        self._camera = overhead_camera(task, pixels)
        tracks = read_tracks(folder / FILE)
        order = task.ordered(options.toasts, options.parts)
        layout = Layout(tuple(obstacle.position_m for obstacle in task.obstacles), ((0.0, 0.0, 0.0),) * len(order))
        with World() as world:
            Scene(world, task, order, layout)
            looks = {body.name: body.shapes for body in world.bodies()}
        shown = [number for number, name in enumerate(tracks.names) if name in looks]
        self._names = [tracks.names[number] for number in shown]
        self._times_s, self._poses = tracks.times_s, tracks.poses[:, shown]
        self._drawn = np.full((len(shown), 7), np.nan)
        self._picture: Image | None = None
        self._world = World()
        for name in self._names:
            self._world.show(name, looks[name])

    def __enter__(self) -> "RunFilm":
        return self

    def __exit__(self, *_: object) -> None:
        self._world.close()

    def pictures(self, times_s: Array) -> "FilmPictures":
        """The pictures at times (n,) [s] since the scene was ready, drawn when they are asked for."""
        return FilmPictures(self, times_s)

    def picture(self, time_s: float) -> Image:
        """The picture (height, width, 3) RGB at a time [s]; its height and width are even, as videos want them."""
        poses = self._poses_at(time_s)
        moved = ~(np.abs(poses - self._drawn).max(axis=1) <= STILL)
        for number in np.flatnonzero(moved).tolist():
            self._world.put(self._names[number], poses[number, :3].tolist(), poses[number, 3:].tolist())
        self._drawn[moved] = poses[moved]
        if self._picture is None or moved.any():
            seen = self._camera.picture(self._world)
            self._picture = seen[: seen.shape[0] // 2 * 2, : seen.shape[1] // 2 * 2].copy()
        return self._picture

    def _poses_at(self, time_s: float) -> Array:
        """The poses (bodies, 7) at a time, between those of the frames before and after it."""
        after = int(np.clip(np.searchsorted(self._times_s, time_s), 1, len(self._times_s) - 1))
        if len(self._times_s) == 1:
            return np.asarray(self._poses[0])
        start_s, end_s = self._times_s[after - 1 : after + 1]
        share = float(np.clip((time_s - start_s) / max(end_s - start_s, 1e-9), 0.0, 1.0))
        one, other = self._poses[after - 1], self._poses[after].copy()
        other[:, 3:] *= np.where((one[:, 3:] * other[:, 3:]).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0)
        poses = one + share * (other - one)
        poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
        return np.asarray(poses)


@dataclass(frozen=True, eq=False)
class FilmPictures:
    """The pictures of a run at times (n,) [s]."""

    film: RunFilm
    times_s: Array

    def __len__(self) -> int:
        return len(self.times_s)

    def __getitem__(self, step: int) -> Image:
        return self.film.picture(float(self.times_s[step]))

    def __iter__(self) -> Iterator[Image]:
        return (self.film.picture(time_s) for time_s in self.times_s.tolist())
