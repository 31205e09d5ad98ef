"""What the lab says when something is wrong: one line, the bad value, where it came from, what is allowed; counts in words."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

MOST_CHARACTERS = 295  # of a message: with "lab: " before it, a line that is read at a glance
MOST_OF_VALUE = 80  # characters of a bad value
MOST_OF_PLACE = 140  # and of where it comes from: a path that is cut cannot be copied
MOST_COMPARED = 10_000  # names with a bad one: more take seconds
KNOWN = " known: "  # before the names that are known, the last of a message
_GAP, _MORE = " ... ", ", ..."
_END = 150  # of a longer message: where it comes from stands first, what is allowed last


def printable(text: str) -> str:
    """Text with each character that cannot be printed, such as a line break or an escape code, as its escape."""
    return text if text.isprintable() else "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def escaped(text: str) -> str:
    """As `printable`, of several lines: line breaks and tabs stay."""
    return "\n".join("\t".join(map(printable, line.split("\t"))) for line in text.split("\n"))


def shortened(value: object, most: int = MOST_OF_VALUE) -> str:
    """A value as an error shows it: printable, and the middle of a long one left out."""
    text = printable(_ends(str(value)))
    if len(text) <= most:
        return text
    end = (most - len(_GAP)) // 2
    return f"{text[: most - len(_GAP) - end]}{_GAP}{text[-end:]}"


class LabError(Exception):
    """Any failure the lab explains in one line; `exit_code` is what a command ends with.

    What cannot be printed, such as a line break or an escape code in a bad value, is shown as its escape; of a message of
    more than MOST_CHARACTERS the last known names are left out, or the middle.
    """

    exit_code = 1

    def __init__(self, message: str = "") -> None:
        super().__init__(_in_a_line(printable(_ends(message))))


def _ends(text: str) -> str:
    """A text without the middle of a very long one, which would take seconds to be made printable."""
    return text if len(text) <= 4 * MOST_CHARACTERS else text[: 2 * MOST_CHARACTERS] + text[-2 * MOST_CHARACTERS :]


def _in_a_line(text: str) -> str:
    """A message of at most MOST_CHARACTERS: of a list of known names at its end the last ones are left out, or its middle."""
    if len(text) <= MOST_CHARACTERS:
        return text
    said, known, names = text.partition(KNOWN)
    if known and len(said) < MOST_CHARACTERS - MOST_OF_VALUE:
        kept = names[: MOST_CHARACTERS - len(said + known + _MORE)].rpartition(", ")[0]
        return f"{said}{known}{kept}{_MORE}"
    return f"{text[: MOST_CHARACTERS - len(_GAP) - _END]}{_GAP}{text[-_END:]}"


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
    """The error for a name that no table holds: shows it, where it came from, the nearest and the known names that fit."""
    names = sorted(known)
    near = get_close_matches(str(value)[:MOST_OF_VALUE], names, n=1) if len(names) <= MOST_COMPARED else []
    hint = f" did you mean '{shortened(near[0])}'?" if near else ""
    said = f"unknown {kind} '{shortened(value)}' ({shortened(where, MOST_OF_PLACE)}):{hint}{KNOWN}"
    return BadInput(f"{said}{listed(names, max(20, MOST_CHARACTERS - len(said))) or 'none'}")


def listed(names: Sequence[str], most: int) -> str:
    """Names with commas between them, as many as `most` characters hold, and how many more there are."""
    text = ", ".join(names[:most])
    if len(text) <= most and len(names) <= most:
        return text
    shown = [shortened(name) for name in names[:most]]
    while shown and len(text) > most:
        shown.pop()
        text = f"{', '.join(shown)} and {len(names) - len(shown)} more"
    return text if shown else counted(len(names), "name")


def counted(number: float, what: str) -> str:
    """How many of something: "1 step", "2 steps", "2 boxes"."""
    ending = "es" if what.endswith(("s", "x", "z", "ch", "sh")) else "s"
    return f"{number} {what}" if number == 1 else f"{number} {what}{ending}"
