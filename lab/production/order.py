"""The order of a job's transfers: as an operator gives it, checked move by move."""

from collections.abc import Sequence

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import part_of
from lab.sequencing.simulate.run import Run


def taken_moves(cell: Cell, words: str, done: Sequence[int] = (), where: str = "order") -> tuple[tuple[int, ...], str]:
    """The first moves of "1 2 1 3" or "1,2,1,3" that may be made after `done`; why the next may not, "" where all may.

    A number is a decision as in a sequence (see `Run`): the part's number, + the number of parts for its second choice.
    BadInput for words that are no moves at all; `where` says what they were typed to.
    """
    run, taken = Run(cell), list[int]()
    for decision in done:
        run.move(decision)
    typed = words.replace(",", " ").split()
    if not typed:
        raise BadInput(f"{where} '{words}': no moves; wanted part numbers such as 1 2 1")
    for position, word in enumerate(typed, 1):
        if not (word.isascii() and word.isdigit()) or len(word) > 6:
            raise BadInput(f"{where} '{words}': move {position} '{word}' is no part's number, 1 to {cell.parts}")
        if reason := run.refusal(int(word)):
            return tuple(taken), f"move {position} '{word}': {reason}; {_allowed(run)}"
        run.move(int(word))
        taken.append(int(word))
    return tuple(taken), ""


def checked_order(cell: Cell, words: str, where: str = "--order") -> tuple[int, ...]:
    """A whole order, as a sequence. BadInput for the first move that may not be made, with the reason, and for what is left."""
    taken, reason = taken_moves(cell, words, where=where)
    if reason:
        raise BadInput(f"{where} '{words}': {reason}")
    run = Run(cell)
    for decision in taken:
        run.move(decision)
    if not run.done:
        part = run.finished_s.index(None) + 1
        station = cell.names[cell.positions[run.locations[part - 1]].station]
        made = counted(len(taken), "move")
        raise BadInput(
            f"{where} '{words}': it ends after {made}, but {cell.part_name(part)} is still at '{station}'; {_allowed(run)}"
        )
    return taken


def _allowed(run: Run) -> str:
    """What may be moved now, in words."""
    if run.done:
        return "all parts are done"
    names = [f"{decision} ({run.cell.part_name(part_of(decision, run.cell.parts))})" for decision in run.allowed()]
    return f"allowed here: {', '.join(names)}" if names else "nothing can move any more"
