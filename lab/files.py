"""Files: those that ship, keys of source, bounded reading, atomic writing, drafts and locks, checks of output folders."""

import ast
import csv
import hashlib
import json
import os
import re
import stat
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from errno import EFBIG, EINVAL
from functools import cache
from importlib.util import find_spec
from io import StringIO
from math import isfinite
from pathlib import Path
from secrets import token_hex
from shutil import rmtree
from sysconfig import get_paths
from typing import Any

from lab.errors import BadInput, WorkFailed
from lab.operating_system import lock, lock_file, opened, replace

PACKAGE = Path(__file__).resolve().parent
MOST_BYTES = 256 << 20  # of any file that is read; most file formats have a lower limit of their own


def tasks_folder() -> Path:
    """The folder of the task files that ship (`*.toml`); raises WorkFailed if it is missing."""
    return find("tasks", PACKAGE)


def assets_folder() -> Path:
    """The folder of the shipped URDFs and meshes; raises WorkFailed if it is missing."""
    return find("assets", PACKAGE)


def pybullet_data_folder() -> Path:
    """The folder of the models in PyBullet's package; raises WorkFailed if it is missing."""
    spec = find_spec("pybullet_data")
    for folder in (spec.submodule_search_locations or []) if spec else []:
        return Path(folder)
    raise WorkFailed("PyBullet's own models (its package 'pybullet_data') are not installed: reinstall 'pybullet'")


def find(name: str, package: Path) -> Path:
    """The data folder `name` of a package: inside the package (installed), or beside it (checkout).

    A folder beside the package counts only if a `pyproject.toml` is there too; beside an installed package it would belong to
    something else. Raises WorkFailed, which names both places, if there is none.
    """
    wheel, checkout = package / "_data" / name, package.parent / name
    if wheel.is_dir():
        return wheel
    if checkout.is_dir() and (package.parent / "pyproject.toml").is_file():
        return checkout
    raise WorkFailed(
        f"the lab's own '{name}' folder is missing: looked for {wheel} and {checkout}; install the lab again"
    )


@cache
def source_hash(package: Path = PACKAGE) -> str:
    """The SHA-256 (64 hex digits) of the paths and contents of all Python files in a package folder, or of one file.

    Caches, such as those of measured durations and compiled functions, use it as a key, so that any change of the source
    invalidates them. Raises WorkFailed if there is no source, or if a file cannot be read.
    """
    digest, paths = hashlib.sha256(), [package] if package.is_file() else sorted(package.rglob("*.py"))
    if not paths:
        raise WorkFailed(f"no Python source is in '{package}'")
    for path in paths:
        try:
            text = read_limited(path)
        except OSError as error:
            raise WorkFailed(f"source '{path}' cannot be read: {error.strerror}") from None
        digest.update(f"{path.relative_to(package).as_posix()} {len(text)} ".encode() + text)
    return digest.hexdigest()


@cache
def source_key(module: str) -> str:
    """A cache key for a loaded module: the name of its top-level package or module, a hash of that source, a hash of the lab's.

    Raises WorkFailed if there is no source.
    """
    package = module.partition(".")[0]
    file = Path(str(sys.modules[package].__file__))
    own = source_hash(file.parent if file.name == "__init__.py" else file)
    return f"{package}-{own[:16]}-{source_hash()[:16]}"


@cache
def code_key(*modules: str) -> str:
    """A key of own code: the first 16 hex digits of a SHA-256 over the source of modules and of what they import; "" for none.

    A module counts with its whole top-level package. Imports are followed, also those in functions, until one leads to the lab or
    to an installed package. What code reads from other files is not part of the key. Raises BadInput for a module without a
    source file.
    """
    own = {name.partition(".")[0] for name in modules}
    digest, waiting, seen = hashlib.sha256(), sorted(own), set[str]()
    while waiting:
        name = waiting.pop()
        file = _file_of(name)
        if file is None and name in own:
            raise BadInput(f"module '{name}': it has no source file, so that no result can be kept under its name")
        if file is None or name in seen or name == PACKAGE.name or (name not in own and _is_installed(file)):
            continue
        seen.add(name)
        whole = file.parent if file.name == "__init__.py" else file
        digest.update(f"{name} {source_hash(whole)} ".encode())
        if not _is_installed(file):
            waiting += sorted(_imported(whole))
    return digest.hexdigest()[:16] if modules else ""


def _file_of(name: str) -> Path | None:
    """The Python file of a top-level module, loaded or not, None if it has none; none of its code runs."""
    if name in sys.modules:
        file = getattr(sys.modules[name], "__file__", None)
    else:
        try:
            spec = find_spec(name)
        except (ImportError, AttributeError, ValueError):
            return None
        file = None if spec is None else spec.origin
    return Path(file).resolve() if file and file.endswith(".py") else None


def _is_installed(file: Path) -> bool:
    installed = {get_paths()[name] for name in ("stdlib", "platstdlib", "purelib", "platlib")}
    return any(file.is_relative_to(Path(folder).resolve()) for folder in installed)


