"""Functions compiled with numba and kept between runs, under a hash of every source that may be compiled in.

numba's own cache knows changes of the function's file only, and writes beside it. Here compiled functions lie in the
user's cache, in a folder that is named by a hash of the function's whole package. Where that folder cannot be made or
written, nothing is kept: each run compiles anew, and says so.
"""

import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from errno import EACCES
from pathlib import Path
from shutil import rmtree
from types import FunctionType
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache
from platformdirs import user_cache_dir

from lab.errors import Notice, WorkFailed
from lab.files import source_key

MOST_FOLDERS = 6  # versions of packages whose compiled functions are kept, each of a few tens of MB
_WITHOUT_REFCOUNTS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
_CONFIG: Any = numba.config  # its types do not know what it holds
Function = TypeVar("Function", bound=Callable[..., Any])


class NotKept(Notice):
    """Compiled functions cannot be kept, or what was kept cannot be read: each run compiles anew."""


class _Kept(FunctionCache):
    """A function's kept versions; one that cannot be read or written is one that is not there."""

    @contextmanager
    def _guard_against_spurious_io_errors(self) -> Iterator[None]:
        """Around every reading and writing, in numba's own words."""
        try:
            yield
        except Exception as error:  # a damaged file: pickle raises anything
            _not_kept(Path(self.cache_path).parents[1], error)


def compiled(function: Function, **options: Any) -> Function:
    """The function compiled, without the GIL, for each kind of arguments that it meets; options: those of `numba.njit`."""
    jit: Any = numba.njit  # its types do not know all options
    jitted: Any = jit(nogil=True, **options)(function)
    kept, before = cache_folder(), _CONFIG.CACHE_DIR
    try:
        folder = kept / source_key(function.__module__)
        _CONFIG.CACHE_DIR = str(folder)  # read when the cache is made
        _make(folder)
        jitted._cache = cast(Any, _Kept)(function)
    except (OSError, RuntimeError, WorkFailed) as error:  # numba's, of a folder in which no file can be made
        _not_kept(kept, error)
    finally:
        _CONFIG.CACHE_DIR = before
    made: Function = jitted
    return made


_said: set[Path] = set()


def _not_kept(kept: Path, error: Exception) -> None:
    """Says, once of each cache folder, that nothing is kept there."""
    if kept in _said:
        return
    _said.add(kept)
    why = getattr(error, "strerror", None) or " ".join(str(error).split())[:100] or type(error).__name__
    warnings.warn(
        f"what is compiled cannot be kept in '{kept}' ({why}): each run compiles anew, which takes seconds; "
        "the variable NUMBA_CACHE_DIR names another folder",
        NotKept,
        stacklevel=2,
    )


def without_refcounts(function: Function, **options: Any) -> Function:
    """The function compiled by njit without reference counting; it must not allocate arrays."""
    return compiled(function, **_WITHOUT_REFCOUNTS, **options)


def inner(function: Function, **options: Any) -> Function:
    """The function compiled as part of functions without reference counting, the only ones that call it: it is not kept, and
    Python cannot call it.

    What Python would need to call it takes a third of the time to compile.
    """
    jit: Any = numba.njit
    jitted: Function = jit(nogil=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **_WITHOUT_REFCOUNTS, **options)(
        function
    )
    return jitted


def inlined(function: Function) -> Function:
    """The function as `inner`, inlined: for what is called in every step, so that handing records on costs nothing."""
    return inner(function, forceinline=True)


def cache_folder() -> Path:
    """The folder "compiled" in the user's cache folder, or "teaching-lab" in NUMBA_CACHE_DIR where that is set."""
    if _CONFIG.CACHE_DIR:
        return Path(_CONFIG.CACHE_DIR, "teaching-lab")
    return Path(user_cache_dir("teaching-lab", appauthor=False), "compiled")


def linked(function: Function, **called: Any) -> Function:
    """A plain function that calls, by these names, compiled functions in place of the plain ones of its module."""
    made: Any = FunctionType(function.__code__, function.__globals__ | called, function.__name__, function.__defaults__)
    linked: Function = made
    return linked


def _make(folder: Path) -> None:
    """Makes the folder, or marks it as used now; the oldest beyond MOST_FOLDERS go. Raises OSError when it cannot be written."""
    try:
        if not folder.is_dir():
            folder.mkdir(parents=True)
            _clear(folder.parent)
        os.utime(folder)
    except FileExistsError:
        if not folder.is_dir():  # it is not another process that has just made it
            raise
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(EACCES, os.strerror(EACCES), str(folder))


def _clear(parent: Path) -> None:
    """Removes the folders that have not been used for longest; whoever still needs one compiles again."""
    with suppress(OSError):
        used = sorted((folder.stat().st_mtime, folder) for folder in parent.iterdir() if folder.is_dir())
        for _, folder in used[:-MOST_FOLDERS]:
            rmtree(folder, ignore_errors=True)
