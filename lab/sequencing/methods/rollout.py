"""Policies for times drawn by chance: a dispatching rule, and replanning of the remaining work by rollout."""

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
    """A dispatching rule as a policy; it sees the mean for every time that is not known yet."""
    return lambda cell: rule


def replan(objective: str = MAKESPAN, planned: Sequence[int] = ()) -> Policy:
    """A policy that replans the remaining work at every decision (`rollout`) and takes the first decision of the plan.

    It plans by mean times. With several robots or servers it is asked at every event; it keeps its last plan, at first
    `planned`, as long as that costs no more than a new one, and takes the first decision of the plan that is allowed, or waits.
    A run of the policy raises BadInput for an objective that the cell does not allow.
    """

    def policy(cell: Cell) -> Choose:
        check_objective(objective, cell)
        if cell.serial:
            return lambda seen, allowed: rollout(seen, objective)[0]
        return _Replanning(cell, planned, objective).choose

    return policy


class _Replanning:
    """The replanning of an episode with several robots or servers. It keeps a plan: each decision with its part's position."""

    def __init__(self, cell: Cell, planned: Sequence[int], objective: str) -> None:
        self.objective = objective
        self._plan = _placed(Run(cell), planned)

    def choose(self, seen: Observed, allowed: tuple[int, ...]) -> int:
        """The first decision of the best known plan that is allowed; WAIT when there is none."""
        planned = rollout(seen, self.objective)
        kept = self._left(seen)
        costs = [
            inf if run is None else cost(run, self.objective) for run in (_moved(seen, kept), _moved(seen, planned))
        ]
        if costs[0] > costs[1] + SAME or not kept:
            kept, self._plan = planned, _placed(seen, planned)
        return first_of(seen, kept, allowed, self.objective)

    def _left(self, seen: Observed) -> tuple[int, ...]:
        """The rest of the plan from where each part stands now."""
        parts, reached, left = seen.cell.parts, set[int](), list[int]()
        for decision, place in self._plan:
            part = part_of(decision, parts)
            if place == seen.locations[part - 1]:
                reached.add(part)
            if part in reached:
                left.append(decision)
        return tuple(left)


def _placed(run: Run, plan: Sequence[int]) -> list[tuple[int, int]]:
    """The decisions of a plan, each with its part's position before it."""
    ahead, placed = branch(run), list[tuple[int, int]]()
    for decision in plan:
        placed.append((decision, ahead.locations[part_of(decision, run.cell.parts) - 1]))
        ahead.move(decision)
    return placed


def first_of(run: Run, plan: Sequence[int], allowed: Collection[int], objective: str = MAKESPAN) -> int:
    """The first allowed decision of a plan that is the first of its part and of its robot; WAIT when there is none.

    Taking it before the plan's earlier decisions, which wait for busy or broken robots, must not raise the plan's cost.
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
    """The run after a list of decisions; None when one of them is not allowed."""
    ahead = branch(run)
    for decision in sequence:
        if ahead.option(decision) is None:
            return None
        ahead.move(decision)
    return ahead


def rollout(run: Run, objective: str = MAKESPAN, depth: int = 1) -> tuple[int, ...]:
    """The best continuation of a run among all that take `depth` decisions and then follow a dispatching rule to the end.

    The search makes branching ** depth simulations for each rule. Of alike parts in one position, which may be swapped, only the
    first to be ready is tried. Ties go to the decision tried first.
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
    assert best is not None  # the run had an allowed decision
    return best[1]


def _distinct(run: Run) -> list[int]:
    """The allowed decisions that differ in position, choice or due time."""
    parts, due_s = run.cell.parts, run.cell.due_s
    distinct: dict[tuple[int, int, float], int] = {}
    for decision in sorted(run.allowed(), key=lambda decision: (run.ready_s[part_of(decision, parts) - 1], decision)):
        index = part_of(decision, parts) - 1
        distinct.setdefault(
            (run.locations[index], choice_of(decision, parts), due_s[index] if due_s else 0.0), decision
        )
    return list(distinct.values())


def _finish(run: Run, rule: Rule, objective: str) -> tuple[float, tuple[int, ...]]:
    ahead = branch(run)
    tail = dispatch(ahead, rule)
    return cost(ahead, objective), tail
