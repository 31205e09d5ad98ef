"""Random search: the best of uniformly drawn sequences."""

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods.session_readable import SessionLearner, learn
from lab.sequencing.search import Search, SequenceResult


def random_search(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The best of the search's episodes, in which each decision is drawn uniformly from the allowed ones.

    Where times are drawn by chance, each sequence is judged by the times of its own episode. Raises BadInput for an objective
    that the cell does not allow, WorkFailed when every sequence ends in a deadlock. Source: thesis 7.6, random search.
    """
    return SequenceResult(*learn(cell, search, drawn_seed(rng), SessionLearner).log.found(cell))
