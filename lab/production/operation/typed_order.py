"""An order of moves that the operator types: checked move by move, and held against the proven optimum."""

from collections.abc import Sequence
from dataclasses import dataclass

from lab.errors import BadInput, counted
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.run import Run, branch


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
    """A typed sequence from a state on, to the end of the work; BadInput names the first entry that may not be taken, and why."""
    run, moves = branch(state), []
    begun_s = run.now_s
    for number, decision in enumerate(sequence, start=1):
        if why := run.refusal(decision):
            allowed = ", ".join(map(str, run.allowed())) or "none, all is done"
            before = f"; the {counted(number - 1, 'entry').replace('entrys', 'entries')} before it may be taken" * (
                number > 1
            )
            raise BadInput(f"entry {number}, '{decision}': {why}; allowed there: {allowed}{before}")
        moves.append(run.move(decision))
    if not run.done:
        left = run.finished_s.index(None) + 1
        where = run.cell.names[run.cell.positions[run.locations[left - 1]].station]
        allowed = ", ".join(map(str, run.allowed())) or "none"
        raise BadInput(
            f"after the last entry, {run.cell.part_name(left)} is still at '{where}': go on to the end; allowed there: {allowed}"
        )
    schedule = Schedule.from_moves(run.cell, moves, sequence)
    proven = optimum(state.cell)
    cost_s = schedule.makespan_s - begun_s
    return TypedOrder(tuple(sequence), schedule, proven.gap(cost_s), proven.proven)
