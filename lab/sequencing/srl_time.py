"""SRL improved: what time costs is learned step by step, alike toasts are one, and values begin at a lower bound."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lab.errors import BadInput
from lab.sequencing.bound import TICKS_PER_S, RobotWork
from lab.sequencing.cell import Cell
from lab.sequencing.events import EpisodeSequenced, LearnedSequence, Run

SAME_S = 1e-6  # two values nearer than this are equally good

State = tuple[tuple[int, ...], int, tuple[tuple[int, ...], ...]]
Table = dict[State, dict[int, float]]


@dataclass(frozen=True)
class SrlTimeResult(LearnedSequence):
    """A sequencer's result, and what was learned: the time [s] still needed, by state and by the station to serve next.

    A state is how many toasts stand at each station, where the robot is, and how long each machine still processes
    [ticks of a nanosecond].
    """

    q: Table


def srl_time(
    cell: Cell,
    episodes: int,
    rng: np.random.Generator,
    on_episode: Callable[[EpisodeSequenced], None] | None = None,
) -> SrlTimeResult:
    """Learn in so many simulated episodes which station to serve next; the best sequence found is the result.

    Q(s,a) begins at what the robot still has to do at least, never above the truth, so that greedy choices explore by
    themselves; ties are drawn by `rng`. After an episode, from its last step to its first, Q(s,a) = elapsed time +
    min Q(s',.): Q-learning with alpha 1, exact where nothing is left to chance. Raises BadInput for episodes < 1.
    Source: Q-learning (Watkins 1989) with admissible start values, as learning real-time A* (Korf 1990).
    """
    if episodes < 1:
        raise BadInput(f"episodes = {episodes}: allowed are whole numbers from 1")
    learner = _Learner(cell, rng)
    makespans: list[float] = []
    best_s, best = math.inf, tuple[int, ...]()
    for episode in range(1, episodes + 1):
        sequence, makespan_s = learner.episode()
        makespans.append(makespan_s)
        if makespan_s < best_s:
            best_s, best = makespan_s, sequence
        if on_episode is not None:
            on_episode(EpisodeSequenced(episode, makespan_s, best_s))
    _, final_s = learner.episode(learns=False)
    return SrlTimeResult(best, best_s, tuple(makespans), final_s, learner.q)


class _Learner:
    """The table, and how an episode goes."""

    def __init__(self, cell: Cell, rng: np.random.Generator) -> None:
        self.q: Table = {}
        self._cell, self._rng, self._work = cell, rng, RobotWork(cell)
        self._machines = [place for place, station in enumerate(cell.stations) if station.kind == "machine"]

    def episode(self, learns: bool = True) -> tuple[tuple[int, ...], float]:
        """One greedy pass; the toasts in the order in which they were moved, and the makespan [s]."""
        run, sequence = Run(self._cell), list[int]()
        steps: list[tuple[dict[int, float], int, float, dict[int, float]]] = []
        row = self._row(run)
        while row:
            station, began_s = self._best(row), run.now_s
            sequence.append(_first(run, station))
            run.move(sequence[-1])
            following = self._row(run)
            steps.append((row, station, run.now_s - began_s, following))
            row = following
        for row, station, elapsed_s, following in reversed(steps) if learns else ():
            row[station] = elapsed_s + min(following.values(), default=0.0)
        return tuple(sequence), run.now_s

    def _row(self, run: Run) -> dict[int, float]:
        """The values of the stations that may be served now; none when all is done."""
        processing = tuple(
            tuple(sorted(round(max(0.0, run.ready_s[t] - run.now_s) * TICKS_PER_S) for t in _toasts_at(run, place)))
            for place in self._machines
        )
        state = (tuple(run.counts), run.robot, processing)
        if state not in self.q:
            least_s = max(0, self._work.left(run.counts, run.robot)) / TICKS_PER_S
            self.q[state] = dict.fromkeys((run.locations[toast - 1] for toast in run.allowed()), least_s)
        return self.q[state]

    def _best(self, row: dict[int, float]) -> int:
        least = min(row.values())
        ties = [station for station, value in row.items() if value <= least + SAME_S]
        return ties[int(self._rng.integers(len(ties)))]


def _toasts_at(run: Run, place: int) -> list[int]:
    """Indices of the toasts at a station."""
    return [toast for toast, station in enumerate(run.locations) if station == place]


def _first(run: Run, place: int) -> int:
    """Of the alike toasts at a station the number of the one that came first."""
    return min(_toasts_at(run, place), key=lambda toast: (run.ready_s[toast], toast)) + 1
