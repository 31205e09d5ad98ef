"""A replay read back from its page: bodies as triangles, their poses at any time, and the captions."""

import base64
import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput
from lab.files import json_of, read_limited
from lab.sim.frames import Shape, Viewpoint
from lab.view.rasterizer import Floats, Mesh
from lab.view.scene_data import corners_of

MOST_NUMBERS = 20_000_000  # in all arrays of a replay; one of three toasts has half a million
LARGEST = 1e9  # [m] or [s]: larger numbers cannot be drawn
_DATA = re.compile(r'<script id="lab-data" type="application/json">(.*?)</script>', re.DOTALL)
_TITLE = re.compile(r"<title>(.*?)</title>", re.DOTALL)


@dataclass(frozen=True, eq=False)
class Moments:
    """The bodies at some times.

    places (times, bodies, 3) [m], turns: rotation matrices (times, bodies, 3, 3), shown (times, bodies), rgba (times,
    bodies, 4), NaN where a body has the colours of its shapes.
    """

    places: Floats
    turns: Floats
    shown: NDArray[np.bool_]
    rgba: Floats


@dataclass(frozen=True, eq=False)
class Replay:
    """The content of a page of `replay_html`. Times count from the first picture [s].

    captions: start and text of each; begins_s: the start of each move.
    """

    title: str
    camera: Viewpoint
    bodies: tuple[tuple[Mesh, ...], ...]
    duration_s: float
    captions: tuple[tuple[float, str], ...]
    begins_s: tuple[float, ...]
    _motions: tuple[dict[str, Any], ...]

    def at(self, times_s: ArrayLike) -> Moments:
        """The poses, visibility and colours of all bodies at each of these times [s]."""
        transform = scipy.spatial.transform
        times, bodies = np.asarray(times_s, dtype=np.float64), len(self.bodies)
        places, quaternions = np.empty((len(times), bodies, 3)), np.empty((len(times), bodies, 4))
        shown, rgba = np.ones((len(times), bodies), dtype=bool), np.full((len(times), bodies, 4), np.nan)
        for number, motion in enumerate(self._motions):
            places[:, number], quaternions[:, number] = motion["start"][:3], motion["start"][3:]
            if motion["position"] is not None:
                keys, values = motion["position"]
                for axis in range(3):
                    places[:, number, axis] = np.interp(times, keys, values[:, axis])
            if motion["quaternion"] is not None:
                keys, values = motion["quaternion"]
                turned = transform.Slerp(keys, transform.Rotation.from_quat(values))(np.clip(times, keys[0], keys[-1]))
                quaternions[:, number] = turned.as_quat()
            for kind, steps in ((shown, motion["visible"]), (rgba, motion["colors"])):
                for since, value in steps:
                    kind[times >= since, number] = value
        turns = transform.Rotation.from_quat(quaternions.reshape(-1, 4)).as_matrix().reshape(len(times), bodies, 3, 3)
        return Moments(places, turns, shown, rgba)


def read_replay(path: Path) -> Replay:
    """The replay in a page that `replay_html` wrote. Raises BadInput for a file that cannot be read or is no replay."""
    try:
        text = read_limited(path).decode()
    except (OSError, UnicodeDecodeError) as reason:
        raise BadInput(f"replay '{path}' cannot be read: {getattr(reason, 'strerror', None) or reason}") from None
    try:
        match = _DATA.search(text)
        if match is None:
            raise ValueError("it holds no replay")
        data, title = json_of(match[1]), _TITLE.search(text)
        return _Reading().replay(data, "" if title is None else unescape(title[1]))
    except (ValueError, KeyError, TypeError, AttributeError, ArithmeticError, BadInput) as reason:
        why = f"no {reason}" if isinstance(reason, KeyError) else str(reason)
        raise BadInput(f"'{path}' is no replay that the lab wrote: {why[:120]}") from None


