"""Sessions in folders: new ones with their journals, and stored ones that are resumed or replayed."""

import json
import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from itertools import count
from pathlib import Path
from shlex import quote
from typing import Any, TypeVar

from lab.advice.advisors import MODEL, split_praise
from lab.advice.entries import FILE, Read, SessionEntry, is_unbegun, line_of, read_journal
from lab.advice.journal import Journal
from lab.advice.receipt import Receipt, receipt
from lab.errors import BadInput, WorkFailed
from lab.learning.environment import TableEnvironment
from lab.learning.problem import Problem
from lab.mdp import FloatArray
from lab.skills import SKILLS
from lab.tasks.record import write_whole
from lab.tasks.task_file import names_file
from lab.teaching.kept_inputs import code_lines, keep_inputs, kept_table, read_inputs, replaced, version_lines
from lab.teaching.lesson_options import DEFAULT_TASK, LessonOptions, SessionOptions, recorded_whole
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.named_problems import PROBLEMS, is_named
from lab.toolbox.folder_place import FolderPlace
from lab.toolbox.names import BEGUN, SESSIONS, SUFFIX, default_address, slug
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import encode
from lab.toolbox.registry import Toolbox
from lab.version import __version__

MOST_VALUES = 3_000_000  # entries of a table; the optimal values of larger ones take too long to compute
Options = TypeVar("Options", bound=SessionOptions)


class SessionInFolder:
    """The base class of sessions in folders, about a table or about an order.

    folder, journal: None before the session begins; plan: None for an order; read: the journal that was read, None for a new
    session; notes: lines about what a replay stands on.
    """

    options: SessionOptions
    notes: Sequence[str] = ()
    folder: Path | None = None
    journal: Journal | None = None
    plan: LessonPlan | None = None
    read: Read | None = None

    def receipt(self) -> Receipt:
        """The receipt for the advice; for an order the optimal values are unknown."""
        if self.plan is None or self.journal is None:
            return receipt([] if self.journal is None else self.journal.entries, None, None, certain=False)
        return receipt_of(self.plan, self.journal, known_values(self.plan))

    def worth(self) -> dict[str, Any]:
        """The folder and the receipt, which is written beside the journal; {} if nothing is stored.

        Raises BadInput if the journal has been removed, or if the receipt cannot be written.
        """
        if self.folder is None or self.journal is None:
            return {}
        if self.journal.path is not None and not self.journal.path.exists():
            raise BadInput(f"journal '{self.journal.path}' is gone: its folder was removed or renamed meanwhile")
        made = self.receipt()
        write_whole(self.folder / "receipt.json", json.dumps(made.to_json(), indent=1, allow_nan=False) + "\n")
        return {"session": str(self.folder), "receipt": made.to_json() | {"lines": made.lines()}}

    def resume_command(self, toolbox: Toolbox) -> str:
        """The end of a message that names the command to resume the session; "" if there is nothing to resume."""
        if self.folder is None or self.journal is None:
            return ""
        box = "" if toolbox.address == default_address() else f" --toolbox {quote(toolbox.address)}"
        advisors = named_with(self.options.advisor_names)
        return f"; go on with: lab {self.options.command} --resume {quote(str(self.folder))}{advisors}{box}"

    def replayed(self) -> dict[str, Any]:
        """The document of `lab replay --json`."""
        assert self.read is not None
        read, made = self.read, self.receipt()
        return {
            "session": str(read.path.parent),
            "problem": read.session.problem,
            "words": read.session.words,
            "seed": self.options.seed,
            "lab": read.session.lab,
            "closed": None if read.closed is None else asdict(read.closed),
            "cut": read.cut,
            "events": [json.loads(line_of(entry)) for entry in read.entries],
            "receipt": made.to_json() | {"lines": made.lines()},
        }


def read_session(folder: Path, where: str, kind: type[Options]) -> tuple[Read, Options]:
    """The journal in a folder and the options of its session. Raises BadInput if it is another command's."""
    read = read_journal(folder, where)
    which = f"journal '{read.path}' ({where})"
    if read.session.command != kind.command:
        raise BadInput(f"{which}: {kind.wanted}")
    return read, kind.from_json(read.session.words, which)


def kept_journal(read: Read, read_only: bool) -> Journal:
    """The journal of a stored session, which answers for people up to its last entry."""
    return Journal(None, read.effective(), True, read.path) if read_only else Journal.resume(read)


