"""Plain sequencers to compare with: random search and first in, first out."""

import math
from collections.abc import Callable

import numpy as np

from lab.errors import BadInput
from lab.sequencing.cell import Cell
from lab.sequencing.events import EpisodeSequenced, Run, SequenceResult


def random_search(
    cell: Cell,
    episodes: int,
    rng: np.random.Generator,
    on_episode: Callable[[EpisodeSequenced], None] | None = None,
) -> SequenceResult:
    """The best of so many sequences, each move drawn evenly from the allowed toasts; BadInput for episodes < 1.

    Source: thesis 7.6, random search.
    """
    if episodes < 1:
        raise BadInput(f"episodes = {episodes}: allowed are whole numbers from 1")
    makespans: list[float] = []
    best_s = math.inf
    best: tuple[int, ...] = ()
    for episode in range(1, episodes + 1):
        run, sequence = Run(cell), []
        while toasts := run.allowed():
            sequence.append(toasts[int(rng.integers(len(toasts)))])
            run.move(sequence[-1])
        makespans.append(run.now_s)
        if run.now_s < best_s:
            best_s, best = run.now_s, tuple(sequence)
        if on_episode is not None:
            on_episode(EpisodeSequenced(episode, run.now_s, best_s))
    return SequenceResult(best, best_s, tuple(makespans))


def fifo(cell: Cell) -> SequenceResult:
    """One sequence: of the allowed toasts always the one that has been ready the longest; ties to the lowest number."""
    run, sequence = Run(cell), []
    while toasts := run.allowed():
        sequence.append(min(toasts, key=lambda toast: (run.ready_s[toast - 1], toast)))
        run.move(sequence[-1])
    return SequenceResult(tuple(sequence), run.now_s, (run.now_s,))
