"""A method of one's own for the order of work: `lab sequence toast --case II --method ./own_sequencer.py:last_first`."""

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.search import EpisodeSequenced, Search, SequenceResult
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run


def last_first(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """Always moves the last part that may be moved: what is nearly done leaves first."""
    run, moves = Run(cell), []
    while allowed := run.allowed():
        moves.append(max(allowed))
        run.move(moves[-1])
    cost = simulate(cell, moves).makespan_s
    if search.on_episode is not None:
        search.on_episode(EpisodeSequenced(1, cost, cost, tuple(moves)))
    return SequenceResult(tuple(moves), cost, (cost,))
