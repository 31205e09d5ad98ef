"""Whether a run told the truth about its troubles: each reason is compared with the faults that had struck by then."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from lab.production.faults.fault import Happened
from lab.teaching.events import Event, MachineBegan, TroubleMet

Came = Literal["delivered", "stopped", "wrong"]
PART = ("part moved", "part gone", "part fallen", "part slips", "part dropped")
FIXED = ("obstacle put", "obstacle moved", "obstacle gone", "station moved")
MACHINE = ("machine slow", "machine fails")
# words of a reason, the faults by which it can be true, and whether it may omit the name of the affected body; the first
# row that fits counts
CLAIMS: tuple[tuple[str, tuple[str, ...], bool], ...] = (
    (r"not done|takes longer|out of order", MACHINE, False),
    (r"no spot of .* is free", ("station full", *PART), False),
    (r"not of this order|is taken", ("station full",), False),
    (r"camera sees nothing", ("camera blind",), True),
    (r"camera does not see|camera sees", (*FIXED, "camera blind", "station full"), True),
    (r"was surveyed|something new|is gone from|since it was learned|since '.*' was learned|in the way", FIXED, True),
    (r"no path reaches|cannot be approached|no room for gripper|enclosed by", FIXED, True),
    (
        r"lies on its side|nowhere on the table|seen .* m away|it stands at|out of reach|fallen",
        (*PART, "station moved"),
        False,
    ),
    (r"is not in the gripper|does not stand|is not in the slot|missed \d+ of", (*FIXED, "station full"), True),
)


@dataclass(frozen=True)
class Verdict:
    """The verdict on a run with faults, and its reason if it is "wrong"; rows: each fault and what the run noticed of it;
    unexplained: reasons of the run that no fault explains."""

    came: Came
    rows: tuple[dict[str, Any], ...]
    unexplained: tuple[str, ...] = ()
    why: str = ""


def verdict(
    happened: Sequence[Happened], heard: Sequence[Event], failure: str | None, lacking: Sequence[str]
) -> Verdict:
    """The verdict on a run with faults: delivered, stopped or wrong.

    heard: the run's events. failure: the run's reason for missing parts; None: there are none. lacking: the parts that do not
    stand at the end of their routes.
    Delivered: all parts are there and finished. Stopped: parts are missing, and each reason of the run refers to a fault.
    Wrong: all others. If nothing struck, the reasons of a stop are not checked.
    """
    troubles = [event for event in heard if isinstance(event, TroubleMet)]
    rows = tuple(_row(fault, troubles) for fault in happened)
    unexplained = tuple(t.what for t in troubles if not explained(t.what, happened, t.part, t.station, t.at_s))
    why = "; ".join(_wrong(happened, heard, failure, lacking))
    came: Came = "delivered" if failure is None else "stopped"
    return Verdict("wrong" if why else came, rows, unexplained, why)


def _wrong(
    happened: Sequence[Happened], heard: Sequence[Event], failure: str | None, lacking: Sequence[str]
) -> Iterator[str]:
    """The untrue statements of the run, and its untrue silences."""
    for fault in happened:
        if fault.undone and fault.part not in lacking and not _begun_again(fault, heard):
            yield f"{fault.part} was delivered, and '{fault.station}' had not finished it"
    if failure is None and lacking:
        yield f"nothing was said of {', '.join(lacking)}"
    for piece in untrue([*pieces(failure or "")], happened) if happened else ():
        yield f"no fault explains: {piece}"


def untrue(told: Sequence[str], happened: Sequence[Happened]) -> list[str]:
    """The reasons that neither a fault nor another explained reason explains."""
    true = [piece for piece in told if explained(piece, happened)]
    while following := [piece for piece in told if piece not in true and _follows(piece, true)]:
        true += following
    return [piece for piece in told if piece not in true]


def _follows(piece: str, true: Sequence[str]) -> bool:
    """Whether a part has no room because of another part whose stay a true reason explains."""
    stands = re.search(r"no spot of .* is free: (.+) is there$", piece)
    return stands is not None and any(one.startswith(f"{stands[1]} ") for one in true)


def _begun_again(fault: Happened, heard: Sequence[Event]) -> bool:
    """Whether the machine from which a part was taken worked on it again."""
    begun = [event for event in heard if isinstance(event, MachineBegan) and event.at_s >= fault.at_s]
    return any(event.part == fault.part for event in begun)


def explained(reason: str, happened: Sequence[Happened], part: str = "", station: str = "", at_s: float = 1e9) -> bool:
    """Whether a fault that had struck makes a reason true: it is of a possible kind and affects the same body."""
    return any(_explains(fault, reason, part, station) for fault in happened if fault.at_s <= at_s)


def _explains(fault: Happened, reason: str, part: str, station: str) -> bool:
    claims = [(kinds, anywhere) for pattern, kinds, anywhere in CLAIMS if re.search(pattern, reason)]
    for kinds, anywhere in claims[:1]:
        if fault.what in kinds and anywhere:
            return True
        if fault.what not in kinds and not (anywhere and fault.what in PART):
            return False
    return fault.explains(reason, part, station)


def pieces(failure: str) -> Iterator[str]:
    """The single reasons of a failure."""
    for piece in failure.split("; "):
        if piece.strip():
            yield piece.strip()


def _row(fault: Happened, troubles: Sequence[TroubleMet]) -> dict[str, Any]:
    """A fault, and the first trouble of the run that refers to it."""
    noticed = next((t for t in troubles if t.at_s >= fault.at_s and _explains(fault, t.what, t.part, t.station)), None)
    row: dict[str, Any] = {"what": fault.what, "at_s": round(fault.at_s, 3), "true_reason": fault.words}
    return row | {
        "noticed": None if noticed is None else noticed.what,
        "noticed_s": None if noticed is None else round(noticed.at_s, 3),
        "answer": None if noticed is None else noticed.answer,
    }
