"""The updates of SRL, the sequencing algorithm of thesis ch. 5, as printed in fig. 5.1.

The loop over episodes and decisions is `session_readable.learn`, which calls `step` after each decision and `end` after each
episode; the arithmetic of logarithms is in `session_updates`. These three files are all of SRL.
"""

from dataclasses import dataclass
from math import exp

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods.session_readable import GreedyLearner, Table, Values, learn
from lab.sequencing.methods.session_updates import log_factor, log_sum
from lab.sequencing.methods.state_keys import Key
from lab.sequencing.search import LearnedSequence, Search


@dataclass(frozen=True)
class SrlResult(LearnedSequence):
    """A sequencer's result and the values that SRL learned.

    cost, sequence: the best of all episodes. final_cost: that of the final greedy policy with the cell's own times. log_q: the
    natural logarithm of Q by state and decision for visited pairs (see `state_keys.key_of`; decision 0: the value of the state).
    """

    log_q: Table

    @property
    def q(self) -> Table:
        """Q by state and decision; values below 1e-308 become 0. Pairs that were never visited, not listed, have the value 1."""
        return {state: {decision: exp(value) for decision, value in row.items()} for state, row in self.log_q.items()}


class Srl(GreedyLearner):
    """The updates of fig. 5.1 on the logarithms of Q, which is 1 at the start."""

    name = "srl"

    def check(self, cost: float) -> None:
        """BadInput for a makespan of 0 s, unless the reward factor is of type A."""
        if not self.rules.type_a:
            super().check(cost)

    def step(self, values: Values, key: Key, following: Key | None, complete: bool) -> None:
        """Updates Q += alpha (discount Q' - Q), eq. 5.2, with Q' = 0 after the last decision.

        With values per next state, the last state's value becomes 1.5 + discount times itself, as in the listings.
        """
        rules = self.rules
        if following is not None:
            values[key] = log_sum(values[key] + rules.log_keep, values[following] + rules.log_take)
        elif complete:
            values[key] = log_sum(values[key] + rules.end_keep, rules.end_add)
        else:
            values[key] += rules.log_keep

    def end(self, values: Values, trail: list[Key], cost: float, best_before: float) -> None:
        """Multiplies Q of each visited pair by the reward factor, eq. 5.3 or 5.4, once for each visit."""
        factor = log_factor(cost, best_before, self.rules.type_a, self.rules.offset)
        for key in trail:
            values[key] += factor


def srl(cell: Cell, search: Search, rng: np.random.Generator) -> SrlResult:
    """The best sequence found in the search's episodes, and the values learned in them.

    Q = 1 at the start; after each step Q(s,a) += alpha (discount Q(s',a') - Q(s,a)), with Q = 0 after the last; after
    each episode the Q of every visited pair is multiplied by the reward factor: type A, 1 / (T - T* + 5) + 0.8 when T is
    later than the best before, else 1 (eq. 5.3); type B, 1 / T (eq. 5.4). T is the cost: the makespan [s], or another
    objective, and then type B is 1 / (1 + cost). Episode n explores with probability n ** -beta; ties between equal values are
    broken at random. An episode that ends in a deadlock costs `stuck_cost`.
    Raises BadInput for an objective that the cell lacks data for, and for type B when a makespan is 0 s;
    WorkFailed when every episode ended in a deadlock. Source: thesis fig. 5.1, eq. 5.1 to 5.4.
    """
    learned = learn(cell, search, drawn_seed(rng), Srl)
    return SrlResult(*learned.log.found(cell), learned.final_cost, learned.table)
