"""`lab.sequence`: the search for the order of a robot's transfers through a cell, and its result."""

from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, TypedDict, Unpack

from annotated_types import Ge, Le

from lab.api.options import ToolboxOrPlace, check_common, checked, data_frame, toolbox_of
from lab.api.pictures import Picture
from lab.errors import BadInput
from lab.lazy import pandas
from lab.production.sequencing_job import SequencingOptions, named_cell, sequence_cell
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE
from lab.sequencing.search import SequenceResult
from lab.sequencing.simulate.follow import simulate
from lab.tasks.sequencing import Sequencing
from lab.teaching.teacher import Teacher
from lab.toolbox.names import default_address
from lab.view.gantt import gantt


class OrderOptions(TypedDict, total=False):
    """The options of `lab sequence`, by their names there; the default of each is the value in the file.

    case: an order by name; toasts: the number of parts; parts: of each kind, such as "slice=2,cup=1".
    layout, robots: the travel times and the number of robots beside an instance file.
    method, objective: by name; episodes: of a session; sessions: how many.
    policy: the file or name of the policy of the method "carried", or of the one that "srl-linear" begins with.
    practice: further cells that "srl-linear" learns in, separated by commas; keep_policy: the file or name under which its policy
    is kept, so that the method "policy:NAME" decides by it.
    stochastic: whether times are drawn; seconds: the search ends after so many [s]; gap: it ends when the cost is at most this
    fraction above the bound.
    """

    case: str
    toasts: int
    parts: str
    layout: Path
    robots: Annotated[int, Ge(1), Le(50)]
    method: str
    policy: Path
    objective: str
    episodes: Annotated[int, Ge(1)]
    sessions: Annotated[int, Ge(1)]
    stochastic: bool
    seconds: float
    gap: float
    practice: str
    keep_policy: str


@dataclass(frozen=True, eq=False)
class OrderResult:
    """The result of a search for an order of transfers, which notebooks display.

    cell: the cell; sessions: the result of each session of the method; document: the dict that `lab sequence --json` prints.

        >>> import lab
        >>> order = lab.sequence("toast-case-1", toasts=1)
        >>> order.moves
        ['toast 1: plate > toaster', 'toast 1: toaster > butter_applier', 'toast 1: butter_applier > finished_plate']
    """

    cell: Cell
    sessions: list[SequenceResult]
    document: dict[str, Any]

    @property
    def cost(self) -> float:
        """The cost of the best order found, in the unit of the objective ([s] for "makespan")."""
        return float(self.document["best_cost"])

    @property
    def bound(self) -> float:
        """The lower bound: no order costs less."""
        return float(self.document["bound_cost"])

    @property
    def proven(self) -> bool:
        """Whether the best order is proven optimal."""
        return bool(self.document["proven"])

    @property
    def stopped_by(self) -> str | None:
        """What ended the search early: "Ctrl-C", "seconds" or "gap"; None if nothing did."""
        return None if self.document["stopped_by"] is None else str(self.document["stopped_by"])

    @property
    def proven_of(self) -> str:
        """The set of plans that `bound` and `proven` hold for, such as "every plan"."""
        return str(self.document["proven_of"])

    @property
    def moves(self) -> list[str]:
        """The moves of the best order, in words."""
        return list(self.document["best_moves"])

    def rows(self) -> list[dict[str, Any]]:
        """The schedule of the best order: part, operation, station, resource, start_s, end_s."""
        return list(self.document["schedule"])

    def to_dataframe(self) -> "pandas.DataFrame":
        """`rows` as a DataFrame. Raises BadInput if pandas is not installed."""
        return data_frame(self.rows())

    @cached_property
    def gantt(self) -> Picture:
        """The Gantt chart of the best order."""
        schedule = simulate(self.cell, self.document["best_sequence"])
        return Picture.drawn(lambda path: gantt(schedule, path, due_s=self.cell.due_s))

    def __str__(self) -> str:
        what = "proven: there is none better" if self.proven else f"nothing below {self.bound:g} is possible"
        return f"{self.document['objective']} {self.cost:g} (by {self.document['best_by']}; {what})"

    def _repr_html_(self) -> str:
        return f"<p>{escape(str(self))}</p>{self.gantt._repr_svg_()}"


def sequence(
    cell: str | Path | Cell, *, seed: int = 0, toolbox: ToolboxOrPlace = None, **options: Unpack[OrderOptions]
) -> OrderResult:
    """The best order of the robot's transfers that a method finds, with a lower bound on the cost of any order.

    cell: a name as for `lab sequence` (a cell, an instance file, or a task, whose moves are timed in simulation), or a `Cell`.
    seed: of all randomness.
    toolbox: provides and saves a task's skills, and the policies of sequencing by name; None (default): no skill is saved, and
    such policies are in the user's own toolbox.
    options: those of `lab sequence`, such as method, objective, episodes, seconds [s], gap (a fraction).

    Raises BadInput for an unknown name, a value out of range, and what does not fit together.

        >>> import lab
        >>> order = lab.sequence("toast-case-1", toasts=2)
        >>> order.proven, order.cost == order.bound, order.rows()[0]["start_s"]
        (True, True, 0.0)
    """
    check_common("lab.sequence", seed=seed)
    given = checked(options, OrderOptions, "lab.sequence")
    case, toasts = given.pop("case", None), given.pop("toasts", None)
    wanted = SequencingOptions(seed=seed, **given).by_policy()
    box = toolbox_of(toolbox, default_address())
    if isinstance(cell, Cell):
        if case is not None or toasts is not None:
            raise BadInput(f"case {case}, toasts {toasts} beside a Cell: its order is its own: leave them away")
        document, found = sequence_cell(cell, Sequencing(), wanted, NO_CHANCE, toolbox=box)
        return OrderResult(cell, found, document)
    with TemporaryDirectory() as nowhere:
        teacher = Teacher(toolbox_of(toolbox, nowhere), seed=seed)
        named = named_cell(str(cell), case, toasts, wanted, teacher, box)
    document, found = sequence_cell(named.cell, named.settings, wanted, named.chance, toolbox=box)
    return OrderResult(named.cell, found, {"task": named.name} | document)
