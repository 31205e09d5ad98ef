"""What the tests of task files stand on: the file that ships, changed, and what is said of it."""

import copy
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.tasks.task_file import load


@pytest.fixture(scope="session")
def refusal() -> Callable[[Callable[[], object]], str]:
    """What a call says that must be bad input: one line."""

    def said(check: Callable[[], object]) -> str:
        with pytest.raises(BadInput) as caught:
            check()
        message = str(caught.value)
        assert "\n" not in message
        return message

    return said


@pytest.fixture(scope="session")
def refused(
    refusal: Callable[[Callable[[], object]], str], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], str]:
    """What `load` says of a file with this text, without the file's name."""
    path: Path = tmp_path_factory.mktemp("refused") / "mine.toml"

    def said(text: str) -> str:
        path.write_text(text)
        message = refusal(lambda: load(str(path)))
        assert message.startswith(f"{path}: ")
        return message.removeprefix(f"{path}: ")

    return said


@pytest.fixture(scope="session")
def edited() -> Callable[[str, str], str]:
    """The text that ships, with the first place of a piece written otherwise."""
    text = (tasks_folder() / "toast.toml").read_text()

    def made(old: str, new: str) -> str:
        assert text.count(old) >= 1
        return text.replace(old, new, 1)

    return made


@pytest.fixture(scope="session")
def changed() -> Callable[[tuple[str | int, ...], Any], dict[str, Any]]:
    """The document that ships, with one value changed; None takes the key out."""
    shipped = tomllib.loads((tasks_folder() / "toast.toml").read_text())

    def made(path: tuple[str | int, ...], value: Any) -> dict[str, Any]:
        document = copy.deepcopy(shipped)
        inner: Any = document
        for part in path[:-1]:
            inner = inner[part]
        if value is None:
            del inner[path[-1]]
        else:
            inner[path[-1]] = value
        return document

    return made
