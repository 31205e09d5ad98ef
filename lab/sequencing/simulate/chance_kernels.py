"""The times of an episode drawn by its seed, compiled with numba; held equal to `chance`."""

from typing import Any

import numpy as np

from lab.learning import splitmix
from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.cell import chance
from lab.sequencing.simulate.cell_arrays import LAW_CODES

CONSTANT, NORMAL = LAW_CODES["constant"], LAW_CODES["normal"]

mixed: Any = inner(splitmix.mixed, inline="always")
fraction: Any = inner(splitmix.fraction, inline="always")
_state_at: Any = inner(splitmix.state_at, inline="always")
_normal, _exponential = inner(chance.normal), inner(chance.exponential)


@without_refcounts
def uniform(seed: Any, number: int) -> float:
    """`splitmix.uniform`."""
    return float(fraction(mixed(_state_at(seed, np.uint64(number)))))


@inner
def drawn(law: int, spread: float, mean_s: float, seed: Any, number: int) -> float:
    """`chance.Episode`: one time [s]."""
    if law == CONSTANT or mean_s == 0.0:
        return mean_s
    u, v = uniform(seed, 2 * number), uniform(seed, 2 * number + 1)
    if law == NORMAL:
        return _normal(mean_s, spread, u, v)
    return _exponential(mean_s, spread, u, v)


@inner
def apart(cell: Any, parts: int) -> int:
    """`chance.Episode._apart`."""
    return 2 * (parts + 1) * len(cell.begins)


@inner
def worked(cell: Any, seed: Any, part: int, there: int, parts: int) -> float:
    """`chance.Episode.processing_s` of a part (from 0)."""
    number = (part + 1) * len(cell.begins) + there
    work_s = drawn(cell.processing_law, cell.spread, cell.processing_s[there], seed, number)
    if cell.breaks_every_s == 0.0 or work_s == 0.0:
        return work_s
    first, worked_s, repaired_s = apart(cell, parts) + parts + 2 * chance.MOST_BREAKS * number, 0.0, 0.0
    for n in range(chance.MOST_BREAKS):
        worked_s -= cell.breaks_every_s * np.log(1.0 - uniform(seed, first + 2 * n))
        if worked_s >= work_s:
            break
        repaired_s -= cell.repair_s * np.log(1.0 - uniform(seed, first + 2 * n + 1))
    return work_s + repaired_s


@inner
def until(cell: Any, seed: Any, parts: int, robot: int, start_s: float, work_s: float) -> float:
    """`chance.Episode.until_s`, and `chance.through`."""
    if cell.robot_breaks_every_s == 0.0:
        return start_s + work_s
    first, until_s, n = apart(cell, parts) * (1 + chance.MOST_BREAKS) + parts, 0.0, robot
    while True:
        from_s = until_s - cell.robot_breaks_every_s * np.log(1.0 - uniform(seed, first + 2 * n))
        until_s = from_s - cell.robot_repair_s * np.log(1.0 - uniform(seed, first + 2 * n + 1))
        if from_s > start_s and from_s >= start_s + work_s:
            return start_s + work_s
        if until_s > start_s:
            work_s -= max(0.0, from_s - start_s)
            start_s = until_s
        n += len(cell.robot_starts)


@inner
def interval(cell: Any, seed: Any, part: int) -> float:
    """`chance.Episode.interval_s` of a part (from 0)."""
    number = (part + 1) * len(cell.begins) + cell.starts[part]
    return drawn(cell.arrivals_law, cell.spread, cell.interval_s[part], seed, number)
