"""The execution of work in a cell of one robot when times are drawn by chance, and what a policy may observe of it.

A policy sees an `Observed` run: where parts stand and what is finished, but not how long anything will still take.
"""

from collections.abc import Callable

from lab.errors import WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Episode
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Move
from lab.sequencing.simulate.run import Run, take_over

WAIT = 0  # the decision to stay where the robot is until something happens: a machine finishes, a part arrives


class Observed(Run):
    """The observable state of a run, as a run by the mean times that can be simulated further.

    ready: whether each part may be picked now, part 1 first. ready_s: when it became ready or, while it is not, when it is
    expected to be: the mean time after its process began, or now when that has passed. processed_s: counts means for unfinished
    processes. began_s: when a part's present process began, or when its arrival was due. clock_s: the present time, where it
    does not follow from the robots.
    """

    def __init__(self, run: Run) -> None:
        super().__init__(run.cell)
        take_over(self, run)
        self.moves.clear()  # since they reveal how long the work will take
        self.ready: tuple[bool, ...] = ()
        self.began_s: list[float] = []
        self.clock_s: float | None = None

    @property
    def now_s(self) -> float:
        return super().now_s if self.clock_s is None else self.clock_s


Choose = Callable[[Observed, tuple[int, ...]], int]  # (what is known, allowed decisions) -> one of them, or WAIT
Policy = Callable[[Cell], Choose]  # called once an episode: what it remembers is of that episode


class Execution:
    """The execution, decision by decision, of a run whose times are not known in advance. sequence: without waits."""

    def __init__(self, cell: Cell, times: Episode | None = None) -> None:
        self.run = Run(cell, times)
        self.sequence: list[int] = []
        # For each part: when its latest process began, and the mean time of that; when it came to its first station, and when
        # it was picked there. Further, the parts that robots hold while they wait for room.
        self._began_s, self._mean_s = list(cell.begin_s), [0.0] * cell.parts
        self._came_s, self._left_s = [0.0] * cell.parts, [0.0] * cell.parts
        self._held = set[int]()

    @property
    def moves(self) -> list[Move]:
        """The moves made so far."""
        return self.run.moves

    def observe(self) -> Observed:
        """A copy of the state that can be observed now."""
        run, seen = self.run, Observed(self.run)
        seen.began_s = self._began_s.copy()
        known = enumerate(run.ready_s)
        seen.ready = tuple(s <= run.now_s and not self._coming(n) and n + 1 not in run.held for n, s in known)
        for index, ready in enumerate(seen.ready):
            if not ready and self._at_start(index):
                seen.ready_s[index] = max(run.now_s, run.cell.begin_s[index])  # arrivals are handled below
            elif not ready:
                began_s, mean_s = self._began_s[index], self._mean_s[index]
                seen.ready_s[index] = max(run.now_s, began_s + mean_s)
                seen.processed_s += mean_s - (run.ready_s[index] - began_s)
        self._expect_arrivals(seen)
        return seen

    def step(self, decision: int) -> None:
        """Carries out a decision, or waits for the next event; raises BadInput for a decision that is not allowed."""
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
        """Whether the part's arrival has not even been started: where arrivals follow picks, all but the next part."""
        arrivals = self.run.cell.arrivals
        if arrivals is None or arrivals.after != "pick" or not self._at_start(index):
            return False
        return index + 1 > self.run.cell.coming[self.run.fetched]

    def _at_start(self, index: int) -> bool:
        return self.run.locations[index] == self.run.cell.starts[index]

    def _expect_arrivals(self, seen: Observed) -> None:
        """Sets expected arrivals: each part its mean interval after the one before, or after a pick that happens now."""
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


def one_by_one(cell: Cell, policy: Policy, times: Episode | None = None) -> Execution:
    """The execution of one episode by a policy, decision by decision, to the end or to a deadlock."""
    execution, choose = Execution(cell, times), policy(cell)
    while allowed := execution.run.allowed():
        execution.step(choose(execution.observe(), allowed))
    return execution
