"""How a session chooses a decision and changes a value: plain functions of numbers, which numba compiles as well.

Values are kept as logarithms by SRL, because the type B factor divides a value by hundreds at each visit: below 1e-308
plain floats would all be 0 and the choice between them a draw.
"""

from collections.abc import Sequence
from math import exp, inf, log, log1p

import numpy as np
from numpy.typing import NDArray

# Eq. 5.3 leaves a and b open; the listing has 1 / (T - T* + 5) + 0.8, which is 1 where T equals the best.
FACTOR_A_OFFSET = 5.0
FACTOR_A_FLOOR = 0.8
NEGLIGIBLE = 37.0  # exp(-37) of a number is less than half of what its last bit stands for


def explore(u: float, epsilon: float, count: int) -> int:
    """Any of `count` decisions, for a uniform number u below epsilon."""
    return min(int(u / epsilon * count), count - 1)


def best_of(values: Sequence[float] | NDArray[np.float64], count: int, u: float) -> int:
    """The decision of the highest value; the uniform number u in [0, 1) decides between equally good ones."""
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
    """What an episode is worth: 1 / T of a makespan (offset 0), 1 / (1 + cost) of objectives that may be 0 (offset 1)."""
    return 1.0 / (offset + cost)


def log_factor(cost: float, best_before: float, type_a: bool, offset: float) -> float:
    """Logarithm of the reward factor, type A (eq. 5.3) or type B (eq. 5.4)."""
    if not type_a:
        return -log(offset + cost)
    late = cost - best_before
    return log(1.0 / (late + FACTOR_A_OFFSET) + FACTOR_A_FLOOR) if late > 0.0 else 0.0


def average(mean: float, visits: int, new: float) -> float:
    """The mean of `visits` numbers and a new one."""
    return (visits * mean + new) / (visits + 1)


def log_of(value: float) -> float:
    """log(value); of 0, -inf."""
    return log(value) if value > 0 else -inf
