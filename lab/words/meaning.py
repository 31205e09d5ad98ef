"""Meanings of sentences: small records, and their JSON forms.

A sentence means a list of these, in the order in which they are to be done. The JSON form of each is an object with the one
field that its docstring shows.
"""

from dataclasses import dataclass
from typing import Any, Literal

WALL, CLEAR = "wall", "clear"
ALL = "all"  # of Allow: every rule is taken back
QuietFor = Literal["stuck", "episode", "always"]


@dataclass(frozen=True)
class Leg:
    """Moves in one direction: a number of steps, or until WALL, CLEAR or next to the object with that id.

    towards, past: of CLEAR, the direction or the object that was named, "" for none; the next leg's direction is meant as a rule.
    """

    direction: str
    steps: int | None = None
    until: str = ""
    towards: str = ""
    past: str = ""

    def as_json(self) -> dict[str, object]:
        """{"direction": "left", "steps": 2} or {"direction": "left", "until": "wall"}."""
        how: dict[str, object] = {"until": self.until} if self.steps is None else {"steps": self.steps}
        return {"direction": self.direction, **how}


@dataclass(frozen=True)
class Go:
    """Moves along legs: {"go": [leg, ...]}."""

    legs: tuple[Leg, ...]

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"go": [leg.as_json() for leg in self.legs]}


@dataclass(frozen=True)
class To:
    """A shortest path to an object, or next to it: {"to": id}."""

    thing: str

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"to": self.thing}


@dataclass(frozen=True)
class Around:
    """A path past an object, on the side with the name of an action, or on either: {"around": id, "side": action or null}."""

    thing: str
    side: str | None = None

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"around": self.thing, "side": self.side}


@dataclass(frozen=True)
class Avoid:
    """A rule, which holds until it is taken back: no move next to the object: {"avoid": id}."""

    thing: str

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"avoid": self.thing}


@dataclass(frozen=True)
class Allow:
    """Rules are taken back, those about an object or ALL: {"allow": id}."""

    thing: str

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"allow": self.thing}


@dataclass(frozen=True)
class Opposite:
    """The move against the last one: {"opposite": true}."""

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"opposite": True}


@dataclass(frozen=True)
class Again:
    """What was answered the last time: {"again": true}."""

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"again": True}


@dataclass(frozen=True)
class Praise:
    """Praise (1) or blame (-1) of what was just done: {"praise": 1}."""

    sign: Literal[1, -1]

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"praise": self.sign}


@dataclass(frozen=True)
class Undo:
    """The last answer is taken back: {"undo": true}."""

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"undo": True}


@dataclass(frozen=True)
class Own:
    """The learner's own choice is answered: {"own": true}."""

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"own": True}


@dataclass(frozen=True)
class Why:
    """The reason for the question is asked for: {"why": true}."""

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"why": True}


@dataclass(frozen=True)
class Quiet:
    """No questions until the learner is stuck, for this episode, always, or for a number of steps: {"quiet": "stuck"}."""

    until: QuietFor | int

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"quiet": self.until}


@dataclass(frozen=True)
class Stop:
    """The session ends: {"stop": true}."""

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"stop": True}


# ---- on the order of transfers ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Move:
    """The move with this number among the allowed ones: {"move": 3}."""

    number: int

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"move": self.number}


@dataclass(frozen=True)
class Finish:
    """A rule: moves of the part come first until it is finished: {"finish": part}."""

    part: str

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"finish": self.part}


@dataclass(frozen=True)
class Never:
    """A rule: the part, or any part, is never left waiting in the station: {"never": {"part": ..., "waits_in": station}}."""

    part: str | None
    station: str

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"never": {"part": self.part, "waits_in": self.station}}


@dataclass(frozen=True)
class Work:
    """The work on a part, in a station; None: on any part, in any station."""

    part: str | None = None
    station: str | None = None

    def as_json(self) -> dict[str, object]:
        """{"part": ..., "station": ...}."""
        return {"part": self.part, "station": self.station}


@dataclass(frozen=True)
class Before:
    """A rule: one work comes before another: {"before": [work, work]}."""

    first: Work
    second: Work

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {"before": [self.first.as_json(), self.second.as_json()]}


Intent = (
    Go | To | Around | Avoid | Allow | Opposite | Again | Praise | Undo | Own | Why | Quiet | Stop
    | Move | Finish | Never | Before
)  # fmt: skip


@dataclass(frozen=True)
class Refusal:
    """A sentence that was not understood: why, in one line, with the nearest sentence that would be."""

    reason: str

    def as_json(self) -> dict[str, object]:
        """{"refuse": true}."""
        return {"refuse": True}


def rule_of(record: dict[str, Any]) -> Avoid | Finish | Never | Before | Quiet:
    """The rule, or the time without questions, with a JSON form. Raises ValueError for any other record."""
    match record:
        case {"avoid": str(thing)}:
            return Avoid(thing)
        case {"finish": str(part)}:
            return Finish(part)
        case {"never": {"part": str() | None as part, "waits_in": str(station)}}:
            return Never(part, station)
        case {"before": [{"part": a, "station": b}, {"part": c, "station": d}]}:
            return Before(Work(a, b), Work(c, d))
        case {"quiet": "stuck" | "episode" | "always" | int() as until}:
            return Quiet(until)
    raise ValueError(f"{record!r}: no rule, and no time without questions")
