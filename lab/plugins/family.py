"""Families: tables of members, shipped or added by other packages through entry points; the blame for faulty members."""

import warnings
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import is_dataclass
from inspect import signature
from numbers import Integral
from traceback import walk_tb
from typing import Any, TypeVar

from lab.errors import BadInput, Notice, shortened

OWN = "package 'teaching-lab'"  # the source of shipped members, whose errors keep their traceback
_modules: dict[str, str] = {}  # module of an added member -> where it comes from


def known_source(thing: object, source: str) -> None:
    """Records where the code of a member comes from."""
    if source == OWN:
        return
    for module in _modules_of(thing):
        _modules[module] = source


def _modules_of(thing: object) -> set[str]:
    """The modules of a member's code; of a record such as a `Study`, of the code of its functions."""
    parts = (thing, *vars(thing).values()) if is_dataclass(thing) and not isinstance(thing, type) else (thing,)
    modules = {str(getattr(value, "__module__", type(value).__module__)) for value in parts}
    return {name for name in modules if name.partition(".")[0] not in ("lab", "builtins")}


def blame(error: BaseException) -> str | None:
    """A line that names the source and line of the added member in which an error was raised; None if there is none."""
    for frame, line in reversed([*walk_tb(error.__traceback__)]):
        source = _modules.get(frame.f_globals.get("__name__", ""))
        if source is not None:
            return f"the code of {source} failed in line {line}: {type(error).__name__}: {error}"
    return None


# ---- the family -----------------------------------------------------------------------------------------------------


GROUP = "teaching_lab"  # entry points of the family "gates" are in the group "teaching_lab.gates"

Row = TypeVar("Row")


class PluginFault(Notice):
    """The warning that a member of another package is faulty and was left out."""


class Family(MutableMapping[str, Row]):
    """A table of members by name: the shipped ones, then those of other packages, which are loaded when first needed.

    kind: of the family, such as "gates"; rows: the shipped members; adopt: makes a row of an object from other code, and raises
    BadInput if that is no member.
    An entry point provides one member, under its own name, or a mapping of names to members. A faulty member, or one whose
    name is taken, causes a `PluginFault` warning and is left out. Looking up a shipped name does not load other packages.
    """

    def __init__(self, kind: str, rows: Mapping[str, Row], adopt: Callable[[str, Any], Row]):
        self.kind, self._rows, self._adopt = kind, dict(rows), adopt
        self._complete = False
        self._used: dict[str, Row] = {}
        self._things: dict[str, Any] = {}  # the objects of which the added rows were made

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
        """Adds a member to the listed ones. Raises BadInput if it is none, or if the name is taken."""
        if name in self._rows:
            raise BadInput(f"the name '{name}' is taken")
        self._rows[name] = self._adopt(name, thing)
        self._things[name] = thing
        known_source(thing, source)

    def named(self, thing: Any) -> str:
        """The name of a class, which is added by `use`; a name is returned unchanged. Raises BadInput for anything else."""
        if isinstance(thing, str):
            return thing
        if not isinstance(thing, type):
            raise BadInput(
                f"{self.kind}: {thing!r}: wanted a name or a class, of which each session makes its own object"
            )
        try:
            return self.use(thing.__name__, thing)
        except BadInput as error:
            raise BadInput(f"{self.kind}: {error}") from None

    def use(self, name: str, thing: Any) -> str:
        """Adds a member under a name that is not listed, and returns the name. Raises BadInput if it is no member."""
        self._used[name] = self._adopt(name, thing)
        self._things[name] = thing
        return name

    def is_added(self, name: str) -> bool:
        """Whether a member comes from other code: a package, a file, or a class made in Python."""
        return name in self._things

    def modules_of(self, name: str) -> list[str]:
        """The modules of an added member's code, see `lab.files.code_key`; empty for a shipped member."""
        return sorted(_modules_of(self._things[name])) if name in self._things else []

    def _look(self) -> None:
        """Adds the members of installed packages, once."""
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
    """The first line of a member's docstring, without the full stop; its name if there is none."""
    return ((thing.__doc__ or "").strip() or getattr(thing, "__name__", str(thing))).splitlines()[0].rstrip(".")


def takes(thing: Any, *given: str) -> bool:
    """Whether an object can be called with as many arguments as `given` has."""
    try:
        signature(thing).bind(*given)
    except (TypeError, ValueError):
        return False
    return True


def allowed_words(allowed: Sequence[int]) -> str:
    """The allowed actions as text, such as "0..3" or "1, 4, 6"."""
    return f"{allowed[0]}..{allowed[-1]}" if isinstance(allowed, range) else ", ".join(map(str, allowed))


def checked_action(action: object, allowed: Sequence[int], who: str) -> int:
    """The action that a member named, as a plain int. Raises BadInput, which names `who`, if it is none of the allowed ones."""
    if type(action) is int and action in allowed:
        return action
    if isinstance(action, bool) or not isinstance(action, Integral) or action not in allowed:
        raise BadInput(f"{who} named action {shortened(repr(action))}: allowed {allowed_words(allowed)}")
    return int(action)


def takes_generator(thing: Any) -> bool:
    """Whether a class takes the argument `rng`, a generator for all its randomness."""
    try:
        return "rng" in signature(thing).parameters
    except (TypeError, ValueError):
        return False


def wanted(thing: Any, what: str) -> BadInput:
    """The error for an object that is no member; what: what was wanted, such as "a subclass of lab.Gate"."""
    return BadInput(f"it is {type(thing).__name__} {getattr(thing, '__name__', thing)!r}: wanted {what}")
