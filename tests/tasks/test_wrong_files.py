"""Wrong task files: each is one line with the file, the line, the field, the value and what is allowed; and nothing crashes."""

import copy
import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput, LabError
from lab.files import tasks_folder
from lab.sim.scene.scene_check import check_apart, check_scene
from lab.skills.prepared_scene import check_task
from lab.tasks.task_file import load
from lab.tasks.toml_text import Loc

HERE = Path(__file__).parent
WRONG: list[dict[str, Any]] = tomllib.loads((HERE / "wrong_files.toml").read_text())["wrong"]
COMMANDS = ("an unknown field of a part", "out of reach", "a mesh with a hole", "a body of a mesh of words")
CORNERS = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"]
FACES = ["1 3 2", "1 4 3", "5 6 7", "5 7 8", "1 2 6", "1 6 5", "2 3 7", "2 7 6", "3 4 8", "3 8 7", "4 1 5", "4 5 8"]


def obj(corners: list[str], faces: list[str]) -> str:
    return "\n".join([*(f"v {corner}" for corner in corners), *(f"f {face}" for face in faces)])


FILES = {
    "open": obj(CORNERS, FACES[2:]),
    "large": obj([corner.replace("1", "80") for corner in CORNERS], FACES),
    "flat": obj(["0 0 0", "0.03 0 0", "0.03 0.03 0", "0 0.03 0"], ["1 2 3", "1 3 4", "1 2 4", "2 3 4"]),
    "empty_urdf": '<robot name="m"><link name="a"><inertial><mass value="1"/>'
    '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link></robot>',
}


def shipped(name: str) -> str:
    return (tasks_folder() / f"{name}.toml").read_text()


def written(wrong: dict[str, Any], folder: Path) -> str:
    """Writes mine.toml and what lies beside it; returns what is to be said of it, after its name."""
    text = shipped(wrong["base"])
    for old, new in wrong["edits"]:
        assert old in text
        text = text.replace(old, new, 1)
    (folder / "mine.toml").write_text(text)
    for name, content in wrong.get("files", {}).items():
        (folder / name).write_text(FILES.get(content, content))
    line = f"line {text[: text.index(wrong['at'])].count(chr(10)) + 1}: " if "at" in wrong else ""
    return line + str(wrong["said"]).replace("{folder}", str(folder.resolve()))


@pytest.mark.parametrize("wrong", WRONG, ids=[wrong["name"] for wrong in WRONG])
def test_a_wrong_file_is_one_line(wrong: dict[str, Any], tmp_path: Path) -> None:
    said = written(wrong, tmp_path)
    path = tmp_path / "mine.toml"
    errors, warnings = check_task(str(path), None, 0)
    assert (errors, warnings) == ([str(LabError(f"{path}: {said}"))], [])
    assert "\n" not in errors[0]


def test_there_are_enough_of_them_and_each_is_of_its_own() -> None:
    assert len(WRONG) >= 45
    assert len({wrong["name"] for wrong in WRONG}) == len(
        {wrong["base"] + str(wrong["edits"]) + str(wrong.get("files")) for wrong in WRONG}
    )


@pytest.mark.parametrize("command", ["task check", "run"])
@pytest.mark.parametrize("wrong", [w for w in WRONG if w["name"] in COMMANDS], ids=COMMANDS)
def test_the_command_ends_with_2_and_writes_nothing(
    lab: Callable[..., Any], wrong: dict[str, Any], command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    said = written(wrong, tmp_path)
    before = sorted(tmp_path.rglob("*"))
    ran = lab(*command.split(), "mine.toml")
    assert (ran.code, ran.out, ran.err) == (2, "", f"lab: mine.toml: {said}\n")
    assert sorted(tmp_path.rglob("*")) == before


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("changed")


# ---- any change to any value of a file that ships: it is taken, or refused in one line -------------------------------

CHANGED = {name: tomllib.loads(shipped(name)) for name in ("breakfast", "fms-arm", "two-toasters")}
VALUES = st.sampled_from(
    [None, True, -1, 0, 1, 2, 100, 1e9, -0.5, 0.01, 0.3, 3.0, "", "plate", "slice", "pallet", "box", "toaster.urdf"]
)
TABLES = st.sampled_from([[], [0.0, 0.0], [0.1, 0.1, 0.1], {}, {"station": "tray"}, [["plate", "tray"]]])


def places_in(value: Any, loc: Loc = ()) -> list[Loc]:
    """The way to every value within a document, tables and lists, too."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [found for key, inner in pairs for found in ((*loc, key), *places_in(inner, (*loc, key)))]


def toml_of(value: Any) -> str:
    """A value in one line of TOML."""
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{json.dumps(key)} = {toml_of(inner)}' for key, inner in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(toml_of(inner) for inner in value)}]"
    return json.dumps(value)


@settings(max_examples=150)
@given(data=st.data())
def test_no_change_of_a_file_is_a_traceback(folder: Path, data: st.DataObject) -> None:
    document = copy.deepcopy(CHANGED[data.draw(st.sampled_from(sorted(CHANGED)))])
    for _ in range(data.draw(st.integers(1, 2))):
        *way, last = data.draw(st.sampled_from(places_in(document)))
        inner: Any = document
        for part in way:
            inner = inner[part]
        if (value := data.draw(VALUES | TABLES)) is None:
            del inner[last]
        else:
            inner[last] = copy.deepcopy(value)
    path = folder / "mine.toml"
    path.write_text("\n".join(f"{json.dumps(key)} = {toml_of(inner)}" for key, inner in document.items()))
    try:
        task = load(str(path))
        order = task.order()
        with task.in_its_file():
            check_scene(task)
            check_apart(task, len(order))
    except BadInput as error:
        assert re.fullmatch(rf"{re.escape(str(path))}: .+", str(error))  # noqa: PT017 (it is one line)
