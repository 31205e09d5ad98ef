"""Sessions kept in folders: where a journal is written, how a session goes on, and how it is looked at again."""

import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

from annotated_types import Ge, Le

from lab.advice.entries import FILE, Read, Session, read_journal
from lab.advice.journal import Journal
from lab.advice.receipt import Receipt, receipt
from lab.errors import BadInput, WorkFailed
from lab.learning.environment import TableEnvironment
from lab.learning.problem import Problem
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import FloatArray
from lab.tasks.task_file import names_file
from lab.teaching.teacher import MAX_SESSIONS, Keep
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox, slug

SESSIONS = "sessions"  # the folder in the toolbox
_BEGUN = "begun"  # the folder in a session's folder for the policy that it went on from
_MOST = 100_000  # sessions of one name


DEFAULT_ADVISORS = ("expert",)
_OPTIONS = {
    "subtask": "SUBTASK",
    "advisors": "--advisor",
    "asked": "--ask",
    "view": "--sight",
}  # that are called otherwise than their fields


@dataclass(frozen=True)
class Words:
    """The options of `lab teach` that a session depends on, by name; None or empty: not given.

    toasts and sessions: how many slices, and at most how many sessions, the lesson of a `lab run` had.
    """

    subtask: str = ""
    task: str | None = None
    view: str | None = None
    learner: str | None = None
    gate: str | None = None
    memory: bool | None = None
    advisors: tuple[str, ...] = ()
    asked: str = "together"
    decide: str = "trust-weighted"
    episodes: Annotated[int, Ge(1)] | None = None
    seed: Annotated[int, Ge(0)] = 0
    save: str | None = None
    toasts: int | None = None
    sessions: Annotated[int, Ge(1), Le(MAX_SESSIONS)] | None = None

    def complete(self) -> "Words":
        """With the advisor that is asked when none is named; BadInput when nothing is named to learn."""
        if not self.subtask:
            raise BadInput("nothing to learn (SUBTASK): name a sub-task, a world or gym:ID, or go on with --resume DIR")
        return replace(self, advisors=self.advisors or DEFAULT_ADVISORS)

    def to_json(self) -> dict[str, Any]:
        """A plain dict, files by their whole paths, so that they are found from another folder."""

        def whole(name: str | None) -> str | None:
            return (
                str(Path(name).absolute()) if name is not None and names_file(name) and Path(name).is_file() else name
            )

        def recorded(name: str) -> str:
            head, _, path = name.partition("recorded:")
            return f"recorded:{Path(path).absolute()}" if path and not head else name

        changed = {"subtask": whole(self.subtask), "task": whole(self.task)}
        return asdict(self) | changed | {"advisors": [recorded(name) for name in self.advisors]}

    @classmethod
    def from_json(cls, record: dict[str, Any], where: str) -> "Words":
        """What `to_json` wrote; BadInput, naming where it stands, for anything else."""
        from pydantic import TypeAdapter, ValidationError

        try:
            return TypeAdapter(cls).validate_python(record | {"advisors": tuple(record.get("advisors", ()))})
        except (ValidationError, TypeError) as error:
            raise BadInput(
                f"{where}: its options are none of lab teach: {' '.join(str(error).split())[:160]}"
            ) from None


MOST_VALUES = 3_000_000  # a larger table's optimal values take too long to know


class _InFolder:
    """What both kinds of session know once the lesson has begun."""

    folder: Path | None = None
    journal: Journal | None = None
    problem: Problem | None = None
    learner = LearnerSettings()
    gate = GateSettings()

    def knows(self, problem: Problem, learner: LearnerSettings, gate: GateSettings) -> None:
        """The lesson begins."""
        self.problem, self.learner, self.gate = problem, learner, gate

    def receipt(self) -> Receipt:
        """What the advice was worth."""
        assert self.problem is not None
        assert self.journal is not None
        values = known_values(self.problem, self.learner.discount)
        certain = self.problem.environment is None
        return receipt(self.journal.entries, self.problem.mdp, values, self.gate.window, certain=certain)


def known_values(problem: Problem, discount: float) -> FloatArray | None:
    """The optimal action values of a problem, None where they cannot be known."""
    mdp = problem.mdp
    if mdp.n_states * mdp.n_actions > MOST_VALUES:
        return None
    try:
        return (problem.environment or TableEnvironment(mdp)).values(discount)
    except WorkFailed:
        return None


class NewSession(_InFolder):
    """A session's journal in a folder, or, without one, in the toolbox's folder `sessions`; made when the lesson begins."""

    def __init__(self, folder: Path | None, toolbox: Toolbox, words: Words):
        self._wanted, self._toolbox, self._words = folder, toolbox, words

    def keep(
        self, problem: Problem, learner: LearnerSettings, gate: GateSettings, unfinished: Policy | None
    ) -> Journal:
        """The journal of a lesson. Raises BadInput when the folder holds a session already."""
        self.knows(problem, learner, gate)
        self.folder = claimed(self._toolbox, problem.name, Path.mkdir) if self._wanted is None else self._wanted
        if unfinished is not None:
            Toolbox(self.folder / _BEGUN).save(unfinished)
        head = Session(
            self._words.to_json(),
            problem.name,
            problem.mdp.signature,
            lab_version(),
            asdict(learner),
            asdict(gate),
            "" if unfinished is None else unfinished.name,
        )
        self.journal = Journal.begin(self.folder, head)
        if self._wanted is not None:
            target = self.folder.resolve()
            with suppress(BadInput):  # where links cannot be made, it is only not listed
                claimed(self._toolbox, problem.name, lambda place: place.symlink_to(target, target_is_directory=True))
        return self.journal


