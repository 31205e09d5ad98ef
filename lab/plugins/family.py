"""A family: the table of its members that ship, and what other packages add to it by entry points."""

import warnings
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from dataclasses import is_dataclass
from traceback import walk_tb
from typing import Any, TypeVar

from lab.errors import BadInput, Notice

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


# ---- family -----------------------------------------------------------------------------------------------------------


GROUP = "teaching_lab"  # entry points of the family "gates" are in the group "teaching_lab.gates"

Row = TypeVar("Row")


class PluginFault(Notice):
    """What is wrong with a member that another package adds; it is left out."""


class Family(MutableMapping[str, Row]):
    """Members by name: those that ship, then those of other packages, which are loaded where they are first asked for.

    An entry point gives one member, called by its name, or a mapping of names to members.

    kind: "gates" and so on; adopt: makes a row of what somebody else's code gives, BadInput for what is none.
    A name that ships is found without looking at other packages. One that is faulty, or whose name is taken, is told in a
    `PluginFault` and left out.
    """

    def __init__(self, kind: str, rows: Mapping[str, Row], adopt: Callable[[str, Any], Row]):
        self.kind, self._rows, self._adopt = kind, dict(rows), adopt
        self._complete = False
        self._used: dict[str, Row] = {}

    def __getitem__(self, name: str) -> Row:
        if name in self._used:
            return self._used[name]
        if name not in self._rows:
            self._look()
        return self._rows[name]

    def __setitem__(self, name: str, row: Row) -> None:
        self._rows[name] = row

    def __delitem__(self, name: str) -> None:
        del self._rows[name]

    def __iter__(self) -> Iterator[str]:
        self._look()
        return iter(dict(self._rows))

    def __len__(self) -> int:
        self._look()
        return len(self._rows)

    def __contains__(self, name: object) -> bool:
        if name not in self._rows and name not in self._used:
            self._look()
        return name in self._rows or name in self._used

    def adopted(self, name: str, thing: Any, source: str) -> None:
        """Take in a member; BadInput for what is none, and for a name that another one has."""
        if name in self._rows:
            raise BadInput(f"the name '{name}' is taken")
        self._rows[name] = self._adopt(name, thing)
        known_source(thing, source)

    def named(self, thing: Any) -> Any:
        """The name of a class that is used in Python (see `use`); anything else as it is."""
        return self.use(thing.__name__, thing) if isinstance(thing, type) else thing

    def use(self, name: str, thing: Any) -> str:
        """Let something be found under a name that is not listed; the name. BadInput for what is no member."""
        self._used[name] = self._adopt(name, thing)
        return name

    def _look(self) -> None:
        """Take in what installed packages add."""
        if self._complete:
            return
        self._complete = True
        from importlib.metadata import entry_points

        for point in entry_points(group=f"{GROUP}.{self.kind}"):
            package = point.dist.name if point.dist is not None else "?"
            name = point.name
            try:
                thing = point.load()
                members = thing if isinstance(thing, Mapping) else {name: thing}
                for name, member in members.items():
                    self.adopted(name, member, f"package '{package}'")
            except (Exception, SystemExit) as error:
                why = str(error) if isinstance(error, BadInput) else f"{type(error).__name__}: {error}"
                what = f"{self.kind}: '{name}' of package '{package}' ({point.value}) is left out: {why}"
                warnings.warn(what, PluginFault, stacklevel=2)


def first_line(thing: Any) -> str:
    """What a member's own text says of it, in one line."""
    return ((thing.__doc__ or "").strip() or getattr(thing, "__name__", str(thing))).splitlines()[0].rstrip(".")


def takes(thing: Any, *given: str) -> bool:
    """Whether it can be called with so many arguments."""
    from inspect import signature

    try:
        signature(thing).bind(*given)
    except (TypeError, ValueError):
        return False
    return True


def wanted(thing: Any, what: str) -> BadInput:
    """The error for what is no member: wanted a subclass of Gate, and so on."""
    return BadInput(f"it is {type(thing).__name__} {getattr(thing, '__name__', thing)!r}: wanted {what}")
