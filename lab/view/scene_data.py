"""A scene and a schedule as JSON data for the page: bodies with each geometry once, meshes, activities and captions."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from io import BytesIO
from itertools import product
from math import cos, radians, sin, tan
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput, unknown
from lab.lazy import trimesh
from lab.mdp import FloatArray
from lab.sequencing.cell.schedule import Activity, Schedule
from lab.sim.frames import Body, Shape, Vector, Viewpoint, unique_names
from lab.sim.mesh_file import readable

_HALF_VIEW = radians(19.0)  # half of the page's field of view, from bottom to top
_WIDE = 1.2  # least aspect ratio, width to height, at which the whole scene is visible
_MARGIN = 1.06


def camera_for(points: ArrayLike, azimuth: float, elevation: float, wide: float = _WIDE) -> Viewpoint:
    """The nearest camera in a given direction whose picture contains all `points` (n, 3) [m].

    `azimuth` [rad] from the x axis, counter-clockwise as seen from above; `elevation` [rad] above the horizon. wide: the
    least aspect ratio of the picture, width to height.
    """
    seen = np.asarray(points, dtype=np.float64)
    target = (seen.min(axis=0) + seen.max(axis=0)) / 2
    back = np.array([cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation)])
    right = np.array([-sin(azimuth), cos(azimuth), 0.0])
    off = seen - target
    aside = np.maximum(abs(off @ np.cross(back, right)), abs(off @ right) / wide)
    eye = target + back * float((_MARGIN * aside / tan(_HALF_VIEW) + off @ back).max())
    return Viewpoint(vector(eye), vector(target))


def corners(low: ArrayLike, high: ArrayLike) -> FloatArray:
    """The eight corners (8, 3) of a box [m]."""
    return np.array(list(product(*np.stack([np.asarray(low), np.asarray(high)], axis=1))), dtype=np.float64)


def vector(values: FloatArray) -> Vector:
    """The three values as a tuple of plain floats."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)


# ---- the scene for the viewer -----------------------------------------------------------------------------------------


MarkKind = Literal["fault", "trouble", "stop", "lost", "operator"]
MARKS: tuple[MarkKind, ...] = get_args(MarkKind)


@dataclass(frozen=True)
class Mark:
    """An event on the timeline: its time [s] and its text. Raises BadInput for a kind that is not in MARKS."""

    at_s: float
    kind: MarkKind
    words: str

    def __post_init__(self) -> None:
        if self.kind not in MARKS:
            raise unknown("kind of mark", self.kind, MARKS, "Mark")


@dataclass(frozen=True)
class Story:
    """The schedule and captions of a run, on the same clock [s] as its recording.

    captions: start and text of each. begins_s: the start of each move. looks: name and colour of each part, by number;
    without it, bars have the colours of their kinds of activity.
    """

    measured: Schedule
    planned: Schedule | None = None
    captions: tuple[tuple[float, str], ...] = ()
    marks: tuple[Mark, ...] = ()
    begins_s: tuple[float, ...] = ()
    looks: Mapping[int, tuple[str, str]] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """The page's data: rows of robot and machines, activities as in `Schedule.to_json`, the rest sorted by time."""
        return {
            "measured": self._rows(self.measured),
            "planned": [] if self.planned is None else self._rows(self.planned),
            "captions": sorted(self.captions, key=lambda caption: caption[0]),
            "marks": [asdict(mark) for mark in sorted(self.marks, key=lambda mark: mark.at_s)],
            "begins_s": sorted(self.begins_s),
        }

    def _rows(self, schedule: Schedule) -> list[dict[str, Any]]:
        return [self._row(activity) for activity in (*schedule.robot, *schedule.machines)]

    def _row(self, activity: Activity) -> dict[str, Any]:
        times = {"start_s": round(activity.start_s, 3), "end_s": round(activity.end_s, 3)}
        name, color = self.looks.get(activity.part or 0, ("", ""))
        look = {"color": color} if color and activity.kind in ("carry", "process", "blocked") else {}
        return asdict(activity) | times | ({"name": name} if name else {}) | look


# ---- bodies and meshes ------------------------------------------------------------------------------------------------


CREASE_RAD = 0.6  # faces that meet at a larger angle keep a sharp edge

Json = dict[str, Any]


