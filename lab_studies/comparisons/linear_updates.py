"""The updates that were measured before `srl-linear` was chosen: step by step, with values that are linear in the same features.

Each is a textbook's way to carry the updates of a table over to weights. They are plain Python around the compiled features.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.carried_over_features import feature_arrays
from lab.sequencing.methods.carried_over_kernels import describe_all, work_arrays
from lab.sequencing.methods.carried_over_policy import FEATURES
from lab.sequencing.simulate import kernels
from lab.sequencing.simulate.cell_arrays import Floats, cell_arrays, run_arrays

ALPHA = 0.1  # of both value updates, as a share of the error, whatever the length of the features
GRADIENT_STEP, FADING = (
    0.3,
    0.1,
)  # of the policy gradient: the length of a step; of its baseline: the weight of the last cost
MOST_STEPS = 2.0  # the largest advantage, in mean deviations


class Choice(NamedTuple):
    """A decision among several: the features (D, F) of all, the index of the chosen one, the time [s], and its probabilities."""

    features: Floats
    chosen: int
    now_s: float
    shares: Floats


@dataclass(frozen=True)
class UpdateOutcome:
    """The lowest cost of all episodes, and that of the greedy policy at the end."""

    cost: float
    final_cost: float


class Simulation:
    """A cell in which episodes are run by a rule that is given the features (D, F) of the allowed decisions."""

    def __init__(self, cell: Cell) -> None:
        self._cell, self._run = cell_arrays(cell), run_arrays(cell)
        self._known, self._work = feature_arrays(cell), work_arrays(cell)
        self._found = np.zeros((cell.parts * cell.most_choices, len(FEATURES)))
        self.scale_s = float(self._known.scale_s)

    def episode(self, pick: Callable[[Floats], tuple[int, Floats]]) -> tuple[float, list[Choice]]:
        """The cost of an episode and its choices; pick: the index of a decision, and what it was drawn by."""
        kernels.reset(self._cell, self._run, np.uint64(0))
        choices = list[Choice]()
        while count := describe_all(self._cell, self._run, self._known, self._work, self._found):
            features, i = self._found[:count].copy(), 0
            if count > 1:
                i, shares = pick(features)
                choices.append(Choice(features, i, float(self._run.clock[0]), shares))
            kernels.move(self._cell, self._run, i, np.uint64(0))
        return float(kernels.cost(self._cell, self._run)), choices


def learned_by_values(cell: Cell, episodes: int, seed: int, bootstraps: bool) -> UpdateOutcome:
    """The outcome of learning the cost to go as a linear function of the features, with epsilon-greedy choices as in SRL.

    bootstraps: the target is the step's time plus the value of the next decision (semi-gradient SARSA(0), from the last step
    to the first); otherwise it is the cost to go of the episode (gradient Monte Carlo).
    Source: Sutton and Barto 2018, 9.3 and 10.1, with a normalised step.
    """
    simulation, rng = Simulation(cell), np.random.default_rng([seed, 3])
    weights, bias, best = np.zeros(len(FEATURES)), 0.0, np.inf

    def greedy(features: Floats) -> tuple[int, Floats]:
        return int(np.argmax(features @ weights)), np.zeros(0)

    for number in range(1, episodes + 1):

        def pick(features: Floats, epsilon: float = 1.0 / number) -> tuple[int, Floats]:
            return (int(rng.integers(len(features))), np.zeros(0)) if rng.random() < epsilon else greedy(features)

        cost, choices = simulation.episode(pick)
        best, following = min(best, cost), None
        for choice in reversed(choices):
            own = choice.features[choice.chosen]
            target = (choice.now_s - cost) / simulation.scale_s
            if bootstraps and following is not None:
                value = following.features[following.chosen] @ weights + bias
                target = value + (choice.now_s - following.now_s) / simulation.scale_s
            step = ALPHA * (target - own @ weights - bias) / (1.0 + own @ own)
            weights, bias, following = weights + step * own, bias + step, choice
    return UpdateOutcome(best, simulation.episode(greedy)[0])


def learned_by_gradient(cell: Cell, episodes: int, seed: int) -> UpdateOutcome:
    """The outcome of REINFORCE with a softmax policy, linear in the features, and a moving baseline.

    Source: Williams 1992; the gradient's length is 1 and the advantage is in mean deviations, so that no unit matters.
    """
    simulation, rng = Simulation(cell), np.random.default_rng([seed, 4])
    weights, best, baseline, spread = np.zeros(len(FEATURES)), np.inf, np.nan, 0.0

    def pick(features: Floats) -> tuple[int, Floats]:
        values = features @ weights
        shares = np.exp(values - values.max())
        shares /= shares.sum()
        return min(int(np.searchsorted(np.cumsum(shares), rng.random())), len(shares) - 1), shares

    for _ in range(episodes):
        cost, choices = simulation.episode(pick)
        best = min(best, cost)
        if np.isnan(baseline):
            baseline = cost
            continue
        gradient = np.zeros(len(FEATURES))
        for choice in choices:
            gradient += choice.features[choice.chosen] - choice.shares @ choice.features
        advantage = np.clip((baseline - cost) / max(spread, 1e-3 * baseline), -MOST_STEPS, MOST_STEPS)
        weights = weights + GRADIENT_STEP * advantage * gradient / (np.linalg.norm(gradient) or 1.0)
        spread += FADING * (abs(cost - baseline) - spread)
        baseline += FADING * (cost - baseline)

    def greedy(features: Floats) -> tuple[int, Floats]:
        return int(np.argmax(features @ weights)), np.zeros(0)

    return UpdateOutcome(best, simulation.episode(greedy)[0])


UPDATES: Mapping[str, Callable[[Cell, int, int], UpdateOutcome]] = {
    "SARSA, linear": lambda cell, episodes, seed: learned_by_values(cell, episodes, seed, bootstraps=True),
    "Monte Carlo, linear": lambda cell, episodes, seed: learned_by_values(cell, episodes, seed, bootstraps=False),
    "policy gradient, linear": learned_by_gradient,
}
