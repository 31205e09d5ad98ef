"""Stored sessions of advice on the order of transfers: their options and journals, for resuming and replaying them."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

from annotated_types import Ge

from lab.advice.advisors import AdvisorName
from lab.advice.entries import MAX_BYTES, Read, SessionEntry
from lab.advice.journal import Journal
from lab.advice.order_level import signature_of
from lab.errors import BadInput
from lab.files import json_of, read_limited
from lab.sequencing.cell.cell import Cell
from lab.tasks.instances import InstanceRequest
from lab.tasks.record import write_whole
from lab.tasks.task_file import whole_path
from lab.teaching.kept_inputs import keep_inputs, read_inputs, replaced, version_lines
from lab.teaching.kept_session import SessionInFolder, check_same, claimed, kept_journal, read_session
from lab.teaching.lesson_options import SessionOptions
from lab.toolbox.registry import Toolbox
from lab.version import __version__

DURATIONS = "durations.json"  # beside the journal of a run's order


@dataclass(frozen=True)
class OrderSessionOptions(SessionOptions):
    """The options of `lab sequence` that a session depends on; None or empty if not given."""

    command = "sequence"
    wanted = "it is no advice on an order: lab teach --resume goes on with it"
    typed: ClassVar[Mapping[str, str]] = {"task": "TASK"}
    advisor_field = "advisor"

    task: str = ""
    case: str | None = None
    toasts: int | None = None
    method: str | None = None
    objective: str | None = None
    episodes: Annotated[int, Ge(1)] | None = None
    sessions: Annotated[int, Ge(1)] = 1
    stochastic: bool = False
    advisor: str = "none"
    gate: str = "ccrl"
    seed: Annotated[int, Ge(0)] = 0
    parts: str | None = None
    layout: str | None = None
    robots: Annotated[int, Ge(1)] | None = None
    policy: str | None = None
    seconds: float | None = None
    gap: float | None = None
    practice: str | None = None
    keep_policy: str | None = None

    def complete(self) -> "OrderSessionOptions":
        """The options themselves. Raises BadInput if they name nothing to sequence."""
        if not self.task:
            raise BadInput("nothing to sequence (TASK): name a task or a cell, or go on with --resume DIR")
        return self

    @property
    def asked(self) -> AdvisorName:
        """The advisor. Raises BadInput for an unknown name."""
        return AdvisorName.of(self.advisor, "--advisor")

    @property
    def advisors(self) -> tuple[str, ...]:
        """The names of all advisors."""
        return (self.advisor,)

    def to_json(self) -> dict[str, Any]:
        """A plain dict with absolute paths, which are valid from any folder."""
        beside = {"layout": self.layout, "policy": self.policy}
        whole = {name: None if path is None else str(Path(path).absolute()) for name, path in beside.items()}
        later = {
            name for name in ("practice", "keep_policy") if getattr(self, name) is None
        }  # older journals lack them
        given = {name: value for name, value in asdict(self).items() if name not in later}
        return given | {"task": whole_path(self.task)} | whole

    @property
    def beside(self) -> InstanceRequest:
        """The options that apply to an instance file."""
        return InstanceRequest(None if self.layout is None else Path(self.layout), self.robots, self.case)


class OrderSession(SessionInFolder):
    """A session of `lab sequence`: a new one, or a stored one (`read`) that is resumed or replayed (`read_only`)."""

    def __init__(
        self,
        options: OrderSessionOptions,
        toolbox: Toolbox,
        read: Read | None = None,
        *,
        read_only: bool = False,
        durations: Mapping[str, Any] | None = None,
        out: Path | None = None,
    ) -> None:
        """durations: for a new session of a run, those that the run plans with; they are stored beside the journal.

        out: the folder of a new session, by default one in the toolbox.
        """
        self.options: OrderSessionOptions = options
        self._durations = durations
        self.read = read
        self._toolbox, self._read_only, self._out = toolbox, read_only, out
        self.folder = None if read is None else read.path.parent

    def durations(self) -> Mapping[str, Any] | None:
        """The durations that a run plans with, None for measured ones. Raises BadInput for a damaged file."""
        if self._durations is not None or self.folder is None or not (self.folder / DURATIONS).exists():
            return self._durations
        try:
            document = json_of(read_limited(self.folder / DURATIONS, MAX_BYTES))
        except (OSError, ValueError) as error:
            raise BadInput(f"'{self.folder / DURATIONS}' cannot be read: {error}") from None
        if not isinstance(document, dict):
            raise BadInput(f"'{self.folder / DURATIONS}': it holds no durations")
        return document

    def keep(self, cell: Cell, objective: str) -> Journal:
        """The journal, once the cell is known. Raises BadInput if the cell is not that of the stored session."""
        signature, read = signature_of(cell, objective), self.read
        if read is None:
            name = f"order of {Path(self.options.task).stem}"
            self.folder = claimed(self._toolbox, name, Path.mkdir) if self._out is None else self._out
            if self._durations is not None:
                write_whole(self.folder / DURATIONS, json.dumps(dict(self._durations), indent=1) + "\n")
            head = SessionEntry(self.options.to_json(), name, signature, __version__, command="sequence")
            self.journal = Journal.begin(self.folder, head)
            try:
                keep_inputs(self.folder, named_files(self.options))
            except BadInput:
                self.journal.close()
                raise
        elif read.session.signature != signature:
            raise BadInput(
                f"session '{self.folder}': it is about '{read.session.problem}' ({read.session.signature[:8]}), and now the "
                f"cell is another one ({signature[:8]}): its file, or what its moves were measured with, has changed"
            )
        else:
            self.journal = kept_journal(read, self._read_only)
        return self.journal


def kept_order(folder: Path, where: str, toolbox: Toolbox, *, read_only: bool = False) -> OrderSession:
    """A stored session of `lab sequence`. Raises BadInput for anything else.

    A replay (`read_only`) stands on the session's own copies of files that are not here or were changed.
    """
    read, options = read_session(folder, where, OrderSessionOptions)
    inputs = read_inputs(read.path.parent) if read_only else None
    if inputs is None:
        return OrderSession(options, toolbox, read, read_only=read_only)
    copies, lines = replaced(read.path.parent, inputs, named_files(options))
    kept = OrderSession(replace(options, **copies), toolbox, read, read_only=read_only)
    kept.notes = lines + version_lines(inputs)
    return kept


def named_files(options: OrderSessionOptions) -> dict[str, str]:
    """The files that the options of a session name, by option."""
    named = {"task": options.task, "layout": options.layout, "policy": options.policy}
    return {option: word for option, word in named.items() if word}


def gone_on(given: OrderSessionOptions, folder: Path, toolbox: Toolbox) -> OrderSession:
    """The session that --resume names. Raises BadInput if it has ended, and for further options."""
    read, options = read_session(folder, "--resume", OrderSessionOptions)
    check_same(given, options, read)
    return OrderSession(options, toolbox, read)