def receipt_of(plan: LessonPlan, journal: Journal, values: FloatArray | None) -> Receipt:
    """The receipt for the advice in a lesson so far; values: the optimal ones (S, A), None if unknown."""
    problem = plan.problem
    return receipt(journal.entries, problem.mdp, values, plan.gate.window, certain=problem.environment is None)


def known_values(plan: LessonPlan) -> FloatArray | None:
    """The optimal action values of a lesson's problem, None if they cannot be computed."""
    problem, mdp = plan.problem, plan.problem.mdp
    if mdp.n_states * mdp.n_actions > MOST_VALUES:
        return None
    try:
        return (problem.environment or TableEnvironment(mdp)).values(plan.learner.discount)
    except WorkFailed:
        return None


class NewSession(SessionInFolder):
    """A new session in a folder, by default in the toolbox's folder `sessions`; its journal is created when the lesson begins."""

    def __init__(self, folder: Path | None, toolbox: Toolbox, options: LessonOptions):
        self._wanted, self._toolbox = folder, toolbox
        self.options: LessonOptions = options

    def keep(self, plan: LessonPlan) -> Journal:
        """The journal of a lesson. Raises BadInput if the folder already holds a session."""
        self.plan, problem = plan, plan.problem
        self.folder = claimed(self._toolbox, problem.name, Path.mkdir) if self._wanted is None else self._wanted
        if plan.begins_from is not None:
            begun = FolderPlace(self.folder / BEGUN)
            begun.write(f"{slug(plan.begins_from.name)}{SUFFIX}", encode(plan.begins_from))
        head = SessionEntry(
            self.options.to_json(),
            problem.name,
            problem.mdp.signature,
            __version__,
            asdict(plan.learner),
            asdict(plan.gate),
            "" if plan.begins_from is None else plan.begins_from.name,
        )
        self.journal = Journal.begin(self.folder, head)
        try:
            keep_inputs(self.folder, named_files(self.options), *self._from_code(plan))
        except BadInput:
            self.journal.close()
            raise
        if self._wanted is not None:
            target = self.folder.resolve()
            with suppress(BadInput):  # without a link the session is merely not listed
                claimed(self._toolbox, problem.name, lambda place: place.symlink_to(target, target_is_directory=True))
        return self.journal

    def _from_code(self, plan: LessonPlan) -> tuple[Problem | None, list[str], str]:
        """(the problem if it comes from no file, names that may be those of own code, the module that is imported)."""
        options = self.options
        problem = plan.problem if not named_files(options) and options.view in (None, "full") else None
        members = [options.subtask.partition(":")[0], plan.learner.learner, plan.gate.gate]
        members += [part for name in options.advisors for part in (name, split_praise(name)[0])]
        module = ""
        if options.subtask.startswith("gym:"):
            from lab.gym import parse_name

            module, problem = parse_name(options.subtask, "SUBTASK").module, None
        return problem, members, module


def named_files(options: LessonOptions) -> dict[str, str]:
    """The task, or the world, that the options of a lesson name, by option; {} if they name neither."""
    name = options.subtask
    if names_file(name):
        return {"subtask": name}
    if name.startswith("gym:") or (options.task is None and name not in SKILLS and is_named(name)):
        return {}
    return {"task": options.task or DEFAULT_TASK}


def claimed(toolbox: Toolbox, name: str, make: Callable[[Path], None]) -> Path:
    """A new folder for a session of this problem, made by `make`; no two processes get the same one."""
    plain = slug(name.lower().replace(" ", "-"))
    numbers, folder = count(1), toolbox.folder / SESSIONS
    try:
        folder.mkdir(parents=True, exist_ok=True)
        while True:
            folder = toolbox.folder / SESSIONS / f"{plain}-{next(numbers)}"
            with suppress(FileExistsError):
                make(folder)
                return folder
    except OSError as error:
        raise BadInput(f"toolbox {toolbox.folder}: {folder}: {error.strerror or error}") from error


