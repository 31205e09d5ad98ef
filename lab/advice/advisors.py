"""The advisors by name: simulated ones, people, language models, recorded advice, learned policies, or none.

A name is parsed once, into an `AdvisorName`. Its row in ADVISORS makes the advisor for a `Level`: for the steps of a table, or
for the order of transfers.
"""

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, replace
from inspect import signature
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from lab.advice.entries import Read, read_journal
from lab.advice.model_address import WANTED as MODEL_WANTED
from lab.advice.model_address import ModelAddress
from lab.errors import BadInput, shortened, unknown
from lab.learning.praise import MOST_MOVES, PRAISE_RULES, Judging
from lab.plugins.code_file import from_file
from lab.plugins.family import Family, checked_action, first_line, takes, takes_generator, wanted

if TYPE_CHECKING:
    import numpy as np

    from lab.learning.requests import Advisor, Ask, Reply, Request


class Level(Protocol):
    """The interface of what a learner learns (a table or an order), as advisors are made for it."""

    @property
    def people(self) -> "Mapping[str, Ask]":
        """The functions that ask people and language models, by advisor name."""

    @property
    def rng(self) -> "np.random.Generator":
        """The generator of the session, which its advisors share."""

    def simulated(self, taus: tuple[float, ...], sign: float) -> "Advisor":
        """An advisor that draws from the exact values with tau, or from the first to the last tau; sign -1 inverts the values."""

    def of_accuracy(self, share: float) -> "Advisor":
        """An advisor that draws from the exact values, with the tau that gives this share of optimal answers.

        Raises BadInput for a share that an advisor has at random.
        """

    def check(self, recorded: Read) -> None:
        """Raises BadInput if the record is about another problem."""

    def learned(self, name: str) -> "Advisor":
        """A policy, by its name or file, as an advisor. Raises BadInput if there is none, or if no state of it matches."""

    def answered(self, path: Path) -> "Mapping[int, int]":
        """The answers by state that a file holds. Raises BadInput if they do not fit."""

    def evaluator(self, advisor: "Advisor", judging: Judging) -> "Advisor":
        """An advisor that judges moves by what another one would have said. Raises BadInput if there is nothing to judge."""


@dataclass(frozen=True)
class AdvisorName:
    """A parsed advisor name.

    text: as it was typed; row: the key in ADVISORS; taus, folder, policy, answers, accuracy, model, person: the parameters in the
    name.
    itself: an advisor made in Python, or its class, which is in no table.
    inner, judging: by whom and how moves are judged, of a name such as "praise:expert", which has the parameters of `inner`, too.
    """

    text: str
    row: str
    taus: tuple[float, ...] = ()
    folder: Path | None = None
    policy: str = ""
    answers: Path | None = None
    itself: "Advisor | Ask | type[Advisor] | None" = None
    accuracy: float = 0.0
    model: ModelAddress | None = None
    person: str = ""
    inner: "AdvisorName | None" = None
    judging: Judging | None = None

    @classmethod
    def made(cls, advisor: "Advisor | Ask | type[Advisor]") -> "AdvisorName":
        """The name of an advisor object or class, or of a function of a request. Raises BadInput for anything else."""
        text = getattr(advisor, "__name__", type(advisor).__name__)
        is_class = isinstance(advisor, type)
        if not (_is_advisor_class(advisor) if is_class else hasattr(advisor, "advise") or callable(advisor)):
            raise BadInput(f"advisor {advisor!r}: wanted a name, {WANTED}, or an object with `advise`")
        if not (is_class or hasattr(advisor, "advise")):
            with suppress(ValueError):  # some functions in C have no signature
                try:
                    signature(advisor).bind(None)
                except TypeError as error:
                    raise BadInput(f"advisor {text!r}: {error}: wanted a function of a request") from None
        return cls(text, PYTHON, itself=advisor)

    def for_session(self) -> "AdvisorName":
        """The same name with an advisor of its own for one session: a copy of an object that was made in Python.

        Raises BadInput for an object that cannot be copied.
        """
        if self.itself is None or isinstance(self.itself, type) or not hasattr(self.itself, "advise"):
            return self
        try:
            return replace(self, itself=deepcopy(self.itself))
        except Exception as error:  # whatever the object's own code raises
            why = f"{type(error).__name__}: {error}"
            raise BadInput(
                f"advisor '{self}': its object cannot be copied for each session ({why}): name its class"
            ) from None

    @classmethod
    def of(cls, text: str, where: str = "advisor") -> "AdvisorName":
        """The parsed name: "expert", "tau=0.2", "accuracy=0.8", "recorded:DIR", "policy:NAME"... Raises BadInput."""
        kind, colon, rest = text.partition(":")
        if colon and kind == PRAISE:
            return _judging(cls, text, where)
        if colon and kind in PREFIXED:
            row, field, make, wanted = PREFIXED[kind]
            if not Path(rest).name.strip():
                raise BadInput(f"advisor '{text}' ({where}): it names {wanted}")
            try:
                return cls(text, row, **{field: make(rest)})
            except BadInput as error:
                raise BadInput(f"advisor '{kind}:...' ({where}): {error}") from None
        if text.startswith("accuracy="):
            return cls(text, "accuracy=X", accuracy=_share(text, where))
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


