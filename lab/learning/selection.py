"""How an action is chosen from action values: greedy, epsilon-greedy, softmax, and the schedule 1/n**beta.

The functions take their uniform numbers in [0, 1) as arguments, so the caller decides on the generator. `exp_of` is also compiled
by numba, so that session and kernel choose the same actions.
"""

from collections.abc import Callable, Iterator, Sequence
from math import exp

import numpy as np

from lab.learning.members import Member

COLDEST = 1e-300  # dividing by a lower temperature would overflow
BELOW_ONE = 1.0 - 2.0**-52  # keeps u * total below the total despite rounding

SOFTMAX, EPSILON_GREEDY, GREEDY = range(3)  # the selections of the kernels

Draw = Callable[[], float]


def temperature(episode: int, beta: float, scale: float = 1.0) -> float:
    """The temperature tau = scale * n**-beta of episode n >= 1. Source: thesis eq. 9.2 (eq. 5.1 for epsilon)."""
    return max(scale * float(episode**-beta), COLDEST)


def exp_of(x: float) -> float:
    """exp(x) for x <= 0 with an error below 2e-8, 0 below -409: a cubic in x/256, squared eight times."""
    r = x * (1.0 / 256.0)
    p = max(1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0))), 0.0)
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    return p * p


def softmax(values: Sequence[float], tau: float) -> list[float]:
    """The Boltzmann probabilities exp(Q/tau) / sum, finite for any tau >= 0; they sum to 1. Source: thesis eq. 9.1."""
    top = max(values)
    tau = max(COLDEST, tau)
    weights = [exp((value - top) / tau) for value in values]  # at most exp(0), so nothing overflows
    total = sum(weights)
    return [weight / total for weight in weights]


def choose_softmax(values: Sequence[float], tau: float, u: float) -> int:
    """The action that the uniform number u in [0, 1) selects by the softmax probabilities, each exact to 1e-7."""
    top = max(values)
    per_tau = 1.0 / max(COLDEST, tau)
    total, sums = 0.0, []
    for value in values:
        total += exp_of((value - top) * per_tau)
        sums.append(total)
    mark = u * total * BELOW_ONE
    return sum(below <= mark for below in sums[:-1])


def greedy(values: Sequence[float]) -> int:
    """The best action; ties: the lowest index."""
    return values.index(max(values))


def choose_greedy(values: Sequence[float], epsilon: float, u: float) -> int:
    """The best action; u in [0, 1) decides between ties. `epsilon` is not used."""
    top = max(values)
    best = [action for action, value in enumerate(values) if value == top]
    return best[min(int(u * len(best)), len(best) - 1)]


def choose_epsilon_greedy(values: Sequence[float], epsilon: float, u: float) -> int:
    """The best action or, with probability epsilon, any action; one uniform number u in [0, 1) decides everything."""
    if u >= epsilon:
        return choose_greedy(values, epsilon, (u - epsilon) / (1.0 - epsilon))
    return min(int(u / epsilon * len(values)), len(values) - 1)


SELECTIONS: dict[str, Member[Callable[[Sequence[float], float, float], int]]] = {
    "softmax": Member(
        choose_softmax, "at random, better moves with higher probability; it explores less with time", SOFTMAX
    ),
    "epsilon-greedy": Member(
        choose_epsilon_greedy, "the best move, sometimes a random one: less often with time", EPSILON_GREEDY
    ),
    "greedy": Member(choose_greedy, "always the best known move", GREEDY),
}


def chances(selection: str, values: Sequence[float], temperature: float) -> list[float]:
    """The probability of each action, (A,), under the selection of that name; they sum to 1."""
    if selection == "softmax":
        return softmax(values, temperature)
    best = [value == max(values) for value in values]
    explores = min(temperature, 1.0) if selection == "epsilon-greedy" else 0.0
    return [explores / len(best) + (1.0 - explores) * is_best / sum(best) for is_best in best]


def uniforms(rng: np.random.Generator, block: int = 1024) -> Draw:
    """A function that returns uniform numbers in [0, 1), one per call: the generator's stream, drawn in blocks for speed."""

    def stream() -> Iterator[float]:
        while True:
            yield from rng.random(block).tolist()

    return stream().__next__
