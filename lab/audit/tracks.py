"""The tracks of a run's bodies: frames as arrays, in the run's folder as `frames.npz`, which numpy alone can read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
import scipy
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.files import read_limited
from lab.lazy import trimesh
from lab.sim.frames import Body, Recording, Shape
from lab.sim.mesh_file import readable

FILE = "frames.npz"
MAX_BYTES = 1_000_000_000  # of the unpacked arrays; a day of a cell with a hundred bodies takes half of that
Array = NDArray[np.float64]
Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class BodyTracks:
    """The pose of every body at every frame of a run.

    names: one per body. times_s (n,) [s], increasing. poses (n, bodies, 7): x, y, z [m] and a quaternion xyzw of its frame.
    low, high (bodies, 3): the corners of each body's bounds in its own frame [m].
    """

    names: tuple[str, ...]
    times_s: Array
    poses: Array
    low: Array
    high: Array

    def number(self, name: str) -> int:
        """The number of the body with this name; -1 when there is none."""
        return self.names.index(name) if name in self.names else -1

    def up(self, body: int) -> Array:
        """The cosine (n,) of a body's tilt at each frame; 1 when it is upright."""
        x, y = self.poses[:, body, 3], self.poses[:, body, 4]
        return np.asarray(1.0 - 2.0 * (x * x + y * y))

    @property
    def robot(self) -> list[int]:
        """The numbers of the robot's links, its base first."""
        return [n for n, name in enumerate(self.names) if name == "robot" or name.startswith("robot ")]

    @property
    def fingers(self) -> list[int]:
        """The numbers of the robot's fingers."""
        return [n for n in self.robot if "finger" in self.names[n]]

    def middle(self, body: int) -> Array:
        """The middle (n, 3) [m] of a body's bounds at each frame."""
        middle = (self.low[body] + self.high[body]) / 2
        turns = scipy.spatial.transform.Rotation.from_quat(self.poses[:, body, 3:])
        return np.asarray(self.poses[:, body, :3] + turns.apply(middle))

    def inside(self, body: int, point: Array) -> Array:
        """Points (n, 3) [m], one per recorded frame, in the coordinate frame of a body that may be turned about the vertical."""
        off = point - self.poses[:, body, :3]
        yaw = 2.0 * np.arctan2(self.poses[:, body, 5], self.poses[:, body, 6])
        c, s = np.cos(yaw), np.sin(yaw)
        return np.stack([c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0], off[:, 2]], axis=1)


def on_grid(low: Array, high: Array) -> Array:
    """The corners of a box, and the points halfway between them (27, 3) [m]."""
    shares = np.array(list(product((0.0, 0.5, 1.0), repeat=3)))
    return np.asarray(low + shares * (high - low))


def in_frame(poses: Array, others: Array, points: Array) -> Array:
    """Points (m, 3) [m] of a body in the frame of another one (m, n, 3), by the poses (n, 7) of both."""
    rotation = scipy.spatial.transform.Rotation
    to_other = rotation.from_quat(others[:, 3:]).inv()
    turn = (to_other * rotation.from_quat(poses[:, 3:])).as_matrix()
    turned = (points @ turn.transpose(0, 2, 1)).transpose(1, 0, 2)
    return np.asarray(turned + to_other.apply(poses[:, :3] - others[:, :3]))


def tracks_of(recording: Recording) -> BodyTracks:
    """The tracks of all bodies that a recording shows. Raises BadInput for a mesh that cannot be read."""
    bodies = [body for body in recording.bodies if any(shape.kind != "label" for shape in body.shapes)]
    names = tuple(body.name for body in bodies)
    poses = np.full((len(recording.frames), len(names), 7), np.nan)
    place = {name: number for number, name in enumerate(names)}
    for now, frame in enumerate(recording.frames):
        if now:
            poses[now] = poses[now - 1]
        for name, pose in frame.poses.items():
            if name in place:
                poses[now, place[name]] = pose
    there = [
        number for number in range(len(names)) if not np.isnan(poses[:, number]).any()
    ]  # without finishes that appeared later
    corners = [_bounds(bodies[number]) for number in there]
    return BodyTracks(
        tuple(names[number] for number in there),
        np.array([frame.time_s for frame in recording.frames]),
        poses[:, there],
        np.array([low for low, _ in corners]),
        np.array([high for _, high in corners]),
    )


