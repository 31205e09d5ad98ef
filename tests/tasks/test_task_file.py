"""Task files: what ships loads, and every slip of the pen is one clear line with the file, the value and what is allowed."""

import copy
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.skills import SKILLS
from lab.tasks.record import MAX_FILE_BYTES, MAX_SHORT_BYTES
from lab.tasks.task_file import (
    MAX_TOASTS,
    MOST_THINGS,
    RESERVED,
    Task,
    check_toasts,
    describe,
    find,
    load,
    load_any,
    load_cell,
    load_world,
    names_file,
    names_of,
    shipped,
)
from lab.tasks.toml_text import explain

SHIPPED: dict[str, Any] = tomllib.loads((tasks_folder() / "toast.toml").read_text())
TEXT = (tasks_folder() / "toast.toml").read_text()
STATIONS = "butter_applier, butter_buffer, finished_plate, plate, toaster, toaster_buffer"

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


def changed(path: Path_, value: Any) -> dict[str, Any]:
    """The shipped document with one value changed; None takes the key out."""
    document = copy.deepcopy(SHIPPED)
    inner: Any = document
    for part in path[:-1]:
        inner = inner[part]
    if value is None:
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    return document


def refusal(check: Callable[[], object]) -> str:
    with pytest.raises(BadInput) as caught:
        check()
    message = str(caught.value)
    assert "\n" not in message
    return message


def refused(folder: Path, text: str) -> str:
    """What `load` says of a file with this text, without the file's name."""
    path = folder / "mine.toml"
    path.write_text(text)
    message = refusal(lambda: load(str(path)))
    assert message.startswith(f"{path}: ")
    return message.removeprefix(f"{path}: ")


def edited(old: str, new: str) -> str:
    assert TEXT.count(old) >= 1
    return TEXT.replace(old, new, 1)


@pytest.mark.parametrize("name", names_of("task"))
def test_what_ships_loads_by_name_and_by_path(name: str) -> None:
    task = load(name)
    assert task.name == name
    assert task == load(str(tasks_folder() / f"{name}.toml"))
    assert set(task.subtasks) <= set(SKILLS)


def test_the_toast_task_is_the_cell_of_the_thesis() -> None:
    task = load("toast")
    assert [stage.station for stage in task.route] == ["plate", "toaster", "butter_applier", "finished_plate"]
    assert [stage.buffer for stage in task.route] == [None, "toaster_buffer", "butter_buffer", None]
    assert len(task.stations) == 6
    for name in SKILLS:
        settings = task.subtask(name)
        assert (settings.rewards.goal, settings.rewards.collision, settings.rewards.step) == (1.5, -11.5, -0.1)
        learner, gate = settings.learner, settings.gate
        assert (learner.learner, learner.alpha, learner.discount) == ("dyna-q", 0.95, 0.99)
        assert (learner.beta, gate.gate) == (1.3, "ccrl")
        assert gate.spare_best  # the file says nothing of it, and its own gate table leaves it as it is
    assert task.insert.shape == (12, 12)


def test_a_task_is_frozen_and_knows_its_stations() -> None:
    task = load("toast")
    with pytest.raises(ValueError, match="frozen"):
        task.name = "other"
    assert task.station("toaster").kind == "machine"
    message = refusal(lambda: task.station("toster"))
    assert message == f"unknown station 'toster' (task 'toast'): did you mean 'toaster'? known: {STATIONS}"


def test_a_sub_task_that_the_file_leaves_out_has_the_thesis_settings() -> None:
    document = changed(("subtasks",), {})
    assert Task.model_validate(document).subtask("grasp").learner.alpha == 0.95


def test_a_copied_task_runs_from_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine.toml").write_text(edited("[0.42, 0.56, 0.0]", "[0.45, 0.56, 0.1]"))
    monkeypatch.chdir(tmp_path)
    assert load("mine.toml").station("toaster_buffer").pose == (0.45, 0.56, 0.1)
    assert find("./mine.toml") == Path("mine.toml")