def _share(text: str, where: str) -> float:
    """The share in "accuracy=0.8". Raises BadInput."""
    with suppress(ValueError):
        if 0.0 < (share := float(text.removeprefix("accuracy="))) < 1.0:
            return share
    raise BadInput(
        f"advisor '{text}' ({where}): accuracy must be a share of optimal answers between 0 and 1, such as accuracy=0.8"
    )


def split_praise(text: str) -> tuple[str, str]:
    """(who, options): the parts of a name such as "praise:late=2:expert", "expert" and "late=2:"; (text, "") for any other."""
    named = re.fullmatch(rf"{PRAISE}:((?:(?:late|rule)=[^:]*:)*)(.*)", text, re.DOTALL)
    return (text, "") if named is None else (named[2], named[1])


def _judging(kind: type[AdvisorName], text: str, where: str) -> AdvisorName:
    """The name of an evaluator. Raises BadInput."""
    who, options = split_praise(text)
    try:
        if not who:
            raise BadInput(f"it names nobody who judges: wanted {PRAISED}")
        inner = kind.of(who, where)
        if inner.row in NO_EVALUATORS:
            raise BadInput(f"'{shortened(who)}' judges no moves: wanted {PRAISED}")
        given = dict(option.split("=", 1) for option in options.split(":")[:-1])
        late = given.get("late", "0")
        if not (late.isascii() and late.isdigit() and len(late) < 4 and int(late) < MOST_MOVES):
            raise BadInput(f"late={late}: allowed are 0 to {MOST_MOVES - 1} moves")
        if (rule := given.get("rule", Judging().rule)) not in PRAISE_RULES:
            raise unknown("rule", rule, PRAISE_RULES, where)
    except BadInput as error:
        raise BadInput(f"advisor '{PRAISE}:...' ({where}): {error}") from None
    return replace(inner, text=text, row=PRAISE_ROW, inner=inner, judging=Judging(True, int(late), rule))


class AdvisorKind(NamedTuple):
    """A row of ADVISORS: the function that makes the advisor for a level (None: no advisor), and a few words for the help."""

    make: "Callable[[AdvisorName, Level], Advisor | None]"
    help: str = ""


class Person:
    """An advisor that calls a function of a request, such as one that asks a person or a language model (see lab/seat).

    judging: whether and how it may judge moves as well; None: not.
    """

    def __init__(self, ask: "Ask", judging: Judging | None = None):
        self._ask, self.judging = ask, judging

    def advise(self, request: "Request") -> "Reply":
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


