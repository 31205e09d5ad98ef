"""Learns a carried-over policy: feature weights by which greedy runs of small cells cost less than those of the rules."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, check_built_in, check_objective, cost
from lab.sequencing.methods.carried_over import Decider, without_idle
from lab.sequencing.methods.carried_over_policy import FEATURES, CarriedPolicy
from lab.sequencing.methods.evolution import Evolution
from lab.sequencing.methods.rules import dispatch, usable
from lab.sequencing.simulate.cell_arrays import Floats
from lab.sequencing.simulate.run import Run

WORST = 3.0  # times the best rule's cost; a run that costs more, such as a deadlock, counts as this


@dataclass(frozen=True)
class CarriedLearning:
    """How policies are learned.

    population: candidates of a generation; batch: random cells that they are tested on; step: the first step size.
    """

    generations: int = 200
    population: int = 32
    batch: int = 120
    step: float = 0.3

    def __post_init__(self) -> None:
        for name, least in (("generations", 4), ("population", 4), ("batch", 1)):
            if getattr(self, name) < least:
                raise BadInput(f"{name} = {getattr(self, name)}: allowed are whole numbers from {least}")


OnGeneration = Callable[[int, float], None]  # (number from 1, mean of the candidates' costs over the best rule's)


def learn_policy(
    cells: Sequence[Cell],
    objective: str = MAKESPAN,
    settings: CarriedLearning | None = None,
    seed: int = 0,
    learned_on: str = "",
    heard: OnGeneration = lambda number, mean: None,
) -> CarriedPolicy:
    """A policy for cells like these small ones, learned only from the costs of greedy runs over the best rule's.

    Learning begins with the rule `nearest_ready`. The weights are the mean over the last quarter of the generations; a weight
    that makes no difference in any of the cells is 0. The same seed gives the same policy. heard: called after each
    generation. Raises BadInput without cells, and for an objective that a cell has no data for. Source: CMA-ES, Hansen
    2016; policies by evolution, Moriarty et al. 1999.
    """
    settings = settings or CarriedLearning()
    if not cells:
        raise BadInput("nothing to learn from: no cell")
    check_built_in(objective, "the carried-over policy")
    for cell in cells:
        check_objective(objective, cell)
    school = _School(cells, objective)
    rng = np.random.default_rng([seed, 11])
    start = np.zeros(len(FEATURES))
    start[[*FEATURES].index("delay")] = -1.0
    evolution, late = Evolution(start, settings.step, settings.population, rng), list[Floats]()
    for number in range(1, settings.generations + 1):
        chosen = rng.permutation(len(cells))[: settings.batch]
        costs = school.costs(evolution.ask(), chosen)
        evolution.tell(costs)
        heard(number, float(costs.mean()))
        if number > settings.generations * 3 // 4:
            late.append(evolution.mean / np.linalg.norm(evolution.mean))
    weights = without_idle(np.mean(late, axis=0), school.deciders)
    kept = {name: round(float(weight), 4) for name, weight in zip(FEATURES, weights, strict=True) if weight}
    return CarriedPolicy(kept, objective, learned_on)


class _School:
    """The training cells, by their `deciders`, and the best rule's cost of each."""

    def __init__(self, cells: Sequence[Cell], objective: str) -> None:
        self.deciders = [Decider(cell, objective) for cell in cells]
        self._scales = [_best_rule(cell, objective) for cell in cells]

    def costs(self, candidates: Floats, chosen: Sequence[int] | np.ndarray) -> Floats:
        """The mean ratio (N,) of the costs of candidates (N, F) to the best rule's in the chosen cells."""
        total = np.zeros(len(candidates))
        for number in chosen:
            total += np.minimum(WORST, self.deciders[number].costs(candidates) / self._scales[number])
        return total / len(chosen)


def _best_rule(cell: Cell, objective: str) -> float:
    """The cost of the best rule, at least 1, as it is divided by."""
    costs = []
    for rule in usable(cell).values():
        run = Run(cell)
        dispatch(run, rule)
        costs.append(cost(run, objective))
    return max(min(costs), 1.0)