@pytest.mark.parametrize("task", ["mine.toml", "./toast", "/nowhere/toast.toml"])
def test_a_file_that_is_not_there_is_said(task: str) -> None:
    message = refusal(lambda: load(task))
    assert message.startswith(f"no task file '{task}'")
    assert "toast" in message


@pytest.mark.parametrize("task", ["toats", "", "Toast", "x" * 300, "toast\0"])
def test_an_unknown_task_lists_the_known(task: str) -> None:
    message = refusal(lambda: load(task))
    assert message.startswith("unknown task '")
    assert message.endswith("known: " + ", ".join(sorted(shipped())))
    assert ("did you mean 'toast'?" in message) == (task in ("toats", "Toast", "toast\0"))


def test_a_folder_is_no_task(tmp_path: Path) -> None:
    folder = tmp_path / "mine.toml"
    folder.mkdir()
    assert f"no task file '{folder}'" in refusal(lambda: load(str(folder)))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('name = "toast"\nx = = 1\n', "not valid TOML: Invalid value (at line 2, column 5)"),
        ('name = "toast"\nname = "toast"\n', "not valid TOML: Cannot overwrite a value (at line 2"),
        ("[robot\n", "not valid TOML: Expected ']' at the end of a table declaration (at line 1"),
        ("a = " + "[" * 5000, "not valid TOML: "),
        ("a = 1" + "0" * 5000, "not valid TOML: "),
        ("", "name: Field required"),
        ("title = 3", "name: Field required"),
    ],
)
def test_malformed_toml_is_said_with_file_and_line(tmp_path: Path, text: str, said: str) -> None:
    assert refused(tmp_path, text).startswith(said)