class _Reading:
    """A reader of one replay, which counts the numbers to limit the memory that a file can demand."""

    def __init__(self) -> None:
        self._numbers = 0

    def replay(self, data: Any, title: str) -> Replay:
        """The page's data as records."""
        scene, story = data["scene"], data["story"] or {"captions": [], "begins_s": []}
        geometries = [self._geometry(spec) for spec in scene["geometries"]]
        camera = Viewpoint(self._row(scene["camera"]["eye"], 3), self._row(scene["camera"]["target"], 3))
        bodies = tuple(tuple(self._meshes(body["shapes"], geometries)) for body in scene["bodies"])
        if not any(bodies):
            raise ValueError("nothing is to be seen in it")
        motions = tuple(self._motion(body["motion"]) for body in scene["bodies"])
        captions = tuple((float(at_s), str(words)) for at_s, words in story["captions"])
        begins_s = tuple(float(at_s) for at_s in story["begins_s"])
        (duration_s,) = self._row([data["duration_s"]], 1)
        if duration_s < 0.0:
            raise ValueError(f"it lasts {duration_s} s")
        return Replay(title, camera, bodies, duration_s, captions, begins_s, motions)

    def _geometry(self, spec: Any) -> tuple[Floats, Floats, NDArray[np.int64]] | None:
        """The positions, normals and faces of a geometry; None for a label, which is not drawn."""
        if spec["kind"] == "label":
            return None
        if spec["kind"] != "mesh":
            return corners_of(Shape(spec["kind"], self._row(spec["size"], len(spec["size"]))))
        positions = self._array(spec["positions"], 3)
        faces = self._array(spec["faces"], 3, "<u4").astype(np.int64)
        normals = self._array(spec["normals"], 3)
        if normals.shape != positions.shape or not len(faces) or faces.max() >= len(positions):
            raise ValueError("a mesh whose corners are not there")
        return positions, normals, faces

    def _meshes(self, shapes: Any, geometries: Sequence[Any]) -> list[Mesh]:
        meshes = []
        for shape in shapes:
            number = int(shape["geometry"])
            if not 0 <= number < len(geometries):
                raise ValueError(f"geometry {number}")
            if geometries[number] is None:
                continue
            positions, normals, faces = geometries[number]
            pose, scale = self._row(shape["pose"], 7), np.array(self._row(shape["scale"], 3))
            if scale.min() <= 0.0:
                raise ValueError(f"a scale of {scale.min()}")
            turn = scipy.spatial.transform.Rotation.from_quat(pose[3:]).as_matrix()
            placed = (positions * scale) @ turn.T + np.array(pose[:3])
            meshes.append(Mesh(placed, (normals / scale) @ turn.T, faces, self._row(shape["rgba"], 4)))
        return meshes

    def _motion(self, motion: Any) -> dict[str, Any]:
        start, turns = self._row(motion["start"], 7), self._track(motion["quaternion"], 4)
        rotation = scipy.spatial.transform.Rotation
        rotation.from_quat(start[3:])  # ValueError for one of length 0
        if turns is not None:
            rotation.from_quat(turns[1])
        return {
            "start": start,
            "position": self._track(motion["position"], 3),
            "quaternion": turns,
            "visible": [(float(at_s), bool(value)) for at_s, value in motion["visible"]],
            "colors": [(float(at_s), self._row(value, 4)) for at_s, value in motion["colors"]],
        }

    def _track(self, track: Any, width: int) -> tuple[Floats, Floats] | None:
        if track is None:
            return None
        times, values = self._array(track["times"], 1)[:, 0], self._array(track["values"], width)
        if len(times) < 2 or len(times) != len(values) or (np.diff(times) <= 0).any():
            raise ValueError("a motion whose times do not rise")
        return times, values

    def _array(self, text: Any, width: int, kind: str = "<f4") -> NDArray[Any]:
        values = np.frombuffer(base64.b64decode(text, validate=True), dtype=kind)
        self._numbers += len(values)
        if len(values) % width or self._numbers > MOST_NUMBERS or not (abs(values) < LARGEST).all():
            raise ValueError("numbers that are too many, too large or not in rows")
        return values.reshape(-1, width).astype(np.float64 if kind == "<f4" else kind)

    def _row(self, values: Any, width: int) -> Any:
        row = tuple(float(value) for value in values)
        if len(row) != width or not all(abs(value) < LARGEST for value in row):
            raise ValueError(f"{len(row)} numbers where {width} below {LARGEST:g} are wanted")
        return row
