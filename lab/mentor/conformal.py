"""Conformal thresholds: a stated share of false alarms, or of failures caught, whatever the measure of doubt.

The episodes must be exchangeable: those that calibrate, and the next one, are runs of the same policy in the same conditions.
Source: split conformal prediction (Vovk, Gammerman and Shafer 2005); for warnings of failures Luo et al. 2022.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, inf
from typing import Annotated, Literal

import numpy as np
from annotated_types import Gt, Lt

from lab.errors import BadInput, check_value, counted
from lab.lazy import scipy

Kind = Literal["false alarms", "failures caught"]
_SLACK = 1e-9  # so that 0.1 * 10 counts as 1


@dataclass(frozen=True)
class Promise:
    """A threshold of doubt, and what it promises about the next episode of the same kind.

    share: at most this share of the successes raises a false alarm, or at least this share of the failures is caught, over
    all calibrations and episodes together. expected: the exact share, for doubts without ties. in_95: the share that is kept in
    95 % of the calibrations with so many episodes, since each single one is a draw.
    """

    kind: Kind
    share: float
    episodes: int
    threshold: float
    expected: float
    in_95: float


def few_false_alarms(peaks: Sequence[float], share: float) -> Promise:
    """The lowest threshold above which at most a share of the successful episodes rises.

    peaks (n,): the largest doubt of each successful episode. Raises BadInput for a share that n episodes cannot promise.
    """
    check_share("false_alarms", share, "calibrate")
    n = len(peaks)
    rank = ceil((n + 1) * (1.0 - share) - _SLACK)
    if rank > n:
        raise _too_few(n, ceil(1.0 / share - 1.0 - _SLACK), f"false_alarms {share:g}", "successful")
    threshold = float(np.sort(peaks)[rank - 1])
    return Promise("false alarms", share, n, threshold, *_above(n, rank, 0.95))


def many_caught(peaks: Sequence[float], share: float) -> Promise:
    """The highest threshold above which at least a share of the failed episodes rises.

    peaks (n,): the largest doubt of each failed episode while there was still time. Raises BadInput for a share that n episodes
    cannot promise.
    """
    check_share("caught", share, "calibrate")
    n = len(peaks)
    rank = floor((n + 1) * (1.0 - share) + _SLACK)
    if rank < 1:
        raise _too_few(n, ceil(1.0 / (1.0 - share) - 1.0 - _SLACK), f"caught {share:g}", "failed")
    lowest = float(np.sort(peaks)[rank - 1])
    threshold = float(np.nextafter(lowest, -inf))  # an episode that reaches it is caught
    return Promise("failures caught", share, n, threshold, *_above(n, rank, 0.05))


def _above(n: int, rank: int, level: float) -> tuple[float, float]:
    """The mean, and a quantile, of the share that lies above the rank-th of n draws: the beta distribution's."""
    return (n + 1 - rank) / (n + 1), float(scipy.special.betaincinv(n + 1 - rank, rank, level))


def check_share(name: str, share: float, where: str) -> None:
    """Raises BadInput, which names `where` it came from, unless a share is above 0 and below 1."""
    check_value(name, share, Annotated[float, Gt(0), Lt(1)], where)


def _too_few(n: int, least: int, what: str, which: str) -> BadInput:
    return BadInput(f"{what} (calibrate): {counted(n, f'{which} episode')}: that takes {least} or more")