def describe(bodies: Sequence[Body], camera: Viewpoint) -> Json:
    """The scene of `page.js`: {"camera", "geometries": [...], "bodies": [{"name", "shapes": [...]}]}.

    Shapes refer to their geometry by its index in the list. Raises BadInput for a mesh file that is missing or unreadable,
    and for two bodies with the same name.
    """
    unique_names(bodies)
    geometries: dict[tuple[object, ...], int] = {}
    contents: list[Json] = []
    described = []
    for body in bodies:
        shapes = []
        for shape in body.shapes:
            key = (shape.kind, shape.mesh if shape.kind == "mesh" else shape.size, shape.text)
            if key not in geometries:
                geometries[key] = len(contents)
                contents.append(_geometry(shape))
            shapes.append(_shape(shape, geometries[key]))
        described.append({"name": body.name, "shapes": shapes})
    look = {"eye": list(camera.eye), "target": list(camera.target)}
    return {"camera": look, "geometries": contents, "bodies": described}


def _shape(shape: Shape, geometry: int) -> Json:
    pose = [round(float(value), 6) for value in (*shape.position, *shape.quaternion)]
    scale = list(shape.size) if shape.kind == "mesh" and shape.size else [1, 1, 1]
    return {"geometry": geometry, "rgba": [float(part) for part in shape.rgba], "pose": pose, "scale": scale}


def _geometry(shape: Shape) -> Json:
    if shape.kind == "label":
        return {"kind": "label", "size": list(shape.size), "text": shape.text}
    if shape.kind != "mesh":
        return {"kind": shape.kind, "size": list(shape.size)}
    path = Path(shape.mesh or "")
    try:
        changed = path.stat().st_mtime_ns
    except OSError as reason:
        raise BadInput(f"mesh file '{path}': {reason.strerror or reason}") from None
    return read_mesh(path, changed)


@lru_cache(maxsize=256)
def read_mesh(path: Path, changed_ns: int) -> Json:
    """The triangles of an OBJ or STL file: base64 of "positions" and "normals" (n * 3, float32), "faces" (m * 3, uint32).

    Edges sharper than 34 degrees stay sharp. The file is read again only when it has changed. Raises BadInput when it
    holds no mesh.
    """
    try:
        mesh: Any = trimesh.load(BytesIO(readable(path)), path.suffix.lower().removeprefix("."), force="mesh")
        assert isinstance(mesh, trimesh.Trimesh)
        mesh.merge_vertices(
            merge_tex=True, merge_norm=True
        )  # files split vertices; CREASE_RAD decides which edges are sharp
        mesh = trimesh.Trimesh(
            mesh.vertices, mesh.faces, process=False
        )  # a picture on it would be packed for every piece
        shaded = trimesh.graph.smooth_shade(mesh, angle=CREASE_RAD)
        if not len(shaded.faces) or not np.isfinite(shaded.vertices).all():
            raise ValueError("no triangles in it, or coordinates that are not finite")
    except Exception as reason:  # any error of the reader for a damaged file
        raise BadInput(
            f"mesh file '{path}': {str(reason) or type(reason).__name__}: an OBJ or STL mesh is wanted"
        ) from None
    return {
        "kind": "mesh",
        "positions": pack(shaded.vertices),
        "normals": pack(shaded.vertex_normals),
        "faces": pack(shaded.faces, "<u4"),
    }


def corners_of(shape: Shape) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """The positions (n, 3) [m], normals (n, 3) and faces (m, 3) of a box, a cylinder or a sphere. BadInput for another shape."""
    if shape.kind == "box":
        mesh = trimesh.creation.box(shape.size)
    elif shape.kind == "cylinder":
        mesh = trimesh.creation.cylinder(shape.size[0], shape.size[1], sections=48)
    elif shape.kind == "sphere":
        mesh = trimesh.creation.icosphere(3, shape.size[0])
    else:
        raise unknown("shape kind", shape.kind, ("box", "cylinder", "sphere"), "corners_of")
    shaded = trimesh.graph.smooth_shade(mesh, angle=CREASE_RAD)
    return np.array(shaded.vertices), np.array(shaded.vertex_normals), np.array(shaded.faces)


def pack(array: NDArray[Any], kind: str = "<f4") -> str:
    """The base64 of an array's values in C order, as `kind` (little-endian, as in browsers)."""
    return base64.b64encode(np.ascontiguousarray(array, dtype=kind).tobytes()).decode("ascii")
