"""Policies that look ahead: a rule asked at every decision, and the rest of the work planned anew."""

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, check_objective, cost
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.methods.rules import Rule, dispatch, usable
from lab.sequencing.simulate.execution import Choose, Policy
from lab.sequencing.simulate.run import Run, branch


def by_rule(rule: Rule) -> Policy:
    """A dispatching rule as a policy: it goes by what is known, and by the means for what is not."""
    return lambda cell: rule


def replan(objective: str = MAKESPAN) -> Policy:
    """A policy that plans the rest of the work anew at every decision (`rollout`), and takes the first step of it.

    It plans by mean times. A run of the policy raises BadInput for an objective that the cell does not allow.
    """

    def policy(cell: Cell) -> Choose:
        check_objective(objective, cell)
        return lambda seen, allowed: rollout(seen, objective)[0]

    return policy


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
