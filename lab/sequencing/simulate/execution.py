"""Carrying work out in a cell where times are drawn by chance: a fixed list of decisions, or a policy that reacts.

A policy sees an `Observed` run: what stands where and what is finished, but not how long anything will still take.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, WorkFailed, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance, Episode, drawn_seed
from lab.sequencing.cell.objectives import MAKESPAN, check_objective, cost
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Move
from lab.sequencing.simulate.run import Run, take_over

WAIT = 0  # the decision to stay where the robot is until something happens: a machine finishes, a part arrives


class Observed(Run):
    """What can be known of a run while it goes on; itself a run, by the mean times, so that it can be played on.

    ready: whether each part may be picked now, part 1 first. ready_s: when it was ready or, as long as it is not, when
    it should be: by the mean time since it began, and now when it is later than that. processed_s counts means for what
    is not finished. began_s: when what goes on with it began, or when it was to come. clock_s: the time, where robots that
    are busy do not tell it.
    """

    def __init__(self, run: Run) -> None:
        super().__init__(run.cell)
        take_over(self, run)
        self.moves.clear()  # they say how long the work will take
        self.ready: tuple[bool, ...] = ()
        self.began_s: list[float] = []
        self.clock_s: float | None = None

    @property
    def now_s(self) -> float:
        return super().now_s if self.clock_s is None else self.clock_s


Choose = Callable[[Observed, tuple[int, ...]], int]  # (what is known, allowed decisions) -> one of them, or WAIT
Policy = Callable[[Cell], Choose]  # called once an episode: what it remembers is of that episode


class Execution:
    """A run whose times nobody knows beforehand, carried out decision by decision. `sequence`: without the waiting."""

    def __init__(self, cell: Cell, times: Episode | None = None) -> None:
        self.run = Run(cell, times)
        self.sequence: list[int] = []
        # For each part: when its latest process began, and how long that takes on average; when it came to its first
        # station, and when it was picked there. And the parts that were held for want of room.
        self._began_s, self._mean_s = list(cell.begin_s), [0.0] * cell.parts
        self._came_s, self._left_s = [0.0] * cell.parts, [0.0] * cell.parts
        self._held = set[int]()

    @property
    def moves(self) -> list[Move]:
        """What was done."""
        return self.run.moves

    def observe(self) -> Observed:
        """What is known now; nothing of it changes when the run goes on."""
        run, seen = self.run, Observed(self.run)
        seen.began_s = self._began_s.copy()
        known = enumerate(run.ready_s)
        seen.ready = tuple(s <= run.now_s and not self._coming(n) and n + 1 not in run.held for n, s in known)
        for index, ready in enumerate(seen.ready):
            if not ready and self._at_start(index):
                seen.ready_s[index] = max(run.now_s, run.cell.begin_s[index])  # those that arrive are looked at below
            elif not ready:
                began_s, mean_s = self._began_s[index], self._mean_s[index]
                seen.ready_s[index] = max(run.now_s, began_s + mean_s)
                seen.processed_s += mean_s - (run.ready_s[index] - began_s)
        self._expect_arrivals(seen)
        return seen

    def step(self, decision: int) -> None:
        """Carry a decision out, or wait for the next event; BadInput for a decision that may not be taken."""
        if decision == WAIT:
            self._wait()
            return
        run, index = self.run, part_of(decision, self.run.cell.parts) - 1
        at_start, came_s = self._at_start(index), run.ready_s[index]
        move = run.move(decision)
        self.sequence.append(decision)
        if at_start:
            self._came_s[index], self._left_s[index] = came_s, move.pick_s
        place = run.cell.positions[run.locations[index]]
        if place.processing_s is not None:
            self._began_s[index], self._mean_s[index] = move.drop_s, place.processing_s
        for part in self._held:
            brought = next(other for other in reversed(run.moves) if other.part == part)
            if run.cell.positions[run.locations[part - 1]].processing_s is not None:
                self._began_s[part - 1] = brought.drop_s
        self._held = set(run.held) - {0}
        for part in run.inside(place.station) if place.station in run.cell.batches else ():
            self._began_s[part - 1], self._mean_s[part - 1] = move.drop_s, run.ready_s[part - 1] - move.drop_s

    def _wait(self) -> None:
        run = self.run
        coming_s = [ready_s for ready_s in run.ready_s if ready_s > run.now_s]
        if not coming_s:
            raise WorkFailed(f"the robot waits at {run.now_s:g} s, but nothing is going to happen: every part is ready")
        run.wait(min(coming_s))

    def _coming(self, index: int) -> bool:
        """Whether the part has not even set out: where each is brought after a pick, those behind the next one."""
        arrivals = self.run.cell.arrivals
        if arrivals is None or arrivals.after != "pick" or not self._at_start(index):
            return False
        return index + 1 > self.run.cell.coming[self.run.fetched]

    def _at_start(self, index: int) -> bool:
        return self.run.locations[index] == self.run.cell.starts[index]

    def _expect_arrivals(self, seen: Observed) -> None:
        """Each part that has not come is expected its mean interval after the one before; after a pick, if picked now."""
        arrivals, came_s = seen.cell.arrivals, 0.0
        if arrivals is None:
            return
        for index in (part - 1 for part in seen.cell.coming):
            mean_s = arrivals.interval_s[index]
            if not self._at_start(index):
                came_s = self._left_s[index] if arrivals.after == "pick" else self._came_s[index]
            elif seen.ready[index]:
                came_s = seen.now_s if arrivals.after == "pick" else self.run.ready_s[index]
            else:
                came_s = seen.ready_s[index] = max(seen.now_s, came_s + mean_s)


def carry_out(cell: Cell, policy: Policy, times: Episode | None = None) -> Execution:
    """What a policy makes of one episode, to the end or to a deadlock; several robots or servers as `several.Dispatch` says."""
    if not cell.serial:
        from lab.sequencing.simulate.several import dispatched

        return dispatched(cell, policy, times)
    return one_by_one(cell, policy, times)


def one_by_one(cell: Cell, policy: Policy, times: Episode | None = None) -> Execution:
    """What a policy makes of one episode, to the end or to a deadlock, one decision after the other."""
    execution, choose = Execution(cell, times), policy(cell)
    while allowed := execution.run.allowed():
        execution.step(choose(execution.observe(), allowed))
    return execution


def _followed(cell: Cell, sequence: Sequence[int], times: Episode) -> Run:
    """The run of a list of decisions, to where one would pick its part too late by these times."""
    run = Run(cell, times)
    for decision in sequence:
        if run.spoils(decision):
            break
        run.move(decision)
    return run


def replicate(
    cell: Cell, how: Policy | Sequence[int], chance: Chance, episodes: int, seed: int, objective: str = MAKESPAN
) -> NDArray[np.float64]:
    """The cost of a policy, or of a fixed list, in each of so many episodes (episodes,); in seconds, for most objectives.

    Episode n meets the same times whatever is carried out, and however many episodes there are: common random numbers,
    so compare two policies by their differences. A deadlock costs `stuck_cost`, and so does a part that a list would pick
    too late. Raises BadInput for fewer than 1
    episode, a negative seed, an objective that the cell does not allow, and a list that is not one of the cell's.
    Source: thesis App. III (50 replications).
    """
    check_objective(objective, cell)
    for name, value, least in (("episodes", episodes, 1), ("seed", seed, 0)):
        if value < least:
            raise BadInput(f"{name} = {value}: allowed are whole numbers from {least}")
    rng, costs = np.random.default_rng(seed), np.empty(episodes)
    for number in range(episodes):
        times = Episode(cell, chance, drawn_seed(rng))
        run = carry_out(cell, how, times).run if callable(how) else _followed(cell, how, times)
        if not run.done and not callable(how) and run.allowed() and not cell.has_windows:
            raise BadInput(f"the sequence ends after {counted(len(how), 'move')}, but not every part is finished")
        costs[number] = cost(run, objective)
    return costs
