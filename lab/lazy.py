"""Names of a module that are loaded when they are touched, by one table: where each is, once."""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def loader(module: str, table: Mapping[str, Sequence[str]]) -> Callable[[str], Any]:
    """A `__getattr__` for the module of that name.

    table: the names by the modules that define them; "run as run_task" is the name `run` there and `run_task` here. A module
    is loaded when one of its names is touched first. Beside the table stand the same imports under TYPE_CHECKING; a test holds
    them equal. The function raises AttributeError for a name that is not in the table.
    """
    places = {row.rpartition(" ")[2]: (where, row.partition(" ")[0]) for where, rows in table.items() for row in rows}

    def found(name: str) -> Any:
        if name not in places:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        where, there = places[name]
        return getattr(import_module(where), there)

    return found
