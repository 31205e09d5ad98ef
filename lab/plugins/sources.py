"""Whose the code of a member is, and whose fault an error is."""

from dataclasses import is_dataclass
from traceback import walk_tb

OWN = "package 'teaching-lab'"  # its faults keep their traceback
_modules: dict[str, str] = {}  # of others, by name: where they come from


def known_source(thing: object, source: str) -> None:
    """Note whose the code of a member is. In a record of the lab, such as a `Study`, that is the code of its functions."""
    if source == OWN:
        return
    for one in (thing, *vars(thing).values()) if is_dataclass(thing) else (thing,):
        module = getattr(one, "__module__", type(one).__module__)
        if module.partition(".")[0] != "lab":
            _modules[module] = source


def blame(error: BaseException) -> str | None:
    """What failed in the code of others, in one line; None where it did not."""
    for frame, line in reversed([*walk_tb(error.__traceback__)]):
        source = _modules.get(frame.f_globals.get("__name__", ""))
        if source is not None:
            return f"the code of {source} failed in line {line}: {type(error).__name__}: {error}"
    return None
