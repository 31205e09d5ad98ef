"""Files: where the shipped ones are; read within bounds; written whole or not at all; folders looked at before use."""

import hashlib
import json
import os
import re
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import EFBIG, EINVAL
from functools import cache
from importlib.util import find_spec
from math import isfinite
from pathlib import Path
from secrets import token_hex
from shutil import rmtree
from typing import Any

from lab.errors import BadInput, WorkFailed
from lab.operating_system import lock, lock_file, opened, replace

PACKAGE = Path(__file__).resolve().parent
MOST_BYTES = 256 << 20  # of any file that is read; most kinds have a lower limit of their own


def tasks_folder() -> Path:
    """The folder of the task files that ship (`*.toml`); raises WorkFailed when the installation lost it."""
    return find("tasks", PACKAGE)


def assets_folder() -> Path:
    """The folder of the shipped URDFs and meshes; raises WorkFailed when the installation lost it."""
    return find("assets", PACKAGE)


def pybullet_data_folder() -> Path:
    """The folder of the models that PyBullet's package brings; raises WorkFailed when the installation lost it."""
    spec = find_spec("pybullet_data")
    for folder in (spec.submodule_search_locations or []) if spec else []:
        return Path(folder)
    raise WorkFailed("PyBullet's own models (its package 'pybullet_data') are not installed: reinstall 'pybullet'")


def find(name: str, package: Path) -> Path:
    """The data folder `name` of the package folder `package`; raises WorkFailed naming the two places it looked in.

    A folder beside the package counts only next to a `pyproject.toml`: beside an installed package any `tasks` folder
    would be somebody else's.
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
    """A hash (64 hex digits) of every Python source of a package, by its place in it; a single file is a package of its own.

    What is computed once and kept, such as measured durations and compiled functions, is kept under this hash: whatever
    source may have decided it is in it. Raises WorkFailed when there is no source, or one cannot be read.
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
    """The name of a loaded module's package, or of one that lies in none, with hashes of all of its source and of the lab's.

    Raises WorkFailed when there is no source.
    """
    package = module.partition(".")[0]
    file = Path(str(sys.modules[package].__file__))
    own = source_hash(file.parent if file.name == "__init__.py" else file)
    return f"{package}-{own[:16]}-{source_hash()[:16]}"


def read_limited(path: Path, most: int = MOST_BYTES) -> bytes:
    """All bytes of a file. Raises OSError, its reason in words, also for no regular file and for more than `most` bytes."""
    if path.exists() and not path.is_file():
        raise OSError(EINVAL, "it is no regular file", str(path))
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        content = file.read(most + 1) if size <= most else b""
        if max(size, len(content)) > most:
            raise OSError(EFBIG, f"it has {max(size, len(content))} bytes, allowed are {most}", str(path))
        return content


def json_of(content: str | bytes) -> Any:
    """What JSON holds, as its standard has it, without NaN and infinities. ValueError for anything else."""
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


_DRAFT = re.compile(r"\.run-\w{8}")  # the folder of a draft
_LOCK = ".lock"  # the ending of the file beside it that is locked while somebody writes in it


def write_whole(path: Path, content: bytes, drafts: Path | None = None) -> None:
    """Writes beside the target, or in the folder `drafts` next to it, then renames: readers never see half a file.

    What killed commands left of the same file goes. The folders must be there. Raises OSError when it cannot be written;
    then nothing is left behind.
    """
    folder = drafts or path.parent
    _clear_drafts(folder, path.name)
    while True:
        beside = folder / f".{path.name}.{token_hex(4)}.tmp"
        try:
            with beside.open("xb") as file:
                with suppress(OSError):  # where nothing can be locked, nothing is taken for one that was left
                    lock(file.fileno())
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            try:
                replace(beside, path)
                return
            except FileNotFoundError:
                if beside.exists():
                    raise
                # another process has taken it for one that was left: once more
        except BaseException:
            with suppress(OSError):
                beside.unlink(missing_ok=True)
            raise


def _clear_drafts(folder: Path, name: str) -> None:
    """Removes the drafts of a file whose writers are gone: nobody holds their lock."""
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
    """The folder itself or the next one above it that is there; what is made in `folder` is made in it.

    Raises OSError for a name that cannot be.
    """
    place = folder
    while not place.exists() and place != place.parent:
        place = place.parent
    return place


def check_out(out: Path) -> None:
    """BadInput unless `out` is a folder that can be written, or can be made; makes nothing."""
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
    """A hidden folder in `folder` for files that are not finished, gone in the end; those that killed ones left go, too.

    One that another process still writes in stays: its writer has locked the file beside it. Raises OSError.
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
    """Whether there is such a file; also False for what can be no file's name."""
    return os.path.isfile(path)


def within(folder: Path, name: str, beside: Path | None = None) -> Path | None:
    """What a name out of a file means, seen from `beside` or `folder`; None where that leads out of `folder`, or is no name."""
    try:
        found = ((beside or folder) / name).resolve()
    except (OSError, ValueError):
        return None
    return found if folder.resolve() in found.parents else None


def beside_or_asset(name: str, folder: Path, what: str) -> Path:
    """A file that a task file names, in the task file's folder or below it, else in the lab's own assets.

    BadInput, beginning with `what`, when it is in neither, or when the name leads out of the folder.
    """
    for place in (folder, assets_folder()):
        found = within(place, name)
        if found is None:
            raise BadInput(f"{what} '{name}': a file's name may not lead out of the task file's folder")
        if is_file(found):
            return found
    known = ", ".join(sorted(path.name for path in assets_folder().glob("*.urdf")))
    raise BadInput(f"{what} '{name}': no such file in {folder}; of its own the lab has {known}")
