"""Plain records for viewers: bodies made of shapes, and the poses of the bodies over time.

Knows no simulator and no viewer: the simulator fills these, `lab/view/meshcat.py` shows them. Metres, seconds,
quaternions xyzw.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from lab.errors import BadInput, unknown

ShapeKind = Literal["box", "cylinder", "sphere", "mesh", "label"]
Rgba = tuple[float, float, float, float]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Pose = tuple[float, float, float, float, float, float, float]

IDENTITY: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
SIZES: dict[str, int] = {"box": 3, "cylinder": 2, "sphere": 1, "mesh": 3, "label": 1}


@dataclass(frozen=True)
class Shape:
    """One visible piece of a body, placed in the body's frame.

    `size` [m]: box (x, y, z) full edges; cylinder (radius, length) along z; sphere (radius,); mesh: scale (x, y, z),
    unitless, () for 1; label (height,). `mesh`: an OBJ or STL file, for kind "mesh" only. `text`: what a label says, which
    always faces who looks. `rgba` within 0..1. Raises BadInput for anything else.
    """

    kind: ShapeKind
    size: tuple[float, ...] = ()
    mesh: Path | None = None
    rgba: Rgba = (0.7, 0.7, 0.7, 1.0)
    position: Vector = (0.0, 0.0, 0.0)
    quaternion: Quaternion = (0.0, 0.0, 0.0, 1.0)
    text: str = ""

    def __post_init__(self) -> None:
        if self.kind not in SIZES:
            raise unknown("shape kind", self.kind, SIZES, "Shape")
        if self.kind == "mesh" and self.mesh is None:
            raise BadInput("Shape of kind 'mesh' without a file: `mesh` must be a path")
        if (self.kind == "label") != bool(self.text):
            raise BadInput(
                f"Shape of kind '{self.kind}' with the text '{self.text}': a label has one, and nothing else"
            )
        expected = SIZES[self.kind]
        if len(self.size) != expected and not (self.kind == "mesh" and not self.size):
            raise BadInput(f"Shape size {self.size}: a {self.kind} takes {expected} numbers")
        if not all(math.isfinite(edge) and edge > 0 for edge in self.size):
            raise BadInput(f"Shape size {self.size}: every number must be finite and above 0")
        if len(self.rgba) != 4 or not all(0 <= part <= 1 for part in self.rgba):
            raise BadInput(f"Shape rgba {self.rgba}: four numbers within 0..1")
        _check_pose((*self.position, *self.quaternion), "Shape")


@dataclass(frozen=True)
class Body:
    """A rigid body by its unique name (one step of a path: not empty, no "/"), made of shapes that move together."""

    name: str
    shapes: tuple[Shape, ...]

    def __post_init__(self) -> None:
        if not self.name or "/" in self.name:
            raise BadInput(f"Body name '{self.name}': must not be empty nor hold a '/'")


@dataclass(frozen=True)
class Frame:
    """Where bodies are at `time_s`: name -> (x, y, z, qx, qy, qz, qw) of the body's frame in the world [m].

    A body left out stays where it was. `colors` (name -> rgba of all its shapes) and `visible` (name -> shown) work the
    same way: only what changes has to be named; a body starts in its shapes' colours, and visible.
    Raises BadInput when a pose is not finite or its quaternion is not of length 1 (within 1e-3).
    """

    time_s: float
    poses: Mapping[str, Pose]
    colors: Mapping[str, Rgba] = field(default_factory=dict)
    visible: Mapping[str, bool] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not math.isfinite(self.time_s):
            raise BadInput(f"Frame time_s {self.time_s}: must be finite")
        for name, pose in self.poses.items():
            _check_pose(pose, f"Frame at {self.time_s} s, body '{name}'")


@dataclass(frozen=True)
class Viewpoint:
    """Where the page looks from and to, in the world [m], z up."""

    eye: Vector = (2.65, -1.8, 1.65)
    target: Vector = (0.35, 0.0, 0.3)


@dataclass
class Recording:
    """Bodies and the frames of a run, in order of time; `frames` may grow while a run goes on."""

    bodies: tuple[Body, ...]
    frames: list[Frame] = field(default_factory=list)
    camera: Viewpoint = field(default_factory=Viewpoint)

    @property
    def duration_s(self) -> float:
        """Simulated seconds from the first frame to the last [s], 0 without frames."""
        return self.frames[-1].time_s - self.frames[0].time_s if self.frames else 0.0

    def check(self) -> None:
        """Raise BadInput unless names are unique, times never run back and frames name only known bodies."""
        names = unique_names(self.bodies)
        for before, after in zip(self.frames, self.frames[1:], strict=False):
            if after.time_s < before.time_s:
                raise BadInput(
                    f"Recording: frame at {after.time_s} s follows one at {before.time_s} s: times must not run back"
                )
        for frame in self.frames:
            for name in (*frame.poses, *frame.colors, *frame.visible):
                if name not in names:
                    raise unknown("body", name, names, f"frame at {frame.time_s} s")


def unique_names(bodies: Sequence[Body]) -> set[str]:
    """The names of the bodies; raises BadInput naming the first one used twice."""
    names: set[str] = set()
    for body in bodies:
        if body.name in names:
            raise BadInput(f"Body name '{body.name}' is used twice: names must be unique")
        names.add(body.name)
    return names


def _check_pose(pose: Sequence[float], where: str) -> None:
    if len(pose) != 7 or not math.isfinite(sum(pose)):
        raise BadInput(f"{where}: pose {tuple(pose)}: must be 7 finite numbers x y z qx qy qz qw")
    length = math.hypot(*pose[3:])
    if abs(length - 1) > 1e-3:
        raise BadInput(f"{where}: quaternion {tuple(pose[3:])} has length {length:.4g}: must be 1")
