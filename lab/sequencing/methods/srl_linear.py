"""SRL with a function approximator: the values of decisions are linear in features, and whole episodes teach the weights.

SRL's table (`srl`) has a value for each state and decision, so that a large cell shows it hardly any state twice, and what it
learns is of that cell alone. Here the value of a decision is a weighted sum of its features (`carried_over_policy.FEATURES`),
which mean the same in every cell: all decisions share what is learned, and the weights are a policy for other cells, too.
"""

from dataclasses import dataclass

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import check_built_in, check_objective
from lab.sequencing.methods.carried_over import Decider, without_idle
from lab.sequencing.methods.carried_over_policy import FEATURES, CarriedPolicy
from lab.sequencing.methods.evolution import Evolution
from lab.sequencing.methods.priorities import Orders
from lab.sequencing.search import LearnedSequence, Log, Search
from lab.sequencing.simulate.cell_arrays import Floats

POPULATION = 12  # episodes between two updates of the weights; a session that is shorter learns nothing
STEP, STEP_ON = 0.5, 0.2  # the first step size from nothing, and from a policy, whose weights have length 1
WORST = 3.0  # times the best rule's cost: a run of a practice cell that costs more, such as a deadlock, counts as this
DIGITS = 4  # of a weight that is kept


@dataclass(frozen=True)
class SrlLinearResult(LearnedSequence):
    """A sequencer's result and the learned policy, which decides in this cell as in any other. final_cost: of its sequence."""

    policy: CarriedPolicy


def srl_linear(cell: Cell, search: Search, rng: np.random.Generator) -> SrlLinearResult:
    """The best sequence found in the search's episodes, and the weights of the features that were learned in them.

    In an episode the decision of the highest value is taken, with weights that are drawn for the episode; this explores. After
    POPULATION episodes the distribution of the weights moves towards those whose episodes cost least. As in SRL, only
    the cost of the whole episode counts. SRL's own updates, carried over from the entries of the table to the weights, were
    measured beside this and find worse sequences: `lab study run srl-linear`.
    With `search.policy` learning begins at its weights, and the policy itself is the first episode. With `search.practice` each
    episode is run in those cells, too, and the mean of the costs counts, each as a share of the best dispatching rule's; the
    sequence and its cost are those of `cell`. It learns by the mean times. Raises BadInput for an objective that a cell lacks
    data for, WorkFailed when every episode ended in a deadlock.
    Source: thesis 10.2.4 ii; CMA-ES for policies, Heidrich-Meisner and Igel 2009; features as in `carried`.
    """
    check_built_in(search.objective, "srl-linear")
    cells = (cell, *search.practice)
    for one in cells:
        check_objective(search.objective, one)
    log, school = Log(search), [Decider(one, search.objective) for one in cells]
    scales = [_scale(one, search.objective) for one in cells] if search.practice else []
    begun = np.zeros(len(FEATURES)) if search.policy is None else _of_length_1(search.policy.vector)
    evolution = Evolution(begun, STEP if search.policy is None else STEP_ON, POPULATION, rng)
    if search.policy is not None:
        _note(log, school[0], begun[None])
    while left := search.episodes - len(log.costs):
        candidates = evolution.ask()[:left]
        costs = _note(log, school[0], candidates)
        if len(candidates) == POPULATION:
            if search.practice:
                each = (decider.costs(candidates) for decider in school[1:])
                shares = [of / scale for of, scale in zip((costs, *each), scales, strict=True)]
                costs = np.mean(np.minimum(WORST, shares), axis=0)
            evolution.tell(costs)
    learned = _of_length_1(without_idle(evolution.mean, school)).round(DIGITS)
    kept = {name: weight for name, weight in zip(FEATURES, learned.tolist(), strict=True) if weight}
    policy = CarriedPolicy(kept, search.objective)
    final_cost = float(school[0].costs(policy.vector[None])[0])
    return SrlLinearResult(*log.found(cell), final_cost, policy)


def _note(log: Log, decider: Decider, candidates: Floats) -> Floats:
    """The costs (N,) of the episodes of N candidate weights (N, F), which are noted one after the other."""
    costs = decider.costs(candidates)
    for weights, cost in zip(candidates, costs.tolist(), strict=True):
        sequence = decider.sequence(weights) if cost < log.best_cost else log.best
        log.note(sequence, cost, cost < decider.stuck_cost)
    return costs


def _scale(cell: Cell, objective: str) -> float:
    """The cost of the best dispatching rule, at least 1, as it is divided by."""
    return max(1.0, Orders(cell, objective, "srl-linear").scale)


def _of_length_1(weights: Floats) -> Floats:
    """The weights, scaled to length 1, which leaves every decision as it is; zeros stay zeros."""
    return weights / (float(np.linalg.norm(weights)) or 1.0)
