"""The fields of a task file: every slip of the pen is one clear line with the value and what is allowed."""

import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.tasks.task import Task
from lab.tasks.task_fields import MOST_THINGS, Workspace
from lab.tasks.task_file import load
from lab.tasks.toml_text import explain

TEXT = (tasks_folder() / "toast.toml").read_text()
SHIPPED: dict[str, Any] = tomllib.loads(TEXT)
STATIONS = "butter_applier, butter_buffer, finished_plate, plate, toaster, toaster_buffer"
Changed = Callable[[tuple[str | int, ...], Any], dict[str, Any]]  # the fixture of conftest.py
Edited = Callable[[str, str], str]  # the fixture of conftest.py
Refused = Callable[[str], str]  # the fixture of conftest.py

Path_ = tuple[str | int, ...]


def leaves(value: Any, path: Path_ = ()) -> Iterator[tuple[Path_, Any]]:
    """Every plain value of a document and the way to it."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, (*path, key))
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            yield from leaves(inner, (*path, number))
    else:
        yield path, value


NUMBERS = [path for path, value in leaves(SHIPPED) if isinstance(value, int | float)]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "capacity = 50",
            "capacity = 0",
            "stations.0.capacity of station 'plate': Input should be greater than or equal to 1 (got 0)",
        ),
        (
            "capacity = 4",
            "capacity = -2",
            "stations.1.capacity of station 'toaster_buffer': Input should be greater than or equal to 1 (got -2)",
        ),
        (
            "capacity = 4",
            "capacity = 1.5",
            "stations.1.capacity of station 'toaster_buffer': Input should be a valid integer",
        ),
        ("processing_s = 60.0", "processing_s = -1.0", "greater than or equal to 0 (got -1.0)"),
        ("processing_s = 60.0", "processing_s = nan", "stations.2.processing_s of station 'toaster': "),
        ("dwell_s = 3.0", "dwell_s = -0.1", "processes.butter.dwell_s: Input should be greater than or equal to 0"),
        ("dwell_s = 3.0", "dwell_s = inf", "processes.butter.dwell_s: Input should be a finite number (got inf)"),
        (
            'station = "toaster"',
            'station = "toster"',
            "unknown station 'toster' (route of part 'slice'): did you mean 'toaster'?",
        ),
        ('buffer = "toaster_buffer"', 'buffer = "buffer"', "unknown station 'buffer' (route of part 'slice'):"),
        ('start = "toaster_buffer"', 'start = "home"', f"unknown station 'home' (robot.start): known: {STATIONS}"),
        ('name = "butter_buffer"', 'name = "plate"', "station 'plate' stands twice in the file"),
        ('name = "cubes B"', 'name = "cubes A"', "obstacle 'cubes A' stands twice in the file"),
        ('name = "cubes B"', 'name = "plate"', "obstacle 'plate' has the name of something else in the cell"),
        ('name = "cubes B"', 'name = "slice 1"', "obstacle 'slice 1' has the name of something else"),
        ('name = "cubes B"', 'name = "toaster marker"', "obstacle 'toaster marker' has the name of something else"),
        ('name = "cubes B"', 'name = "cubes A marker"', "obstacle 'cubes A marker' has the name of something else"),
        ('name = "plate"', 'name = "slice 1"', "station 'slice 1' has the name of something else in the cell"),
        (
            'name = "cubes B"',
            'name = "butter_applier head"',
            "obstacle 'butter_applier head' has the name of something",
        ),
        ('name = "cubes B"', 'name = ""', "obstacles.1.name: "),
        ('name = "cubes B"', 'name = "a/b"', "(got 'a/b')"),
        ('name = "cubes B"', 'name = "a > b"', "(got 'a > b')"),
        (
            'learner = "dyna-q"',
            'learner = "dyna"',
            "unknown learner 'dyna' (subtasks.transfer.learner): did you",
        ),
        ('gate = "ccrl"', 'gate = "crcl"', "unknown gate 'crcl' (subtasks.transfer.gate): did you mean 'ccrl'?"),
        ('method = "srl-time"', 'method = "slr"', "unknown method 'slr' (sequencing.method): did you mean 'srl'?"),
        (
            'method = "srl-time"',
            'objective = "makespn"',
            "unknown objective 'makespn' (sequencing.objective): did you mean",
        ),
        (
            'method = "srl-time"',
            'objective = "tardy-parts"',
            "objective 'tardy-parts' needs due times, and there are none",
        ),
        (
            'method = "srl-time"',
            'state = "robot"',
            "sequencing.state: Input should be 'parts' or 'stations' (got 'robot')",
        ),
        ("alpha = 0.95", "alpha = 1.5", "subtasks.transfer.learner.alpha: Input should be less than or equal to 1"),
        ("omega = 7", "omega = -1", "subtasks.transfer.gate.omega: Input should be greater than or equal to 0"),
        ("step = -0.1", "collision = 1.0", "rewards.collision: Input should be less than 0 (got 1.0)"),
        (
            "title =",
            "titel =",
            "titel: there is no such key, did you mean 'title'? (got 'Toast making with one robot')",
        ),
        ("speed_m_s = 0.5", "sped_m_s = 0.5", "robot.sped_m_s: there is no such key, did you mean 'speed_m_s'?"),
        ("beta = 1.3", "bta = 1.3", "subtasks.transfer.learner.bta: there is no such key, did you mean 'beta'?"),
        (
            'kind = "buffer"',
            'kind = "bufer"',
            "stations.1.kind of station 'toaster_buffer': Input should be 'storage', 'buffer' or 'machine'",
        ),
        ("processing_s = 60.0", "", "machine 'toaster' needs either processing_s or process, a sub-task to learn"),
        (
            'process = "butter"',
            'processing_s = 3.0\nprocess = "butter"',
            "machine 'butter_applier' needs either processing_s or",
        ),
        ("shape = [14, 18, 3]", "shape = [14, 18, 0]", "workspace.shape.2: Input should be greater than or equal to 1"),
        (
            "area = [0.04, 0.03]",
            "area = [0, 0, 0]",
            "obstacles.0.area of obstacle 'cubes A': wanted a list of 2 (got [0, 0, 0])",
        ),
        ("area = [0.020, 0.006, 0.12]", "area = [0]", "parts.0.area of part 'slice': wanted a list of 3 (got [0])"),
        ("shape = [14, 18, 3]", "shape = [14, 18]", "workspace.shape: wanted a list of 3 (got [14, 18])"),
        (
            "shape = [12, 12]",
            "shape = [12, 1000000]",
            "stations.2.grid.shape.1 of station 'toaster': Input should be less than or equal to 100",
        ),
        (
            "speed_m_s = 0.5",
            "speed_m_s = 0.0",
            "robot.speed_m_s: Input should be greater than or equal to 0.01 (got 0.0)",
        ),
        ("pixels = 640", "pixels = 640000", "camera.pixels: Input should be less than or equal to 4096"),
        (
            "position_m = [0.84, 0.0, 2.4]",
            "position_m = [0.84, 0.0, 0.0]",
            "camera.position_m.2: Input should be greater",
        ),
        ("episodes = 200", "episodes = 0", "subtasks.transfer.learner.episodes: Input should be greater than or equal"),
        ("goal = 1.5", "goal = inf", "subtasks.transfer.rewards.goal: Input should be a finite number (got inf)"),
        (
            "step = -0.1",
            "collision = -inf",
            "subtasks.transfer.rewards.collision: Input should be a finite number",
        ),
        ("goal = 1.5", "goal = 1e308", "subtasks.transfer.rewards: goal = 1e+308: allowed are -1000000 to 1000000"),
        ("goal = 1.5", "goal = true", "subtasks.transfer.rewards.goal: Input should be a valid number (got True)"),
        (
            "alpha = 0.95",
            'alpha = "0.9"',
            "subtasks.transfer.learner.alpha: Input should be a valid number (got '0.9')",
        ),
        ("omega = 7", "omega = true", "subtasks.transfer.gate.omega: Input should be a valid integer (got True)"),
        ("speed_m_s = 0.5", "speed_m_s = true", "robot.speed_m_s: Input should be a valid number (got True)"),
        (
            "capacity = 4",
            'capacity = "4"',
            "stations.1.capacity of station 'toaster_buffer': Input should be a valid integer (got '4')",
        ),
        (
            "capacity = 4",
            "capacity = true",
            "stations.1.capacity of station 'toaster_buffer': Input should be a valid integer (got True)",
        ),
        (
            "[0.42, 0.56, 0.0]",
            '[0.42, "0.56", 0.0]',
            "stations.1.pose.1 of station 'toaster_buffer': Input should be a valid number (got '0.56')",
        ),
        (
            "capacity = 4",
            "capacity = 4\nprocessing_s = 5.0",
            "station 'toaster_buffer' is a buffer: only a machine has processing_s",
        ),
        (
            "capacity = 50",
            "capacity = 50\nprocess = 'butter'",
            "station 'plate' is a storage: only a machine has process",
        ),
        (
            "lower_m = [-0.48, -1.08, 0.24]",
            "lower_m = 3",
            "workspace.lower_m: Input should be a list in brackets (got 3)",
        ),
    ],
)
def test_a_bad_value_is_said_with_what_is_allowed(
    old: str, new: str, said: str, refused: Refused, edited: Edited
) -> None:
    assert said in refused(edited(old, new))


def test_whole_numbers_may_stand_for_others(tmp_path: Path, edited: Edited) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(edited("goal = 1.5", "goal = 2").replace("speed_m_s = 0.5", "speed_m_s = 1"))
    task = load(str(path))
    assert (task.subtask("transfer").rewards.goal, task.robot.speed_m_s) == (2.0, 1.0)


@pytest.mark.parametrize("key", ["name", "robot", "parts", "workspace", "stations"])
def test_what_a_task_needs_must_be_there(key: str, changed: Changed) -> None:
    with pytest.raises(ValueError, match=rf"(?s)1 validation error.*{key}"):
        Task.model_validate(changed((key,), None))


def test_who_is_approached_by_the_camera_needs_one(refused: Refused) -> None:
    said = refused(re.sub(r"(?s)\[camera\].*?\n\n", "", TEXT))
    assert "station 'toaster': approach = 'camera': the table [camera] is missing" in said


def test_a_route_or_a_cell_of_one_place_is_too_short(changed: Changed) -> None:
    for path in (("parts", 0, "routes", 0), ("stations",)):
        short = SHIPPED["parts"][0]["routes"][0][:1] if path[0] == "parts" else SHIPPED["stations"][:1]
        with pytest.raises(ValueError, match=rf"(?s){path[0]}.*at least 2 items"):
            Task.model_validate(changed(path, short))


def test_several_findings_are_counted(refused: Refused, edited: Edited) -> None:
    text = edited("pixels = 640", "pixels = 1").replace("capacity = 4", "capacity = 0")
    assert refused(text).endswith("(and 2 more)")


@given(
    path=st.sampled_from(NUMBERS),
    value=st.one_of(
        st.floats(), st.integers(), st.integers(-(10**40), 10**40), st.text(max_size=4), st.booleans(), st.just([])
    ),
)
def test_any_value_in_any_numbers_place_loads_or_is_bad_input(changed: Changed, path: Path_, value: Any) -> None:
    message = ""
    try:
        task = Task.model_validate(changed(path, value))
        numbers = [abs(n) for _, n in leaves(task.model_dump(exclude={"subtasks"})) if isinstance(n, float)]
        assert max(numbers) <= 86_400
    except BadInput as error:
        message = str(error)
    except ValidationError as error:
        message = explain(error)
        where = [str(part) for part in path]
        of_table = f"{'.'.join(where[:-1])}: {where[-1]} = "
        assert message.startswith(
            (".".join(where), of_table, "station '", "machine '", "part '", f"{'.'.join(where[:2])}: ")
        )
    assert "\n" not in message


def test_more_things_than_a_table_holds_are_refused(refused: Refused) -> None:
    cubes = '\n[[obstacles]]\nname = "pile"\nposition_m = [0.5, 0.0]\n'
    said = refused(TEXT + cubes * MOST_THINGS)
    assert re.match(r"line \d+: obstacles: ", said)
    assert "at most 200 items" in said
    assert len(said) < 400


def test_a_workspace_that_no_machine_surveys_in_time_is_refused() -> None:
    """100 x 100 x 10 cells are as many as can be."""
    place = {"lower_m": [0.0, 0.0, 0.0], "cell_m": [0.01, 0.01, 0.01]}
    assert Workspace.model_validate(place | {"shape": [100, 100, 10]}).shape == (100, 100, 10)
    with pytest.raises(ValidationError, match="110000 cells: up to 100000 can be surveyed: wanted larger cells"):
        Workspace.model_validate(place | {"shape": [100, 100, 11]})
