"""A whole list of decisions carried out in a cell."""

from collections.abc import Iterator, Sequence

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Episode
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.simulate.run import NO_WAIT, SLACK_S, Run, Wait, Windowless, branch
from lab.sequencing.simulate.waits import waits_of


def waits_in(start: Run, sequence: Sequence[int]) -> tuple[Wait, ...]:
    """The waits on purpose with which a list keeps to all windows from where a run is; none where it needs none, or where none
    would help."""
    if not start.cell.has_windows:
        return ()
    run = branch(start)
    for decision in sequence:
        if run.option(decision) is None:
            # Where rounded times make a circle, it is kept to by as much as they may be off.
            waits = run.spoils(decision) and (waits_of(start, sequence) or waits_of(start, sequence, SLACK_S / 2))
            return waits or ()
        run.move(decision)
    return ()


def steps(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Iterator[tuple[Run, int, Wait]]:
    """The run before each decision of a list, that decision, and its wait on purpose, by the cell's own times; whoever asks makes
    the move."""
    run, waits = Run(cell, times), waits_in(Run(cell), sequence)
    for number, decision in enumerate(sequence):
        yield run, decision, waits[number] if waits else NO_WAIT


def spoils(cell: Cell, sequence: Sequence[int]) -> bool:
    """Whether a part would be picked too late by a list of decisions, whatever the waits."""
    for run, decision, wait in steps(cell, sequence) if cell.has_windows else ():
        if run.spoils(decision):
            return True
        run.move(decision, wait)
    return False


def follow(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Run:
    """The run of a list of decisions, one after the other whatever the times; BadInput where one may not be taken."""
    run = Run(cell, times)
    for run, decision, wait in steps(cell, sequence, times):
        run.move(decision, wait)
    return run


def simulate(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Schedule:
    """The schedule of a sequence of decisions (see `Run`; one entry a move), with the cell's times or an episode's.

    Robots and servers wait on purpose where a part would be picked too late else (see `waits_of`).
    Raises BadInput, with the position, for a decision that may not be taken there and for a sequence that ends too early.
    Source: thesis ch. 7.4, 7.5; makespan to the last arrival at the end of a route.
    """
    run = Run(cell, times)
    came_s: list[float] = [0.0] * cell.parts
    for run, decision, wait in steps(cell, sequence, times):
        reason = run.refusal(decision)
        if reason:
            allowed = ", ".join(str(other) for other in run.allowed()) or (
                "none, all are done" if run.done else "none, it is a deadlock"
            )
            raise BadInput(f"position {len(run.moves) + 1} of the sequence: {reason}; allowed here: {allowed}")
        part = part_of(decision, cell.parts)
        if run.locations[part - 1] == cell.starts[part - 1]:
            came_s[part - 1] = run.ready_s[part - 1]
        run.move(decision, wait)
    if not run.done:
        left = run.finished_s.index(None) + 1
        where = cell.names[cell.positions[run.locations[left - 1]].station]
        raise BadInput(
            f"the sequence ends after {counted(len(run.moves), 'move')}, but {cell.part_name(left)} is still at '{where}'"
        )
    return Schedule.from_moves(cell, run.moves, sequence, came_s)


def closes(run: Run, station: int, following: Sequence[int]) -> bool:
    """Whether nothing more comes into a machine with batches before one of its parts is taken out, by the decisions to come."""
    ahead = Windowless(run.cell, run.times, run)
    for decision in following:
        option = ahead.option(decision)
        if option is None or option.origin == station:
            return True
        if option.target == station:
            return False
        ahead.move(decision)
    return True
