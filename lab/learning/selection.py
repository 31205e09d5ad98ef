"""How an action is chosen from action values: greedy, epsilon-greedy, softmax, and the schedule 1/n**beta.

A choice takes its uniform numbers in [0, 1) as arguments, so whoever draws them decides on the generator.
"""

from collections.abc import Callable, Iterator, Sequence
from math import exp, inf

import numpy as np

COLDEST = 1e-300  # below this a temperature is as good as 0, and dividing by it would overflow


def temperature(episode: int, beta: float) -> float:
    """tau = n**-beta for episode n >= 1, never 0. Source: thesis eq. 9.2 (eq. 5.1 for epsilon)."""
    return max(float(episode**-beta), COLDEST)


def softmax(values: Sequence[float], tau: float) -> list[float]:
    """The Boltzmann probabilities exp(Q/tau) / sum: sums to 1, finite for any tau >= 0. Source: thesis eq. 9.1."""
    weights = _weights(values, tau)
    total = sum(weights)
    return [weight / total for weight in weights]


def choose_softmax(values: Sequence[float], tau: float, u: float) -> int:
    """The action that the uniform number u in [0, 1) picks from the softmax probabilities."""
    weights = _weights(values, tau)
    mark = u * sum(weights)
    for action, weight in enumerate(weights):
        mark -= weight
        if mark < 0.0:
            return action
    return greedy(values)  # u so near to 1 that rounding used up all weights


def _weights(values: Sequence[float], tau: float) -> list[float]:
    top = max(values)
    tau = max(COLDEST, tau)
    return [exp((value - top) / tau) for value in values]  # at most exp(0): nothing can overflow


def greedy(values: Sequence[float]) -> int:
    """The best action; ties: the lowest index."""
    best, best_value = 0, -inf
    for action, value in enumerate(values):
        if value > best_value:
            best, best_value = action, value
    return best


def choose_epsilon_greedy(values: Sequence[float], epsilon: float, u: float) -> int:
    """The best action, or with probability epsilon any one: one uniform number u in [0, 1) decides both."""
    if u >= epsilon:
        return greedy(values)
    return min(int(u / epsilon * len(values)), len(values) - 1)


def uniforms(rng: np.random.Generator, block: int = 1024) -> Callable[[], float]:
    """A fast source of uniform numbers in [0, 1): the generator's own stream, drawn in blocks."""

    def stream() -> Iterator[float]:
        while True:
            yield from rng.random(block).tolist()

    return stream().__next__