class KeptSession(SessionInFolder):
    """A stored session, to be resumed or replayed (`read_only`). Raises BadInput if there is none.

    where: the option that names it, for messages; trusted: the modules that the session may import: it may come from somebody
    else, and importing a module runs its code. In a replay, the folder's own copies are used where what was learned on is not
    here or was changed: `notes` says so, and `table` is a problem whose code is not here.
    """

    options: LessonOptions
    read: Read
    table: Problem | None = None

    def __init__(self, folder: Path, where: str, *, read_only: bool = False, trusted: Sequence[str] = ()):
        self.read, self.options = read_session(folder, where, LessonOptions)
        self.folder: Path = self.read.path.parent
        self._read_only, self.where, self.trusted = read_only, where, trusted
        inputs = read_inputs(self.folder) if read_only else None
        if inputs is not None:
            copies, self.notes = replaced(self.folder, inputs, named_files(self.options))
            self.options = replace(self.options, **copies)
            if self.options.subtask.partition(":")[0] not in PROBLEMS:
                self.table = kept_table(self.folder, inputs)
            self.notes += code_lines(inputs, self.table is not None) + version_lines(inputs)

    def keep(self, plan: LessonPlan) -> Journal:
        """The journal, which answers up to its last entry. Raises BadInput if problem or settings have changed."""
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
            if changed := [name for name in now if name not in then or then[name] != now[name]]:
                name = changed[0]
                raise BadInput(
                    f"session '{self.folder}' ({self.where}): its {what} had {name} = {then.get(name)!r}, and the task now "
                    f"gives {now[name]!r}: its file has changed"
                )
        self.journal = kept_journal(self.read, self._read_only)
        return self.journal

    def same(self, given: LessonOptions) -> LessonOptions:
        """The options of the session. Raises BadInput if the command names others, or if the session has ended."""
        check_same(given, self.options, self.read)
        return self.options

    def begun(self, problem: Problem) -> Policy | None:
        """The policy that the session continued or was warm-started from, None if it began anew.

        Raises BadInput if that policy is missing.
        """
        name = self.read.session.continues
        if not name:
            return None
        kept, _ = Toolbox(self.folder / BEGUN).index()
        for policy in kept.values():
            if (policy.name, policy.subtask) == (name, problem.subtask):
                return policy
        raise BadInput(f"session '{self.folder}': the policy that it went on from is not in '{BEGUN}' any more")


def check_same(given: Any, options: SessionOptions, read: Read) -> None:
    """Raises BadInput if a command that resumes a session also names options, or if the session has ended.

    Where a language model advises, the advisors have to be named again, see `check_named`.
    """
    nothing = type(given)()
    check_alone(check_named(given, options, nothing, read.path.parent), nothing, read.path.parent)
    read.check_goes_on()


def check_named(given: Any, options: SessionOptions, nothing: SessionOptions, folder: Path) -> Any:
    """The given options, without their advisors where these had to be named again: where a language model is among them.

    A journal may come from somebody else, and no file decides where questions and a key are sent. options: those of the journal;
    nothing: the options at their defaults. Raises BadInput if other advisors were named, or none.
    """
    if not any(name.startswith(MODEL) for name in options.advisor_names):
        return given
    if [*map(recorded_whole, given.advisor_names)] != [*map(recorded_whole, options.advisor_names)]:
        raise BadInput(
            f"--resume {folder}: a language model is asked there, which has to be named again, because no file decides where "
            f"questions are sent: add{named_with(options.advisor_names)}"
        )
    return replace(given, **{given.advisor_field: getattr(nothing, given.advisor_field)})


def named_with(advisors: Sequence[str]) -> str:
    """The advisors as options of a command that resumes their session: all if a language model is among them, else ""."""
    if not any(name.startswith(MODEL) for name in advisors):
        return ""
    return "".join(f" --advisor {quote(name)}" for name in advisors)


def check_alone(given: Any, nothing: Any, folder: Path) -> None:
    """Raises BadInput if options were given beside --resume; nothing: the options at their defaults."""
    for name, value in asdict(given).items():
        if value != getattr(nothing, name):
            option = given.typed.get(name, f"--{name}")
            raise BadInput(f"{option}: --resume takes its options from the session in {folder}; remove {option}")


def check_new(folder: Path) -> None:
    """Raises BadInput if a folder (--out) holds a session, because its files would belong to another lesson."""
    path = folder / FILE
    if not os.path.lexists(path) or is_unbegun(path):
        return
    is_over = False
    with suppress(BadInput):
        is_over = read_journal(path, "--out").closed is not None
    what, then = ("is over", "look at it again") if is_over else ("is not over", "go on with it")
    command = f"lab replay {quote(str(folder))}" if is_over else f"lab teach --resume {quote(str(folder))}"
    raise BadInput(f"'{folder}' (--out) holds a session that {what}: {then} ({command}), or choose another folder")
