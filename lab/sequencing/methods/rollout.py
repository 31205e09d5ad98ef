"""Policies that look ahead: a rule asked at every decision, and the rest of the work planned anew."""

from collections.abc import Collection, Sequence
from math import inf

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, check_objective, cost
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.methods.rules import Rule, dispatch, usable
from lab.sequencing.search import SAME
from lab.sequencing.simulate.execution import WAIT, Choose, Observed, Policy
from lab.sequencing.simulate.run import Run, branch


def by_rule(rule: Rule) -> Policy:
    """A dispatching rule as a policy: it goes by what is known, and by the means for what is not."""
    return lambda cell: rule


def replan(objective: str = MAKESPAN, planned: Sequence[int] = ()) -> Policy:
    """A policy that plans the rest of the work anew at every decision (`rollout`), and takes the first step of it.

    It plans by mean times. With several robots or servers it is asked whenever something happens, keeps to its last plan, at
    first `planned`, as long as that costs no more than a new one, and takes the first step that is asked for, or waits. A run of
    the policy raises BadInput for an objective that the cell does not allow.
    """

    def policy(cell: Cell) -> Choose:
        check_objective(objective, cell)
        if cell.serial:
            return lambda seen, allowed: rollout(seen, objective)[0]
        return _Replanning(cell, planned, objective).choose

    return policy


class _Replanning:
    """An episode of several robots or servers: the plan that is kept, each decision with where its part stands before it."""

    def __init__(self, cell: Cell, planned: Sequence[int], objective: str) -> None:
        self.objective = objective
        self._plan = _placed(Run(cell), planned)

    def choose(self, seen: Observed, allowed: tuple[int, ...]) -> int:
        """The first step, in the best plan known, that is allowed; WAIT: none."""
        found = rollout(seen, self.objective)
        kept = self._left(seen)
        costs = [inf if run is None else cost(run, self.objective) for run in (_moved(seen, kept), _moved(seen, found))]
        if costs[0] > costs[1] + SAME or not kept:
            kept, self._plan = found, _placed(seen, found)
        return first_of(seen, kept, allowed, self.objective)

    def _left(self, seen: Observed) -> tuple[int, ...]:
        """What is left of the plan, from where each part stands."""
        parts, reached, left = seen.cell.parts, set[int](), list[int]()
        for decision, place in self._plan:
            part = part_of(decision, parts)
            if place == seen.locations[part - 1]:
                reached.add(part)
            if part in reached:
                left.append(decision)
        return tuple(left)


def _placed(run: Run, plan: Sequence[int]) -> list[tuple[int, int]]:
    """A plan, each decision with where its part stands before it."""
    ahead, found = branch(run), list[tuple[int, int]]()
    for decision in plan:
        found.append((decision, ahead.locations[part_of(decision, run.cell.parts) - 1]))
        ahead.move(decision)
    return found


def first_of(run: Run, plan: Sequence[int], allowed: Collection[int], objective: str = MAKESPAN) -> int:
    """The first decision of a plan that is allowed, and the first one there of its part and of its robot; WAIT: there is none.

    What robots that are busy or out of order are to do before it must not cost more for its being taken first.
    """
    ahead, taken = branch(run), set[str]()
    by = [ahead.move(decision).by for decision in plan]
    for n, decision in enumerate(plan):
        part = run.cell.part_name(part_of(decision, run.cell.parts))  # never the name of a robot or a station
        if decision in allowed and not taken & {by[n], part}:
            again = _moved(run, (decision, *plan[:n], *plan[n + 1 :]))
            if again is not None and cost(again, objective) <= cost(ahead, objective) + SAME:
                return decision
        taken |= {by[n], part}
    return WAIT


def _moved(run: Run, sequence: Sequence[int]) -> Run | None:
    """Where a list of decisions leads from a run; None where one of them may not be taken."""
    ahead = branch(run)
    for decision in sequence:
        if ahead.option(decision) is None:
            return None
        ahead.move(decision)
    return ahead


def rollout(run: Run, objective: str = MAKESPAN, depth: int = 1) -> tuple[int, ...]:
    """The best of: each allowed decision, `depth` of them in a row, then each of the dispatching rules to the end.

    A bounded search: branching ** depth times as many simulations as there are rules. Of alike parts in one position,
    which a swap does not change, only the first to be ready is tried. Ties to the decision tried first.
    Source: Bertsekas, Tsitsiklis and Wu 1997, rollout algorithms for combinatorial optimization.
    """
    allowed = _distinct(run)
    if depth == 0 or not allowed:
        return min((_finish(run, rule, objective) for rule in usable(run.cell).values()), key=lambda tail: tail[0])[1]
    best: tuple[float, tuple[int, ...]] | None = None
    for decision in allowed:
        ahead = branch(run)
        ahead.move(decision)
        tail = rollout(ahead, objective, depth - 1)
        for move in tail:
            ahead.move(move)
        value = cost(ahead, objective)
        if best is None or value < best[0]:
            best = value, (decision, *tail)
    assert best is not None  # there was an allowed decision
    return best[1]


def _distinct(run: Run) -> list[int]:
    """Of the allowed decisions those that differ: by position, choice and due time."""
    parts, due_s = run.cell.parts, run.cell.due_s
    found: dict[tuple[int, int, float], int] = {}
    for decision in sorted(run.allowed(), key=lambda decision: (run.ready_s[part_of(decision, parts) - 1], decision)):
        index = part_of(decision, parts) - 1
        found.setdefault((run.locations[index], choice_of(decision, parts), due_s[index] if due_s else 0.0), decision)
    return list(found.values())


def _finish(run: Run, rule: Rule, objective: str) -> tuple[float, tuple[int, ...]]:
    ahead = branch(run)
    tail = dispatch(ahead, rule)
    return cost(ahead, objective), tail
