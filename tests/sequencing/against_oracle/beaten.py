"""The classes of cells of which something is said that the oracle beats, or a plan breaks a rule: what is left to be mended.

Each has a name and what a cell of it has. A drawn cell of no class is one of which everything has to hold; what is mended is
taken off this list, and its cells are then asked of, too.
"""

from collections.abc import Callable

from against_oracle.drawn import Raw, features

BEATEN: dict[str, Callable[[set[str]], bool]] = {
    "several robots on a track: a part is picked, and makes room, before its robot can set out": lambda has: (
        "track" in has
    ),
}


def classes(raw: Raw) -> list[str]:
    """The classes that a cell is of."""
    has = set(features(raw))
    return [name for name, is_of in BEATEN.items() if is_of(has)]
