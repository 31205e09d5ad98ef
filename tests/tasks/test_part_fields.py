"""What a task file may say of a part: each shape has its own fields, and what is wrong is said in words."""

from typing import Any

import pytest
from pydantic import ValidationError

from lab.tasks.part_fields import PartFields
from lab.tasks.toml_text import explain

BOX: dict[str, Any] = {"name": "brick", "shape": "box", "size_m": [0.03, 0.02, 0.05], "mass_kg": 0.1}
CUP: dict[str, Any] = {"name": "cup", "shape": "mesh", "file": "cup.obj", "mass_kg": 0.1}


def fault(fields: dict[str, Any]) -> str:
    with pytest.raises(ValidationError) as refused:
        PartFields.model_validate(fields)
    return explain(refused.value)


def test_a_part_of_each_shape() -> None:
    brick = PartFields.model_validate(BOX)
    assert (brick.size_m, brick.friction, brick.stands, brick.grip) == ((0.03, 0.02, 0.05), 0.8, (0.0, 0.0), None)
    can = PartFields.model_validate({**BOX, "shape": "cylinder", "size_m": [0.03, 0.08], "grip": {"up_m": 0.02}})
    assert can.grip is not None
    assert (can.grip.yaw, can.grip.up_m, can.grip.at_m) == (0.0, 0.02, (0.0, 0.0))
    assert PartFields.model_validate({**CUP, "scale": 0.001, "hull": True}).file == "cup.obj"


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        (
            {**BOX, "shape": "boxx"},
            "shape: unknown shape 'boxx' (of a part): did you mean 'box'? known: box, cylinder, mesh (got 'boxx')",
        ),
        ({**BOX, "size_m": [0.03, 0.02]}, "part 'brick' is a box: it needs size_m = [x, y, z] [m], 3 numbers: not [0.03, 0.02]"),
        (
            {**BOX, "shape": "cylinder"},
            "part 'brick' is a cylinder: it needs size_m = [diameter, height] [m], 2 numbers: not [0.03, 0.02, 0.05]",
        ),
        ({**BOX, "size_m": None}, "part 'brick' is a box: it needs size_m = [x, y, z] [m], 3 numbers: none is given"),
        ({**BOX, "file": "brick.stl"}, "part 'brick' is a box: it has no file (got 'brick.stl'): only a mesh has"),
        ({**BOX, "scale": 0.5}, "part 'brick' is a box: it has no scale (got 0.5): only a mesh has"),
        ({**CUP, "file": None}, "part 'cup' is a mesh: it needs file, an OBJ or STL file: none is given"),
        ({**CUP, "size_m": [0.1]}, "part 'cup' is a mesh: it has no size_m (got [0.1]): its file and scale say how large"),
        ({**CUP, "file": "cup.glb"}, "part 'cup' is a mesh: file = 'cup.glb': wanted a file that ends with .obj or .stl"),
        ({**CUP, "look": "cup.png"}, "part 'cup': look = 'cup.png': wanted a file that ends with .urdf"),
        ({**CUP, "look": "a.urdf", "color": [1.0, 0.0, 0.0]}, "part 'cup' has color and look = 'a.urdf': allowed is one of them"),
    ],
)  # fmt: skip
def test_a_wrong_field_is_named_with_what_is_allowed(fields: dict[str, Any], says: str) -> None:
    assert fault(fields) == says


@pytest.mark.parametrize("name", ["../cup.obj", "/etc/cup.obj", "a/../../cup.obj", ""])
def test_a_file_lies_beside_the_task_file(name: str) -> None:
    assert fault({**CUP, "file": name}).startswith("file: wanted: a file beside the task file")
    assert fault({**CUP, "look": name}).startswith("look: wanted: a file beside the task file")


@pytest.mark.parametrize(
    ("field", "value"), [("mass_kg", 0.0), ("mass_kg", float("nan")), ("friction", -0.1), ("scale", 0.0)]
)
def test_a_number_beyond_its_bounds_is_refused_by_its_name(field: str, value: float) -> None:
    assert fault({**CUP, field: value}).startswith(f"{field}: ")
