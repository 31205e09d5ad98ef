"""An order of moves that the operator types: checked move by move, and held against the proven optimum."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lab.errors import counted
from lab.production.order import moves_from
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.rest import rest_of
from lab.sequencing.simulate.run import Run


@dataclass(frozen=True)
class TypedOrder:
    """A sequence that may be carried out: when it ends [s] and how much longer that is than the proven optimum or bound.

    gap: a fraction; proven: against an optimum, not only a bound.
    """

    sequence: tuple[int, ...]
    schedule: Schedule
    gap: float
    proven: bool

    @property
    def words(self) -> str:
        """What came of the check, for people."""
        against = "proven optimum" if self.proven else "proven bound"
        longer = (
            f"{100 * self.gap:.1f} % longer than the {against}" if self.gap > 1e-9 else f"as short as the {against}"
        )
        return f"{counted(len(self.sequence), 'move')}, {self.schedule.makespan_s:.1f} s: {longer}"


def checked(state: Run, sequence: Sequence[int]) -> TypedOrder:
    """A typed sequence from a state on, to the end of the work. BadInput names the first move that may not be made, and why."""
    moves = moves_from(state, sequence, "order")
    schedule = Schedule.from_moves(state.cell, moves, sequence)
    rest = rest_of(state, fallback_s=float(np.nanmax(state.cell.empty_s, initial=0.0))).cell
    proven = optimum(state.cell if rest is None else rest)
    gap = proven.gap(schedule.makespan_s - state.now_s)
    return TypedOrder(tuple(sequence), schedule, gap, proven.proven)