def test_what_is_no_text_is_said(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xff\xfe\x00")
    assert "cannot be read" in refusal(lambda: load(str(path)))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("capacity = 50", "capacity = 0", "stations.0.capacity: Input should be greater than or equal to 1 (got 0)"),
        ("capacity = 4", "capacity = -2", "stations.1.capacity: Input should be greater than or equal to 1 (got -2)"),
        ("capacity = 4", "capacity = 1.5", "stations.1.capacity: Input should be a valid integer"),
        ("processing_s = 60.0", "processing_s = -1.0", "greater than or equal to 0 (got -1.0)"),
        ("processing_s = 60.0", "processing_s = nan", "stations.2.processing_s: "),
        ("dwell_s = 3.0", "dwell_s = -0.1", "stations.4.dwell_s: Input should be greater than or equal to 0"),
        ("dwell_s = 3.0", "dwell_s = inf", "stations.4.dwell_s: Input should be a finite number (got inf)"),
        ('station = "toaster"', 'station = "toster"', "unknown station 'toster' (route): did you mean 'toaster'?"),
        ('buffer = "toaster_buffer"', 'buffer = "buffer"', "unknown station 'buffer' (route):"),
        ('start = "toaster_buffer"', 'start = "home"', f"unknown station 'home' (robot.start): known: {STATIONS}"),
        ("[0.42, 0.56, 0.0]", "[0.05, 0.80, 0.0]", "stations 'plate' and 'toaster_buffer' overlap: 0.050 m apart"),
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
        ("title =", "titel =", "titel: there is no such key (got 'Toast making with one robot')"),
        ("speed_m_s = 0.5", "sped_m_s = 0.5", "robot.sped_m_s: there is no such key"),
        ("beta = 1.3", "bta = 1.3", "subtasks.transfer.learner.bta: "),
        ('kind = "buffer"', 'kind = "bufer"', "stations.1.kind: Input should be 'storage', 'buffer' or 'machine'"),
        ("processing_s = 60.0", "", "machine 'toaster' needs either processing_s or process, a sub-task to learn, not"),
        ("dwell_s = 3.0", "processing_s = 3.0", "machine 'butter_applier' needs either processing_s or process"),
        ("shape = [14, 18, 3]", "shape = [14, 18, 0]", "workspace.shape.2: Input should be greater than or equal to 1"),
        ("shape = [14, 18, 3]", "shape = [14, 18]", "workspace.shape.2: Field required"),
        ("shape = [12, 12]", "shape = [12, 1000000]", "insert.shape.1: Input should be less than or equal to 100"),
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
        ("capacity = 4", 'capacity = "4"', "stations.1.capacity: Input should be a valid integer (got '4')"),
        ("capacity = 4", "capacity = true", "stations.1.capacity: Input should be a valid integer (got True)"),
        ("[0.42, 0.56, 0.0]", '[0.42, "0.56", 0.0]', "stations.1.pose.1: Input should be a valid number (got '0.56')"),
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
        ("lower_m = [-0.48, -1.08, 0.24]", "lower_m = 3", "workspace.lower_m: Input should be a valid tuple (got 3)"),
    ],
)
def test_a_bad_value_is_said_with_what_is_allowed(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert said in refused(tmp_path, edited(old, new))


def test_whole_numbers_may_stand_for_others(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(edited("goal = 1.5", "goal = 2").replace("speed_m_s = 0.5", "speed_m_s = 1"))
    task = load(str(path))
    assert (task.subtask("transfer").rewards.goal, task.robot.speed_m_s) == (2.0, 1.0)


@pytest.mark.parametrize("name", RESERVED)
def test_reserved_names_are_refused(tmp_path: Path, name: str) -> None:
    assert f"obstacle '{name}'" in refused(tmp_path, edited('name = "cubes B"', f'name = "{name}"'))
    document = TEXT.replace('"plate"', f'"{name}"')
    assert f"station '{name}'" in refused(tmp_path, document)


@pytest.mark.parametrize("key", ["name", "robot", "workspace", "camera", "insert", "stations", "route"])
def test_what_a_task_needs_must_be_there(key: str) -> None:
    with pytest.raises(ValueError, match=rf"(?s)1 validation error.*{key}"):
        Task.model_validate(changed((key,), None))


def test_a_route_or_a_cell_of_one_place_is_too_short(tmp_path: Path) -> None:
    for key in ("route", "stations"):
        with pytest.raises(ValueError, match=rf"(?s){key}.*at least 2 items"):
            Task.model_validate(changed((key,), SHIPPED[key][:1]))


def test_several_findings_are_counted(tmp_path: Path) -> None:
    text = edited("pixels = 640", "pixels = 1").replace("capacity = 4", "capacity = 0")
    assert refused(tmp_path, text).endswith("(and 2 more)")


@given(
    st.sampled_from(NUMBERS),
    st.one_of(
        st.floats(), st.integers(), st.integers(-(10**40), 10**40), st.text(max_size=4), st.booleans(), st.just([])
    ),
)
def test_any_value_in_any_numbers_place_loads_or_is_bad_input(path: Path_, value: Any) -> None:
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
        assert message.startswith((".".join(where), of_table, "stations '", "machine '"))
    assert "\n" not in message


@given(st.binary(max_size=60))
def test_any_bytes_load_or_are_bad_input(tmp_path_factory: pytest.TempPathFactory, raw: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "bytes.toml"
    path.write_bytes(raw)
    assert refusal(lambda: load(str(path))).startswith(f"{path}: ")


# ---- worlds -------------------------------------------------------------------------------------------------------

WORLD = (tasks_folder() / "world-1.toml").read_text()


@pytest.mark.parametrize("name", names_of("world"))
def test_a_world_that_ships_loads_by_name_and_by_path(name: str) -> None:
    world = load_world(name)
    assert world.name == name
    assert world == load_world(str(tasks_folder() / f"{name}.toml")) == load_any(name)
    assert world.check().start == np.ravel_multi_index(world.start, world.shape)


def test_what_ships_is_a_task_a_cell_or_a_world() -> None:
    assert sorted(names_of("task") + names_of("cell") + names_of("world")) == sorted(shipped())
    assert (shipped()["toast"], shipped()["fms"], shipped()["world-1"]) == ("task", "cell", "world")
    assert [names_file(word) for word in ("world-1", "toast", "fms", "a.txt", "./a", "random:", "insert", "world")] == (
        [True] * 6 + [False] * 2
    )


@pytest.mark.parametrize("word", ["world-1", str(tasks_folder() / "world-1.toml"), "random:3x3:0.1:0"])
def test_a_world_is_no_task_and_no_cell(word: str) -> None:
    assert refusal(lambda: load(word)) == f"{word}: it is a world, not a task: learn it with lab teach {word}"
    assert refusal(lambda: load_cell(word)) == f"{word}: it is a world, not a cell: learn it with lab teach {word}"


@pytest.mark.parametrize("word", ["fms", str(tasks_folder() / "fms.toml")])
def test_a_cell_is_no_task_and_no_world(word: str) -> None:
    assert load_cell(word) == load_any(word) == load_cell("fms")
    for read, kind in ((load, "task"), (load_world, "world")):
        said = f"{word}: it is a cell, not a {kind}: sequence it with lab sequence {word}"
        assert refusal(lambda read=read: read(word)) == said  # type: ignore[misc]


def test_a_task_is_no_world(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT)
    for word in ("toast", str(path)):
        said = f"{word}: it is a task, not a world: lab run {word}, or lab teach SUBTASK --task {word}"
        assert refusal(lambda word=word: load_world(word)) == said  # type: ignore[misc]
        assert refusal(lambda word=word: load_cell(word)) == said.replace("not a world", "not a cell")  # type: ignore[misc]


def test_a_kind_that_there_is_not(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(WORLD.replace('"world"', '"wrold"'))
    for read in (load, load_world):
        assert refusal(lambda read=read: read(str(path))) == (  # type: ignore[misc]
            f"{path}: line 7: unknown kind 'wrold' (of task file): did you mean 'world'? known: cell, world"
        )


def test_a_text_grid_is_a_world(tmp_path: Path) -> None:
    path = tmp_path / "my grid.txt"
    path.write_text("S.#\n..G\n")
    world = load_world(str(path))
    assert (world.name, world.shape, world.obstacles) == ("my grid", (2, 3), ((0, 2),))
    assert f"{path}: it is a world, not a task" in refusal(lambda: load(str(path)))
    assert refusal(lambda: load_world("no.txt")).startswith("no task file 'no.txt'")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("shape = [10, 10, 10]", "shape = [10]", "at least 2 items after validation, not 1 (got [10])"),
        ("shape = [10, 10, 10]", "shape = [10, 10, 10, 10]", "at most 3 items after validation, not 4 (got [10,"),
        (
            "shape = [10, 10, 10]",
            "shape = [10, 10, 101]",
            "shape.2: Input should be less than or equal to 100 (got 101)",
        ),
        ("shape = [10, 10, 10]", "shape = [10, 10, 0]", "shape.2: Input should be greater than or equal to 1 (got 0)"),
        ("shape = [10, 10, 10]", "shape = [10, 10]", "start (0, 7, 1) has 3 coordinates: 2 are wanted"),
        ("shape = [10, 10, 10]", "shape = 10", "shape: Input should be a valid tuple (got 10)"),
        ("start = [0, 7, 1]", "start = [0, 7, 10]", "start (0, 7, 10) is outside the world: allowed are 0..9 x 0..9 x"),
        ("start = [0, 7, 1]", "start = [0, 7, -1]", "start (0, 7, -1) is outside the world: allowed are 0..9 x 0..9 x"),
        ("start = [0, 7, 1]", "start = [0, 7, 1.0]", "start.2: Input should be a valid integer (got 1.0)"),
        ("start = [0, 7, 1]", "start = [0, 0, 0]", "start (0, 0, 0) is blocked by an obstacle: a free cell is wanted"),
        ("start = [0, 7, 1]", "start = [8, 5, 3]", "start and goal are the same cell (8, 5, 3): two cells are wanted"),
        ("start = [0, 7, 1]", "", "start: Field required"),
        ("goal = [8, 5, 3]", "goal = [8, 4, 2]", "goal (8, 4, 2) is blocked by an obstacle: a free cell is wanted"),
        ("[0, 1, 0]", "[0, 10, 0]", "obstacle (0, 10, 0) is outside the world: allowed are 0..9 x 0..9 x 0..9"),
        ("[0, 1, 0]", "[0, 1]", "obstacle (0, 1) has 2 coordinates: 3 are wanted"),
        ("[0, 1, 0]", "[0, 0, 0]", "obstacle (0, 0, 0) stands twice in the file"),
        ("lower = [5, 2, 2]", "lower = [5, 9, 2]", "view.lower 9 on axis 1 is above view.upper: allowed are 0..8"),
        ("upper = [9, 8, 7]", "upper = [9, 8, 10]", "view.upper (9, 8, 10) is outside the world: allowed are 0..9 x"),
        ("upper = [9, 8, 7]", "", "view.upper: Field required"),
        ("collision = -1.0", "collision = 1.0", "rewards.collision: Input should be less than 0 (got 1.0)"),
        ("goal = 1.5", "goal = 1e308", "rewards: goal = 1e+308: allowed are -1000000 to 1000000"),
        ("alpha = 0.95", "alpha = 1.5", "learner.alpha: Input should be less than or equal to 1 (got 1.5)"),
        ("count_start = true", "count_start = 1", "learner.count_start: Input should be a valid boolean (got 1)"),
        ('"afterstate"', '"afterstat"', "unknown learner 'afterstat' (learner): did you mean 'afterstate'?"),
        ('"ccrl"', '"ccl"', "unknown gate 'ccl' (gate): did you mean 'ccrl'?"),
        ("alpha = 0.95", 'selection = "sftmax"', "unknown selection 'sftmax' (learner): did you mean 'softmax'?"),
        ('name = "world-1"', 'name = "a/b"', "name: "),
        ("title =", "titel =", "titel: there is no such key"),
    ],
)
def test_a_bad_world_is_said_with_what_is_allowed(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "mine.toml"
    assert WORLD.count(old) >= 1
    path.write_text(WORLD.replace(old, new, 1))
    message = refusal(lambda: load_world(str(path)))
    assert message.startswith(f"{path}: ")
    assert said in message


@pytest.mark.parametrize("toasts", [0, -1, MAX_TOASTS + 1])
def test_no_or_too_many_toasts_are_refused(toasts: int) -> None:
    message = refusal(lambda: check_toasts(toasts, load("toast")))
    assert message == f"{toasts} toasts (--toasts): allowed are 1 to 50"


def test_both_ends_of_the_route_must_hold_the_toasts() -> None:
    check_toasts(50, load("toast"))
    small = Task.model_validate(changed(("stations", 5, "capacity"), 2))
    check_toasts(2, small)
    message = refusal(lambda: check_toasts(3, small))
    assert message == "3 toasts (--toasts) do not fit on 'finished_plate': its capacity in the task file is 2"


def test_a_file_too_long_to_be_a_task_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "long.toml"
    path.write_text("".join(f"k{n} = {n}\n" for n in range(100_000)))
    assert refusal(lambda: load_any(str(path))).endswith("characters: a file that holds no world has up to 1000000")
    path.write_text(WORLD + "#" * MAX_SHORT_BYTES)
    assert load_world(str(path)).name == "world-1"
    with path.open("wb") as file:
        file.truncate(MAX_FILE_BYTES + 1)
    assert refusal(lambda: load_any(str(path))).endswith("bytes: files up to 10000000 bytes are read")


def test_more_things_than_a_table_holds_are_refused(tmp_path: Path) -> None:
    cubes = '\n[[obstacles]]\nname = "pile"\nposition_m = [0.5, 0.0]\n'
    said = refused(tmp_path, TEXT + cubes * MOST_THINGS)
    assert said.startswith("obstacles: ")
    assert "at most 200 items" in said
    assert len(said) < 400


@pytest.mark.parametrize("name", names_of("cell"))
def test_a_cell_is_described(name: str, root: Path) -> None:
    text, document = describe(name)
    assert text == (root / "tasks" / f"{name}.toml").read_text(encoding="utf-8")
    assert (document["name"], document["kind"], document["file"]) == (
        name,
        "cell",
        str(root / "tasks" / f"{name}.toml"),
    )
