"""Who can be asked, by name: simulated advisors, a person, recorded advice, a policy that was learned, or nobody.

A name is read once, where it comes in, into an `AdvisorName`; a `Level` (a table's steps, the order of the transfers) makes of
it who answers there. One row of ADVISORS serves both.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from lab.errors import BadInput, unknown
from lab.plugins.code_file import from_file
from lab.plugins.family import Family, first_line, takes, wanted

if TYPE_CHECKING:
    from lab.advice.entries import Read
    from lab.learning.requests import Advisor, Ask, Request


class Level(Protocol):
    """What a learner learns, as far as an advisor of it has to know."""

    @property
    def people(self) -> "Mapping[str, Ask]":
        """Who can be asked, by name."""

    def simulated(self, taus: tuple[float, ...], sign: float) -> "Advisor":
        """Knows the exact values; a first and a last tau are passed through over the session; sign -1: the worst is best."""

    def check(self, recorded: "Read") -> None:
        """BadInput when that is advice about something else."""

    def learned(self, name: str) -> "Advisor":
        """The policy of that name, or in that file; BadInput where there is none, and where it knows nothing of this."""

    def answered(self, path: Path) -> "Mapping[int, int]":
        """What a file of answers says in each state; BadInput where it is about something else."""


@dataclass(frozen=True)
class AdvisorName:
    """An advisor as it was asked for: its row in ADVISORS, what was said beside that, and the text itself.

    itself: one that was made in Python; it is in no table.
    """

    text: str
    row: str
    taus: tuple[float, ...] = ()
    folder: Path | None = None
    policy: str = ""
    answers: Path | None = None
    itself: "Advisor | None" = None

    @classmethod
    def made(cls, advisor: "Advisor | Ask") -> "AdvisorName":
        """For an advisor, or a function of a request; BadInput for anything else."""
        text = getattr(advisor, "__name__", type(advisor).__name__)
        if hasattr(advisor, "advise"):
            return cls(text, PYTHON, itself=advisor)
        if not callable(advisor):
            raise BadInput(f"advisor {advisor!r}: wanted a name, a function of a request, or an object with `advise`")
        return cls(text, PYTHON, itself=Person(advisor))

    @classmethod
    def of(cls, text: str, where: str = "advisor") -> "AdvisorName":
        """From "expert", "tau=0.2", "recorded:DIR", "answers:FILE", "policy:NAME"...; BadInput, with `where` it was said."""
        kind, colon, rest = text.partition(":")
        if colon and kind in PREFIXED:
            row, field, make, wanted = PREFIXED[kind]
            if not Path(rest).name.strip():
                raise BadInput(f"advisor '{text}' ({where}): it names {wanted}")
            return cls(text, row, **{field: make(rest)})
        if not text.startswith("tau="):
            if text in ADVISORS:
                return cls(text, text, (SKILL_TAUS[text],) if text in SKILL_TAUS else ())
            raise from_file("advisor", text, where) or unknown("advisor", text, ADVISORS, where)
        try:
            taus = tuple(float(part) for part in text[4:].split("..", 1))
        except ValueError:
            taus = (0.0,)
        if not all(isfinite(tau) and tau > 0.0 for tau in taus):
            raise BadInput(f"advisor '{text}' ({where}): tau must be a number above 0, such as tau=0.05 or tau=1..0.01")
        return cls(text, "tau=X" if len(taus) == 1 else "tau=X..Y", taus)

    def __str__(self) -> str:
        return self.text


class AdvisorKind(NamedTuple):
    """A row of ADVISORS: how whoever bears that name is made for a level (None: nobody), and a few words for the help."""

    make: "Callable[[AdvisorName, Level], Advisor | None]"
    help: str = ""


class Person:
    """A person, asked through a prompt or a page that is brought along (see lab/seat), or any function of a request."""

    def __init__(self, ask: "Ask"):
        self._ask = ask

    def advise(self, request: "Request") -> int | None:
        """What the person says."""
        return self._ask(request)


class RecordedAdvisor:
    """Says again in each state what was last said there, where that may be done, and nothing elsewhere."""

    def __init__(self, said: Mapping[int, int]):
        self._said = dict(said)

    def advise(self, request: "Request") -> int | None:
        """What the record holds for this state."""
        said = self._said.get(request.state)
        return said if said in request.allowed else None


def _simulated(name: AdvisorName, level: Level) -> "Advisor":
    return level.simulated(name.taus, 1.0)


def _person(name: AdvisorName, level: Level) -> "Advisor":
    if name.text not in level.people:
        raise BadInput(f"advisor '{name}': this command has no {PEOPLE[name.text]} to ask a person through")
    return Person(level.people[name.text])


def _recorded(name: AdvisorName, level: Level) -> "Advisor":
    from lab.advice.entries import read_journal

    assert name.folder is not None
    found = read_journal(name.folder, "--advisor")
    said = found.said()
    try:
        level.check(found)
        if not said:
            raise BadInput("nothing was advised in that session")
    except BadInput as error:
        raise BadInput(f"advisor '{name}': {error}") from None
    return RecordedAdvisor(said)


def _answers(name: AdvisorName, level: Level) -> "Advisor":
    assert name.answers is not None
    try:
        return RecordedAdvisor(level.answered(name.answers))
    except BadInput as error:
        raise BadInput(f"advisor '{name}': {error}") from None


def _learned(name: AdvisorName, level: Level) -> "Advisor":
    try:
        return level.learned(name.policy)
    except BadInput as error:
        raise BadInput(f"advisor '{name}': {error}") from None


# what is told by a prefix: its row, the field of AdvisorName, what that is made by, and what is said where it is missing
PREFIXED: dict[str, tuple[str, str, Callable[[str], Any], str]] = {
    "recorded": ("recorded:DIR", "folder", Path, "no file: wanted recorded:DIR, the folder of a session"),
    "answers": ("answers:FILE", "answers", Path, "no file: wanted answers:FILE, see docs/teaching.md"),
    "policy": ("policy:NAME", "policy", str, "no policy: wanted policy:NAME; see lab toolbox list"),
}
PYTHON = "python"  # the row of an advisor that is in no table
PEOPLE = {"terminal": "prompt", "web": "page"}
SKILL_TAUS = {"expert": 0.01, "moderate": 0.1, "limited": 0.3, "novice": 1.0}


def _adopted(name: str, thing: Any) -> AdvisorKind:
    if isinstance(thing, type) and hasattr(thing, "advise") and takes(thing):
        return AdvisorKind(lambda name, level: thing(), first_line(thing))
    if isinstance(thing, type) or not takes(thing, "request"):
        raise wanted(thing, "a function of a request, or a class with `advise` that is made without arguments")
    return AdvisorKind(lambda name, level: Person(thing), first_line(thing))


_SHIPPED: dict[str, AdvisorKind] = {
    **{name: AdvisorKind(_simulated) for name in SKILL_TAUS},
    "wrong": AdvisorKind(lambda name, level: level.simulated((SKILL_TAUS["expert"],), -1.0)),
    **{name: AdvisorKind(_person) for name in PEOPLE},
    "none": AdvisorKind(lambda name, level: None),
    "tau=X": AdvisorKind(_simulated),
    "tau=X..Y": AdvisorKind(_simulated, "changing over the episodes"),
    "recorded:DIR": AdvisorKind(_recorded, "a session's folder"),
    "answers:FILE": AdvisorKind(_answers, 'answers kept as JSON, {"state": "action"}'),
    "policy:NAME": AdvisorKind(_learned, "a policy in the toolbox, or its file"),
}
ADVISORS = Family("advisors", _SHIPPED, _adopted)


def named() -> list[str]:
    """The names that are said as they stand; the others have something of the user's in them."""
    return [name for name in ADVISORS if not {"=", ":"} & {*name}]


def make_advisor(name: AdvisorName, level: Level) -> "Advisor | None":
    """Who answers to that name there, None for "none".

    Raises BadInput for a person who is not there, for a record that does not fit, and for what is too large to know.
    """
    return name.itself or ADVISORS[name.row].make(name, level)


def recorded_fault(found: "Read", what: str, signature: str) -> BadInput:
    """What is said of a record that is about something else."""
    then = found.session
    return BadInput(
        f"it is advice about another {what}, '{then.problem}' ({then.signature[:8]}): wanted {signature[:8]}"
    )
