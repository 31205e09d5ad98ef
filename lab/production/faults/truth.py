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
# what a reason may say, the faults of which that can be true, and whether it need not name what they are about, as what
# stands elsewhere is in many ways; the first that fits counts
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
    """What a run with faults came to, and why it is wrong; rows: of each fault, what was noticed; unexplained: what was told
    that no fault explains."""

    came: Came
    rows: tuple[dict[str, Any], ...]
    unexplained: tuple[str, ...] = ()
    why: str = ""


def verdict(
    happened: Sequence[Happened], heard: Sequence[Event], failure: str | None, lacking: Sequence[str]
) -> Verdict:
    """What a run with faults came to.

    heard: what the run told. failure: why not all was delivered, as it says; None: all was. lacking: the parts that do not
    stand at the end of their routes.
    Delivered: all parts are there, and each was finished. Stopped: some are not there, the run said why, and each reason is
    about a fault. Else it is wrong; a run in which nothing struck may stop for reasons that nobody can check.
    """
    troubles = [event for event in heard if isinstance(event, TroubleMet)]
    rows = tuple(_row(one, troubles) for one in happened)
    unexplained = tuple(t.what for t in troubles if not explained(t.what, happened, t.part, t.station, t.at_s))
    why = "; ".join(_wrong(happened, heard, failure, lacking))
    came: Came = "delivered" if failure is None else "stopped"
    return Verdict("wrong" if why else came, rows, unexplained, why)


def _wrong(
    happened: Sequence[Happened], heard: Sequence[Event], failure: str | None, lacking: Sequence[str]
) -> Iterator[str]:
    """What the run said, or did not say, that is not true."""
    for one in happened:
        if one.undone and one.part not in lacking and not _begun_again(one, heard):
            yield f"{one.part} was delivered, and '{one.station}' had not finished it"
    if failure is None and lacking:
        yield f"nothing was said of {', '.join(lacking)}"
    for piece in untrue([*pieces(failure or "")], happened) if happened else ():
        yield f"no fault explains: {piece}"


def untrue(told: Sequence[str], happened: Sequence[Happened]) -> list[str]:
    """The reasons that no fault explains, and that do not follow from one that a fault explains."""
    true = [piece for piece in told if explained(piece, happened)]
    while following := [piece for piece in told if piece not in true and _follows(piece, true)]:
        true += following
    return [piece for piece in told if piece not in true]


def _follows(piece: str, true: Sequence[str]) -> bool:
    """Whether a part has no room because of another one, of which a true reason tells why it is still there."""
    stands = re.search(r"no spot of .* is free: (.+) is there$", piece)
    return stands is not None and any(one.startswith(f"{stands[1]} ") for one in true)


def _begun_again(one: Happened, heard: Sequence[Event]) -> bool:
    """Whether the machine that a part was taken out of worked on it once more."""
    begun = [event for event in heard if isinstance(event, MachineBegan) and event.at_s >= one.at_s]
    return any(event.part == one.part for event in begun)


def explained(reason: str, happened: Sequence[Happened], part: str = "", station: str = "", at_s: float = 1e9) -> bool:
    """Whether a fault that had struck makes a reason true: one of those of which it can be, and about the same thing."""
    return any(_explains(one, reason, part, station) for one in happened if one.at_s <= at_s)


def _explains(one: Happened, reason: str, part: str, station: str) -> bool:
    claims = [(kinds, anywhere) for pattern, kinds, anywhere in CLAIMS if re.search(pattern, reason)]
    for kinds, anywhere in claims[:1]:
        if one.what in kinds and anywhere:
            return True
        if one.what not in kinds and not (anywhere and one.what in PART):
            return False
    return one.explains(reason, part, station)


def pieces(failure: str) -> Iterator[str]:
    """The reasons of which a failure is made."""
    for piece in failure.split("; "):
        if piece.strip():
            yield piece.strip()


def _row(one: Happened, troubles: Sequence[TroubleMet]) -> dict[str, Any]:
    """A fault, and the first that was told of it."""
    found = next((t for t in troubles if t.at_s >= one.at_s and _explains(one, t.what, t.part, t.station)), None)
    row: dict[str, Any] = {"what": one.what, "at_s": round(one.at_s, 3), "true_reason": one.words}
    return row | {
        "noticed": None if found is None else found.what,
        "noticed_s": None if found is None else round(found.at_s, 3),
        "answer": None if found is None else found.answer,
    }
