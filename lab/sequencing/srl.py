"""SRL, the sequencing algorithm of thesis ch. 5, as printed in fig. 5.1."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lab.errors import BadInput, unknown
from lab.sequencing.cell import Cell
from lab.sequencing.events import EpisodeSequenced, LearnedSequence, Run

Locations = tuple[int, ...]
Table = dict[Locations, dict[int, float]]
FACTORS = ("A", "B")
# Eq. 5.3 leaves a and b open; the listing has 1 / (T - T* + 5) + 0.8, which is 1 where T equals the best.
FACTOR_A_OFFSET_S = 5.0
FACTOR_A_FLOOR = 0.8


@dataclass(frozen=True)
class SrlResult(LearnedSequence):
    """A sequencer's result, and what SRL learned.

    `makespan_s` and `sequence` are the best found in any episode; `final_makespan_s` is the greedy policy's at the end.
    `log_q`: natural logarithm of Q by locations (station index per toast, nothing merged) and toast, for visited
    pairs. Logarithms, because the type B factor divides a value by hundreds or more at each visit: below 1e-308 plain
    floats would all be 0 and the choice between them a draw.
    """

    log_q: Table

    @property
    def q(self) -> Table:
        """Q itself; values below 1e-308 show as 0. Pairs never visited still have their first value, 1."""
        return {state: {toast: math.exp(value) for toast, value in row.items()} for state, row in self.log_q.items()}


def srl(
    cell: Cell,
    episodes: int,
    rng: np.random.Generator,
    *,
    alpha: float = 0.05,
    discount: float = 0.9,
    beta: float = 1.0,
    factor: Literal["A", "B"] = "B",
    on_episode: Callable[[EpisodeSequenced], None] | None = None,
) -> SrlResult:
    """Learn a sequence of toasts in so many episodes; the best sequence found is the result.

    Q = 1 at the start; after each step Q(s,a) += alpha (discount Q(s',a') - Q(s,a)), with Q = 0 after the last; after
    each episode the Q of every visited pair is multiplied by the reward factor, type A (eq. 5.3) or type B, 1 / T with
    T in seconds (eq. 5.4). Episode n explores with probability n ** -beta; equal values are drawn between by `rng`.
    Raises BadInput for settings out of range, and for type B when a makespan is 0 s.
    Source: thesis fig. 5.1, eq. 5.1 to 5.4.
    """
    _check_settings(episodes, alpha, discount, beta, factor)
    table: Table = {}
    makespans: list[float] = []
    best_s = math.inf
    best: tuple[int, ...] = ()
    for episode in range(1, episodes + 1):
        visited, makespan_s = _episode(cell, table, episode**-beta, alpha, discount, rng)
        log_factor = _log_factor(factor, makespan_s, best_s)
        for state, toast in visited:
            table[state][toast] += log_factor
        makespans.append(makespan_s)
        if makespan_s < best_s:
            best_s, best = makespan_s, tuple(toast for _, toast in visited)
        if on_episode is not None:
            on_episode(EpisodeSequenced(episode, makespan_s, best_s))
    return SrlResult(best, best_s, tuple(makespans), _greedy_makespan_s(cell, table, rng), table)


def _episode(
    cell: Cell, table: Table, epsilon: float, alpha: float, discount: float, rng: np.random.Generator
) -> tuple[list[tuple[Locations, int]], float]:
    """One pass with the step update; the (locations, toast) pairs visited and the makespan [s]."""
    run, visited = Run(cell), []
    log_keep, log_take = _log(1 - alpha), _log(alpha * discount)
    state, toasts = tuple(run.locations), run.allowed()
    toast = _choose(table.get(state, {}), toasts, epsilon, rng)
    while toasts:
        visited.append((state, toast))
        run.move(toast)
        row = table.setdefault(state, {})
        updated = row.get(toast, 0.0) + log_keep
        state, toasts = tuple(run.locations), run.allowed()
        if toasts:
            next_row = table.get(state, {})
            toast_after = _choose(next_row, toasts, epsilon, rng)
            updated = _log_sum(updated, log_take + next_row.get(toast_after, 0.0))
            row[toast], toast = updated, toast_after
        else:
            row[toast] = updated
    return visited, run.now_s


def _choose(row: dict[int, float], toasts: Sequence[int], epsilon: float, rng: np.random.Generator) -> int:
    """A random allowed toast with probability epsilon, else one of highest value; a value not yet held is log 1 = 0."""
    if rng.random() < epsilon:
        return toasts[int(rng.integers(len(toasts)))]
    values = [row.get(toast, 0.0) for toast in toasts]
    highest = max(values)
    ties = [toast for toast, value in zip(toasts, values, strict=True) if value == highest]
    return ties[int(rng.integers(len(ties)))]


def _greedy_makespan_s(cell: Cell, table: Table, rng: np.random.Generator) -> float:
    run = Run(cell)
    while toasts := run.allowed():
        run.move(_choose(table.get(tuple(run.locations), {}), toasts, 0.0, rng))
    return run.now_s


def _log_factor(factor: str, makespan_s: float, best_before_s: float) -> float:
    """Logarithm of the reward factor, eq. 5.3 (A) or 5.4 (B)."""
    if factor == "B":
        if makespan_s <= 0:
            raise BadInput(f"makespan {makespan_s} s: the type B factor 1 / T needs one above 0")
        return -math.log(makespan_s)
    late_s = makespan_s - best_before_s
    return 0.0 if late_s <= 0 else math.log(1 / (late_s + FACTOR_A_OFFSET_S) + FACTOR_A_FLOOR)


def _log(value: float) -> float:
    return math.log(value) if value > 0 else -math.inf


def _log_sum(a: float, b: float) -> float:
    """log(exp(a) + exp(b)) without leaving the range of floats."""
    low, high = min(a, b), max(a, b)
    return high if low == -math.inf else high + math.log1p(math.exp(low - high))


def _check_settings(episodes: int, alpha: float, discount: float, beta: float, factor: str) -> None:
    if episodes < 1:
        raise BadInput(f"episodes = {episodes}: allowed are whole numbers from 1")
    if factor not in FACTORS:
        raise unknown("reward factor", factor, FACTORS, "SRL")
    for name, value in (("alpha", alpha), ("discount", discount)):
        if not 0 <= value <= 1:
            raise BadInput(f"{name} = {value}: allowed are 0 to 1")
    if not 0 <= beta < math.inf:
        raise BadInput(f"beta = {beta}: allowed are finite numbers from 0")
