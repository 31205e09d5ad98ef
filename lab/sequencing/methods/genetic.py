"""A genetic algorithm as a rival: random keys that a simulation decodes into a sequence."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Episode, drawn_seed
from lab.sequencing.cell.objectives import cost
from lab.sequencing.search import Log, Search, SequenceResult
from lab.sequencing.simulate.cell_arrays import most_moves
from lab.sequencing.simulate.run import Run

# Shares of a generation, and the chance of a gene to come from the elite parent: within what Gonçalves and Resende 2011
# recommend, not tuned to a cell.
ELITE, MUTANTS, BIAS = 0.2, 0.15, 0.7
GENERATIONS, SMALLEST, LARGEST = 20, 10, 200  # a session is about so many generations, of so many sequences


def genetic(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The best sequence that a biased random-key genetic algorithm finds; every one that it tries is an episode.

    By chance, each sequence is judged by the times of its own episode. Raises BadInput for an objective that the cell
    does not allow, WorkFailed when every sequence ends in a deadlock.
    Source: Gonçalves and Resende 2011, as pymoo has it; random keys: Bean 1994.
    """
    search.check(cell)
    algorithm, log = _algorithm(most_moves(cell), search.episodes, drawn_seed(rng)), Log(search)
    while len(log.costs) < search.episodes:
        population = algorithm.ask()
        values = [_episode(cell, search, rng, keys, log) for keys in population.get("X")]
        if None not in values:  # else the session has ended within a generation
            population.set("F", np.array(values)[:, None])
            algorithm.tell(infills=population)
    return SequenceResult(*log.found(cell))


def decode(run: Run, keys: NDArray[np.float64]) -> tuple[int, ...]:
    """The decisions that keys (most moves,), each 0 to 1, stand for; the run is moved to its end, or to a deadlock.

    The n-th key is a share of the list of decisions allowed at step n, ascending, and takes the one that it falls on.
    So every set of keys stands for an allowed sequence, every sequence for some keys, and even keys for an even draw.
    Source: as Fang, Ross and Corne 1993 choose from a list of unfinished jobs.
    """
    sequence: list[int] = []
    while allowed := run.allowed():
        share = float(keys[len(sequence)])
        sequence.append(allowed[min(int(share * len(allowed)), len(allowed) - 1)])
        run.move(sequence[-1])
    return tuple(sequence)


def _episode(cell: Cell, search: Search, rng: np.random.Generator, keys: NDArray[np.float64], log: Log) -> float | None:
    """The cost of what the keys stand for; None, and nothing is done, when the session is over."""
    if len(log.costs) >= search.episodes:
        return None
    run = Run(cell, _drawn_times(cell, search, rng))
    log.note(decode(run, keys), cost(run, search.objective), run.done)
    return log.costs[-1]


def _algorithm(genes: int, episodes: int, seed: int) -> Any:
    """pymoo's algorithm, ready to be asked."""
    # Only here: nobody else needs pymoo, and it takes a while to import.
    from pymoo.algorithms.soo.nonconvex.brkga import BRKGA  # type: ignore[import-untyped,unused-ignore]
    from pymoo.core.problem import Problem  # type: ignore[import-untyped,unused-ignore]
    from pymoo.core.termination import NoTermination  # type: ignore[import-untyped,unused-ignore]

    size = min(max(math.ceil(episodes / GENERATIONS), SMALLEST), LARGEST)
    elites, mutants = max(1, round(ELITE * size)), max(1, round(MUTANTS * size))
    algorithm = BRKGA(n_elites=elites, n_offsprings=size - elites - mutants, n_mutants=mutants, bias=BIAS, seed=seed)
    algorithm.setup(Problem(n_var=genes, n_obj=1, xl=0.0, xu=1.0), termination=NoTermination())
    return algorithm


def _drawn_times(cell: Cell, search: Search, rng: np.random.Generator) -> Episode:
    """The times of the next episode; a search without chance draws nothing."""
    return Episode(cell) if search.chance == NO_CHANCE else Episode(cell, search.chance, drawn_seed(rng))
