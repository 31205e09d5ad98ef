"""A cyclic order in a run: found for the ordered products, unrolled for all parts, and measured."""

from collections import Counter
from collections.abc import Sequence
from functools import reduce
from math import gcd
from typing import Any

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.cyclic.several import Rhythm, best_rhythm
from lab.sequencing.cyclic.unrolled import Unrolled, period_of, unrolled

SECONDS_PER_HOUR = 3600.0


def cycle_document(rhythm: Rhythm) -> dict[str, Any]:
    """The best cycle, and those that were tried, as a JSON document."""
    cycle, per_part_s = rhythm.cycle, rhythm.per_part_s
    products = {move.slot: cycle.product(move) for move in cycle.line.moves}
    return {
        "robots": 1,
        "parts_a_cycle": cycle.parts,
        "mix": [products[slot] for slot in range(cycle.parts)],
        "period_s": cycle.period_s,
        "per_part_s": per_part_s,
        "parts_per_hour": SECONDS_PER_HOUR / per_part_s,
        "bound_s": rhythm.bound_part_s * cycle.parts,
        "bound_per_part_s": rhythm.bound_part_s,
        "proven": rhythm.proven,
        "proven_of": rhythm.proven_of,
        "least_per_part_s": rhythm.least_part_s,
        "most_parts_a_cycle": rhythm.most_parts,
        "why_no_more": rhythm.why_no_more or None,
        "tried": [
            {"parts_a_cycle": trial.parts, "period_s": trial.period_s, "bound_s": trial.bound_s, "proven": trial.proven}
            for trial in rhythm.tried
        ],
        "most_in_work": cycle.most_in_work,
        "moves": cycle.to_json(),
        "wall_s": rhythm.wall_s,
    }


def mix_of(order: Sequence[str]) -> tuple[str, ...]:
    """The smallest mix of products that repeats in an order, whatever its sequence: 4 slices and 2 cups give 2 and 1."""
    counts = Counter(order)
    cycles = reduce(gcd, counts.values())
    return tuple(name for name, count in counts.items() for _ in range(count // cycles))


def check_parts(most_parts: int, mix: Sequence[str], cyclic: bool) -> None:
    """Raises BadInput for --parts-per-cycle without a cycle, and for a mix with more parts."""
    if not cyclic:
        raise BadInput(f"--parts-per-cycle {most_parts}: only a cycle has as many: add --cyclic")
    if most_parts < len(mix):
        enter = ", ".join(counted(count, name) for name, count in Counter(mix).items())
        raise BadInput(
            f"--parts-per-cycle {most_parts}: a cycle has {enter} at the least: allowed are {len(mix)} or more"
        )


def measured_period(rhythm: Rhythm, planned: Schedule, measured: Schedule) -> dict[str, Any]:
    """The measured and the planned period of a run that carried a cycle out; None if too few parts were delivered."""

    cycle = rhythm.cycle
    found_s = period_of(measured, cycle)
    return cycle_document(rhythm) | {
        "planned_period_s": period_of(planned, cycle),
        "measured_period_s": found_s,
        "period_deviation": None if found_s is None else found_s / cycle.period_s - 1.0,
    }


def cyclic_order(cell: Cell, seed: int, most_parts: int | None = None) -> tuple[Rhythm, Unrolled]:
    """The cycle of a cell's products with the least time per part, and its unrolled order for the cell's parts.

    most_parts: the limit of a cycle, see `best_rhythm`; at most the cell's parts. Raises BadInput as `best_rhythm`.
    """

    rhythm = best_rhythm(cell, mix_of(cell.order), most_parts and min(most_parts, cell.parts), seed)
    return rhythm, unrolled(rhythm.cycle, cell)
