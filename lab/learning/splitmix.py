"""SplitMix64, the random number generator of all compiled code: plain functions of integers, which numba compiles as well.

Source: Steele, Lea and Flood, Fast splittable pseudorandom number generators, OOPSLA 2014.
"""

from collections.abc import Callable

STEP = 0x9E3779B97F4A7C15
MASK = (1 << 64) - 1


def following(state: int) -> int:
    """The state that follows a state, 0 to 2**64 - 1; the first one is the seed. Compiled functions here take uint64."""
    return state + STEP & MASK


def mixed(state: int) -> int:
    """The 64 output bits of a state."""
    z = (state ^ (state >> 30)) * 0xBF58476D1CE4E5B9 & MASK
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB & MASK
    return z ^ (z >> 31)


def fraction(bits: int) -> float:
    """The uniform number in [0, 1) that output bits represent."""
    return (bits >> 11) * 2.0**-53


def state_at(seed: int, number: int) -> int:
    """The state of number `number` (from 0) in the stream of a seed."""
    return seed + STEP + number * STEP & MASK


def apart(seed: int, number: int) -> int:
    """A seed whose stream is independent of that of `seed`, for the purpose with that number."""
    return mixed(seed + number & MASK)


def uniform(seed: int, number: int) -> float:
    """Uniform number `number` (from 0) in the stream of a seed."""
    return fraction(mixed(state_at(seed, number)))


def stream(seed: int) -> Callable[[], float]:
    """A function that returns the uniform numbers of a seed, one per call: those that a compiled session draws."""
    state = seed

    def draw() -> float:
        nonlocal state
        state = following(state)
        return fraction(mixed(state))

    return draw
