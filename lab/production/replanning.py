"""Replanning: the order of the remaining work from the reached state, by the run's method, with its proven gap."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from lab.errors import LabError, WorkFailed
from lab.sequencing import find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.methods.exact import Optimum, optimum
from lab.sequencing.search import SAME, EpisodeSequenced
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.rest import NOTHING, Mishaps, Rest, rest_of
from lab.sequencing.simulate.run import Run, branch
from lab.tasks.sequencing import Sequencing, search_for

EXACT = "exact"


@dataclass(frozen=True)
class Planner:
    """The planner of a run's work, and of the rest after trouble, by the method of these settings."""

    settings: Sequencing = field(default_factory=Sequencing)
    seed: int = 0

    def order(self, cell: Cell, proven: Optimum) -> tuple[tuple[int, ...], str]:
        """The order that the method finds, and the method's name; the search ends as soon as its order is proven to be optimal.

        It is the order of the exact search if the method finds none, or cannot order the rest.
        """
        method, search = self.settings.method, search_for(self.settings)
        is_timed = search.objective == MAKESPAN
        if method == EXACT and is_timed:
            return proven.sequence, EXACT

        def until_best(tried: EpisodeSequenced) -> None:
            if is_timed and tried.best and tried.best_cost <= proven.bound_s + SAME:
                raise _NothingBetter(tried.best)

        try:
            return find_sequence(cell, method, replace(search, on_episode=until_best), self.seed).sequence, method
        except _NothingBetter as ended:
            return ended.sequence, method
        except LabError:
            return proven.sequence, EXACT


class _NothingBetter(Exception):
    """Raised when a search has found an order that costs no more than the proven bound."""

    def __init__(self, sequence: tuple[int, ...]) -> None:
        self.sequence = sequence


@dataclass(frozen=True)
class NewPlan:
    """The new plan: the run, the remaining decisions and their proven bound; schedule: None if nothing was ordered.

    proven: the bound over all orders that begin with the part in the gripper; None: unknown. stuck: the parts that cannot be
    finished, with reasons. method: the method that found the order, "" if nothing was ordered.
    """

    run: Run
    sequence: tuple[int, ...]
    proven: Optimum | None
    schedule: Schedule | None
    stuck: Mapping[int, str]
    method: str = ""


def plan_again(run: Run, mishaps: Mishaps, under_way: int | None = None, planner: Planner | None = None) -> NewPlan:
    """The plan of the remaining work from a run's state; under_way: the first decision, whose part is in the gripper.

    planner: by default that of default settings.
    Raises WorkFailed if no order can be completed, or that part cannot be brought on.
    """
    fallback_s = float(np.nanmax(run.cell.empty_s, initial=0.0))
    rest = rest_of(run, mishaps, fallback_s)
    if under_way is not None and (rest.cell is None or Run(rest.cell).option(under_way) is None):
        name = run.cell.part_name(part_of(under_way, run.cell.parts))
        raise WorkFailed(f"{name} is in the gripper and cannot be brought on: take it out")
    if rest.cell is None:
        return NewPlan(run, (), None, None, rest.stuck)
    now, planner = Run(rest.cell), planner or Planner()
    if under_way is None:
        return _ordered(rest, now, (), planner)
    ahead = branch(now)
    ahead.move(under_way)
    later = rest_of(ahead, NOTHING, fallback_s)
    return _ordered(replace(later, stuck={**rest.stuck, **later.stuck}), now, (under_way,), planner)


def _ordered(rest: Rest, now: Run, first: tuple[int, ...], planner: Planner) -> NewPlan:
    """The plan of the rest, which begins after the first decisions; its bound covers both."""
    if rest.cell is None:
        return NewPlan(now, first, None, None, rest.stuck)
    best, ahead = optimum(rest.cell), branch(now)
    for decision in first:
        ahead.move(decision)
    own, method = planner.order(rest.cell, best)
    cost, bound_s = (ahead.now_s + seconds for seconds in (best.cost, best.bound_s))
    whole = replace(best, cost=cost, sequence=(*first, *best.sequence), bound_s=bound_s)
    # With windows it may be better to hold the part in the gripper for a while, which the plan of the rest ignores.
    proven = None if first and now.cell.has_windows else whole
    schedule = simulate(now.cell, (*first, *own))
    return NewPlan(now, (*first, *own), proven, schedule, rest.stuck, method)


def in_another(run: Run, cell: Cell) -> Run:
    """The same state in a cell with other times: its robot is at the same station, its parts in the same positions."""
    other = Run(cell)
    own = run.cell.begins
    for part, place in enumerate(run.locations):
        if place >= len(cell.laid_out) and own is not None:  # a separate position: the part stays there, or is nowhere
            known, product = own[part].position, run.cell.positions[place].product
            ends = (n for n, at in enumerate(cell.laid_out) if at.product == product and not at.options)
            place = next(ends) if known is None else known
        other.locations[part] = place
    other.ready_s, other.occupied = run.ready_s.copy(), run.occupied.copy()
    other.robots_at, other.robots_s = run.robots_at.copy(), run.robots_s.copy()
    return other
