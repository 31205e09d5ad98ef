"""The Monte Carlo method that thesis ch. 7.6 compares SRL with."""

from dataclasses import dataclass

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods.session_readable import GreedyLearner, Table, Values, learn
from lab.sequencing.methods.session_updates import average, gain
from lab.sequencing.methods.state_keys import Key
from lab.sequencing.search import LearnedSequence, Search


@dataclass(frozen=True)
class MonteCarloResult(LearnedSequence):
    """A sequencer's result and the learned values: `q` by state and decision (see `state_keys.key_of`), for visited pairs."""

    q: Table


class MonteCarloAverage(GreedyLearner):
    """Q is the average return of the episodes in which a pair was visited; before the first visit it is 1, as in the listing.

    The initial values are optimistic: no return of the thesis's cells comes near 1, so the greedy choice tries new pairs first.
    """

    name = "mc"
    first = 1.0

    def __init__(self, search: Search) -> None:
        super().__init__(search)
        self.visits: dict[Key, int] = {}

    def end(self, values: Values, trail: list[Key], cost: float, best_before: float) -> None:
        """Adds the episode's return to the averages of the visited pairs, once for each visit."""
        worth = gain(cost, self.rules.offset)
        for key in trail:
            before = self.visits.get(key, 0)
            values[key] = average(values[key], before, worth)
            self.visits[key] = before + 1


def monte_carlo(cell: Cell, search: Search, rng: np.random.Generator) -> MonteCarloResult:
    """The best sequence found in the search's episodes, and the values learned in them.

    The return of an episode is 1 / T of its makespan [s], or 1 / (1 + cost) of another objective. Decisions are chosen
    as in `srl`. Raises BadInput for an objective that the cell lacks data for, and for a makespan of 0 s;
    WorkFailed when every episode ended in a deadlock. Source: thesis ch. 7.6 and its listing (Q = 1 at the start).
    """
    learned = learn(cell, search, drawn_seed(rng), MonteCarloAverage)
    return MonteCarloResult(*learned.log.found(cell), learned.final_cost, learned.table)
