"""What the lab says when something is wrong: one line, the bad value, where it came from, what is allowed; counts in words."""

from collections.abc import Iterable
from difflib import get_close_matches

MOST_NAMES = 30  # an error lists so many known names at the most
MOST_CHARACTERS = 1600  # of a message: a screen
_END = (
    MOST_CHARACTERS // 2 - 25
)  # of a longer one that is shown: it says where it comes from first, what is allowed last


def printable(text: str) -> str:
    """Text with each character that cannot be printed, such as a line break or an escape code, as its escape."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def escaped(text: str) -> str:
    """As `printable`, of several lines: line breaks and tabs stay."""
    return text if text.isprintable() else "".join(c if c in "\n\t" else printable(c) for c in text)


class LabError(Exception):
    """Any failure the lab explains in one line; `exit_code` is what a command ends with.

    What cannot be printed, such as a line break or an escape code in a bad value, is shown as its escape; the middle of a
    message that fills more than a screen is left out.
    """

    exit_code = 1

    def __init__(self, message: str = "") -> None:
        shown = printable(message)
        if len(shown) > MOST_CHARACTERS:
            shown = f"{shown[:_END]} ... ({len(shown) - 2 * _END} more characters) ... {shown[-_END:]}"
        super().__init__(shown)


class Notice(UserWarning):
    """What goes on all the same, but should be known: a command says it in one line."""


class BadInput(LabError):
    """The input is wrong: nothing was tried, nothing was written (exit 2)."""

    exit_code = 2


class WorkFailed(LabError):
    """The work was tried and failed (exit 1)."""

    exit_code = 1


_NO_ROOM = ("failed to map segment", "annot allocate memory", "can't start new thread", "unable to allocate")


def out_of_memory(error: BaseException) -> WorkFailed | None:
    """The error for one that comes of too little memory, here or in what it comes from; None for any other.

    Libraries that cannot be loaded for want of memory say so in words only.
    """
    cause: BaseException | None = error
    while cause is not None:
        words = [line.strip() for line in str(cause).splitlines() if any(part in line for part in _NO_ROOM)]
        if isinstance(cause, MemoryError) or words:
            return WorkFailed(f"there is not enough memory{f': {words[0][:200]}' if words else ''}")
        cause = cause.__cause__ or cause.__context__
    return None


def unknown(kind: str, value: object, known: Iterable[str], where: str) -> BadInput:
    """The error for a name that no table holds: shows it, where it came from, the nearest and all known names."""
    names = sorted(known)
    near = get_close_matches(str(value), names, n=1)
    hint = f" did you mean '{near[0]}'?" if near else ""
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return BadInput(f"unknown {kind} '{value}' ({where}):{hint} known: {', '.join(names[:MOST_NAMES]) or 'none'}{more}")


def counted(number: float, what: str) -> str:
    """How many of something: "1 step", "2 steps", "2 boxes"."""
    ending = "es" if what.endswith(("s", "x", "z", "ch", "sh")) else "s"
    return f"{number} {what}" if number == 1 else f"{number} {what}{ending}"
