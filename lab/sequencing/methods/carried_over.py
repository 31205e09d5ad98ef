"""A policy learned on small cells and applied to larger ones: it takes the decision of highest value and does not search."""

from collections.abc import Sequence

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, cost
from lab.sequencing.methods import deferred
from lab.sequencing.methods.carried_over_features import FeatureArrays, feature_arrays, features
from lab.sequencing.methods.carried_over_policy import DEFAULT, CarriedPolicy
from lab.sequencing.methods.rules import Rule
from lab.sequencing.search import SAME, Search, SequenceResult, only_one
from lab.sequencing.simulate.cell_arrays import Floats, cell_arrays, run_arrays
from lab.sequencing.simulate.follow import follow
from lab.sequencing.simulate.run import Run


def rule_of(policy: CarriedPolicy) -> Rule:
    """The policy as a dispatching rule, in plain Python."""
    last: list[tuple[Cell, FeatureArrays]] = []

    def choose(run: Run, allowed: tuple[int, ...]) -> int:
        if not last or last[0][0] is not run.cell:
            last[:] = [(run.cell, feature_arrays(run.cell, policy.objective))]
        values = features(run, allowed, last[0][1]) @ policy.vector
        best = 0
        for i, value in enumerate(values):
            if value > values[best] + SAME:
                best = i
        return allowed[best]

    return choose


class Decider:
    """The policy's decisions in a cell, compiled; it is made once a cell."""

    def __init__(self, cell: Cell, objective: str = MAKESPAN) -> None:
        """objective: what runs are judged by; the features use its data, such as due times."""
        self._kernels = deferred.carried_over_kernels
        self._work = self._kernels.work_arrays(cell)
        self._cell, self._run = cell_arrays(cell, objective), run_arrays(cell)
        self._known = feature_arrays(cell, objective)
        self.stuck_cost = float(self._cell.stuck_cost)

    def sequence(self, weights: Floats) -> tuple[int, ...]:
        """The decisions that the weights (F,) lead to, until all parts are finished or none can move."""
        made = self._kernels.decide(self._cell, self._run, self._known, self._work, weights)
        return tuple(self._work.sequence[:made].tolist())

    def costs(self, candidates: Floats) -> Floats:
        """The costs (N,) of the sequences that N candidate weights (N, F) lead to."""
        costs = np.zeros(len(candidates))
        self._kernels.costs_of(self._cell, self._run, self._known, self._work, candidates, costs)
        return costs


def without_idle(weights: Floats, deciders: Sequence[Decider]) -> Floats:
    """The weights (F,) after setting to 0, the smallest first, those that change the cost of no decider's run."""

    def each(tried: Floats) -> Floats:
        return np.array([decider.costs(tried[None])[0] for decider in deciders])

    costs = each(weights)
    for number in np.argsort(np.abs(weights)):
        without = weights.copy()
        without[number] = 0.0
        if (np.abs(each(without) - costs) <= SAME).all():
            weights = without
    return weights


def carried(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The sequence of the policy in `search`, or of the policy that ships with the lab; it draws nothing from `rng`.

    Raises BadInput for an objective that the cell has no data for, WorkFailed when it ends in a deadlock.
    """
    search.check(cell)
    policy = search.policy or DEFAULT
    sequence = Decider(cell, policy.objective if cell.due_s is not None else MAKESPAN).sequence(policy.vector)
    run = follow(cell, sequence)
    return only_one(cell, search, sequence, cost(run, search.objective), run.done)
