"""What the tests of task files stand on: the file that ships, changed, and what is said of it."""

import copy
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.tasks.task_file import load

TEXT = (tasks_folder() / "toast.toml").read_text()
SHIPPED: dict[str, Any] = tomllib.loads(TEXT)
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
