"""A cyclic order in a run: found for the products that are ordered, carried out for as many parts as there are, measured."""

from collections import Counter
from collections.abc import Sequence
from functools import reduce
from math import gcd
from typing import TYPE_CHECKING, Any

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Schedule

if TYPE_CHECKING:  # and below where it is needed: OR-Tools takes its time
    from lab.sequencing.cyclic.cycle import Cycle
    from lab.sequencing.cyclic.unrolled import Unrolled

SECONDS_PER_HOUR = 3600.0


def cycle_document(cycle: "Cycle") -> dict[str, Any]:
    """What is told of a cycle, for JSON."""
    per_part_s = cycle.period_s / cycle.parts
    products = {move.slot: cycle.product(move) for move in cycle.line.moves}
    return {
        "robots": 1,
        "parts_a_cycle": cycle.parts,
        "mix": [products[slot] for slot in range(cycle.parts)],
        "period_s": cycle.period_s,
        "per_part_s": per_part_s,
        "parts_per_hour": SECONDS_PER_HOUR / per_part_s,
        "bound_s": cycle.bound_s,
        "proven": cycle.proven,
        "most_in_work": cycle.most_in_work,
        "moves": cycle.to_json(),
        "wall_s": cycle.wall_s,
    }


def mix_of(order: Sequence[str]) -> tuple[str, ...]:
    """The smallest mix of products that repeats in an order, whatever their turns: 4 slices and 2 cups are 2 and 1."""
    counts = Counter(order)
    cycles = reduce(gcd, counts.values())
    return tuple(name for name, count in counts.items() for _ in range(count // cycles))


def measured_period(cycle: "Cycle", planned: Schedule, measured: Schedule) -> dict[str, Any]:
    """The period of a run that carried a cycle out, beside the planned one; None where too few parts were delivered."""
    from lab.sequencing.cyclic.unrolled import period_of

    found_s = period_of(measured, cycle)
    return cycle_document(cycle) | {
        "planned_period_s": period_of(planned, cycle),
        "measured_period_s": found_s,
        "period_deviation": None if found_s is None else found_s / cycle.period_s - 1.0,
    }


def cyclic_order(cell: Cell, seed: int) -> "tuple[Cycle, Unrolled]":
    """The cycle of a cell's products and its order for the cell's parts, as a run carries it out. BadInput as `best_cycle`."""
    from lab.sequencing.cyclic.cycle import best_cycle
    from lab.sequencing.cyclic.unrolled import unrolled

    cycle = best_cycle(cell, mix_of(cell.order), seed=seed)
    return cycle, unrolled(cycle, cell)
