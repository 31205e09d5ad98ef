"""Q-learning of what time still to come costs, from a lower bound of the full model on: close to heuristic search."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, WITH_DUE_TIMES, check_built_in, machine_places, stuck_cost
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.cell.ways import TICKS_PER_S
from lab.sequencing.methods.lower_bound import LowerBound
from lab.sequencing.search import SAME, LearnedSequence, Log, Search
from lab.sequencing.simulate.execution import Choose, Observed, Policy
from lab.sequencing.simulate.merged import MergedCell, MergedKey, MergedState

SMALL_JOBS = (5, 6, 7)  # parts; what is learned with so few is tried with more
MOST_VALUES = 2_000_000  # of a table: half a gigabyte
PRACTICE, TRIES = 5, 20  # each small job is practised in a fifth of the episodes, and tried in a twentieth

Action = tuple[int, int, int]  # position, choice, and the part where parts are told apart (else 0)
Row = dict[Action, float]
Table = dict[tuple[object, ...], Row]


@dataclass(frozen=True)
class SrlTimeResult(LearnedSequence):
    """A sequencer's result, and what was learned: the cost still to come, by state and by what to move next.

    A state is how many parts stand at each position, where the robot is, and how long is still to be waited for what is
    processed or arrives [ticks of a nanosecond]. With many parts `final_cost` is that of the best policy learned with
    few or with all.
    """

    q: Table


def srl_time(cell: Cell, search: Search, rng: np.random.Generator, bounded: bool = True) -> SrlTimeResult:
    """Learn in simulated episodes which position to serve next; the best sequence found is the result.

    Where alike parts are more than in SMALL_JOBS, these are learned first, each in a fifth of the episodes, and what was
    learned is tried on the job in a twentieth: with many parts waiting and many done, it does not matter how many. In
    what is left the job itself is learned. `episode_costs` are those of the job.
    Q(s,a) begins at what the step costs and what has to come at least after it (`lower_bound`), never above the
    truth, so that greedy choices explore by themselves; ties are drawn by `rng`. That bound knows the whole model, its
    times and all that is still to come, which a learner that only sees episodes does not: with `bounded` False values begin
    at 0. After an episode, from its last step to
    its first, Q(s,a) = cost of the step + min Q(s',.): Q-learning with alpha 1, exact where nothing is left to chance. It
    learns with the mean times; `srl_time_reacting` goes on learning where times are drawn. Raises BadInput for an
    objective that the cell has no times for.
    Source: Q-learning (Watkins 1989) with admissible start values, as learning real-time A* (Korf 1990).
    """
    search.check(cell)
    log, final = Log(search), inf
    learner, left = TimeLearner(cell, search.objective, rng, bounded), search.episodes
    for parts in SMALL_JOBS if _many_alike(cell) else ():
        practice, tries = search.episodes // PRACTICE, search.episodes // TRIES
        small = TimeLearner(replace(cell, order=cell.order[:parts]), search.objective, rng, bounded)
        for _ in range(practice):
            search.look()
            small.episode()
        for _ in range(tries):
            sequence, cost, done = small.tried_on(learner)
            log.note(sequence, cost, done)
            final = min(final, cost)
        left -= practice + tries
    for _ in range(left):
        log.note(*learner.episode())
    final = min(final, learner.episode(learns=False)[1])
    return SrlTimeResult(*log.found(cell), final, learner.q)


def bound_alone(cell: Cell, search: Search, rng: np.random.Generator) -> float | None:
    """What an order costs that follows the first values of `srl_time` greedily, nothing learned; None: it gets stuck."""
    _, cost, done = TimeLearner(cell, search.objective, rng).episode(learns=False)
    return cost if done else None


def _many_alike(cell: Cell) -> bool:
    alike = len(set(cell.order)) == 1 and cell.arrivals is None and cell.due_s is None
    return alike and cell.begins is None and not cell.precedences and cell.parts > max(SMALL_JOBS)


class TimeLearner:
    """The table, and how an episode goes. distinct: alike parts are told apart, which due times make necessary.

    bounded: values begin at what has to come at least; else at 0.
    """

    def __init__(self, cell: Cell, objective: str, rng: np.random.Generator, bounded: bool = True) -> None:
        check_built_in(objective, "srl-time")
        self.q: Table = {}
        self._values = 0
        self.merged = MergedCell(cell)
        self.distinct = objective in WITH_DUE_TIMES
        self._cell, self._objective, self._rng, self._bounded = cell, objective, rng, bounded
        self._bound = LowerBound(self.merged) if bounded and objective in (MAKESPAN, "machine-idle") else None
        self.stuck_cost, self._machines = stuck_cost(cell, objective), machine_places(cell)
        self._all_work_s = sum(place.processing_s or 0.0 for place in cell.positions)

    def greedy(self, state: MergedState) -> Action:
        """The action of least cost to come."""
        return self._best(self._row(state))

    def episode(self, begin: MergedState | None = None, *, learns: bool = True) -> tuple[tuple[int, ...], float, bool]:
        """One greedy pass, from the start or from `begin`; the decisions, their cost, and whether it came to its end."""
        state, sequence, total = begin or self.merged.start(named=True), list[int](), 0.0
        steps: list[tuple[Row, Action, float, Row]] = []
        row = self._row(state)
        while row:
            action = self._best(row)
            state, cost = self.step(state, action)
            sequence.append(self.merged.decision(state))
            total += cost
            following = self._row(state)
            steps.append((row, action, cost, following))
            row = following
        done = self.merged.done(state)
        rest = 0.0 if done else self.stuck_cost
        for row, action, cost, following in reversed(steps) if learns else ():
            row[action] = cost + min(following.values(), default=rest)
        return tuple(sequence), total if done else self.stuck_cost, done

    def step(self, state: MergedState, action: Action) -> tuple[MergedState, float]:
        """The state after an action, and what that adds to the cost."""
        place, choice, part = action
        way = self.merged.choices(state)[place, choice]
        ahead = self.merged.after(state, way, part)
        if self._objective == MAKESPAN:
            return ahead, (ahead.now - state.now) / TICKS_PER_S
        if self.distinct:
            return ahead, self._late(ahead) if way.option.to in self.merged.ends else 0.0
        if self._objective == "robot-idle":
            return ahead, self.merged.waited(state, ahead) / TICKS_PER_S
        worked = self.merged.process[way.option.to] or 0
        return ahead, (self._machines * (ahead.now - state.now) - worked) / TICKS_PER_S

    def tried_on(self, job: "TimeLearner") -> tuple[tuple[int, ...], float, bool]:
        """One greedy pass through a larger job by what was learned in this one; what `episode` returns.

        As how many the done parts count while others still wait is drawn. Where nothing is known it serves any part.
        """
        state, sequence, total = job.merged.start(named=True), list[int](), 0.0
        done = int(self._rng.integers(1, self._cell.parts - 1))
        while possible := list(job.actions(state)):
            row = self.q.get(self._as_if_small(job.merged, state, done), {})
            known = {action: row[action] for action in possible if action in row}
            state, cost = job.step(state, self._best(known or dict.fromkeys(possible, 0.0)))
            sequence.append(job.merged.decision(state))
            total += cost
        complete = job.merged.done(state)
        return tuple(sequence), total if complete else job.stuck_cost, complete

    def actions(self, state: MergedState) -> Iterator[Action]:
        """What may be done now: from which position, by which of its ways, and with which part where that matters."""
        for (place, choice), way in self.merged.choices(state).items():
            if not self.distinct or state.who is None:
                yield place, choice, 0
                continue
            in_order = self._cell.arrivals is not None and place in self.merged.starts
            for nth, part in enumerate(state.who[place][:1] if in_order else state.who[place]):
                if self.merged.in_time(state, way, nth):
                    yield place, choice, part

    def _as_if_small(self, job: MergedCell, state: MergedState, done: int) -> MergedKey:
        """The state of a larger job as it would be with this one's few: those that wait and those that are done are fewer."""
        counts, first, ends = job.counted(state.counts), self._cell.starts[0], job.ends
        finished = sum(counts[place] for place in ends)
        here = self._cell.parts - (sum(counts) - counts[first] - finished)
        counts[first] = max(0, min(counts[first], here - min(done, finished)))
        for place in ends:
            counts[place] = 0
        counts[ends[0]] = here - counts[first]
        _, robot, waits = job.key(state)
        return job.code(counts), robot, waits

    def _row(self, state: MergedState) -> Row:
        """The values of what may be done now; none when all is done, or nothing can move any more.

        Where the table is full, a state that it does not hold has the values that states begin with, each time anew.
        """
        key = (*self.merged.key(state), state.now, state.who) if self.distinct else self.merged.key(state)
        if (row := self.q.get(key)) is None:
            row = {action: self._at_least(state, action) for action in self.actions(state)}
            if self._values + len(row) <= MOST_VALUES:
                self.q[key] = row
                self._values += len(row)
        return row

    def _at_least(self, state: MergedState, action: Action) -> float:
        """What an action costs, and what has to come at least after it; 0 where nobody is to know."""
        if not self._bounded:
            return 0.0
        ahead, cost = self.step(state, action)
        if self._bound is None:
            return cost
        least_s = self._bound.left(ahead) / TICKS_PER_S
        return cost + (least_s if self._objective == MAKESPAN else self._machines * least_s - self._work_left_s(ahead))

    def _work_left_s(self, state: MergedState) -> float:
        """More than what machines still will be given to do [s]."""
        return (self._cell.parts - self.merged.finished(state)) * self._all_work_s

    def _late(self, state: MergedState) -> float:
        """What the part costs that was just finished."""
        due_s = self._cell.due_s
        if due_s is None:
            return 0.0
        late_s = max(0.0, state.now / TICKS_PER_S - due_s[state.part - 1])
        return float(late_s > 0) if self._objective == "tardy-parts" else late_s / self._cell.parts

    def _best(self, row: Row) -> Action:
        least = min(row.values())
        ties = [action for action, value in row.items() if value <= least + SAME]
        return ties[int(self._rng.integers(len(ties)))]


# ---- srl time reacting ------------------------------------------------------------------------------------------------


PRACTICE_EPISODES = 20  # simulated episodes before each decision


def reacting(cell: Cell, objective: str = MAKESPAN, seed: int = 0) -> Policy:
    """A policy that, before each decision, learns in a few simulated episodes from what can be seen to the end.

    It sees what stands where and for how long machines have been at work, and takes the mean for what is left. The table
    is the one of `srl_time`, and it is kept from decision to decision and from episode to episode, so that little is
    learned twice. Source: learning real-time A* (Korf 1990), as `srl_time`; certainty equivalence for the times.
    """
    learner = TimeLearner(cell, objective, np.random.default_rng(seed))

    def choose(seen: Observed, allowed: tuple[int, ...]) -> int:
        """The decision that serves the position of least cost to come; of alike parts the one that is ready first."""
        if len(allowed) == 1:
            return allowed[0]
        here = learner.merged.of_run(seen)
        for _ in range(PRACTICE_EPISODES):
            learner.episode(here)
        place, choice, wanted = learner.greedy(here)
        parts = cell.parts
        fitting = [
            d for d in allowed if choice_of(d, parts) == choice and seen.locations[part_of(d, parts) - 1] == place
        ]
        named = [d for d in fitting if part_of(d, parts) == wanted]
        return min(named or fitting, key=lambda d: (seen.ready_s[part_of(d, parts) - 1], d))

    def policy(_cell: Cell) -> Choose:
        return choose

    return policy
