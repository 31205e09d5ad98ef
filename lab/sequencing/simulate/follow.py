"""The simulation of a whole list of decisions, with the deliberate waits that it needs."""

from collections.abc import Iterator, Sequence

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Episode
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.simulate.run import NO_WAIT, SLACK_S, Run, Wait, Windowless, branch
from lab.sequencing.simulate.waits import waits_of


def waits_in(start: Run, sequence: Sequence[int]) -> tuple[Wait, ...]:
    """The deliberate waits with which a list satisfies all time windows from the state of a run; empty where no waits are
    needed, or none would help."""
    if not start.cell.has_windows:
        return ()
    run = branch(start)
    for decision in sequence:
        if run.option(decision) is None:
            # Rounded times may make a circuit infeasible; then the windows are widened by the rounding error.
            waits = run.spoils(decision) and (waits_of(start, sequence) or waits_of(start, sequence, SLACK_S / 2))
            return waits or ()
        run.move(decision)
    return ()


def steps(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Iterator[tuple[Run, int, Wait]]:
    """The run before each decision of a list, the decision, and its deliberate wait; the caller must make the move."""
    run, waits = Run(cell, times), waits_in(Run(cell), sequence)
    for number, decision in enumerate(sequence):
        yield run, decision, waits[number] if waits else NO_WAIT


def spoils(cell: Cell, sequence: Sequence[int]) -> bool:
    """Whether a list of decisions picks a part too late, whatever the deliberate waits."""
    for run, decision, wait in steps(cell, sequence) if cell.has_windows else ():
        if run.spoils(decision):
            return True
        run.move(decision, wait)
    return False


def follow(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Run:
    """The run after a list of decisions; raises BadInput when one of them is not allowed."""
    run = Run(cell, times)
    for run, decision, wait in steps(cell, sequence, times):
        run.move(decision, wait)
    return run


def simulate(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Schedule:
    """The schedule of a sequence of decisions (see `Run`; one entry per move), with the cell's times or an episode's.

    Robots and servers wait deliberately where a part would otherwise be picked too late (see `waits_of`).
    Raises BadInput, with the position, for a decision that is not allowed there and for a sequence that ends too early.
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
    """Whether the following decisions take a part out of a machine with batches before they bring another one in."""
    ahead = Windowless(run.cell, run.times, run)
    for decision in following:
        option = ahead.option(decision)
        if option is None or option.origin == station:
            return True
        if option.target == station:
            return False
        ahead.move(decision)
    return True