def claimed(toolbox: Toolbox, name: str, make: Callable[[Path], None]) -> Path:
    """A new place for a session of this problem; what two commands make at a time, only one of them gets."""
    plain = slug(name.lower().replace(" ", "-"))
    for number in range(1, _MOST):
        folder = toolbox.folder / SESSIONS / f"{plain}-{number}"
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            make(folder)
        except FileExistsError:
            continue
        except OSError as error:
            raise BadInput(f"toolbox {toolbox.folder}: {folder}: {error.strerror or error}") from error
        return folder
    raise BadInput(f"toolbox {toolbox.folder}: it holds {_MOST} sessions of '{name}': remove some")


def kept_by(toolbox: Toolbox, words: Words) -> Keep:
    """Keeps the journal of each lesson of a run in the toolbox; it can be replayed, gone on with, and advise again."""

    def keep(problem: Problem, learner: LearnerSettings, gate: GateSettings, unfinished: Policy | None) -> Journal:
        session = NewSession(None, toolbox, replace(words, subtask=problem.name, sessions=MAX_SESSIONS))
        return session.keep(problem, learner, gate, unfinished)

    return keep


class KeptSession(_InFolder):
    """A session that was kept: to go on with it, or (`read_only`) to look at it again. Raises BadInput for none.

    trusted: modules that the session may name: it may be somebody else's, and code runs when one is imported.
    """

    def __init__(self, folder: Path, where: str, *, read_only: bool = False, trusted: Sequence[str] = ()):
        self.read: Read = read_journal(folder, where)
        self.folder = self.read.path.parent
        if self.read.session.command != "teach":
            raise BadInput(
                f"journal '{self.read.path}' ({where}): it is advice on an order: wanted a session of lab teach"
            )
        self.words = Words.from_json(self.read.session.words, f"journal '{self.read.path}' ({where})")
        self._read_only, self.where, self.trusted = read_only, where, trusted

    def keep(
        self, problem: Problem, learner: LearnerSettings, gate: GateSettings, unfinished: Policy | None
    ) -> Journal:
        """The journal, which answers until it is used up. Raises BadInput when the problem is not the same any more."""
        self.knows(problem, learner, gate)
        head = self.read.session
        if head.signature != problem.mdp.signature:
            raise BadInput(
                f"session '{self.folder}' ({self.where}): it is about '{head.problem}' ({head.signature[:8]}), and the "
                f"task now gives another problem ({problem.mdp.signature[:8]}): its file or the lab has changed"
            )
        for what, then, now in (("learner", head.learner, asdict(learner)), ("gate", head.gate, asdict(gate))):
            then = now | then  # an older journal does not know all settings of today
            if changed := [name for name in now if then[name] != now[name]]:
                name = changed[0]
                raise BadInput(
                    f"session '{self.folder}' ({self.where}): its {what} had {name} = {then[name]!r}, and the task now "
                    f"gives {now[name]!r}: its file has changed"
                )
        entries = self.read.effective()
        self.journal = Journal(None, entries, read_only=True) if self._read_only else Journal.resume(self.read)
        return self.journal

    def same(self, given: Words) -> Words:
        """The words of the session; BadInput when the command names others, and when the session is over."""
        for name, value in asdict(given).items():
            if value != getattr(Words(), name):
                option = _OPTIONS.get(name, f"--{name}")
                raise BadInput(
                    f"{option} beside --resume {self.folder}: a session goes on as it was begun: leave it away"
                )
        self.read.check_goes_on()
        return self.words

    def begun(self, problem: Problem) -> Policy | None:
        """The policy that the session went on from when it began. Raises BadInput when it is not there any more."""
        name = self.read.session.continues
        if not name:
            return None
        found = Toolbox(self.read.path.parent / _BEGUN).find(problem.subtask, problem.mdp.signature, name)
        if found is None:
            raise BadInput(f"session '{self.folder}': the policy that it went on from is not in '{_BEGUN}' any more")
        return found


def session_rows(toolbox: Toolbox) -> list[dict[str, Any]]:
    """The sessions in a toolbox, those changed last first: folder, problem, who advised, and whether it is over.

    Those kept in a folder elsewhere are links there; of one that is gone nothing is said.
    """
    found = {path.resolve() for path in (toolbox.folder / SESSIONS).glob(f"*/{FILE}")}
    rows = []
    for path in sorted(found, key=lambda path: path.stat().st_mtime, reverse=True):
        row = {"session": str(path.parent), "problem": "", "advisor": "", "state": "damaged"}
        with suppress(BadInput):
            read = read_journal(path, "toolbox")
            state = "not over" if read.closed is None else "solved" if read.closed.solved else "over"
            advisors = " + ".join(read.session.words.get("advisors") or [read.session.words.get("advisor", "")])
            row |= {"problem": read.session.problem, "advisor": advisors, "state": state}
        rows.append(row)
    return rows


def check_new(folder: Path) -> None:
    """Raises BadInput when a folder (--out) holds a session: what is kept in it would mean another lesson."""
    path = folder / FILE
    if not os.path.lexists(path):
        return
    is_over = False
    with suppress(BadInput):
        is_over = read_journal(path, "--out").closed is not None
    what, then = ("is over", "look at it again") if is_over else ("is not over", "go on with it")
    command = f"lab replay {quote(str(folder))}" if is_over else f"lab teach --resume {quote(str(folder))}"
    raise BadInput(f"'{folder}' (--out) holds a session that {what}: {then} ({command}), or choose another folder")


def lab_version() -> str:
    """The version of the lab that runs."""
    try:
        return version("teaching-lab")
    except PackageNotFoundError:  # run from a source folder
        return "unknown"
