"""Sources of modules: of all that a module imports, however it does; what cannot be found is an error."""

import py_compile
from pathlib import Path

import pytest

from lab.errors import WorkFailed
from lab.learning.sources import source, sources

FILES = {
    "__init__.py": "",
    "top.py": "import json\nfrom typing import TYPE_CHECKING\nfrom {0}.low import f\nif TYPE_CHECKING:\n    import {0}.seen\n",
    "low.py": "def f():\n    from {0} import late\n    import numpy as np\n",
    "late.py": "from . import beside\nfrom .room.inner import x\n",
    "beside.py": "import {0}.top\n",
    "seen.py": "",
    "room/__init__.py": "from {0}.other import y\n",
    "room/inner.py": "x = 1\n",
    "other.py": "y = 1\n",
}


@pytest.fixture
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package of its own for each test: what was once imported is not looked for again."""
    folder = tmp_path / f"house_{tmp_path.name}"
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text.format(folder.name))
    monkeypatch.syspath_prepend(str(tmp_path))
    return folder


def names(house: Path, *roots: str, without: tuple[str, ...] = ()) -> set[str]:
    found = sources([f"{house.name}.{root}" for root in roots], [f"{house.name}.{out}" for out in without])
    return {name.removeprefix(f"{house.name}.") for name in found.texts}


def test_imports_are_followed_everywhere(house: Path) -> None:
    every = {house.name, "top", "low", "late", "beside", "room", "room.inner", "other"}
    assert names(house, "top") == every  # not `seen`, which is never loaded
    assert sources([f"{house.name}.top"]).libraries == {"numpy"}
    assert names(house, "beside") == every
    assert names(house, "other") == {house.name, "other"}


def test_what_is_left_out_is_not_followed(house: Path) -> None:
    assert names(house, "top", without=("room",)) == {house.name, "top", "low", "late", "beside"}


def test_the_text_is_that_of_the_file_now(house: Path) -> None:
    assert source(f"{house.name}.other") == "y = 1\n"
    (house / "other.py").write_text("y = 2\n")
    assert sources([f"{house.name}.top"]).texts[f"{house.name}.other"] == "y = 2\n"


def test_a_module_without_its_source_is_an_error(house: Path) -> None:
    py_compile.compile(str(house / "other.py"), cfile=str(house / "other.pyc"))
    (house / "other.py").unlink()
    with pytest.raises(WorkFailed, match=r"^the source of the module '.*\.other' cannot be found$"):
        sources([f"{house.name}.top"])
    with pytest.raises(WorkFailed, match="'nowhere_at_all' cannot be found"):
        source("nowhere_at_all")
