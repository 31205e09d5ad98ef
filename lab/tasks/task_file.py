"""Loading of tasks, cells and worlds by name or file into checked, frozen records."""

import os
import re
from functools import partial
from os.path import isfile
from pathlib import Path
from typing import Any, Literal, TypeVar, cast, get_args

from pydantic import ValidationError

from lab.errors import BadInput, shortened, unknown
from lab.files import tasks_folder
from lab.tasks.cell_file import CellFile
from lab.tasks.grid_world import RANDOM, GridWorld, from_text, from_words
from lab.tasks.instances import SUFFIXES, InstanceRequest, is_instance, read_instance, takes_case
from lab.tasks.record import MAX_SHORT_BYTES, Record, read_text
from lab.tasks.task import Task
from lab.tasks.task_faults import fields_at, loc_of, refusal, within
from lab.tasks.toml_text import TomlText, explain, finding

_SAYS_WORLD = re.compile(r"""^[ \t]*kind[ \t]*=[ \t]*["']world["']""", re.MULTILINE)

_OF_WHOLE = ("value_error", "assertion_error")  # errors that concern more than one field of a record

FileKind = Literal["task", "cell", "world"]  # the kind of a file's content
Checked = TypeVar("Checked", bound=Record)


def shipped() -> dict[str, str]:
    """The files that ship, by name, and their kinds: "task", "cell" or "world"."""
    return {name: _kind(_toml(path)) for name, path in _files().items()}


def _files() -> dict[str, Path]:
    return {path.stem: path for path in sorted(tasks_folder().glob("*.toml"))}


def names_of(wanted: FileKind) -> list[str]:
    """The names of the files of a kind that ship."""
    return [name for name, kind in shipped().items() if kind == wanted]


def names_file(word: str) -> bool:
    """Whether a word stands for a world, cell or task (a path, a name, or a random world) and not for a sub-task."""
    return word.startswith(RANDOM) or is_path(word) or word in _files()


def whole_path(name: str | None) -> str | None:
    """The absolute path of an existing file; any other name unchanged."""
    return str(Path(name).absolute()) if name is not None and names_file(name) and isfile(name) else name


def is_path(task: str) -> bool:
    """Whether a word for a task, cell or world is a path; the file need not exist."""
    return Path(task).suffix in (".toml", ".txt", *SUFFIXES) or not {"/", os.sep}.isdisjoint(task)


def find(task: str) -> Path:
    """The file of a task, cell or world given by name or path; raises BadInput when there is none."""
    files = _files()
    there = isfile(task)  # also False for a name that is too long for any file
    if is_path(task) or (task not in files and there):  # many instances have no ending
        if there:
            return Path(task)
        known = ", ".join(files)
        raise BadInput(
            f"no task file '{shortened(task)}': give a file that exists, .toml or .txt, or what ships; known: {known}"
        )
    if task not in files:
        raise unknown("task", task, files, "TASK")
    return files[task]


def load(task: str) -> Task:
    """The checked task of a name or path; raises BadInput with the file, the line or field, the value and what is allowed."""
    return cast(Task, load_any(task, "task"))


def task_of_text(path: Path, text: str) -> Task:
    """The checked task of a text, whose file need not exist yet; raises BadInput as `load` does."""
    return _task(TomlText.parsed(path, text))


def load_cell(cell: str) -> CellFile:
    """The checked cell of a name or file, without physics; raises BadInput with file and line."""
    return cast(CellFile, load_any(cell, "cell"))


def load_world(world: str) -> GridWorld:
    """The checked world of a name, of a file (.toml, or .txt with a text grid), or a random one ("random:10x10x10:0.06:7")."""
    return cast(GridWorld, load_any(world, "world"))