def _of_accuracy(name: AdvisorName, level: Level) -> "Advisor":
    try:
        return level.of_accuracy(name.accuracy)
    except BadInput as error:
        raise BadInput(f"advisor '{name}': {error}") from None


def _person(name: AdvisorName, level: Level) -> "Advisor":
    if name.text not in level.people:
        what = f"page for '{name.person}'" if name.person else f"{PEOPLE[name.text]} to ask a person through"
        raise BadInput(f"advisor '{name}': this command has no {what}")
    return Person(level.people[name.text], Judging())


def _language_model(name: AdvisorName, level: Level) -> "Advisor":
    if name.text not in level.people:
        raise not_called(name.text)
    return Person(level.people[name.text])


def not_called(name: str) -> BadInput:
    """The error for a language model in a command of many sessions, each of which would call its server."""
    return BadInput(
        f"advisor '{shortened(name)}': only lab teach, run and sequence ask a language model, and not sessions by the "
        "thousand: record one lesson with it, then name recorded:DIR"
    )


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


def _evaluator(name: AdvisorName, level: Level) -> "Advisor":
    assert name.inner is not None
    assert name.judging is not None
    judged_by = ADVISORS[name.inner.row].make(name.inner, level)
    assert judged_by is not None
    try:
        return level.evaluator(judged_by, name.judging)
    except BadInput as error:
        raise BadInput(f"advisor '{name}': {error}") from None


def _learned(name: AdvisorName, level: Level) -> "Advisor":
    try:
        return level.learned(name.policy)
    except BadInput as error:
        raise BadInput(f"advisor '{name}': {error}") from None


def _person_name(text: str) -> str:
    """The name of a person. Raises BadInput for one that is long, or not of letters, digits, spaces and hyphens."""
    if len(text) > MOST_NAME or not re.fullmatch(r"[^\W_]+(?:[ -][^\W_]+)*", text):
        raise BadInput(
            f"name '{shortened(text)}': wanted at most {MOST_NAME} letters, digits, single spaces and hyphens"
        )
    return text


# prefix -> row, field of AdvisorName, the type of that field, the error text if it is empty
PREFIXED: dict[str, tuple[str, str, Callable[[str], Any], str]] = {
    "recorded": ("recorded:DIR", "folder", Path, "no file: wanted recorded:DIR, the folder of a session"),
    "answers": ("answers:FILE", "answers", Path, "no file: wanted answers:FILE, see docs/teaching.md"),
    "policy": ("policy:NAME", "policy", str, "no policy: wanted policy:NAME; see lab toolbox list"),
    "web": ("web:PERSON", "person", _person_name, "nobody: wanted web:PERSON, one of several people with a page each"),
    "llm": ("llm:URL", "model", ModelAddress.of, f"no server: wanted {MODEL_WANTED}"),
}
PRAISE, PRAISE_ROW = "praise", "praise:WHO"
PRAISED = "praise:WHO, an advisor who names moves or a person, such as praise:expert or praise:late=2:terminal"
NO_EVALUATORS = ("none", "llm:URL", PRAISE_ROW)  # the rows of those who cannot judge
PYTHON = "python"  # the row of an advisor that is in no table
PEOPLE = {"terminal": "prompt", "web": "page"}
MODEL = "llm:"  # begins the name of a language model
PAGE_OF = "web:"  # begins the name of one of several people with a page each
MOST_NAME = 40  # characters of a person's name
# the rows of those whose answers nothing can compute again: a journal holds them
EXTERNAL = (*PEOPLE, "web:PERSON", "llm:URL")
SKILL_TAUS = {"expert": 0.01, "moderate": 0.1, "limited": 0.3, "novice": 1.0}


WANTED = "a function of a request, or a class with `advise` that is made with nothing or with `rng`"


