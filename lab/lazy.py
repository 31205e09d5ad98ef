"""Lazy imports, by tables: libraries that take long to load, and names of a module that other modules define."""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import av
    import cv2
    import distributed
    import fsspec.core
    import gymnasium.spaces
    import h5py  # type: ignore[import-untyped]
    import jinja2
    import joblib
    import lark.exceptions
    import lark.parsers.earley_forest
    import matplotlib.artist
    import matplotlib.axes
    import matplotlib.backends.backend_agg
    import matplotlib.collections
    import matplotlib.colors
    import matplotlib.figure
    import matplotlib.font_manager
    import matplotlib.legend_handler
    import matplotlib.lines
    import matplotlib.patches
    import matplotlib.style
    import matplotlib.ticker
    import minari.data_collector
    import minari.storage
    import networkx  # type: ignore[import-untyped]
    import optuna
    import pandas
    import prompt_toolkit.application
    import prompt_toolkit.filters
    import prompt_toolkit.input
    import prompt_toolkit.key_binding
    import prompt_toolkit.output.vt100
    import prompt_toolkit.utils
    import psutil
    import pyarrow.parquet
    import pydantic
    import rich.console
    import rich.padding
    import rich.panel
    import rich.table
    import rich.text
    import scipy
    import sklearn.neural_network
    import statsmodels.regression.mixed_linear_model
    import tensorboard.compat.proto.event_pb2
    import tensorboard.compat.proto.summary_pb2
    import tensorboard.summary.writer.event_file_writer
    import threadpoolctl
    import torch
    import trimesh.voxel.ops
    import yaml

# library -> the modules that are loaded with it: `from lab.lazy import trimesh` stands for `import trimesh`, and loads it when
# one of its names is first used
LIBRARIES: Mapping[str, Sequence[str]] = {
    "av": ("av",),
    "cv2": ("cv2",),
    "distributed": ("distributed",),
    "fsspec": ("fsspec.core",),
    "gymnasium": ("gymnasium.spaces",),
    "h5py": ("h5py",),
    "jinja2": ("jinja2",),
    "joblib": ("joblib",),
    "lark": ("lark.exceptions", "lark.parsers.earley_forest"),
    "matplotlib": (
        "matplotlib.artist",
        "matplotlib.axes",
        "matplotlib.backends.backend_agg",
        "matplotlib.collections",
        "matplotlib.colors",
        "matplotlib.figure",
        "matplotlib.font_manager",
        "matplotlib.legend_handler",
        "matplotlib.lines",
        "matplotlib.patches",
        "matplotlib.style",
        "matplotlib.ticker",
    ),
    "minari": ("minari.data_collector", "minari.storage"),
    "networkx": ("networkx",),
    "optuna": ("optuna",),
    "pandas": ("pandas",),
    "prompt_toolkit": (
        "prompt_toolkit.application",
        "prompt_toolkit.filters",
        "prompt_toolkit.input",
        "prompt_toolkit.key_binding",
        "prompt_toolkit.output.vt100",
        "prompt_toolkit.utils",
    ),
    "psutil": ("psutil",),
    "pyarrow": ("pyarrow.parquet",),
    "pydantic": ("pydantic",),
    "rich": ("rich.console", "rich.padding", "rich.panel", "rich.table", "rich.text"),
    "scipy": ("scipy",),
    "sklearn": ("sklearn.neural_network",),
    "statsmodels": ("statsmodels.regression.mixed_linear_model",),
    "tensorboard": (
        "tensorboard.compat.proto.event_pb2",
        "tensorboard.compat.proto.summary_pb2",
        "tensorboard.summary.writer.event_file_writer",
    ),
    "threadpoolctl": ("threadpoolctl",),
    "torch": ("torch",),
    "trimesh": ("trimesh.voxel.ops",),
    "yaml": ("yaml",),
}


class Library(ModuleType):
    """A library of the table, which is imported when one of its names is first used."""

    def __getattr__(self, name: str) -> Any:
        return getattr(load(self), name)


def load(library: ModuleType) -> ModuleType:
    """The loaded library. Raises ImportError if it is not installed."""
    for module in LIBRARIES[library.__name__]:
        import_module(module)
    return import_module(library.__name__)


def loader(module: str, table: Mapping[str, Sequence[str]]) -> Callable[[str], Any]:
    """The `__getattr__` function of the module with that name.

    table: defining module -> names, its submodules among them; "run as run_task" is the name `run` there and `run_task` here.
    Each defining module is imported when one of its names is first used. The module repeats the imports under TYPE_CHECKING, and
    a test holds both equal. The returned function raises AttributeError for a name that is not in the table.
    """
    places = {row.rpartition(" ")[2]: (where, row.partition(" ")[0]) for where, rows in table.items() for row in rows}

    def attribute(name: str) -> Any:
        if name not in places:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        where, name_there = places[name]
        defining = import_module(where)
        return (
            getattr(defining, name_there) if hasattr(defining, name_there) else import_module(f"{where}.{name_there}")
        )

    return attribute


if not TYPE_CHECKING:
    globals().update({name: Library(name) for name in LIBRARIES})
