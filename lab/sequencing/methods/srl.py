"""SRL, the sequencing algorithm of thesis ch. 5, as printed in fig. 5.1: its updates.

The episodes, explored and greedy decisions, one after the other, are in `session_readable.learn`, which calls `step` after each
decision and `end` after each episode; the logarithms are in `session_updates`. With these three files SRL is read whole.
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
    """A sequencer's result, and what SRL learned.

    `cost` and `sequence` are the best found in any episode; `final_cost` is the greedy policy's at the end, with the
    cell's own times. `log_q`: natural logarithm of Q by state and decision (see `state_keys.key_of`; decision 0: of the
    state itself), for what was visited.
    """

    log_q: Table

    @property
    def q(self) -> Table:
        """Q itself; values below 1e-308 show as 0. What was never visited still has its first value, 1."""
        return {state: {decision: exp(value) for decision, value in row.items()} for state, row in self.log_q.items()}


class Srl(GreedyLearner):
    """The updates of fig. 5.1 on the logarithms of Q, which is 1 at the start."""

    name = "srl"

    def check(self, cost: float) -> None:
        """BadInput for a makespan of 0 s, unless the reward factor is of type A."""
        if not self.rules.type_a:
            super().check(cost)

    def step(self, values: Values, key: Key, following: Key | None, complete: bool) -> None:
        """Q += alpha (discount Q' - Q), eq. 5.2: with Q' = 0 after the last one.

        Values per next state end as in the listings: the last state's becomes 1.5 + discount times itself.
        """
        rules = self.rules
        if following is not None:
            values[key] = log_sum(values[key] + rules.log_keep, values[following] + rules.log_take)
        elif complete:
            values[key] = log_sum(values[key] + rules.end_keep, rules.end_add)
        else:
            values[key] += rules.log_keep

    def end(self, values: Values, trail: list[Key], cost: float, best_before: float) -> None:
        """Q times the reward factor, eq. 5.3 or 5.4, once for each visit."""
        factor = log_factor(cost, best_before, self.rules.type_a, self.rules.offset)
        for key in trail:
            values[key] += factor


def srl(cell: Cell, search: Search, rng: np.random.Generator) -> SrlResult:
    """Learn a sequence in so many episodes; the best one found is the result.

    Q = 1 at the start; after each step Q(s,a) += alpha (discount Q(s',a') - Q(s,a)), with Q = 0 after the last; after
    each episode the Q of every visited pair is multiplied by the reward factor: type A, 1 / (T - T* + 5) + 0.8 when T is
    later than the best before, else 1 (eq. 5.3); type B, 1 / T (eq. 5.4). T is the cost: the makespan [s], or another
    objective, and then type B is 1 / (1 + cost). Episode n explores with probability n ** -beta; between equal values
    chance decides. An episode that ends in a deadlock costs `stuck_cost`.
    Raises BadInput for an objective that the cell has not got what it takes for, and for type B when a makespan is 0 s;
    WorkFailed when every episode ended in a deadlock. Source: thesis fig. 5.1, eq. 5.1 to 5.4.
    """
    learned = learn(cell, search, drawn_seed(rng), Srl)
    return SrlResult(*learned.log.found(cell), learned.final_cost, learned.table)
