"""Lazy names of a module: a table says which module defines each name, and the first use of the name imports it."""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def loader(module: str, table: Mapping[str, Sequence[str]]) -> Callable[[str], Any]:
    """The `__getattr__` function of the module with that name.

    table: defining module -> names; "run as run_task" is the name `run` name_there and `run_task` here. Each defining module is
    imported when one of its names is first used. The module repeats the imports under TYPE_CHECKING, and a test holds both
    equal. The returned function raises AttributeError for a name that is not in the table.
    """
    places = {row.rpartition(" ")[2]: (where, row.partition(" ")[0]) for where, rows in table.items() for row in rows}

    def attribute(name: str) -> Any:
        if name not in places:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        where, name_there = places[name]
        return getattr(import_module(where), name_there)

    return attribute
