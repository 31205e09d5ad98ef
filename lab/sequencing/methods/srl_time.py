"""Q-learning of the cost to go, with values that begin at a lower bound from the full model: close to heuristic search."""

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

SMALL_JOBS = (5, 6, 7)  # numbers of parts in the small jobs whose values are tried on the whole job
MOST_VALUES = 2_000_000  # values in a table: half a gigabyte
PRACTICE, TRIES = 5, 20  # each small job is practised in a fifth of the episodes, and tried in a twentieth

Action = tuple[int, int, int]  # position, choice, and the part where parts are told apart (else 0)
Row = dict[Action, float]
Table = dict[tuple[object, ...], Row]


@dataclass(frozen=True)
class SrlTimeResult(LearnedSequence):
    """A sequencer's result and the learned cost to go, by state and action.

    A state is how many parts stand at each position, where the robot is, and the time left until each process or arrival ends
    [ticks of a nanosecond]. With many parts, final_cost is that of the best policy, learned on a small job or on the whole one.
    """

    q: Table


def srl_time(cell: Cell, search: Search, rng: np.random.Generator, bounded: bool = True) -> SrlTimeResult:
    """The best sequence found while Q-learning, in simulated episodes, learns which position to serve next.

    When there are more identical parts than in SMALL_JOBS, the small jobs are learned first, each in a fifth of the episodes, and
    their values are tried on the whole job in a twentieth: with many parts waiting and many done, their numbers hardly matter. In
    the remaining episodes the whole job is learned; `episode_costs` are those of the whole job.
    Q(s,a) begins at the cost of the step plus a lower bound of the cost after it (`lower_bound`). Such values are optimistic, so
    greedy choices explore; ties are drawn by `rng`. The bound uses the whole model, which a learner that only sees episodes does
    not have: with `bounded` False values begin at 0. After an episode, from its last step to its first,
    Q(s,a) = cost of the step + min Q(s',.): Q-learning with alpha 1, which is exact when times are not drawn. It learns with the
    mean times; `reacting` goes on learning where times are drawn. Raises BadInput for an objective that the cell lacks data for.
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
    """The cost of the order that is greedy by the initial values of `srl_time`, without learning; None: it ends in a deadlock."""
    _, cost, done = TimeLearner(cell, search.objective, rng).episode(learns=False)
    return cost if done else None


def _many_alike(cell: Cell) -> bool:
    alike = len(set(cell.order)) == 1 and cell.arrivals is None and cell.due_s is None
    return alike and cell.begins is None and not cell.precedences and cell.parts > max(SMALL_JOBS)


class TimeLearner:
    """The table of values and its episodes. distinct: whether identical parts are told apart, as due times require.

    bounded: whether values begin at a lower bound of the cost to go; else they begin at 0.
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
        """The action of least cost to go."""
        return self._best(self._row(state))

    def episode(self, begin: MergedState | None = None, *, learns: bool = True) -> tuple[tuple[int, ...], float, bool]:
        """The decisions of a greedy episode from the start or from `begin`, their cost, and whether all parts were finished."""
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
        """The state after an action, and the cost of the step."""
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
        """The result, as of `episode`, of a greedy pass through a larger job by the values of this one.

        The number of parts that count as done while others still wait is drawn. In unknown states a random action is taken.
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
        """The allowed actions: position, choice, and the part where parts are told apart."""
        for (place, choice), way in self.merged.choices(state).items():
            if not self.distinct or state.who is None:
                yield place, choice, 0
                continue
            in_order = self._cell.arrivals is not None and place in self.merged.starts
            for nth, part in enumerate(state.who[place][:1] if in_order else state.who[place]):
                if self.merged.in_time(state, way, nth):
                    yield place, choice, part

    def _as_if_small(self, job: MergedCell, state: MergedState, done: int) -> MergedKey:
        """The key of a larger job's state in this small one: with fewer parts that wait and fewer that are done."""
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
        """The values of the allowed actions; empty when all parts are finished or none can move.

        When the table is full, a state that it does not hold gets its initial values anew each time.
        """
        key = (*self.merged.key(state), state.now, state.who) if self.distinct else self.merged.key(state)
        if (row := self.q.get(key)) is None:
            row = {action: self._at_least(state, action) for action in self.actions(state)}
            if self._values + len(row) <= MOST_VALUES:
                self.q[key] = row
                self._values += len(row)
        return row

    def _at_least(self, state: MergedState, action: Action) -> float:
        """The initial value of an action: the cost of the step plus a lower bound of the cost after it; 0 if not `bounded`."""
        if not self._bounded:
            return 0.0
        ahead, cost = self.step(state, action)
        if self._bound is None:
            return cost
        least_s = self._bound.left(ahead) / TICKS_PER_S
        return cost + (least_s if self._objective == MAKESPAN else self._machines * least_s - self._work_left_s(ahead))

    def _work_left_s(self, state: MergedState) -> float:
        """An upper bound of the processing that machines still have to begin [s]."""
        return (self._cell.parts - self.merged.finished(state)) * self._all_work_s

    def _late(self, state: MergedState) -> float:
        """The cost of the part that was just finished."""
        due_s = self._cell.due_s
        if due_s is None:
            return 0.0
        late_s = max(0.0, state.now / TICKS_PER_S - due_s[state.part - 1])
        return float(late_s > 0) if self._objective == "tardy-parts" else late_s / self._cell.parts

    def _best(self, row: Row) -> Action:
        least = min(row.values())
        ties = [action for action, value in row.items() if value <= least + SAME]
        return ties[int(self._rng.integers(len(ties)))]


# ---- Where times are drawn: a policy that goes on learning ------------------------------------------------------------


PRACTICE_EPISODES = 20  # simulated episodes before each decision


def reacting(cell: Cell, objective: str = MAKESPAN, seed: int = 0) -> Policy:
    """A policy that, before each decision, learns in a few simulated episodes from the observed state to the end.

    It observes where parts stand and how long machines have been at work, and assumes mean times for the rest. Its table is that
    of `srl_time`, kept from decision to decision and from episode to episode, so that little is learned twice. Source: learning
    real-time A* (Korf 1990), as `srl_time`; certainty equivalence for the times.
    """
    learner = TimeLearner(cell, objective, np.random.default_rng(seed))

    def choose(seen: Observed, allowed: tuple[int, ...]) -> int:
        """The decision that serves the position of least cost to go; of identical parts the first that is ready."""
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
