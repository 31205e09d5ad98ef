"""The choice of a decision and the updates of a value: plain functions of numbers, which numba compiles as well.

SRL keeps the logarithms of values, because the type B factor divides a value by hundreds at each visit: below 1e-308 plain floats
would all be 0, and the choice between them random.
"""

from collections.abc import Sequence
from math import exp, inf, log, log1p

import numpy as np
from numpy.typing import NDArray

# Eq. 5.3 leaves a and b open; the listing has 1 / (T - T* + 5) + 0.8, which is 1 where T equals the best.
FACTOR_A_OFFSET = 5.0
FACTOR_A_FLOOR = 0.8
NEGLIGIBLE = 37.0  # exp(-37) times a number is less than half of its last bit


def explore(u: float, epsilon: float, count: int) -> int:
    """The index of a random one of `count` decisions; u: a uniform number below epsilon."""
    return min(int(u / epsilon * count), count - 1)


def best_of(values: Sequence[float] | NDArray[np.float64], count: int, u: float) -> int:
    """The index of the highest of the first `count` values; the uniform number u in [0, 1) breaks ties."""
    top, ties = values[0], 1
    for i in range(1, count):
        if values[i] > top:
            top, ties = values[i], 1
        elif values[i] == top:
            ties += 1
    rank = min(int(u * ties), ties - 1)
    for i in range(count):
        if values[i] == top:
            if rank == 0:
                return i
            rank -= 1
    return count - 1


def log_sum(a: float, b: float) -> float:
    """log(exp(a) + exp(b)) without leaving the range of floats; -inf stands for 0."""
    low, high = min(a, b), max(a, b)
    if low > high - NEGLIGIBLE:
        return high + log1p(exp(low - high))
    return high


def gain(cost: float, offset: float) -> float:
    """The return of an episode: 1 / T of a makespan (offset 0), 1 / (1 + cost) of objectives that may be 0 (offset 1)."""
    return 1.0 / (offset + cost)


def log_factor(cost: float, best_before: float, type_a: bool, offset: float) -> float:
    """The logarithm of the reward factor, type A (eq. 5.3) or type B (eq. 5.4)."""
    if not type_a:
        return -log(offset + cost)
    late = cost - best_before
    return log(1.0 / (late + FACTOR_A_OFFSET) + FACTOR_A_FLOOR) if late > 0.0 else 0.0


def average(mean: float, visits: int, new: float) -> float:
    """The mean of a new number and of `visits` numbers with the given mean."""
    return (visits * mean + new) / (visits + 1)


def log_of(value: float) -> float:
    """The logarithm of a value; -inf for 0."""
    return log(value) if value > 0 else -inf
