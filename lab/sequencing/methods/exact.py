"""The proven optimum of a cell: the values of all its states for an advisor, and best-first search with alike parts merged."""

import heapq
from dataclasses import dataclass
from itertools import chain
from math import inf
from operator import le

import numpy as np

from lab.errors import BadInput, WorkFailed, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.cell.ways import FAR, TICKS_PER_S, Way
from lab.sequencing.methods import deferred
from lab.sequencing.methods.lower_bound import LowerBound
from lab.sequencing.methods.one_robot import TIME_LIMIT_S as TOURS_S
from lab.sequencing.methods.one_robot import OneRobot, one_robot, why_not
from lab.sequencing.methods.rules import first_come
from lab.sequencing.methods.shared import Shared, shared_of
from lab.sequencing.search import Search, SequenceResult, gap, only_one
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.merged import MergedCell, MergedKey, MergedState
from lab.sequencing.simulate.run import Run
from lab.sequencing.simulate.windowed import WindowedCell

MOST_STATES = 100_000
MOST_PARTS = 40  # each adds to the depth of the search


class ExactValues:
    """The least time [s] that a cell still needs after each decision, by exhaustive search that visits each state once.

    Raises BadInput for more than MOST_PARTS parts or MOST_STATES states.
    """

    def __init__(self, cell: Cell) -> None:
        if cell.parts > MOST_PARTS:
            raise BadInput(f"an advisor who knows exact values: {cell.parts} parts are too many, at most {MOST_PARTS}")
        self.cell, self._merged = cell, MergedCell(cell)
        self._left: dict[MergedKey, float] = {}

    def of(self, run: Run, allowed: tuple[int, ...]) -> list[float]:
        """The time from now to the end after each of the decisions; infinite where it ends in a deadlock."""
        state, parts = self._merged.of_run(run)._replace(who=None), self.cell.parts
        left_s = {at: self._after(state, way) / TICKS_PER_S for at, way in self._merged.choices(state).items()}
        return [left_s[run.locations[part_of(d, parts) - 1], choice_of(d, parts)] for d in allowed]

    def _after(self, state: MergedState, way: Way) -> float:
        ahead = self._merged.after(state, way)
        return ahead.now - state.now + self._least(ahead)

    def _least(self, state: MergedState) -> float:
        if self._merged.done(state):
            return 0.0
        key = self._merged.key(state)
        if key not in self._left:
            if len(self._left) >= MOST_STATES:
                what = f"{self.cell.parts} parts have more than {MOST_STATES} states"
                raise BadInput(f"an advisor who knows exact values: {what}; take fewer")
            ways = self._merged.choices(state).values()
            self._left[key] = min((self._after(state, way) for way in ways), default=inf)
        return self._left[key]


# ---- Best-first search and the method `exact` -------------------------------------------------------------------------


MAX_EXPANDED = 300_000
ROUND = 500  # states expanded between two checks of the limits
STRAIGHT = 5  # one of so many expanded states is spent on a greedy descent to a complete order
MOST_KEPT = 20_000_000  # integers in all states that were reached: half a gigabyte, which only large cells come near


@dataclass(frozen=True)
class Optimum:
    """The best sequence known, and what is proven: no sequence is shorter than `bound_s`.

    cost: its makespan [s]. `proven`: the sequence is optimal (to a nanosecond a move) and `bound_s` is its makespan.
    `expanded`: states opened.
    """

    cost: float
    sequence: tuple[int, ...]
    proven: bool
    bound_s: float
    expanded: int

    @property
    def optimal_s(self) -> float | None:
        """The makespan when it is proven to be optimal, else None [s]."""
        return self.cost if self.proven else None

    def gap(self, cost: float) -> float:
        """How much longer a makespan is than the proven optimum, or than the bound when there is none (see `search.gap`)."""
        return gap(cost, self.bound_s)


