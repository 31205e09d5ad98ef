"""Compiled random futures: the cost of a decision in each of them, continued by a list of priorities."""

from typing import Any

from lab.learning.compiled import inner, without_refcounts
from lab.sequencing.methods.priorities import carried_on
from lab.sequencing.simulate.kernels import take


@inner
def _as_it_is(run: Any, now: Any) -> None:
    for part in range(len(run.locations)):
        run.locations[part], run.finished_s[part] = now.locations[part], now.finished_s[part]
    for station in range(len(run.room)):
        run.room[station] = now.room[station]
    for i in range(len(run.clock)):
        run.clock[i] = now.clock[i]
    run.whole[0], run.whole[1] = now.whole[0], now.whole[1]
    run.robots_at[0], run.robots_s[0] = now.robots_at[0], now.robots_s[0]


@without_refcounts
def mean_cost(cell: Any, run: Any, now: Any, order: Any, way: Any, ready_s: Any, seeds: Any) -> float:
    """The mean cost over K futures of a decision `way`, (part from 0, option), and of the list `order` after it.

    now: the present state of the run, without ready_s (K, P), the times from which parts may be picked in each future; seeds
    (K,): of the times that have not begun yet. run: room for a run.
    """
    total = 0.0
    for k in range(len(seeds)):
        _as_it_is(run, now)
        for part in range(len(run.ready_s)):
            run.ready_s[part] = ready_s[k, part]
        for i in range(len(order.used)):
            order.used[i] = False
        take(cell, run, way[0], way[1], seeds[k])
        total += carried_on(cell, run, order, 1e300, seeds[k])
    return total / len(seeds)
