"""Advice on the order of the transfers, kept: its journal, and what is needed to go on with it or to look at it again."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from annotated_types import Ge

from lab import __version__
from lab.advice.advisors import AdvisorName
from lab.advice.entries import MAX_BYTES, Read, Session
from lab.advice.journal import Journal
from lab.advice.order_level import signature_of
from lab.errors import BadInput
from lab.files import json_of, read_limited
from lab.sequencing.cell.cell import Cell
from lab.tasks.instances import Asked
from lab.tasks.record import write_whole
from lab.teaching.kept_session import SessionInFolder, check_same, claimed, kept_journal, read_session
from lab.teaching.lesson_options import SessionOptions, whole_path
from lab.toolbox.registry import Toolbox

DURATIONS = "durations.json"  # beside the journal of a run's order


@dataclass(frozen=True)
class OrderOptions(SessionOptions):
    """The options of `lab sequence` that a session depends on, by name; None or empty: not given."""

    command = "sequence"
    wanted = "it is no advice on an order: lab teach --resume goes on with it"
    typed: ClassVar[Mapping[str, str]] = {"task": "TASK"}

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
        beside = {"layout": self.layout, "policy": self.policy}
        whole = {name: None if path is None else str(Path(path).absolute()) for name, path in beside.items()}
        return asdict(self) | {"task": whole_path(self.task)} | whole

    @property
    def beside(self) -> Asked:
        """What is asked for beside a file."""
        return Asked(None if self.layout is None else Path(self.layout), self.robots, self.case)


class OrderSession(SessionInFolder):
    """A session of `lab sequence`: a new one, or (`read`) one that is gone on with or, `read_only`, looked at again."""

    def __init__(
        self,
        options: OrderOptions,
        toolbox: Toolbox,
        read: Read | None = None,
        *,
        read_only: bool = False,
        durations: Mapping[str, Any] | None = None,
    ) -> None:
        """durations: those that a run plans with, of a new session; they are kept beside its journal."""
        self.options: OrderOptions = options
        self._durations = durations
        self.read = read
        self._toolbox, self._read_only = toolbox, read_only
        self.folder = None if read is None else read.path.parent

    def durations(self) -> Mapping[str, Any] | None:
        """How long a run's moves take, in which its order was advised; None: as measured. BadInput for a damaged file."""
        if self._durations is not None or self.folder is None or not (self.folder / DURATIONS).exists():
            return self._durations
        try:
            found = json_of(read_limited(self.folder / DURATIONS, MAX_BYTES))
        except (OSError, ValueError) as error:
            raise BadInput(f"'{self.folder / DURATIONS}' cannot be read: {error}") from None
        if not isinstance(found, dict):
            raise BadInput(f"'{self.folder / DURATIONS}': it holds no durations")
        return found

    def keep(self, cell: Cell, objective: str) -> Journal:
        """The journal, once the cell is known; BadInput when it is not the kept session's any more."""
        signature, read = signature_of(cell, objective), self.read
        if read is None:
            name = f"order of {Path(self.options.task).stem}"
            self.folder = claimed(self._toolbox, name, Path.mkdir)
            if self._durations is not None:
                write_whole(self.folder / DURATIONS, json.dumps(dict(self._durations), indent=1) + "\n")
            head = Session(self.options.to_json(), name, signature, __version__, command="sequence")
            self.journal = Journal.begin(self.folder, head)
        elif read.session.signature != signature:
            raise BadInput(
                f"session '{self.folder}': it is about '{read.session.problem}' ({read.session.signature[:8]}), and now the "
                f"cell is another one ({signature[:8]}): its file, or what its moves were measured with, has changed"
            )
        else:
            self.journal = kept_journal(read, self._read_only)
        return self.journal


def kept_order(folder: Path, where: str, toolbox: Toolbox, *, read_only: bool = False) -> OrderSession:
    """A session of `lab sequence` that was kept. Raises BadInput for anything else."""
    read, options = read_session(folder, where, OrderOptions)
    return OrderSession(options, toolbox, read, read_only=read_only)


def gone_on(given: OrderOptions, folder: Path, toolbox: Toolbox) -> OrderSession:
    """The session that --resume names; BadInput when it is over, and for options beside it."""
    read, options = read_session(folder, "--resume", OrderOptions)
    check_same(given, read)
    return OrderSession(options, toolbox, read)
