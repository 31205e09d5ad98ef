"""The order of the work that remains, found anew from the state that was reached, with its proven gap."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from lab.errors import WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.methods.exact import Optimum, optimum
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.rest import NOTHING, Mishaps, Rest, rest_of
from lab.sequencing.simulate.run import Run, branch


@dataclass(frozen=True)
class NewPlan:
    """The run to go on with, the decisions still to come, and what is proven of them; schedule: None where there are none.

    stuck: the parts that cannot be finished, and why not.
    """

    run: Run
    sequence: tuple[int, ...]
    proven: Optimum | None
    schedule: Schedule | None
    stuck: Mapping[int, str]


def plan_again(run: Run, mishaps: Mishaps, under_way: int | None = None) -> NewPlan:
    """The best order from where a run is; under_way: the decision that must come first, its part is in the gripper.

    Raises WorkFailed where no order comes to its end, and where that part cannot be brought on.
    """
    fallback_s = float(np.nanmax(run.cell.empty_s, initial=0.0))
    rest = rest_of(run, mishaps, fallback_s)
    if under_way is not None and (rest.cell is None or Run(rest.cell).option(under_way) is None):
        name = run.cell.part_name(part_of(under_way, run.cell.parts))
        raise WorkFailed(f"{name} is in the gripper and cannot be brought on: take it out")
    if rest.cell is None:
        return NewPlan(run, (), None, None, rest.stuck)
    now = Run(rest.cell)
    if under_way is None:
        return _ordered(rest, now, ())
    ahead = branch(now)
    ahead.move(under_way)
    later = rest_of(ahead, NOTHING, fallback_s)
    return _ordered(replace(later, stuck={**rest.stuck, **later.stuck}), now, (under_way,))


def _ordered(rest: Rest, now: Run, first: tuple[int, ...]) -> NewPlan:
    if rest.cell is None:
        return NewPlan(now, first, None, None, rest.stuck)
    found = optimum(rest.cell)
    sequence = (*first, *found.sequence)
    schedule = None if first else simulate(now.cell, sequence)
    return NewPlan(now, sequence, None if first else found, schedule, rest.stuck)


def in_another(run: Run, cell: Cell) -> Run:
    """The same state in a cell with other times: its robot is at the same station, its parts in the same positions."""
    other = Run(cell)
    own = run.cell.begins
    for part, place in enumerate(run.locations):
        if place >= len(cell.laid_out) and own is not None:  # a position of its own: it stays there, or is nowhere
            known, product = own[part].position, run.cell.positions[place].product
            ends = (n for n, at in enumerate(cell.laid_out) if at.product == product and not at.options)
            place = next(ends) if known is None else known
        other.locations[part] = place
    other.ready_s, other.occupied = run.ready_s.copy(), run.occupied.copy()
    other.robots_at, other.robots_s = run.robots_at.copy(), run.robots_s.copy()
    return other
