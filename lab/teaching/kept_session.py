"""Sessions kept in folders: where a journal is written, how a session goes on, and how it is looked at again."""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from shlex import quote
from typing import Any

from lab.advice.entries import FILE, Read, Session, line_of, read_journal
from lab.advice.journal import Journal
from lab.advice.receipt import Receipt, receipt
from lab.errors import BadInput, WorkFailed
from lab.learning.environment import TableEnvironment
from lab.learning.problem import Problem
from lab.mdp import FloatArray
from lab.tasks.record import write_whole
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.lesson_plan import MAX_SESSIONS, Keep, LessonPlan
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox, default_folder, slug

SESSIONS = "sessions"  # the folder in the toolbox
_BEGUN = "begun"  # the folder in a session's folder for the policy that it went on from
_MOST = 100_000  # sessions of one name
_OPTIONS = {
    "subtask": "SUBTASK",
    "advisors": "--advisor",
    "asked": "--ask",
    "view": "--sight",
}  # that are called otherwise than their fields
MOST_VALUES = 3_000_000  # a larger table's optimal values take too long to know


class _InFolder:
    """What both kinds of session know once the lesson has begun."""

    folder: Path | None = None
    journal: Journal | None = None
    plan: LessonPlan | None = None

    def receipt(self) -> Receipt:
        """What the advice was worth."""
        assert self.plan is not None
        assert self.journal is not None
        return receipt_of(self.plan, self.journal, known_values(self.plan))


def receipt_of(plan: LessonPlan, journal: Journal, values: FloatArray | None) -> Receipt:
    """What the advice in a lesson was worth so far; values: its problem's optimal ones, None where they are not known."""
    problem = plan.problem
    return receipt(journal.entries, problem.mdp, values, plan.gate.window, certain=problem.environment is None)


def known_values(plan: LessonPlan) -> FloatArray | None:
    """The optimal action values of a lesson's problem, None where they cannot be known."""
    problem, mdp = plan.problem, plan.problem.mdp
    if mdp.n_states * mdp.n_actions > MOST_VALUES:
        return None
    try:
        return (problem.environment or TableEnvironment(mdp)).values(plan.learner.discount)
    except WorkFailed:
        return None


class NewSession(_InFolder):
    """A session's journal in a folder, or, without one, in the toolbox's folder `sessions`; made when the lesson begins."""

    def __init__(self, folder: Path | None, toolbox: Toolbox, options: LessonOptions):
        self._wanted, self._toolbox, self._options = folder, toolbox, options

    def keep(self, plan: LessonPlan) -> Journal:
        """The journal of a lesson. Raises BadInput when the folder holds a session already."""
        self.plan, problem = plan, plan.problem
        self.folder = claimed(self._toolbox, problem.name, Path.mkdir) if self._wanted is None else self._wanted
        if plan.unfinished is not None:
            Toolbox(self.folder / _BEGUN).save(plan.unfinished)
        head = Session(
            self._options.to_json(),
            problem.name,
            problem.mdp.signature,
            lab_version(),
            asdict(plan.learner),
            asdict(plan.gate),
            "" if plan.unfinished is None else plan.unfinished.name,
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


def kept_by(toolbox: Toolbox, options: LessonOptions) -> Keep:
    """Keeps the journal of each lesson of a run in the toolbox; it can be replayed, gone on with, and advise again."""

    def keep(plan: LessonPlan) -> Journal:
        own = replace(options, subtask=plan.problem.name, sessions=MAX_SESSIONS)
        return NewSession(None, toolbox, own).keep(plan)

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
        self.options = LessonOptions.from_json(self.read.session.words, f"journal '{self.read.path}' ({where})")
        self._read_only, self.where, self.trusted = read_only, where, trusted

    def keep(self, plan: LessonPlan) -> Journal:
        """The journal, which answers until it is used up. Raises BadInput when the problem is not the same any more."""
        self.plan, problem = plan, plan.problem
        head = self.read.session
        if head.signature != problem.mdp.signature:
            raise BadInput(
                f"session '{self.folder}' ({self.where}): it is about '{head.problem}' ({head.signature[:8]}), and the "
                f"task now gives another problem ({problem.mdp.signature[:8]}): its file or the lab has changed"
            )
        for what, then, now in (
            ("learner", head.learner, asdict(plan.learner)),
            ("gate", head.gate, asdict(plan.gate)),
        ):
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

    def same(self, given: LessonOptions) -> LessonOptions:
        """The options of the session; BadInput when the command names others, and when the session is over."""
        check_same(given, self.read, _OPTIONS)
        return self.options

    def begun(self, problem: Problem) -> Policy | None:
        """The policy that the session went on from when it began. Raises BadInput when it is not there any more."""
        name = self.read.session.continues
        if not name:
            return None
        found = Toolbox(self.read.path.parent / _BEGUN).find(problem.subtask, problem.mdp.signature, name)
        if found is None:
            raise BadInput(f"session '{self.folder}': the policy that it went on from is not in '{_BEGUN}' any more")
        return found


def check_same(given: Any, read: Read, names: Mapping[str, str]) -> None:
    """BadInput when a command that goes on with a session names options, too, or when the session is over.

    names: of options that are called otherwise than their fields.
    """
    for name, value in asdict(given).items():
        if value != getattr(type(given)(), name):
            option, folder = names.get(name, f"--{name}"), read.path.parent
            raise BadInput(f"{option} beside --resume {folder}: a session goes on as it was begun: leave it away")
    read.check_goes_on()


def resume_command(folder: Path | None, toolbox: Toolbox, command: str = "teach") -> str:
    """The command that goes on with a session."""
    box = "" if toolbox.folder == default_folder() else f" --toolbox {quote(str(toolbox.folder))}"
    return f"lab {command} --resume {quote(str(folder))}{box}"


def worth_of(folder: Path | None, made: Receipt) -> dict[str, Any]:
    """Where a session is kept, and what its advice was worth; the receipt is written beside the journal."""
    assert folder is not None
    write_whole(folder / "receipt.json", json.dumps(made.to_json(), indent=1, allow_nan=False) + "\n")
    return {"session": str(folder), "receipt": made.to_json() | {"lines": made.lines()}}


def replayed(read: Read, seed: int, made: Receipt) -> dict[str, Any]:
    """The document of `lab replay --json`."""
    return {
        "session": str(read.path.parent),
        "problem": read.session.problem,
        "words": read.session.words,
        "seed": seed,
        "lab": read.session.lab,
        "closed": None if read.closed is None else asdict(read.closed),
        "cut": read.cut,
        "events": [json.loads(line_of(entry)) for entry in read.entries],
        "receipt": made.to_json() | {"lines": made.lines()},
    }


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
