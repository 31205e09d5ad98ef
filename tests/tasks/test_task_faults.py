"""Where in a file a fault is, and which key was meant."""

import tomllib
from typing import Any

import pytest

from lab.files import tasks_folder
from lab.tasks.cell_file import CellFile
from lab.tasks.task import Task
from lab.tasks.task_faults import fields_at, loc_of
from lab.tasks.toml_text import Loc

TEXT = (tasks_folder() / "toast.toml").read_text()
SHIPPED: dict[str, Any] = tomllib.loads(TEXT)


@pytest.mark.parametrize(
    ("message", "loc"),
    [
        ("station 'plate' is full", ("stations", 0, "name")),
        ("station 'plate': its pose is odd", ("stations", 0, "pose")),
        ("machine 'toaster': grid.height_m is odd", ("stations", 2, "grid", "height_m")),
        ("stations 'toaster' and 'plate' meet", ("stations", 2, "name")),
        ("unknown station 'toster' (route of part 'slice')", ("parts", 0, "routes")),
        ("unknown look 'slice.urdf' (part 'slice')", ("parts", 0, "look")),
        ("part 'slice' at 'butter_buffer': odd", ("parts", 0, "routes", 0, 2, "buffer")),
        ("part 'slice' is too wide", ("parts", 0, "size_m")),
        ("stage 2 of the route: odd", ("parts", 0, "routes", 0, 1)),
        ("stage 3 of route 1 of 'slice': odd", ("parts", 0, "routes", 0, 2)),
        ("obstacle 'tower left' stands on station 'plate'", ("obstacles", 3, "name")),
        ("workspace.lower_m: too low for station 'plate'", ("workspace", "lower_m")),
        ("unknown station 'home' (robot.start)", ("robot", "start")),
        ("grasp at toaster_buffer: no way", ("stations", 1, "name")),
        ("/a/folder/applier.urdf: no URDF", ("stations", 4, "body")),
        ("unknown sub-task 'cover' (task 'toast': subtasks)", ("subtasks", "cover")),
        ("station 'toasters' is full", ()),
        ("it is dark", ()),
    ],
)
def test_where_what_a_message_is_about_stands(message: str, loc: Loc) -> None:
    assert loc_of(SHIPPED, message) == loc


@pytest.mark.parametrize(
    ("loc", "some", "not_one"),
    [
        ((), "workspace", "pose"),
        (("stations", 3), "floor_m", "mass_kg"),
        (("stations", 3, "grid"), "start_m", "capacity"),
        (("parts", 0, "routes", 0, 1), "buffer", "mass_kg"),
        (("parts", 0, "grip"), "up_m", "mass_kg"),
        (("processes", "butter"), "dwell_s", "capacity"),
        (("subtasks", "grasp", "learner"), "alpha", "omega"),
        (("subtasks", "grasp", "gate"), "omega", "alpha"),
    ],
)
def test_the_fields_of_a_table(loc: Loc, some: str, not_one: str) -> None:
    found = fields_at(Task, loc)
    assert some in found
    assert not_one not in found


def test_the_fields_of_a_cell_file() -> None:
    assert "travel" in fields_at(CellFile, ())
    assert "processing_s" in fields_at(CellFile, ("stations", 0))
