"""SRL improved: what time costs is learned step by step, alike toasts are one, and values begin at a lower bound."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from lab.errors import BadInput
from lab.sequencing.bound import TICKS_PER_S, RobotWork
from lab.sequencing.cell import Cell
from lab.sequencing.events import EpisodeSequenced, LearnedSequence, Run

SAME_S = 1e-6  # two values nearer than this are equally good
SMALL_JOBS = (5, 6, 7)  # toasts; what is learned with so few is tried with more
PRACTICE, TRIES = 5, 20  # each small job is practised in a fifth of the episodes, and tried in a twentieth

State = tuple[tuple[int, ...], int, tuple[tuple[int, ...], ...]]
Table = dict[State, dict[int, float]]


@dataclass(frozen=True)
class SrlTimeResult(LearnedSequence):
    """A sequencer's result, and what was learned: the time [s] still needed, by state and by the station to serve next.

    A state is how many toasts stand at each station, where the robot is, and how long each machine still processes
    [ticks of a nanosecond]. With many toasts `final_makespan_s` is that of the best policy learned with few or with all.
    """

    q: Table


def srl_time(
    cell: Cell,
    episodes: int,
    rng: np.random.Generator,
    on_episode: Callable[[EpisodeSequenced], None] | None = None,
) -> SrlTimeResult:
    """Learn in so many simulated episodes which station to serve next; the best sequence found is the result.

    Where there are more toasts than in SMALL_JOBS, these are learned first, each in a fifth of the episodes, and what was
    learned is tried on the job in a twentieth: with many toasts waiting and many done, it does not matter how many. In
    what is left the job itself is learned. `episode_makespans_s` are those of the job.
    Q(s,a) begins at what the robot still has to do at least, never above the truth, so that greedy choices explore by
    themselves; ties are drawn by `rng`. After an episode, from its last step to its first, Q(s,a) = elapsed time +
    min Q(s',.): Q-learning with alpha 1, exact where nothing is left to chance. Raises BadInput for episodes < 1.
    Source: Q-learning (Watkins 1989) with admissible start values, as learning real-time A* (Korf 1990).
    """
    if episodes < 1:
        raise BadInput(f"episodes = {episodes}: allowed are whole numbers from 1")
    tried: list[tuple[tuple[int, ...], float]] = []
    best_s = math.inf

    def note(sequence: tuple[int, ...], makespan_s: float) -> None:
        nonlocal best_s
        tried.append((sequence, makespan_s))
        best_s = min(best_s, makespan_s)
        if on_episode is not None:
            on_episode(EpisodeSequenced(len(tried), makespan_s, best_s))

    learner, left, final_s = _Learner(cell, rng), episodes, math.inf
    for toasts in SMALL_JOBS if cell.toasts > max(SMALL_JOBS) else ():
        practice, tries = episodes // PRACTICE, episodes // TRIES
        small = _Learner(replace(cell, toasts=toasts), rng)
        for _ in range(practice):
            small.episode()
        for _ in range(tries):
            note(*small.tried_on(cell))
            final_s = min(final_s, tried[-1][1])
        left -= practice + tries
    for _ in range(left):
        note(*learner.episode())
    final_s = min(final_s, learner.episode(learns=False)[1])
    sequence, makespan_s = min(tried, key=lambda one: one[1])
    return SrlTimeResult(sequence, makespan_s, tuple(seconds for _, seconds in tried), final_s, learner.q)


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

    def tried_on(self, cell: Cell) -> tuple[tuple[int, ...], float]:
        """One greedy pass through a larger job by what was learned in this one; the sequence and its makespan [s].

        As how many the done toasts count while others still wait is drawn. Where nothing is known it serves any toast.
        """
        run, sequence = Run(cell), list[int]()
        done = int(self._rng.integers(1, self._cell.toasts - 1))
        while allowed := run.allowed():
            row = self.q.get(self._state(run, self._as_if_small(run, done)), {})
            possible = {run.locations[toast - 1] for toast in allowed}
            known = {place: value for place, value in row.items() if place in possible}
            station = self._best(known or dict.fromkeys(sorted(possible), 0.0))
            sequence.append(_first(run, station))
            run.move(sequence[-1])
        return tuple(sequence), run.now_s

    def _as_if_small(self, run: Run, done: int) -> list[int]:
        """Toasts per station as they would be with this job's few: those that wait and those that are done are fewer."""
        cell, counts = self._cell, list(run.counts)
        here = cell.toasts - (sum(counts) - counts[cell.first] - counts[cell.last])
        counts[cell.first] = max(0, min(counts[cell.first], here - min(done, counts[cell.last])))
        counts[cell.last] = here - counts[cell.first]
        return counts

    def _state(self, run: Run, counts: list[int]) -> State:
        processing = tuple(
            tuple(sorted(round(max(0.0, run.ready_s[t] - run.now_s) * TICKS_PER_S) for t in _toasts_at(run, place)))
            for place in self._machines
        )
        return tuple(counts), run.robot, processing

    def _row(self, run: Run) -> dict[int, float]:
        """The values of the stations that may be served now; none when all is done."""
        state = self._state(run, run.counts)
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
