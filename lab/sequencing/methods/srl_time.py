"""SRL improved: what time costs is learned step by step, alike parts are one, and values begin at a lower bound."""

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, WITH_DUE_TIMES, stuck_cost
from lab.sequencing.cell.schedule import LearnedSequence
from lab.sequencing.methods.robot_bound import TICKS_PER_S
from lab.sequencing.search import SAME, Log, Search
from lab.sequencing.simulate.merged import Action, Flow, Layout, State

SMALL_JOBS = (5, 6, 7)  # parts; what is learned with so few is tried with more
PRACTICE, TRIES = 5, 20  # each small job is practised in a fifth of the episodes, and tried in a twentieth

Row = dict[Action, float]
Table = dict[State, Row]


@dataclass(frozen=True)
class SrlTimeResult(LearnedSequence):
    """A sequencer's result, and what was learned: the cost still to come, by state and by what to move next.

    A state is how many parts stand at each position, where the robot is, and how long is still to be waited for what is
    processed or arrives [ticks of a nanosecond]. With many parts `final_cost` is that of the best policy learned with
    few or with all.
    """

    q: Table


def srl_time(cell: Cell, search: Search, rng: np.random.Generator) -> SrlTimeResult:
    """Learn in simulated episodes which position to serve next; the best sequence found is the result.

    Where alike parts are more than in SMALL_JOBS, these are learned first, each in a fifth of the episodes, and what was
    learned is tried on the job in a twentieth: with many parts waiting and many done, it does not matter how many. In
    what is left the job itself is learned. `episode_costs` are those of the job.
    Q(s,a) begins at what the step costs and what has to come at least after it (`lower_bound`), never above the
    truth, so that greedy choices explore by themselves; ties are drawn by `rng`. After an episode, from its last step to
    its first, Q(s,a) = cost of the step + min Q(s',.): Q-learning with alpha 1, exact where nothing is left to chance. It
    learns with the mean times; `srl_time_reacting` goes on learning where times are drawn. Raises BadInput for an
    objective that the cell has no times for.
    Source: Q-learning (Watkins 1989) with admissible start values, as learning real-time A* (Korf 1990).
    """
    search.check(cell)
    log, final = Log(search), inf
    learner, left = Learner(cell, search.objective, rng), search.episodes
    for parts in SMALL_JOBS if _many_alike(cell) else ():
        practice, tries = search.episodes // PRACTICE, search.episodes // TRIES
        small = Learner(replace(cell, order=cell.order[:parts]), search.objective, rng)
        for _ in range(practice):
            small.episode()
        for _ in range(tries):
            sequence, cost = small.tried_on(learner)
            log.note(sequence, cost)
            final = min(final, cost)
        left -= practice + tries
    for _ in range(left):
        log.note(*learner.episode())
    final = min(final, learner.episode(learns=False)[1])
    log.check(cell)
    return SrlTimeResult(log.best, log.best_cost, tuple(log.costs), final, learner.q)


def _many_alike(cell: Cell) -> bool:
    alike = len(set(cell.order)) == 1 and cell.arrivals is None and cell.due_s is None
    return alike and cell.parts > max(SMALL_JOBS)


