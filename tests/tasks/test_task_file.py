"""Task files: what ships loads by name and by path, and what is no task file, or another kind, is said in one line."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.files import tasks_folder
from lab.skills import SKILLS
from lab.tasks.record import MAX_FILE_BYTES, MAX_SHORT_BYTES
from lab.tasks.task_file import describe, find, load, load_any, load_cell, load_world, names_file, names_of, shipped

TEXT = (tasks_folder() / "toast.toml").read_text()
Edited = Callable[[str, str], str]  # the fixture of conftest.py
Refusal = Callable[[Callable[[], object]], str]  # the fixture of conftest.py
Refused = Callable[[str], str]  # the fixture of conftest.py


@pytest.mark.parametrize("name", names_of("task"))
def test_what_ships_loads_by_name_and_by_path(name: str) -> None:
    task = load(name)
    assert task.name == name
    assert task == load(str(tasks_folder() / f"{name}.toml"))
    assert set(task.subtasks) <= set(SKILLS)


def test_a_copied_task_runs_from_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, edited: Edited) -> None:
    (tmp_path / "mine.toml").write_text(edited("[0.42, 0.56, 0.0]", "[0.45, 0.56, 0.1]"))
    monkeypatch.chdir(tmp_path)
    assert load("mine.toml").station("toaster_buffer").pose == (0.45, 0.56, 0.1)
    assert find("./mine.toml") == Path("mine.toml")


@pytest.mark.parametrize("task", ["mine.toml", "./toast", "/nowhere/toast.toml"])
def test_a_file_that_is_not_there_is_said(task: str, refusal: Refusal) -> None:
    message = refusal(lambda: load(task))
    assert message.startswith(f"no task file '{task}'")
    assert "toast" in message


@pytest.mark.parametrize("task", ["toats", "", "Toast", "x" * 300, "toast\0"])
def test_an_unknown_task_lists_the_known(task: str, refusal: Refusal) -> None:
    message = refusal(lambda: load(task))
    assert message.startswith("unknown task '")
    assert "known: " + ", ".join(sorted(shipped()))[:100] in message
    assert ("did you mean 'toast'?" in message) == (task in ("toats", "Toast", "toast\0"))


def test_a_folder_is_no_task(tmp_path: Path, refusal: Refusal) -> None:
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
def test_malformed_toml_is_said_with_file_and_line(text: str, said: str, refused: Refused) -> None:
    assert refused(text).startswith(said)


def test_what_is_no_text_is_said(tmp_path: Path, refusal: Refusal) -> None:
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xff\xfe\x00")
    assert "cannot be read" in refusal(lambda: load(str(path)))


@given(raw=st.binary(max_size=60))
def test_any_bytes_load_or_are_bad_input(
    refusal: Refusal, tmp_path_factory: pytest.TempPathFactory, raw: bytes
) -> None:
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
def test_a_world_is_no_task_and_no_cell(word: str, refusal: Refusal) -> None:
    assert refusal(lambda: load(word)) == f"{word}: it is a world, not a task: learn it with lab teach {word}"
    assert refusal(lambda: load_cell(word)) == f"{word}: it is a world, not a cell: learn it with lab teach {word}"


@pytest.mark.parametrize("word", ["toast-case-1", str(tasks_folder() / "toast-case-1.toml")])
def test_a_cell_is_no_task_and_no_world(word: str, refusal: Refusal) -> None:
    assert load_cell(word) == load_any(word) == load_cell("toast-case-1")
    for read, kind in ((load, "task"), (load_world, "world")):
        said = f"{word}: it is a cell, not a {kind}: sequence it with lab sequence {word}"
        assert refusal(lambda read=read: read(word)) == said  # type: ignore[misc]


def test_a_cell_that_says_its_task_in_physics_is_that_task_too() -> None:
    assert load_cell("fms").in_physics == "fms-arm"
    assert load("fms") == load("fms-arm")


def test_a_task_is_no_world(tmp_path: Path, refusal: Refusal) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT)
    for word in ("toast", str(path)):
        said = f"{word}: it is a task, not a world: lab run {word}, or lab teach SUBTASK --task {word}"
        assert refusal(lambda word=word: load_world(word)) == said  # type: ignore[misc]
        assert refusal(lambda word=word: load_cell(word)) == said.replace("not a world", "not a cell")  # type: ignore[misc]


def test_a_kind_that_there_is_not(tmp_path: Path, refusal: Refusal) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(WORLD.replace('"world"', '"wrold"'))
    for read in (load, load_world):
        assert refusal(lambda read=read: read(str(path))) == (  # type: ignore[misc]
            f"{path}: line 7: unknown kind 'wrold' (of task file): did you mean 'world'? known: cell, task, world"
        )


def test_a_text_grid_is_a_world(tmp_path: Path, refusal: Refusal) -> None:
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
            "shape = [10, 10, 113]",
            "shape 10x10x113: allowed are 2 axes of 1 to 1200 cells or 3 axes of 1 to 112 cells",
        ),
        ("shape = [10, 10, 10]", "shape = [10, 10, 0]", "shape.2: Input should be greater than or equal to 1 (got 0)"),
        ("shape = [10, 10, 10]", "shape = [10, 10]", "start (0, 7, 1) has 3 coordinates: 2 are wanted"),
        ("shape = [10, 10, 10]", "shape = 10", "shape: Input should be a list in brackets (got 10)"),
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
        ("title =", "titel =", "titel: there is no such key, did you mean 'title'?"),
    ],
)
def test_a_bad_world_is_said_with_what_is_allowed(
    tmp_path: Path, old: str, new: str, said: str, refusal: Refusal
) -> None:
    path = tmp_path / "mine.toml"
    assert WORLD.count(old) >= 1
    path.write_text(WORLD.replace(old, new, 1))
    message = refusal(lambda: load_world(str(path)))
    assert message.startswith(f"{path}: ")
    assert said in message


def test_a_file_too_long_to_be_a_task_is_refused_before_it_is_read(tmp_path: Path, refusal: Refusal) -> None:
    path = tmp_path / "long.toml"
    path.write_text("".join(f"k{n} = {n}\n" for n in range(100_000)))
    assert refusal(lambda: load_any(str(path))).endswith("characters: a file that holds no world has up to 1000000")
    path.write_text(WORLD + "#" * MAX_SHORT_BYTES)
    assert load_world(str(path)).name == "world-1"
    with path.open("wb") as file:
        file.truncate(MAX_FILE_BYTES + 1)
    assert refusal(lambda: load_any(str(path))).endswith("bytes, allowed are 10000000")


@pytest.mark.parametrize("name", names_of("cell"))
def test_a_cell_is_described(name: str, root: Path) -> None:
    text, document = describe(name)
    assert text == (root / "tasks" / f"{name}.toml").read_text(encoding="utf-8")
    assert (document["name"], document["kind"], document["file"]) == (
        name,
        "cell",
        str(root / "tasks" / f"{name}.toml"),
    )
