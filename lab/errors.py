"""Errors of one line, which name the bad value, where it came from and what is allowed; shortened values and lists."""

import operator
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from numbers import Integral, Real
from os import PathLike
from typing import Annotated, Any, get_args, get_origin

MOST_CHARACTERS = 295  # of a message, to which a command prepends "lab: "
MOST_OF_VALUE = 80  # characters of a bad value
MOST_OF_PLACE = 140  # characters of where it comes from: more, because a shortened path cannot be copied
MOST_COMPARED = 10_000  # known names that are searched for the nearest one: more would take seconds
KNOWN = " known: "  # precedes the known names, which end a message
_GAP, _MORE = " ... ", ", ..."
_END = 150  # characters that are kept of a long message's end, which says what is allowed


def printable(text: str) -> str:
    """The text with unprintable characters, such as line breaks and escape codes, replaced by their escapes."""
    return text if text.isprintable() else "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def escaped(text: str) -> str:
    """The text with unprintable characters replaced by their escapes, except line breaks and tabs."""
    return "\n".join("\t".join(map(printable, line.split("\t"))) for line in text.split("\n"))


def shortened(value: object, most: int = MOST_OF_VALUE) -> str:
    """A value as text for an error message: printable, and at most `most` characters long; the middle is left out."""
    text = printable(_ends(str(value)))
    if len(text) <= most:
        return text
    end = (most - len(_GAP)) // 2
    return f"{text[: most - len(_GAP) - end]}{_GAP}{text[-end:]}"


class LabError(Exception):
    """The base of all failures that the lab explains in one line; `exit_code` is the exit code of the command.

    Unprintable characters of the message are replaced by their escapes. A message of more than MOST_CHARACTERS loses the last
    of the known names that it lists, or its middle.

        >>> import lab
        >>> try:
        ...     lab.grid((3, 3), [[0] * 3] * 3, (0, 0), (5, 5))
        ... except lab.LabError as error:
        ...     print(error.exit_code, error)
        2 goal (5, 5) is outside the grid: allowed 0..2 x 0..2
    """

    exit_code = 1

    def __init__(self, message: str = "") -> None:
        super().__init__(_in_a_line(printable(_ends(message))))


def _ends(text: str) -> str:
    """The text without its middle if it is very long: `printable` would take seconds on it."""
    return text if len(text) <= 4 * MOST_CHARACTERS else text[: 2 * MOST_CHARACTERS] + text[-2 * MOST_CHARACTERS :]


def _in_a_line(text: str) -> str:
    """The message, shortened to MOST_CHARACTERS: the last known names that it lists are dropped, or else its middle."""
    if len(text) <= MOST_CHARACTERS:
        return text
    beginning, known, names = text.partition(KNOWN)
    if known and len(beginning) < MOST_CHARACTERS - MOST_OF_VALUE:
        kept = names[: MOST_CHARACTERS - len(beginning + known + _MORE)].rpartition(", ")[0]
        return f"{beginning}{known}{kept}{_MORE}"
    return f"{text[: MOST_CHARACTERS - len(_GAP) - _END]}{_GAP}{text[-_END:]}"


class Notice(UserWarning):
    """A warning that a command prints in one line before it continues."""


class BadInput(LabError):
    """The input is wrong; nothing was started and nothing was written (exit code 2)."""

    exit_code = 2


class WorkFailed(LabError):
    """The work was started and failed (exit code 1)."""

    exit_code = 1


_NO_ROOM = (
    *("failed to map segment", "annot allocate memory", "can't start new thread", "unable to allocate"),
    *("allowed dimension exceeded", "int too large to convert"),  # of a size that no memory could hold
)


def out_of_memory(error: BaseException) -> WorkFailed | None:
    """A WorkFailed if the error or one of its causes means that memory ran out, otherwise None.

    The text of each error is searched too, because a library that cannot be loaded for lack of memory raises no MemoryError.
    """
    cause: BaseException | None = error
    while cause is not None:
        words = [line.strip() for line in str(cause).splitlines() if any(part in line for part in _NO_ROOM)]
        if isinstance(cause, MemoryError) or words:
            return WorkFailed(f"there is not enough memory{f': {words[0][:200]}' if words else ''}")
        cause = cause.__cause__ or cause.__context__
    return None


def unknown(kind: str, value: object, known: Iterable[str], where: str) -> BadInput:
    """The error for a name that is not in a table.

    kind: what the name stands for, such as "gate"; value: the name; where: where it came from. The message adds the nearest known
    name and as many of the known names as it has room for.
    """
    names = sorted(known)
    nearest = get_close_matches(str(value)[:MOST_OF_VALUE], names, n=1) if len(names) <= MOST_COMPARED else []
    hint = f" did you mean '{shortened(nearest[0])}'?" if nearest else ""
    beginning = f"unknown {kind} '{shortened(value)}' ({shortened(where, MOST_OF_PLACE)}):{hint}{KNOWN}"
    return BadInput(f"{beginning}{listed(names, max(20, MOST_CHARACTERS - len(beginning))) or 'none'}")


LIMITS = {"gt": "above", "ge": "at least", "le": "at most", "lt": "below"}  # the limits of annotated_types
_KINDS: dict[str, tuple[Any, str]] = {
    "int": (Integral, "a whole number"),
    "float": (Real, "a number"),
    "bool": (bool, "True or False"),
    "str": (str, "text"),
    "Path": ((str, PathLike), "a path"),
}


def check_value(name: str, value: object, allowed: Any, where: str) -> None:
    """Raises BadInput unless a value has the allowed type and is within its limits.

    allowed: int, float, bool, str or Path, or an `Annotated` of one with limits such as `Ge(1)`; where: where it came from.
    """
    kind, *limits = get_args(allowed) if get_origin(allowed) is Annotated else (allowed,)
    types, words = _KINDS[kind.__name__]
    bounds = [(word, getattr(limit, word)) for limit in limits for word in LIMITS if hasattr(limit, word)]
    fits = isinstance(value, types) and (kind is bool or not isinstance(value, bool))
    if not fits or not all(getattr(operator, word)(value, bound) for word, bound in bounds):
        within = "".join(f", {LIMITS[word]} {bound}" for word, bound in bounds)
        raise BadInput(f"{name} {shortened(repr(value))} ({where}): wanted {words}{within}")


def listed(names: Sequence[str], most: int) -> str:
    """The names, separated by commas: as many as fit into `most` characters, and how many more there are."""
    text = ", ".join(names[:most])
    if len(text) <= most and len(names) <= most:
        return text
    shown = [shortened(name) for name in names[:most]]
    while shown and len(text) > most:
        shown.pop()
        text = f"{', '.join(shown)} and {len(names) - len(shown)} more"
    return text if shown else counted(len(names), "name")


def counted(number: float, noun: str) -> str:
    """A number with its noun in the singular or plural: "1 step", "2 steps", "2 boxes"."""
    ending = "es" if noun.endswith(("s", "x", "z", "ch", "sh")) else "s"
    return f"{number} {noun}" if number == 1 else f"{number} {noun}{ending}"