class Learner:
    """The table, and how an episode goes. distinct: alike parts are told apart, which due times make necessary."""

    def __init__(self, cell: Cell, objective: str, rng: np.random.Generator) -> None:
        self.q: Table = {}
        self.layout = Layout.of(cell)
        self.distinct = objective in WITH_DUE_TIMES
        self._cell, self._objective, self._rng = cell, objective, rng
        self._stuck = stuck_cost(cell, objective)

    def flow(self) -> Flow:
        """A new pass through the cell."""
        return Flow(self.layout, distinct=self.distinct)

    def greedy(self, run: Flow) -> Action:
        """The action of least cost to come."""
        return self._best(self._row(run))

    def episode(self, begin: Flow | None = None, *, learns: bool = True) -> tuple[tuple[int, ...], float, bool]:
        """One greedy pass, from the start or from `begin`; the decisions, their cost, and whether it came to its end."""
        run, sequence, total = begin.branch() if begin else self.flow(), list[int](), 0.0
        steps: list[tuple[Row, Action, float, Row]] = []
        row = self._row(run)
        while row:
            action = self._best(row)
            cost, decision = self.step(run, action)
            sequence.append(decision)
            total += cost
            following = self._row(run)
            steps.append((row, action, cost, following))
            row = following
        rest = 0.0 if run.done else self._stuck
        for row, action, cost, following in reversed(steps) if learns else ():
            row[action] = cost + min(following.values(), default=rest)
        return tuple(sequence), total if run.done else self._stuck, run.done

    def step(self, run: Flow, action: Action) -> tuple[float, int]:
        """Carry an action out; what it adds to the cost, and the decision that it was."""
        now, waited, processed = run.now, run.waited, run.processed
        decision = run.take(action)
        if self.distinct:
            return self._late(run), decision
        if self._objective == "robot-idle":
            return (run.waited - waited) / TICKS_PER_S, decision
        if self._objective == "machine-idle":
            passed, worked = self.layout.machines * (run.now - now), run.processed - processed
            return (passed - worked) / TICKS_PER_S, decision
        return (run.now - now) / TICKS_PER_S, decision

    def tried_on(self, job: "Learner") -> tuple[tuple[int, ...], float]:
        """One greedy pass through a larger job by what was learned in this one; the sequence and its cost.

        As how many the done parts count while others still wait is drawn. Where nothing is known it serves any part.
        """
        run, sequence, total = job.flow(), list[int](), 0.0
        done = int(self._rng.integers(1, self._cell.parts - 1))
        while not run.done:
            row = self.q.get(self._as_if_small(run, done), {})
            possible = list(run.actions())
            known = {action: row[action] for action in possible if action in row}
            cost, decision = job.step(run, self._best(known or dict.fromkeys(possible, 0.0)))
            sequence.append(decision)
            total += cost
        return tuple(sequence), total

    def _as_if_small(self, run: Flow, done: int) -> State:
        """The state as it would be with this job's few: those that wait and those that are done are fewer."""
        counts, first = list(run.counts), self._cell.starts[0]
        ends = [place for place, at in enumerate(self._cell.positions) if not at.options]
        finished = sum(counts[place] for place in ends)
        here = self._cell.parts - (sum(counts) - counts[first] - finished)
        counts[first] = max(0, min(counts[first], here - min(done, finished)))
        for place in ends:
            counts[place] = 0
        counts[ends[0]] = here - counts[first]
        _, robot, waits = run.state()
        return (tuple(counts), robot, waits)

    def _row(self, run: Flow) -> Row:
        """The values of what may be done now; none when all is done, or nothing can move any more."""
        state = run.state()
        if state not in self.q:
            self.q[state] = {action: self._at_least(run.branch(), action) for action in run.actions()}
        return self.q[state]

    def _at_least(self, run: Flow, action: Action) -> float:
        """What an action costs, and what has to come at least after it."""
        cost, _ = self.step(run, action)
        return cost + self._least(run)

    def _least(self, run: Flow) -> float:
        if self._objective not in (MAKESPAN, "machine-idle"):
            return 0.0
        least_s = run.least_left() / TICKS_PER_S
        return least_s if self._objective == MAKESPAN else self.layout.machines * least_s - self._work_left_s(run)

    def _work_left_s(self, run: Flow) -> float:
        """More than what machines still will be given to do [s]."""
        longest = sum(place.processing_s or 0.0 for place in self._cell.positions)
        return (self._cell.parts - run.finished) * longest

    def _late(self, run: Flow) -> float:
        part, due_s = run.last_finished, self._cell.due_s
        if not part or due_s is None:
            return 0.0
        late_s = max(0.0, run.now / TICKS_PER_S - due_s[part - 1])
        return float(late_s > 0) if self._objective == "tardy-parts" else late_s / self._cell.parts

    def _best(self, row: Row) -> Action:
        least = min(row.values())
        ties = [action for action, value in row.items() if value <= least + SAME]
        return ties[int(self._rng.integers(len(ties)))]
