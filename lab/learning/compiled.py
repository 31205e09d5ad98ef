"""Functions compiled with numba and cached between runs, under a hash of all source that they may depend on.

numba's own cache notices changes of the function's own file only, and writes beside it. Here the cache is a folder in the user's
cache, named by a hash of the function's whole package. If it cannot be written, each run compiles anew, and a warning says so.
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
from numba.core.errors import NumbaError
from platformdirs import user_cache_dir

from lab.errors import Notice, WorkFailed
from lab.files import source_key

MOST_FOLDERS = 6  # versions of packages whose compiled functions are kept, each of a few tens of MB
_WITHOUT_REFCOUNTS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
_CONFIG: Any = numba.config  # typed as Any, because its type stubs lack the attributes
NotCompilable = NumbaError  # raised when a function with new argument types cannot be compiled
Function = TypeVar("Function", bound=Callable[..., Any])


class NotKept(Notice):
    """The warning that compiled functions cannot be cached, or a cached one cannot be read, so that each run compiles anew."""


class _Kept(FunctionCache):
    """A function's cache; an entry that cannot be read or written counts as missing."""

    @contextmanager
    def _guard_against_spurious_io_errors(self) -> Iterator[None]:
        """Surrounds every read and write; the name is numba's."""
        try:
            yield
        except Exception as error:  # a damaged file: pickle raises anything
            _not_kept(Path(self.cache_path).parents[1], error)


def compiled(function: Function, **options: Any) -> Function:
    """The function compiled by `numba.njit`, without the GIL, for each combination of argument types; options: those of njit."""
    jit: Any = numba.njit  # its types do not know all options
    jitted: Any = jit(nogil=True, **options)(function)
    kept, before = cache_folder(), _CONFIG.CACHE_DIR
    try:
        folder = kept / source_key(function.__module__)
        _CONFIG.CACHE_DIR = str(folder)  # read when the cache is made
        _make(folder)
        jitted._cache = cast(Any, _Kept)(function)
    except (
        OSError,
        RuntimeError,
        WorkFailed,
    ) as error:  # a RuntimeError is numba's, if no file can be created in the folder
        _not_kept(kept, error)
    finally:
        _CONFIG.CACHE_DIR = before
    made: Function = jitted
    return made


_warned: set[Path] = set()


def _not_kept(kept: Path, error: Exception) -> None:
    """Warns, once per cache folder, that nothing can be cached there."""
    if kept in _warned:
        return
    _warned.add(kept)
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


def not_kept(function: Function) -> Function:
    """The function compiled without reference counting for this process only, because its arguments are functions."""
    jit: Any = numba.njit
    jitted: Function = jit(nogil=True, **_WITHOUT_REFCOUNTS)(getattr(function, "py_func", function))
    return jitted


def inner(function: Function, **options: Any) -> Function:
    """The function compiled for calls from other functions without reference counting only.

    Python cannot call it and it is not cached by itself; leaving out the wrapper for Python saves a third of the compile time.
    """
    jit: Any = numba.njit
    given = _WITHOUT_REFCOUNTS | options
    jitted: Function = jit(nogil=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **given)(function)
    return jitted


def compiled_rule(rule: Function, arguments: tuple[Any, ...]) -> tuple[Function, bool]:
    """A rule of other code, compiled as `inner` for arguments like these; the second value is whether it returns a bool.

    It raises the errors of Python, as for a division by zero. Raises any exception if it cannot be compiled.
    """
    jitted: Any = inner(rule, boundscheck=True, error_model="python")
    jitted.compile(types_of(arguments))
    jitted.disable_compile()  # what it returns for others is not known
    (signature,) = jitted.nopython_signatures
    types: Any = numba.types
    made: Function = jitted
    return made, types.unliteral(signature.return_type) == types.boolean


def types_of(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """The types as which a compiled function takes these arguments."""
    return tuple(map(numba.typeof, arguments))


def inlined(function: Function) -> Function:
    """The function compiled as `inner` and inlined, for calls in every step: passing records then costs nothing."""
    return inner(function, forceinline=True)


def cache_folder() -> Path:
    """The cache folder: "compiled" in the user's cache folder, or "teaching-lab" in NUMBA_CACHE_DIR if that is set."""
    if _CONFIG.CACHE_DIR:
        return Path(_CONFIG.CACHE_DIR, "teaching-lab")
    return Path(user_cache_dir("teaching-lab", appauthor=False), "compiled")


def linked(function: Function, **called: Any) -> Function:
    """A copy of a plain function in which these names refer to compiled functions instead of the plain ones of its module."""
    made: Any = FunctionType(function.__code__, function.__globals__ | called, function.__name__, function.__defaults__)
    linked: Function = made
    return linked


def _make(folder: Path) -> None:
    """Creates the folder or marks it as just used; removes the oldest beyond MOST_FOLDERS. Raises OSError if not writable."""
    try:
        if not folder.is_dir():
            folder.mkdir(parents=True)
            _clear(folder.parent)
        os.utime(folder)
    except FileExistsError:
        if not folder.is_dir():  # otherwise another process has just created it
            raise
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(EACCES, os.strerror(EACCES), str(folder))


def _clear(parent: Path) -> None:
    """Removes the least recently used folders; a process that still needs one compiles again."""
    with suppress(OSError):
        used = sorted((folder.stat().st_mtime, folder) for folder in parent.iterdir() if folder.is_dir())
        for _, folder in used[:-MOST_FOLDERS]:
            rmtree(folder, ignore_errors=True)
