"""What is compiled is kept, and compiled anew as soon as anything that is compiled in has changed."""

import importlib
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numba
import pytest

from lab import files
from lab.files import source_hash, source_key
from lab.learning import compiled

DOUBLED = """from lab.learning.compiled import inner, without_refcounts
from kitchen import recipe

slices = inner(recipe.slices)


"""
DOUBLED += "@without_refcounts\ndef doubled(toasts):\n    return 2 * slices(toasts)\n"
SLICES = "from .bread import (\n    PER_TOAST,  # slices\n)\n\n\ndef slices(toasts):\n    return PER_TOAST * toasts\n"


@pytest.fixture
def kitchen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package whose kernel has a function of another file compiled in, and that one a number of a third."""
    folder = tmp_path / "installed" / "kitchen"
    folder.mkdir(parents=True)
    for name, text in (("__init__", ""), ("kernel", DOUBLED), ("recipe", SLICES), ("bread", "PER_TOAST = 1\n")):
        (folder / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(str(folder.parent))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "kept"))
    monkeypatch.setattr(compiled, "_warned", set())
    yield folder
    _forget()


def _forget() -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "kitchen"]:
        del sys.modules[name]
    source_key.cache_clear()
    source_hash.cache_clear()


def started() -> Any:
    """The kernel as the next run of a program has it."""
    _forget()
    importlib.invalidate_caches()
    return importlib.import_module("kitchen.kernel")


def loaded(function: Any) -> int:
    """How many times a compiled function was found instead of compiled."""
    return sum(function.stats.cache_hits.values())


def test_what_has_not_changed_is_compiled_once(kitchen: Path) -> None:
    first = started()
    assert (first.doubled(3), loaded(first.doubled)) == (6, 0)
    second = started()
    assert (second.doubled(3), loaded(second.doubled)) == (6, 1)


@pytest.mark.parametrize(("file", "text"), [("recipe", SLICES + "    #\n"), ("bread", "PER_TOAST = 1  # slice\n")])
def test_any_change_of_what_is_compiled_in_compiles_anew(kitchen: Path, file: str, text: str) -> None:
    assert started().doubled(3) == 6
    (kitchen / f"{file}.py").write_text(text)
    changed = started()
    assert (changed.doubled(3), loaded(changed.doubled)) == (6, 0)


def test_a_changed_number_two_files_away_counts_at_once(kitchen: Path) -> None:
    assert started().doubled(3) == 6
    (kitchen / "bread.py").write_text("PER_TOAST = 5\n")
    assert started().doubled(3) == 30


def test_nothing_is_written_beside_the_sources(kitchen: Path) -> None:
    started().doubled(3)
    assert sorted(path.name for path in kitchen.iterdir()) == ["__init__.py", "bread.py", "kernel.py", "recipe.py"]
    assert list(compiled.cache_folder().glob("kitchen-*/*/*.nbc"))


@pytest.mark.parametrize("what", ["a file", "nothing can be written", "no file can be made"])
def test_where_nothing_can_be_kept_it_still_runs_and_says_so_once(
    kitchen: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    """Also where the folder can be made, but numba can make no file in it, nor beside the sources, nor at home."""
    place = kitchen / "recipe.py" if what == "a file" else kitchen / what
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(place))
    if what == "nothing can be written":
        monkeypatch.setattr(os, "access", lambda *_: False)
    if what == "no file can be made":
        monkeypatch.setattr(tempfile, "TemporaryFile", lambda *_, **__: full())
    with pytest.warns(compiled.NotKept, match=f"cannot be kept in '{place}/teaching-lab' .*NUMBA_CACHE_DIR"):
        assert started().doubled(3) == 6
    assert started().doubled(3) == 6  # nothing is said any more, or this test fails
    assert loaded(started().doubled) == 0


def full() -> None:
    raise OSError(28, "No space left on device")


def test_what_was_kept_and_is_damaged_is_compiled_anew(kitchen: Path) -> None:
    started().doubled(3)
    for path in compiled.cache_folder().rglob("*.nb?"):
        path.write_bytes(path.read_bytes()[:40])
    with pytest.warns(compiled.NotKept, match="each run compiles anew"):
        assert started().doubled(3) == 6


def test_what_was_not_used_for_longest_goes(kitchen: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "MOST_FOLDERS", 3)
    older = [compiled.cache_folder() / name for name in ("oldest", "older", "old")]
    for second, folder in enumerate(older):
        folder.mkdir(parents=True)
        os.utime(folder, (second, second))
    started().doubled(3)
    left = sorted(folder.name.partition("-")[0] for folder in compiled.cache_folder().iterdir())
    assert left == ["kitchen", "old", "older"]


@pytest.mark.parametrize("package", ["kitchen", "mine"])
def test_a_change_of_the_lab_compiles_the_functions_of_others_anew(
    kitchen: Path, monkeypatch: pytest.MonkeyPatch, package: str
) -> None:
    """They may have functions of the lab compiled in; a module that lies in no package is kept by its own file."""
    (kitchen.parent / "mine.py").write_text("import kitchen.kernel\n")
    importlib.import_module("mine")
    started()
    before = source_key(package)
    monkeypatch.setattr(files, "source_hash", lambda *own: source_hash(*own) if own else "0" * 64)
    source_key.cache_clear()
    assert source_key(package) != before
    source_key.cache_clear()