class AddedAdvisor:
    """An advisor from other code, whose answers are checked.

    The class of an advisor is made with `rng`, a generator of the session's seed that nobody else draws from, if it takes that.
    """

    def __init__(self, name: object, thing: Any, rng: "np.random.Generator"):
        if isinstance(thing, type):
            thing = thing(rng=rng.spawn(1)[0]) if takes_generator(thing) else thing()
        self._name, self._ask = name, getattr(thing, "advise", thing)
        self.followed = getattr(thing, "followed", None)

    def advise(self, request: "Request") -> int | None:
        """The advisor's answer. Raises BadInput, which names the advisor, if it is neither an allowed action nor None."""
        answer = self._ask(request)
        return None if answer is None else checked_action(answer, request.allowed, f"advisor '{self._name}'")


def _is_advisor_class(thing: Any) -> bool:
    return isinstance(thing, type) and hasattr(thing, "advise") and (takes(thing) or takes_generator(thing))


def _adopted(name: str, thing: Any) -> AdvisorKind:
    if not (_is_advisor_class(thing) or (not isinstance(thing, type) and takes(thing, "request"))):
        raise wanted(thing, WANTED)
    return AdvisorKind(lambda name, level: AddedAdvisor(name, thing, level.rng), first_line(thing))


_SHIPPED: dict[str, AdvisorKind] = {
    **{name: AdvisorKind(_simulated) for name in SKILL_TAUS},
    "wrong": AdvisorKind(lambda name, level: level.simulated((SKILL_TAUS["expert"],), -1.0)),
    **{name: AdvisorKind(_person) for name in PEOPLE},
    "none": AdvisorKind(lambda name, level: None),
    "tau=X": AdvisorKind(_simulated),
    "tau=X..Y": AdvisorKind(_simulated, "changing over the episodes"),
    "accuracy=X": AdvisorKind(_of_accuracy, "the share of optimal answers"),
    "recorded:DIR": AdvisorKind(_recorded, "a session's folder"),
    "answers:FILE": AdvisorKind(_answers, 'answers kept as JSON, {"state": "action"}'),
    "policy:NAME": AdvisorKind(_learned, "a policy in the toolbox, or its file"),
    "llm:URL": AdvisorKind(_language_model, "a language model behind a server with chat completions"),
    "web:PERSON": AdvisorKind(_person, "one of several people, who have a page each"),
    PRAISE_ROW: AdvisorKind(_evaluator, "praises and blames moves as one of these would, WHO, or a person"),
}
ADVISORS = Family("advisors", _SHIPPED, _adopted)


def is_external(name: str) -> bool:
    """Whether an advisor of this name asks one of EXTERNAL: a person, also one who only judges, or a language model."""
    return split_praise(name)[0] in PEOPLE or name.startswith((MODEL, PAGE_OF))


def shown_name(name: str) -> str:
    """An advisor's name for people: of one of several people, the person's."""
    return name.removeprefix(PAGE_OF)


def named() -> list[str]:
    """The names without parameters."""
    return [name for name in ADVISORS if not {"=", ":"} & {*name}]


def make_advisor(name: AdvisorName, level: Level) -> "Advisor | None":
    """The advisor of that name for a level, None for "none".

    Raises BadInput if there is no way to ask the person, if a record does not fit, and if the exact values cannot be computed.
    """
    if name.itself is None:
        return ADVISORS[name.row].make(name, level)
    thing: Any = name.itself
    if type(thing).__module__.partition(".")[0] == "lab" and hasattr(thing, "advise"):
        advisor: Advisor = thing  # one of the lab's own, such as a table of advice
        return advisor
    return AddedAdvisor(name, thing, level.rng)


def recorded_fault(record: Read, what: str, signature: str) -> BadInput:
    """The error for a record of another problem; what: "problem" or "order"; signature: the one that is needed."""
    recorded = record.session
    return BadInput(
        f"it is advice about another {what}, '{recorded.problem}' ({recorded.signature[:8]}): wanted {signature[:8]}"
    )
