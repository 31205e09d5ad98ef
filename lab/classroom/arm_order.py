"""The order in which a participant meets the arms of a study: by a balanced Latin square, drawn, or one arm each."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

Design = Literal["latin-square", "draw", "between"]
ORDER = 53  # part of the seed of orders


def williams_rows(n: int) -> list[tuple[int, ...]]:
    """The rows of Williams's design for n treatments 0..n-1: n rows for an even n, 2n for an odd one above 1.

    Every treatment stands equally often in every place, and follows every other one equally often (Williams 1949).
    """
    zigzag = [k // 2 + 1 if k % 2 else (n - k // 2) % n for k in range(n)]  # 0, 1, n-1, 2, n-2, ...
    rows = [tuple((first + shift) % n for first in zigzag) for shift in range(n)]
    return rows if n % 2 == 0 or n == 1 else rows + [row[::-1] for row in rows]


def rows_of(design: Design, n: int) -> list[tuple[int, ...]]:
    """The orders of n arms of which every block of participants has each once; none for "draw", which has no blocks."""
    match design:
        case "latin-square":
            return williams_rows(n)
        case "between":
            return [(arm,) for arm in range(n)]
        case _:
            return []


def arms_at(design: Design, arms: Sequence[str], position: int, seed: int) -> tuple[str, ...]:
    """The arms of the participant at a position (from 0) in their order; only one arm if the design is "between".

    Positions come in blocks as long as the design has rows; each block holds every row once, in an order drawn from the seed.
    """
    rows = rows_of(design, len(arms))
    if not rows:
        rng = np.random.default_rng([seed, ORDER, position])
        drawn = rng.permutation(len(arms))
    else:
        block, place = divmod(position, len(rows))
        rng = np.random.default_rng([seed, ORDER, block])
        drawn = np.asarray(rows[int(rng.permutation(len(rows))[place])])
    return tuple(arms[int(arm)] for arm in drawn)
