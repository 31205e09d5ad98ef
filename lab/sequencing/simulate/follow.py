"""A whole list of decisions carried out in a cell."""

from collections.abc import Sequence

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Episode
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.simulate.run import Run


def follow(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Run:
    """The run of a list of decisions, one after the other whatever the times; BadInput where one may not be taken."""
    run = Run(cell, times)
    for decision in sequence:
        run.move(decision)
    return run


def simulate(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Schedule:
    """The schedule of a sequence of decisions (see `Run`; one entry a move), with the cell's times or an episode's.

    Raises BadInput, with the position, for a decision that may not be taken there and for a sequence that ends too early.
    Source: thesis ch. 7.4, 7.5; makespan to the last arrival at the end of a route.
    """
    run, moves = Run(cell, times), []
    came_s: list[float] = [0.0] * cell.parts
    for position, decision in enumerate(sequence, 1):
        reason = run.refusal(decision)
        if reason:
            allowed = ", ".join(str(other) for other in run.allowed()) or (
                "none, all are done" if run.done else "none, it is a deadlock"
            )
            raise BadInput(f"position {position} of the sequence: {reason}; allowed here: {allowed}")
        part = part_of(decision, cell.parts)
        if run.locations[part - 1] == cell.starts[part - 1]:
            came_s[part - 1] = run.ready_s[part - 1]
        moves.append(run.move(decision))
    if not run.done:
        left = run.finished_s.index(None) + 1
        where = cell.names[cell.positions[run.locations[left - 1]].station]
        raise BadInput(
            f"the sequence ends after {counted(len(moves), 'move')}, but {cell.part_name(left)} is still at '{where}'"
        )
    return Schedule.from_moves(cell, moves, sequence, came_s)
