"""Advice on the order of the transfers, kept: its journal, and what is needed to go on with it or to look at it again."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge

from lab.advice.advisors import AdvisorName
from lab.advice.entries import Read, Session, read_journal
from lab.advice.journal import Journal
from lab.advice.order_level import signature_of
from lab.advice.receipt import Receipt, receipt
from lab.errors import BadInput
from lab.learning.settings import GateSettings
from lab.sequencing.cell.cell import Cell
from lab.tasks.task_file import names_file
from lab.teaching.kept_session import check_same, claimed, lab_version, replayed, resume_command, worth_of
from lab.toolbox.registry import Toolbox


@dataclass(frozen=True)
class OrderOptions:
    """The options of `lab sequence` that a session depends on, by name; None or empty: not given."""

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

    def complete(self) -> "OrderOptions":
        """Themselves; BadInput when nothing is named to sequence."""
        if not self.task:
            raise BadInput("nothing to sequence (TASK): name a task or a cell, or go on with --resume DIR")
        return self

    @property
    def asked(self) -> AdvisorName:
        """The advisor; BadInput for a name that nobody has."""
        return AdvisorName.of(self.advisor, "--advisor")

    @property
    def advisors(self) -> tuple[str, ...]:
        """All who advise, by name."""
        return (self.advisor,)

    def to_json(self) -> dict[str, Any]:
        """A plain dict, files by their whole paths, so that they are found from another folder."""
        is_file = names_file(self.task) and Path(self.task).is_file()
        return asdict(replace(self, task=str(Path(self.task).absolute()) if is_file else self.task))


class OrderSession:
    """A session of `lab sequence`: a new one, or (`read`) one that is gone on with or, `read_only`, looked at again."""

    def __init__(
        self, options: OrderOptions, toolbox: Toolbox, read: Read | None = None, *, read_only: bool = False
    ) -> None:
        self.options, self.read = options, read
        self._toolbox, self._read_only = toolbox, read_only
        self.where = "--resume"
        self.journal: Journal | None = None
        self.folder = None if read is None else read.path.parent

    def keep(self, name: str, cell: Cell, objective: str) -> Journal:
        """The journal, once the cell is known; BadInput when it is not the kept session's any more."""
        signature, read = signature_of(cell, objective), self.read
        if read is None:
            self.folder = claimed(self._toolbox, f"order of {name}", Path.mkdir)
            words = self.options.to_json()
            head = Session(words, f"order of {name}", signature, lab_version(), command="sequence")
            self.journal = Journal.begin(self.folder, head)
        elif read.session.signature != signature:
            raise BadInput(
                f"session '{self.folder}': it is about '{read.session.problem}' ({read.session.signature[:8]}), and now the "
                f"cell is another one ({signature[:8]}): its file, or what its moves were measured with, has changed"
            )
        else:
            self.journal = Journal(None, read.effective(), read_only=True) if self._read_only else Journal.resume(read)
        return self.journal

    def resume_command(self) -> str:
        """What goes on with it; "" when there is nothing to go on with."""
        if self.folder is None or self.journal is None:
            return ""
        return f"; go on with: {resume_command(self.folder, self._toolbox, 'sequence')}"

    def receipt(self) -> Receipt:
        """What the advice was worth."""
        entries = [] if self.journal is None else self.journal.entries
        return receipt(entries, None, None, GateSettings.window, certain=False)

    def worth(self) -> dict[str, Any]:
        """Where it is kept, and its receipt, which is written beside the journal; nothing where nothing is kept."""
        if self.folder is None or self.journal is None:
            return {}
        return worth_of(self.folder, self.receipt())

    def replayed(self) -> dict[str, Any]:
        """The document of `lab replay --json`."""
        assert self.read is not None
        return replayed(self.read, self.options.seed, self.receipt())


def is_order(folder: Path, where: str) -> bool:
    """Whether the session in a folder is one of `lab sequence`. Raises BadInput for none."""
    return read_journal(folder, where).session.command == "sequence"


def kept_order(folder: Path, where: str, toolbox: Toolbox, *, read_only: bool = False) -> OrderSession:
    """A session of `lab sequence` that was kept. Raises BadInput for anything else."""
    from pydantic import TypeAdapter, ValidationError

    read = read_journal(folder, where)
    if read.session.command != "sequence":
        raise BadInput(
            f"journal '{read.path}' ({where}): it is no advice on an order: lab teach --resume goes on with it"
        )
    try:
        options = TypeAdapter(OrderOptions).validate_python(read.session.words)
    except ValidationError as error:
        why = " ".join(str(error).split())[:160]
        raise BadInput(f"journal '{read.path}' ({where}): its options are none of lab sequence: {why}") from None
    return OrderSession(options, toolbox, read, read_only=read_only)


def gone_on(given: OrderOptions, folder: Path, toolbox: Toolbox) -> OrderSession:
    """The session that --resume names; BadInput when it is over, and for options beside it."""
    kept = kept_order(folder, "--resume", toolbox)
    assert kept.read is not None
    check_same(given, kept.read, {"task": "TASK"})
    return kept