class _Search:
    """The queue and the reached states. expanded: how many states were expanded; kept: how many integers all of them hold."""

    def __init__(self, cell: Cell) -> None:
        self.merged = WindowedCell(cell) if cell.has_windows else MergedCell(cell)
        self._least = LowerBound(self.merged)
        # Arrivals by the clock are left out of the comparison: they are the same in all states.
        self._waits = len(self.merged.slots) + self.merged.one_by_one
        self.expanded = self.bound = self._serial = self.kept = self._straight = 0
        self._fronts: dict[tuple[int, int], list[tuple[int, ...]]] = {}
        self._heap: list[tuple[int, int, MergedState]] = []
        self._greedy, self.most_kept = False, MOST_KEPT
        self._reach(self.merged.start())

    @property
    def exhausted(self) -> bool:
        """Whether every state that can be reached was opened."""
        return not self._heap

    def run(self, most: int, shared: Shared | None = None) -> MergedState | None:
        """The first complete state; None: none was found among `most` expanded states, among all, or within the memory limit.

        shared: receives the bound, and orders found by greedy descent from the state reached.
        """
        while self._heap:
            bound, serial, state = heapq.heappop(self._heap)
            if self._times(state) not in self._fronts[state.counts, state.robot]:
                continue  # overtaken since it was queued
            self.bound = max(self.bound, bound)
            if self.merged.done(state):
                return state
            if self.expanded >= most or self.kept >= self.most_kept:
                heapq.heappush(self._heap, (bound, serial, state))
                return None
            self.expanded += 1
            if shared is not None and self.expanded % ROUND == 1:
                self._report(shared, state)
            for successor in self.merged.successors(state):
                self._reach(successor)
        return None

    def _report(self, shared: Shared, state: MergedState) -> None:
        """Tells `shared` the bound, and now and then an order, and checks the limits."""
        if not self._greedy:
            order = self._straight_on(state) if self.expanded > STRAIGHT * self._straight else ()
            shared.tell("A*", order, self.bound / TICKS_PER_S)
        shared.look()

    def _straight_on(self, state: MergedState) -> tuple[int, ...]:
        """The decisions of a greedy descent from a state, each to the successor of least bound; empty: it ends in a deadlock."""
        while not self.merged.done(state):
            ahead = [
                (successor.now + self._least.left(successor), n, successor)
                for n, successor in enumerate(self.merged.successors(state))
            ]
            self._straight += 1
            least, _, state = min(ahead, default=(FAR, 0, state))
            if least >= FAR:
                return ()
        return self.merged.decisions(state)

    def hasten(self) -> None:
        """Switches to greedy best-first search by the time left alone: from now on any complete state will do."""
        self._greedy, self.most_kept = True, 2 * self.most_kept
        self._heap = [(self._least.left(state), serial, state) for _, serial, state in self._heap]
        heapq.heapify(self._heap)

    def _reach(self, state: MergedState) -> None:
        """Queues a state unless another one with equal counts and robot dominates it; states that it dominates are dropped."""
        if self.merged.one_by_one:
            # How long a part has already waited to be picked does not matter either.
            state = state._replace(waits=(*state.waits[:-1], tuple([max(at, state.now) for at in state.waits[-1][:1]])))
        left = self._least.left(state)
        if left >= FAR:
            return
        times = self._times(state)
        front = self._fronts.setdefault((state.counts, state.robot), [])
        if any(all(map(le, other, times)) for other in front):
            return
        front[:] = [other for other in front if not all(map(le, times, other))]
        front.append(times)
        self.kept += len(times) + len(state.waits) * (1 + sum(map(len, state.rows)))
        # Of equally promising states the newest comes first, hence the falling serial number.
        self._serial -= 1
        heapq.heappush(self._heap, (left if self._greedy else state.now + left, self._serial, state))

    def _times(self, state: MergedState) -> tuple[int, ...]:
        """The times of a state for the dominance test: with equal counts and robot, a state that is nowhere later is no worse."""
        waited = self._waits
        moments = [(state.now,), *state.waits[:waited]]
        for row in chain.from_iterable(state.rows):
            moments += [(row.now, -row.until), *row.waits[:waited]]
        return tuple(chain.from_iterable(moments))


def optimum(cell: Cell, max_expanded: int = MAX_EXPANDED, shared: Shared | None = None) -> Optimum:
    """The shortest makespan of the cell and a sequence that reaches it; alike parts are numbered first in, first out.

    In a cell with time windows the robot may wait deliberately (see `WindowedCell`). States are expanded in the order of time so
    far + lower bound of the time left, so the first complete one is optimal. After `max_expanded` states, or once the reached
    states hold MOST_KEPT integers, the proof is given up and as many states again are expanded by the time left alone to find a
    sequence: `proven` is then False and `bound_s` the bound reached. `shared` receives incumbents and bounds as they are found
    and may end the search (see `Shared.look`). Raises WorkFailed when no complete sequence exists, or none was found.
    Source: uniform-cost search (Dijkstra 1959) with an admissible bound (A*, Hart et al. 1968); the pruning of later
    states that are otherwise alike is the thesis's branch and bound, App. IV.
    """
    search = _Search(cell)
    state = search.run(max_expanded, shared)
    if state is not None:
        sequence = search.merged.decisions(state)
        cost = simulate(cell, sequence).makespan_s
        return Optimum(cost, sequence, True, cost, search.expanded)
    bound_s, expanded = search.bound / TICKS_PER_S, search.expanded
    search.hasten()
    state = search.run(2 * max_expanded, shared)
    sequence = () if search.exhausted and state is None else first_come(cell)
    sequence = sequence if state is None else search.merged.decisions(state)
    if not sequence:
        why = "is proven: all were tried" if search.exhausted else f"was not proven, in {search.expanded} states"
        parts = counted(len(cell.unfinished), "part")
        raise WorkFailed(f"no order was found that finishes {parts}; that there is none {why}")
    return Optimum(simulate(cell, sequence).makespan_s, sequence, False, bound_s, expanded)


def exact(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The proven best sequence by the mean times; it draws nothing from `rng`.

    The makespan is minimised by `optimum`, or by `one_robot` for a job shop with one transport robot; when these give up, and for
    other objectives and cells, by CP-SAT within its time limit, which may not prove its sequence. Raises BadInput as they do.
    """
    search.check(cell)
    shared = shared_of(cell, search)
    best: Optimum | OneRobot | None = None
    if search.objective == MAKESPAN and cell.serial:
        best = optimum(cell, shared=shared)
        shared.tell("A*", best.sequence, best.bound_s)
    elif search.objective == MAKESPAN and not why_not(cell):
        best = one_robot(cell, shared.left_s(TOURS_S), shared)
    sequence, cost = (best.sequence, best.cost) if best else ((), inf)
    if best is None or (not best.proven and deferred.fits(cell) and not cell.batches):
        left_s = shared.left_s(deferred.CP_SAT_TIME_LIMIT_S)
        other = deferred.cp_sat(cell, search.objective, left_s, hint=sequence or None, shared=shared)
        sequence, cost = min((cost, sequence), (other.cost, other.sequence))[::-1]
    return only_one(cell, search, sequence, cost, bool(sequence))
