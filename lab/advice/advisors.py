"""The advisors by name: simulated ones, people, recorded advice, learned policies, or none.

A name is parsed once, into an `AdvisorName`. Its row in ADVISORS makes the advisor for a `Level`: for the steps of a table, or
for the order of transfers.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from lab.advice.entries import Read, read_journal
from lab.errors import BadInput, unknown
from lab.plugins.code_file import from_file
from lab.plugins.family import Family, first_line, takes, wanted

if TYPE_CHECKING:
    from lab.learning.requests import Advisor, Ask, Request


class Level(Protocol):
    """The interface of what a learner learns (a table or an order), as advisors are made for it."""

    @property
    def people(self) -> "Mapping[str, Ask]":
        """The functions that ask people, by advisor name."""

    def simulated(self, taus: tuple[float, ...], sign: float) -> "Advisor":
        """An advisor that draws from the exact values with tau, or from the first to the last tau; sign -1 inverts the values."""

    def check(self, recorded: Read) -> None:
        """Raises BadInput if the record is about another problem."""

    def learned(self, name: str) -> "Advisor":
        """A policy, by its name or file, as an advisor. Raises BadInput if there is none, or if no state of it matches."""

    def answered(self, path: Path) -> "Mapping[int, int]":
        """The answers by state that a file holds. Raises BadInput if they do not fit."""


@dataclass(frozen=True)
class AdvisorName:
    """A parsed advisor name.

    text: as it was typed; row: the key in ADVISORS; taus, folder, policy, answers: the parameters in the name.
    itself: an advisor made in Python, which is in no table.
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
        """The name of an advisor object or of a function of a request. Raises BadInput for anything else."""
        text = getattr(advisor, "__name__", type(advisor).__name__)
        if hasattr(advisor, "advise"):
            return cls(text, PYTHON, itself=advisor)
        if not callable(advisor):
            raise BadInput(f"advisor {advisor!r}: wanted a name, a function of a request, or an object with `advise`")
        return cls(text, PYTHON, itself=Person(advisor))

    @classmethod
    def of(cls, text: str, where: str = "advisor") -> "AdvisorName":
        """The parsed name: "expert", "tau=0.2", "recorded:DIR", "answers:FILE", "policy:NAME"... Raises BadInput."""
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
    """A row of ADVISORS: the function that makes the advisor for a level (None: no advisor), and a few words for the help."""

    make: "Callable[[AdvisorName, Level], Advisor | None]"
    help: str = ""


class Person:
    """An advisor that calls a function of a request, such as one that asks a person (see lab/seat)."""

    def __init__(self, ask: "Ask"):
        self._ask = ask

    def advise(self, request: "Request") -> int | None:
        """The function's answer."""
        return self._ask(request)


class RecordedAdvisor:
    """An advisor that repeats recorded answers: the last one for each state, none in other states."""

    def __init__(self, said: Mapping[int, int]):
        self._said = dict(said)

    def advise(self, request: "Request") -> int | None:
        """The recorded answer for this state, None if there is none or if it is not allowed."""
        said = self._said.get(request.state)
        return said if said in request.allowed else None


def _simulated(name: AdvisorName, level: Level) -> "Advisor":
    return level.simulated(name.taus, 1.0)


def _person(name: AdvisorName, level: Level) -> "Advisor":
    if name.text not in level.people:
        raise BadInput(f"advisor '{name}': this command has no {PEOPLE[name.text]} to ask a person through")
    return Person(level.people[name.text])


def _recorded(name: AdvisorName, level: Level) -> "Advisor":
    assert name.folder is not None
    journal = read_journal(name.folder, "--advisor")
    answers = journal.said()
    try:
        level.check(journal)
        if not answers:
            raise BadInput("nothing was advised in that session")
    except BadInput as error:
        raise BadInput(f"advisor '{name}': {error}") from None
    return RecordedAdvisor(answers)


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


# prefix -> row, field of AdvisorName, the type of that field, the error text if it is empty
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
    """The names without parameters."""
    return [name for name in ADVISORS if not {"=", ":"} & {*name}]


def make_advisor(name: AdvisorName, level: Level) -> "Advisor | None":
    """The advisor of that name for a level, None for "none".

    Raises BadInput if there is no way to ask the person, if a record does not fit, and if the exact values cannot be computed.
    """
    return name.itself or ADVISORS[name.row].make(name, level)


def recorded_fault(record: Read, what: str, signature: str) -> BadInput:
    """The error for a record of another problem; what: "problem" or "order"; signature: the one that is needed."""
    recorded = record.session
    return BadInput(
        f"it is advice about another {what}, '{recorded.problem}' ({recorded.signature[:8]}): wanted {signature[:8]}"
    )
