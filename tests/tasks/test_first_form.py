"""Task files of the first form: they mean what they meant, and faults are told of in their own keys."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.files import tasks_folder
from lab.tasks.first_form import own_loc, renewed
from lab.tasks.task_file import load

SHIPPED: dict[str, Any] = tomllib.loads((tasks_folder() / "toast.toml").read_text())
Refused = Callable[[str], str]  # the fixture of conftest.py

TEXT = (Path(__file__).parent / "first_form.toml").read_text()
RAW: dict[str, Any] = tomllib.loads(TEXT)


def test_the_first_form_of_toast_is_the_task_that_ships(tmp_path: Path) -> None:
    path = tmp_path / "toast.toml"
    path.write_text(TEXT)
    assert load(str(path)).model_dump() == load("toast").model_dump()


def test_a_file_of_the_new_form_is_left_as_it_is() -> None:
    assert renewed(SHIPPED) is SHIPPED
    assert own_loc(SHIPPED, ("stations", 2, "grid", "height_m")) == ("stations", 2, "grid", "height_m")


@pytest.mark.parametrize(
    ("loc", "own"),
    [
        (("parts", 0, "mass_kg"), ("slices", "mass_kg")),
        (("parts", 0), ("slices",)),
        (("parts", 0, "routes", 0, 1, "buffer"), ("route", 1, "buffer")),
        (("stations", 2, "grid", "shape", 1), ("insert", "shape", 1)),
        (("stations", 2, "pose"), ("stations", 2, "pose")),
        (("processes", "butter", "speed_m_s"), ("stations", 4, "head_speed_m_s")),
        (("processes", "butter", "dwell_s"), ("stations", 4, "dwell_s")),
        (("processes", "butter", "grid"), ("stations", 4)),
        (("subtasks", "cover", "gate"), ("subtasks", "butter", "gate")),
        (("subtasks", "grasp", "gate"), ("subtasks", "grasp", "gate")),
        ((), ()),
    ],
)
def test_where_a_value_is_in_the_file_itself(loc: tuple[str | int, ...], own: tuple[str | int, ...]) -> None:
    assert own_loc(RAW, loc) == own


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("mass_kg = 0.040", "mass_kg = -1.0", "slices.mass_kg: Input should be greater than or equal to 0.001"),
        (
            "dwell_s = 3.0",
            "dwell_s = -0.1",
            "stations.4.dwell_s of station 'butter_applier': Input should be greater than or equal to 0 (got -0.1)",
        ),
        (
            "dwell_s = 3.0",
            "dwell_s = inf",
            "stations.4.dwell_s of station 'butter_applier': Input should be a finite number (got inf)",
        ),
        ("shape = [12, 12]", "shape = [12, 1000000]", "insert.shape.1: Input should be less than or equal to 100"),
        ('station = "toaster"', "station = 3", "route.1.station: Input should be a valid string (got 3)"),
        (
            'buffer = "toaster_buffer"',
            'bufer = "toaster_buffer"',
            "route.1.bufer: there is no such key, did you mean 'buffer'?",
        ),
        ("friction = 0.8", "friktion = 0.8", "slices.friktion: there is no such key, did you mean 'friction'?"),
        ("alpha = 0.95", "alpha = 1.5", "subtasks.transfer.learner.alpha: Input should be less than or equal to 1"),
        ("processing_s = 60.0", "", "machine 'toaster' needs either processing_s or process, a sub-task to learn"),
    ],
)
def test_a_fault_is_told_of_in_the_keys_of_the_file(old: str, new: str, said: str, refused: Refused) -> None:
    assert old in TEXT
    assert said in refused(TEXT.replace(old, new, 1))


def test_a_route_of_one_place_is_too_short(refused: Refused) -> None:
    first = TEXT.index("[[route]]")
    rest = TEXT[first:].split("[[route]]")
    after = rest[-1][rest[-1].index("\n# ----") :]
    said = refused(TEXT[:first] + "[[route]]" + rest[1] + after)
    assert "route: Value should have at least 2 items" in said


@given(
    st.dictionaries(
        st.sampled_from(["slices", "route", "insert", "stations", "subtasks", "parts"]),
        st.none() | st.lists(st.none(), max_size=2),
    )
)
def test_what_is_no_table_is_left_for_the_check(raw: dict[str, Any]) -> None:
    assert ("parts" in renewed(raw)) == bool(raw.keys() & {"slices", "route", "insert", "parts"})


@pytest.mark.parametrize(("room", "count"), [(50, 3), (2, 2), (1, 1)])
def test_as_many_slices_as_the_plates_hold(room: int, count: int) -> None:
    raw = {
        "slices": {},
        "route": [],
        "stations": [{"kind": "storage", "capacity": 50}, {"kind": "storage", "capacity": room}],
    }
    assert renewed(raw)["parts"][0]["count"] == count
