"""The record of a kind of part in a task file: shape, mass, friction, pose, looks, and grip."""

from pathlib import PurePosixPath
from typing import Annotated, Literal, Self, get_args

from pydantic import BeforeValidator, Field, field_validator, model_validator

from lab.errors import unknown
from lab.tasks.record import Name, Record, as_tuple

ShapeName = Literal["box", "cylinder", "mesh"]
Edge = Annotated[float, Field(ge=0.001, le=10)]  # [m]
Angle = Annotated[float, Field(ge=-7, le=7)]  # [rad], a little more than a full turn
Off = Annotated[float, Field(ge=0, le=10)]
Share = Annotated[float, Field(ge=0, le=1)]

MESH_FILES = (".obj", ".stl")
SIZES = {
    "box": ("[x, y, z]", 3),
    "cylinder": ("[diameter, height]", 2),
}  # the numbers of size_m and their count, by shape


class GripFields(Record):
    """The place at which the gripper takes a part."""

    yaw: Angle = 0.0
    """The tool's yaw relative to the part [rad]; at 0 the fingers close along the part's y axis."""
    up_m: Annotated[float, Field(gt=0, le=10)]
    """The height of the finger tips above the part's foot [m], such as `0.04`."""
    at_m: Annotated[
        tuple[Annotated[float, Field(ge=-1, le=1)], Annotated[float, Field(ge=-1, le=1)]], BeforeValidator(as_tuple)
    ] = (0.0, 0.0)
    """The offset of the tool's axis from the part's middle, along its x and y axes [m], such as `[0.0, 0.01]`."""


class PartFields(Record):
    """A kind of part: its body, and the place of the grip."""

    name: Name
    """The kind's name, such as `"bun"`; parts are called by it and their number: bun 1, bun 2."""
    shape: ShapeName
    """The shape of its body: a box, an upright cylinder, or a mesh from a file."""
    size_m: Annotated[tuple[Edge, ...] | None, BeforeValidator(as_tuple)] = None
    """The edges along x, y and z of a box, or the diameter and height of a cylinder [m], such as `[0.06, 0.03, 0.08]`
    or `[0.03, 0.09]`; a mesh has none.
    """
    file: str | None = None
    """The OBJ or STL file of a mesh, beside the task file, such as `"bracket.stl"`."""
    scale: Annotated[float, Field(gt=0, le=1000)] = 1.0
    """The length of one unit of the mesh file [m], such as `0.001`."""
    hull: bool = False
    """Whether a mesh with holes is taken as its convex hull."""
    stands: Annotated[tuple[Angle, Angle], BeforeValidator(as_tuple)] = (0.0, 0.0)
    """The tilt of the standing shape against its file: roll and pitch [rad], such as `[1.5708, 0.0]`."""
    mass_kg: Annotated[float, Field(ge=0.001, le=6)]
    """The mass of one part [kg], such as `0.05`."""
    friction: Annotated[float, Field(ge=0, le=5)] = 0.8
    """The coefficient of friction of the part against the fingers and its support [-]."""
    color: Annotated[tuple[Share, Share, Share], BeforeValidator(as_tuple)] = (0.62, 0.42, 0.22)
    """The part's colour: red, green and blue [-]."""
    look: str | None = None
    """A URDF that is shown instead of the shape in its colour, such as `"slice.urdf"`."""
    area: Annotated[tuple[Off, Off, Off], BeforeValidator(as_tuple)] = (0.0, 0.0, 0.0)
    """The largest offset of a part from its spot at the start, drawn from the seed in both directions: x, y and turn
    [m, m, rad], such as `[0.004, 0.004, 0.06]`.
    """
    grip: GripFields | None = None
    """The place of the grip, such as `{ up_m = 0.04 }`; left out: computed from the shape."""

    @field_validator("shape", mode="before")
    @classmethod
    def _known_shape(cls, shape: object) -> object:
        if isinstance(shape, str) and shape not in get_args(ShapeName):
            raise ValueError(str(unknown("shape", shape, get_args(ShapeName), "of a part")))
        return shape

    @field_validator("file", "look")
    @classmethod
    def _within_the_folder(cls, name: str | None) -> str | None:
        if name is not None and (not name or PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts):
            raise ValueError("wanted: a file beside the task file, or one of the lab's assets, without '..'")
        return name

    @model_validator(mode="after")
    def _fields_of_the_shape(self) -> Self:
        """Each shape has its own fields, and needs them."""
        what = f"part '{self.name}' is a {self.shape}"
        if self.shape in SIZES:
            words, count = SIZES[self.shape]
            if self.size_m is None or len(self.size_m) != count:
                got = "none is given" if self.size_m is None else f"not {list(self.size_m)}"
                raise ValueError(f"{what}: it needs size_m = {words} [m], {count} numbers: {got}")
            for field in ("file", "scale", "hull"):
                if field in self.model_fields_set:
                    raise ValueError(f"{what}: it has no {field} (got {getattr(self, field)!r}): only a mesh has")
        else:
            if self.file is None:
                raise ValueError(f"{what}: it needs file, an OBJ or STL file: none is given")
            if self.size_m is not None:
                raise ValueError(
                    f"{what}: it has no size_m (got {list(self.size_m)}): its file and scale say how large"
                )
            if not self.file.lower().endswith(MESH_FILES):
                raise ValueError(f"{what}: file = '{self.file}': wanted a file that ends with .obj or .stl")
        if self.look is not None and not self.look.endswith(".urdf"):
            raise ValueError(f"part '{self.name}': look = '{self.look}': wanted a file that ends with .urdf")
        if self.look is not None and "color" in self.model_fields_set:
            raise ValueError(f"part '{self.name}' has color and look = '{self.look}': allowed is one of them")
        return self
