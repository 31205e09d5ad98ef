"""OR-Tools' `cp_model`, loaded without pandas, which takes twice as long as the rest of it and serves only its `*_series`."""

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from lab.optional import optional

__all__ = ["cp_model"]

AT_ONCE = ("Index", "Series")  # what `cp_model` looks up in pandas while it is loaded, for annotations


class LazyPandas(ModuleType):
    """Stands for pandas while `cp_model` is loaded, and in it from then on: what is looked up in it is looked up in pandas.

    What `cp_model` looks up at once is dropped afterwards, so that a method that takes a series meets the true classes.
    """

    def __getattr__(self, name: str) -> Any:
        if sys.modules.get("pandas") is self:  # more is looked up at once
            del sys.modules["pandas"]
        with optional("a series in a model of CP-SAT"):
            import pandas

        return getattr(pandas, name)


def _without_pandas() -> ModuleType:
    """`cp_model`. `sys.modules` is left as if nobody had asked for pandas."""
    import numpy  # noqa: F401  # first, as the helper is, so that the stand-in is there for a moment only
    from ortools.sat.python import cp_model_helper  # noqa: F401

    lazy = LazyPandas("pandas")
    vars(lazy).update({name: type(name, (), {}) for name in AT_ONCE})
    sys.modules["pandas"] = lazy
    try:
        from ortools.sat.python import cp_model
    finally:
        if sys.modules.get("pandas") is lazy:
            del sys.modules["pandas"]
        for name in AT_ONCE:
            delattr(lazy, name)
    return cp_model


if TYPE_CHECKING or "pandas" in sys.modules:
    from ortools.sat.python import cp_model
else:
    cp_model = _without_pandas()
