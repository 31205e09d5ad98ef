"""Optional libraries: if one is missing, a one-line error says what to install."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from types import ModuleType

from lab.errors import BadInput, out_of_memory
from lab.lazy import load

EXTRAS = {  # extra in pyproject.toml -> the optional libraries that it installs, by their import names
    "dask": ("distributed",),
    "data": ("h5py", "minari", "pandas", "tensorboard"),
    "deep": ("torch",),
    "people": ("pyarrow", "statsmodels"),
    "recordings": ("av", "pyarrow", "sklearn", "threadpoolctl"),
    "remote": ("fsspec", "s3fs"),
    "tune": ("optuna",),
}


@contextmanager
def optional(use: str, extra: str | None = None) -> Iterator[None]:
    """A block that imports an optional library; raises BadInput, which says what to install, if an import fails.

    use: what the user asked for, such as "--dask 127.0.0.1:8786". extra: what installs all that it needs, of the extras that
    bring the missing library; by default the first of them.
    """
    try:
        yield
    except ImportError as error:
        if out_of_memory(error):
            raise
        library = _missing(error)
        if library is None:
            raise BadInput(f"{use}: a library that it needs cannot be loaded: {error}") from None
        bringing = [name for name, libraries in EXTRAS.items() if library in libraries]
        extra = extra if extra in bringing else next(iter(bringing), None)
        command = f"pip install '.[{extra}]' in a checkout of the lab" if extra else f"pip install {library}"
        raise BadInput(f"{use}: the library '{library}' is not installed: {command}") from None


def require(use: str, *libraries: ModuleType, extra: str | None = None) -> None:
    """Loads libraries of `lab.lazy`; raises BadInput as `optional` does."""
    with optional(use, extra):
        for library in libraries:
            load(library)


def require_extra(use: str, extra: str) -> None:
    """Raises BadInput, as `optional` does, unless all libraries of an extra are installed; loads none of them."""
    with optional(use, extra):
        for library in EXTRAS[extra]:
            if find_spec(library) is None:
                raise ModuleNotFoundError(name=library)


def _missing(error: BaseException | None) -> str | None:
    """The library whose import failed, according to the error or one of its causes; None if none of them names one."""
    while error is not None:
        if isinstance(error, ModuleNotFoundError) and error.name:
            return error.name.partition(".")[0]
        error = error.__cause__ or error.__context__
    return None
