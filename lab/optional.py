"""Libraries that the lab uses where they are installed: where one is not, what to install is said in one line."""

from collections.abc import Iterator
from contextlib import contextmanager

from lab.errors import BadInput, out_of_memory

EXTRAS = {  # extra of pyproject.toml -> the optional libraries that it brings, by the names they are imported under
    "dask": ("distributed",),
    "data": ("h5py", "minari", "pandas", "tensorboard"),
    "remote": ("fsspec", "s3fs"),
    "tune": ("optuna",),
}


@contextmanager
def optional(use: str) -> Iterator[None]:
    """What is done inside needs an optional library. BadInput when it, or what it needs itself, cannot be imported.

    use: what was asked for, such as "--dask 127.0.0.1:8786". The message says what to install.
    """
    try:
        yield
    except ImportError as error:
        if out_of_memory(error):
            raise
        library = _missing(error)
        if library is None:
            raise BadInput(f"{use}: a library that it needs cannot be loaded: {error}") from None
        extra = next((name for name, libraries in EXTRAS.items() if library in libraries), None)
        command = f"pip install '.[{extra}]' in a checkout of the lab" if extra else f"pip install {library}"
        raise BadInput(f"{use}: the library '{library}' is not installed: {command}") from None


def _missing(error: BaseException | None) -> str | None:
    """The library that an error, or one that it comes from, did not find; None: no library is said to be missing."""
    while error is not None:
        if isinstance(error, ModuleNotFoundError) and error.name:
            return error.name.partition(".")[0]
        error = error.__cause__ or error.__context__
    return None
