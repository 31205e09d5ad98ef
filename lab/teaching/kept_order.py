"""Advice on the order of the transfers, kept: its journal, and what is needed to go on with it or to look at it again."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

from annotated_types import Ge

from lab.advice.advisors import AdvisorName
from lab.advice.entries import Read, Session, line_of, read_journal
from lab.advice.journal import Journal
from lab.advice.order_level import signature_of
from lab.advice.receipt import Receipt, receipt
from lab.errors import BadInput
from lab.learning.settings import GateSettings
from lab.sequencing.cell.cell import Cell
from lab.tasks.record import write_whole
from lab.tasks.task_file import is_path, names_file
from lab.teaching.kept_session import claimed, lab_version
from lab.toolbox.registry import Toolbox, default_folder


@dataclass(frozen=True)
class OrderWords:
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

    def complete(self) -> "OrderWords":
        """Themselves; BadInput when nothing is named to sequence."""
        if not self.task:
            raise BadInput("nothing to sequence (TASK): name a task or a cell, or go on with --resume DIR")
        return self

    @property
    def asked(self) -> AdvisorName:
        """The advisor; BadInput for a name that nobody has."""
        return AdvisorName.of(self.advisor, "--advisor")

    def to_json(self) -> dict[str, Any]:
        """A plain dict, files by their whole paths, so that they are found from another folder."""
        is_file = names_file(self.task) and Path(self.task).is_file()
        return asdict(replace(self, task=str(Path(self.task).absolute()) if is_file else self.task))


class OrderSession:
    """A session of `lab sequence`: a new one, or (`read`) one that is gone on with or, `read_only`, looked at again."""

    def __init__(
        self, words: OrderWords, toolbox: Toolbox, read: Read | None = None, *, read_only: bool = False
    ) -> None:
        self.words, self.read = words, read
        self._toolbox, self._read_only = toolbox, read_only
        self.journal: Journal | None = None
        self.folder = None if read is None else read.path.parent

    def keep(self, name: str, cell: Cell, objective: str) -> Journal:
        """The journal, once the cell is known; BadInput when it is not the kept session's any more."""
        signature, read = signature_of(cell, objective), self.read
        if read is None:
            self.folder = claimed(self._toolbox, f"order of {name}", Path.mkdir)
            words = self.words.to_json()
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
        box = "" if self._toolbox.folder == default_folder() else f" --toolbox {quote(str(self._toolbox.folder))}"
        return f"; go on with: lab sequence --resume {quote(str(self.folder))}{box}"

    def receipt(self) -> Receipt:
        """What the advice was worth."""
        entries = [] if self.journal is None else self.journal.entries
        return receipt(entries, None, None, GateSettings.window, certain=False)

    def worth(self) -> dict[str, Any]:
        """Where it is kept, and its receipt, which is written beside the journal; nothing where nothing is kept."""
        if self.folder is None or self.journal is None:
            return {}
        made = self.receipt()
        write_whole(self.folder / "receipt.json", json.dumps(made.to_json(), indent=1, allow_nan=False) + "\n")
        return {"session": str(self.folder), "receipt": made.to_json() | {"lines": made.lines()}}

    def replayed(self) -> dict[str, Any]:
        """The document of `lab replay --json`."""
        read, made = self.read, self.receipt()
        assert read is not None
        return {
            "session": str(self.folder),
            "problem": read.session.problem,
            "words": read.session.words,
            "seed": self.words.seed,
            "lab": read.session.lab,
            "closed": None if read.closed is None else asdict(read.closed),
            "cut": read.cut,
            "events": [json.loads(line_of(entry)) for entry in read.entries],
            "receipt": made.to_json() | {"lines": made.lines()},
        }


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
        words = TypeAdapter(OrderWords).validate_python(read.session.words)
    except ValidationError as error:
        why = " ".join(str(error).split())[:160]
        raise BadInput(f"journal '{read.path}' ({where}): its options are none of lab sequence: {why}") from None
    return OrderSession(words, toolbox, read, read_only=read_only)


def gone_on(given: OrderWords, folder: Path, toolbox: Toolbox) -> OrderSession:
    """The session that --resume names; BadInput when it is over, and for options beside it."""
    kept = kept_order(folder, "--resume", toolbox)
    for name, value in asdict(given).items():
        if value != getattr(OrderWords(), name):
            option = "TASK" if name == "task" else f"--{name}"
            raise BadInput(f"{option} beside --resume {folder}: a session goes on as it was begun: leave it away")
    assert kept.read is not None
    kept.read.check_goes_on()
    return kept


def outside(kept: OrderSession) -> Sequence[str]:
    """The files outside its own folder that a session names, and that are read when it goes on or is shown again."""
    task, recorded = kept.words.task, kept.words.asked.folder
    assert kept.folder is not None
    here = kept.folder.resolve()
    files = [task] if is_path(task) and Path(task).is_file() else []
    files += [] if recorded is None else [str(recorded)]
    return [name for name in files if not Path(name).resolve().is_relative_to(here)]
