"""`lab.sequence`: the order of a robot's transfers through a cell, and what came of looking for it."""

from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from lab.api.options import ToolboxOrPlace, checked, data_frame, toolbox_of
from lab.api.pictures import Picture
from lab.errors import BadInput
from lab.production.sequencing_job import SequencingOptions, sequence_cell, sequenced_named
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE
from lab.sequencing.search import SequenceResult
from lab.sequencing.simulate.follow import simulate
from lab.tasks.sequencing import Sequencing
from lab.teaching.teacher import Teacher

if TYPE_CHECKING:
    import pandas


class OrderOptions(TypedDict, total=False):
    """The options of `lab sequence`, by their names there; those that are not given are as the file says."""

    case: str
    toasts: int
    parts: str
    layout: Path
    robots: int
    method: str
    policy: Path
    objective: str
    episodes: int
    sessions: int
    stochastic: bool
    seconds: float
    gap: float


@dataclass(frozen=True, eq=False)
class OrderResult:
    """What looking for an order came to.

    cell: what is ordered; sessions: what each session of the method found; document: as `lab sequence --json` gives it.
    """

    cell: Cell
    sessions: list[SequenceResult]
    document: dict[str, Any]

    @property
    def cost(self) -> float:
        """What the best order that anything found costs, in the units of the objective."""
        return float(self.document["best_cost"])

    @property
    def bound(self) -> float:
        """What no order can cost less than."""
        return float(self.document["bound_cost"])

    @property
    def proven(self) -> bool:
        """Whether no order costs less than the best one."""
        return bool(self.document["proven"])

    @property
    def stopped_by(self) -> str | None:
        """What ended it early: "Ctrl-C", "seconds" or "gap"; None: nothing did."""
        return None if self.document["stopped_by"] is None else str(self.document["stopped_by"])

    @property
    def proven_of(self) -> str:
        """Of which plans `bound` and `proven` speak: "every plan"."""
        return str(self.document["proven_of"])

    @property
    def moves(self) -> list[str]:
        """The moves of the best order, in words."""
        return list(self.document["best_moves"])

    def rows(self) -> list[dict[str, Any]]:
        """The schedule of the best order: part, operation, station, resource, start_s, end_s."""
        return list(self.document["schedule"])

    def to_dataframe(self) -> "pandas.DataFrame":
        """`rows` as a DataFrame. BadInput when pandas is not installed."""
        return data_frame(self.rows())

    @cached_property
    def gantt(self) -> Picture:
        """The Gantt chart of the best order."""
        from lab.view.gantt import gantt

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
    """The order of the robot's transfers, as `lab sequence` finds it: by a method, beside what is proven.

    cell: what `lab sequence` takes by name (a cell, an instance file, a task, whose moves are timed in simulation), or a
    `Cell`; toolbox: where a task's skills are found and kept; None: nothing is kept. Raises BadInput for what does not fit.
    """
    given = checked(options, OrderOptions, "lab.sequence")
    case, toasts = given.pop("case", None), given.pop("toasts", None)
    wanted = SequencingOptions(seed=seed, **given)
    if isinstance(cell, Cell):
        if case is not None or toasts is not None:
            raise BadInput(f"case {case}, toasts {toasts} beside a Cell: its order is its own: leave them away")
        document, found = sequence_cell(cell, Sequencing(), wanted, NO_CHANCE)
        return OrderResult(cell, found, document)
    with TemporaryDirectory() as nowhere:
        teacher = Teacher(toolbox_of(toolbox, nowhere), seed=seed)
        ordered, document, found = sequenced_named(str(cell), case, toasts, wanted, teacher)
    return OrderResult(ordered, found, document)
