"""Whose the code of a member is, and whose fault an error is."""

from traceback import walk_tb

_modules: dict[str, str] = {}  # of others, by name: where they come from


def known_source(thing: object, source: str) -> None:
    """Note whose a member is."""
    _modules[getattr(thing, "__module__", type(thing).__module__)] = source


def blame(error: BaseException) -> str | None:
    """What failed in the code of others, in one line; None where it did not."""
    for frame, line in reversed([*walk_tb(error.__traceback__)]):
        source = _modules.get(frame.f_globals.get("__name__", ""))
        if source is not None:
            return f"the code of {source} failed in line {line}: {type(error).__name__}: {error}"
    return None