def load_any(word: str, wanted: FileKind | None = None) -> Task | CellFile | GridWorld:
    """The task, cell or world of a name or file, as `load`, `load_cell` and `load_world` read it.

    wanted: the expected kind; raises BadInput for another one.
    """
    drawn = word.startswith(RANDOM)
    path = Path(word) if drawn else find(word)
    if not drawn and is_instance(path):
        _check_wanted(word, "cell", wanted)
        return read_instance(path)
    if drawn or path.suffix == ".txt":
        _check_wanted(word, "world", wanted)
        return from_words(word) if drawn else from_text(path)
    toml = _toml(path)
    kind = _kind(toml)
    if kind == "cell" and wanted == "task" and (cell := CellFile.checked(toml)).in_physics is not None:
        other = cell.in_physics
        return load_any(str(path.parent / other) if is_path(other) else other, wanted)
    _check_wanted(word, kind, wanted)
    if kind == "cell":
        return CellFile.checked(toml)
    return _task(toml) if kind == "task" else _checked(GridWorld, toml)


def load_beside(word: str, asked: InstanceRequest) -> tuple[Task | CellFile | GridWorld, str | None]:
    """The task, cell or world of a word with the given options, and the --case if it names an order; else None.

    A layout fits instance files only; robots fit these and cells. Raises BadInput for other combinations.
    """
    path = None if word.startswith(RANDOM) else find(word)
    if path is not None and is_instance(path):
        return read_instance(path, asked), None if takes_case(path, asked) else asked.case
    loaded = load_any(word)
    if asked.layout is not None:
        raise BadInput(f"--layout {asked.layout} beside {word}: it is no instance file: its travel times are its own")
    if asked.robots is not None:
        if not isinstance(loaded, CellFile):
            raise BadInput(
                f"--robots {asked.robots} beside {word}: it is no cell: the arm is the one that its file has"
            )
        loaded = loaded.with_robots(asked.robots)
    return loaded, asked.case


def load_cell_beside(word: str, asked: InstanceRequest) -> CellFile:
    """The cell of a word with the given options; raises BadInput for anything else, and for a --case that names no instance."""
    loaded, case = load_beside(word, asked)
    if not isinstance(loaded, CellFile):
        raise BadInput(f"{word}: wanted an instance file or a cell")
    if case is not None:
        raise BadInput(f"--case {case} beside {word}: it holds one instance only")
    return loaded


def describe(word: str) -> tuple[str, dict[str, Any]]:
    """The text of a task, cell or world, and the document of `lab task show --json`; a random world has no "file"."""
    loaded = load_any(word)
    if isinstance(loaded, GridWorld) and word.startswith(RANDOM):
        return loaded.to_toml(), {"file": None, **loaded.model_dump(mode="json")}
    path = find(word)
    return read_text(path), {"file": str(path), **loaded.model_dump(mode="json")}


def _check_wanted(word: str, kind: FileKind, wanted: FileKind | None) -> None:
    if wanted is None or kind == wanted:
        return
    instead = {
        "task": f"lab run {word}, or lab teach SUBTASK --task {word}",
        "cell": f"sequence it with lab sequence {word}",
        "world": f"learn it with lab teach {word}",
    }
    raise BadInput(f"{word}: it is a {kind}, not a {wanted}: {instead[kind]}")


def _kind(toml: TomlText) -> FileKind:
    kind = toml.raw.get("kind", "task")
    if kind in get_args(FileKind):
        return cast(FileKind, kind)
    raise toml.refusal(("kind",), str(unknown("kind", kind, get_args(FileKind), "of task file")))


def _toml(path: Path) -> TomlText:
    text = read_text(path)
    if len(text) > MAX_SHORT_BYTES and not _SAYS_WORLD.search(text):  # checked first, since parsing would take seconds
        raise BadInput(f"{path}: {len(text)} characters: a file that holds no world has up to {MAX_SHORT_BYTES}")
    return TomlText.parsed(path, text)


def _task(toml: TomlText) -> Task:
    task = _checked(Task, toml)
    task._folder, task._toml = toml.path.resolve().parent, toml
    return task


def _checked(model: type[Checked], toml: TomlText) -> Checked:
    try:
        return model.model_validate(toml.raw)
    except ValidationError as error:
        first = finding(error)
        said = explain(error, partial(fields_at, model), toml.raw)
        at = first["loc"]
        if first["type"] in _OF_WHOLE:
            at = at + within(toml.raw, at, first["msg"]) if at else loc_of(toml.raw, first["msg"])
        raise toml.refusal(at, said) from None
    except BadInput as error:
        raise refusal(toml, str(error)) from None