def _bounds(body: Body) -> tuple[Array, Array]:
    """The lower and the upper corner of a body in its own frame [m]."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for shape in body.shapes:
        corners = _corners(shape)
        placed = scipy.spatial.transform.Rotation.from_quat(shape.quaternion).apply(corners) + np.array(shape.position)
        low, high = np.minimum(low, placed.min(axis=0)), np.maximum(high, placed.max(axis=0))
    return low, high


def _corners(shape: Shape) -> Array:
    """Points (n, 3) [m] with the same bounds as a shape."""
    if shape.kind == "mesh":
        path = Path(shape.mesh or "")
        load: Any = trimesh.load
        mesh = load(BytesIO(readable(path)), path.suffix.lower().removeprefix("."), force="mesh")
        return np.asarray(mesh.bounds) * (shape.size or (1.0, 1.0, 1.0))
    if shape.kind == "label":
        return np.zeros((1, 3))
    edges = shape.size
    if shape.kind == "cylinder":
        edges = (2 * shape.size[0], 2 * shape.size[0], shape.size[1])
    elif shape.kind == "sphere":
        edges = (2 * shape.size[0],) * 3
    x, y, z = (edge / 2 for edge in edges)
    return np.array([(i, j, k) for i in (-x, x) for j in (-y, y) for k in (-z, z)])


def packed(tracks: BodyTracks) -> bytes:
    """The content of a `frames.npz`: the arrays `names`, `times_s`, `poses`, `low` and `high` of `BodyTracks`."""
    data = BytesIO()
    arrays: Mapping[str, Any] = {
        "names": np.array(tracks.names),
        "times_s": tracks.times_s,
        "poses": tracks.poses.astype(np.float32),
        "low": tracks.low,
        "high": tracks.high,
    }
    np.savez_compressed(data, **arrays)
    return data.getvalue()


def read_tracks(path: Path) -> BodyTracks:
    """The tracks in a file. Raises BadInput when it is missing, damaged, or larger than MAX_BYTES."""
    try:
        data = read_limited(path)
        with ZipFile(BytesIO(data)) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > MAX_BYTES:
            raise ValueError(f"it unpacks to {size} bytes: allowed are {MAX_BYTES}")
        with np.load(BytesIO(data), allow_pickle=False) as arrays:
            names = tuple(str(name) for name in arrays["names"])
            times_s, poses, low, high = (
                np.asarray(arrays[name], dtype=np.float64) for name in ("times_s", "poses", "low", "high")
            )
    except OSError as error:
        raise BadInput(f"'{path}' cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError, BadZipFile, EOFError, MemoryError, NotImplementedError, RuntimeError) as error:
        raise BadInput(f"'{path}' holds no frames of a run: {' '.join(str(error).split())[:120]}") from None
    _check(path, names, (times_s, poses, low, high))
    return BodyTracks(names, times_s, poses, low, high)


def _check(path: Path, names: Sequence[str], arrays: Sequence[Array]) -> None:
    times_s, poses, _, _ = arrays
    bodies = len(names)
    wanted = ((len(times_s),), (len(times_s), bodies, 7), (bodies, 3), (bodies, 3))
    shapes = tuple(array.shape for array in arrays)
    if shapes != wanted or not len(times_s) or len(set(names)) != bodies:
        raise BadInput(f"'{path}' holds no frames of a run: arrays of {shapes} for {bodies} bodies")
    if (np.abs(np.linalg.norm(poses[..., 3:], axis=2) - 1.0) > 1e-2).any():
        raise BadInput(f"'{path}' holds no frames of a run: a quaternion whose length is not 1")
    if not all(np.isfinite(array).all() for array in arrays) or (np.diff(times_s) < 0).any():
        raise BadInput(f"'{path}' holds no frames of a run: numbers that are not finite, or times that run back")