def _imported(whole: Path) -> Iterator[str]:
    """The top-level names of all modules that the files of a package, or a file, may import."""
    for file in [whole] if whole.is_file() else whole.rglob("*.py"):
        try:
            tree = ast.parse(read_limited(file))
        except (OSError, SyntaxError, ValueError):  # such a file cannot be imported either
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                yield from (alias.name.partition(".")[0] for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                yield node.module.partition(".")[0]


def read_limited(path: Path, most: int = MOST_BYTES) -> bytes:
    """The bytes of a file. Raises OSError if it cannot be read, is no regular file, or has more than `most` bytes."""
    if path.exists() and not path.is_file():
        raise OSError(EINVAL, "it is no regular file", str(path))
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        content = file.read(most + 1) if size <= most else b""
        if max(size, len(content)) > most:
            raise OSError(EFBIG, f"it has {max(size, len(content))} bytes, allowed are {most}", str(path))
        return content


def json_of(content: str | bytes) -> Any:
    """The value of a JSON text. Raises ValueError for anything that the standard excludes, NaN and infinities among it."""
    try:
        return json.loads(content, parse_constant=_reject_constant, parse_float=_finite)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def _reject_constant(text: str) -> None:
    raise ValueError(f"{text} is not allowed")


def _finite(text: str) -> float:
    if not isfinite(number := float(text)):
        raise ValueError(f"{text[:40]} is too large a number")
    return number


_DRAFT = re.compile(r"\.run-\w{8}")  # the name of a draft folder
_LOCK = ".lock"  # suffix of the file beside a draft folder that is locked while the draft is in use


def write_whole(path: Path, content: bytes, drafts: Path | None = None) -> None:
    """Writes a file atomically: first a draft, beside it or in `drafts` (on the same file system), which is then renamed.

    Drafts of the same file that killed processes left are removed. The folders must exist. Raises OSError if the file cannot be
    written, and then leaves no draft.
    """
    folder = drafts or path.parent
    _clear_drafts(folder, path.name)
    while True:
        draft_path = folder / f".{path.name}.{token_hex(4)}.tmp"
        try:
            with draft_path.open("xb") as file:
                with suppress(OSError):  # a file system without locks: no process removes drafts there
                    lock(file.fileno())
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            try:
                replace(draft_path, path)
                return
            except FileNotFoundError:
                if draft_path.exists():
                    raise
                # another process took the draft for an abandoned one and removed it: try again
        except BaseException:
            with suppress(OSError):
                draft_path.unlink(missing_ok=True)
            raise


def _clear_drafts(folder: Path, name: str) -> None:
    """Removes the abandoned drafts of a file: those whose lock no process holds."""
    draft_of = re.compile(rf"\.{re.escape(name)}\.[0-9a-f]{{8}}\.tmp")
    with suppress(OSError), os.scandir(folder) as entries:
        for left in [Path(entry) for entry in entries if draft_of.fullmatch(entry.name)]:
            with suppress(OSError):
                if stat.S_ISREG(left.lstat().st_mode):
                    file = opened(left, os.O_RDWR, follow=False)
                    try:
                        lock(file, wait=False)
                    finally:
                        os.close(file)
                    left.unlink()


def nearest(folder: Path) -> Path:
    """The deepest existing folder among `folder` and its parents. Raises OSError for an invalid name."""
    place = folder
    while not place.exists() and place != place.parent:
        place = place.parent
    return place


def check_out(out: Path) -> None:
    """Raises BadInput unless `out` is a writable folder, or one that could be created; creates nothing."""
    try:
        place = nearest(out)
    except OSError as error:
        raise BadInput(f"output folder '{out}' (--out): {error.strerror}") from None
    if not place.is_dir():
        raise BadInput(f"output folder '{out}' (--out): '{place}' is a file; give a folder")
    if not os.access(place, os.W_OK | os.X_OK):
        raise BadInput(f"output folder '{out}' (--out): '{place}' is not writable")


@contextmanager
def draft(folder: Path) -> Iterator[Path]:
    """A hidden folder inside `folder` for unfinished files, removed at the end.

    Draft folders that killed processes left are removed as well; one that another process still uses is locked, by a file beside
    it, and stays. Raises OSError if the folder cannot be created.
    """
    for left in {folder / path.name.removesuffix(_LOCK) for path in folder.iterdir()}:
        if _DRAFT.fullmatch(left.name):
            with suppress(OSError), lock_file(left.with_name(left.name + _LOCK), wait=False):
                rmtree(left)
    made = folder / f".run-{token_hex(4)}"
    with lock_file(made.with_name(made.name + _LOCK)):
        made.mkdir(0o700)
        try:
            yield made
        finally:
            rmtree(made, ignore_errors=True)


def is_file(path: Path | str) -> bool:
    """Whether the file exists; False also for a name that no file can have."""
    return os.path.isfile(path)


def within(folder: Path, name: str, beside: Path | None = None) -> Path | None:
    """The path that a name in a file means, relative to `beside` (default: `folder`).

    None if the path leads out of `folder`, or if no file can have that name.
    """
    try:
        path = ((beside or folder) / name).resolve()
    except (OSError, ValueError):
        return None
    return path if folder.resolve() in path.parents else None


def beside_or_asset(name: str, folder: Path, what: str) -> Path:
    """The path of a file that a task file names: in the task file's folder or below it, otherwise among the lab's assets.

    Raises BadInput, which begins with `what`, if it is in neither, or if the name leads out of the folder.
    """
    for place in (folder, assets_folder()):
        inside = within(place, name)
        if inside is None:
            raise BadInput(f"{what} '{name}': a file's name may not lead out of the task file's folder")
        if is_file(inside):
            return inside
    known = ", ".join(sorted(path.name for path in assets_folder().glob("*.urdf")))
    raise BadInput(f"{what} '{name}': no such file in {folder}; of its own the lab has {known}")


def csv_of(rows: Iterable[Mapping[str, object]], columns: Sequence[str]) -> str:
    """The rows as the text of a CSV file with these columns. Raises ValueError for a row with another key."""
    text = StringIO()
    table = csv.DictWriter(text, columns, lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()
