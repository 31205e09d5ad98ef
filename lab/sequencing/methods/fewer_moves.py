"""A sequence without pointless hops: where a part stops over for nothing, it goes straight on."""

from collections.abc import Iterator, Sequence

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, cost
from lab.sequencing.cell.routes import entry, part_of
from lab.sequencing.search import SAME
from lab.sequencing.simulate.follow import follow, steps


def fewer_moves(cell: Cell, sequence: Sequence[int], objective: str = MAKESPAN) -> tuple[int, ...]:
    """The sequence with as many stopovers left out as can be, one after the other, at no more cost.

    A stopover is a place where nothing is done with the part. Both are tried: to go straight on when the part set out, and
    when it would have left the stopover. It is a local search: of several that exclude each other the first is left out.
    """
    best, least = tuple(sequence), _cost(cell, sequence, objective)
    while True:
        shorter = next((one for one in _straight(cell, best) if _cost(cell, one, objective) <= least + SAME), None)
        if shorter is None:
            return best
        best, least = shorter, _cost(cell, shorter, objective)


def _straight(cell: Cell, sequence: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """Each sequence that is left when one stopover is left out."""
    came = dict[int, tuple[int, int]]()  # by part: where in the sequence it set out last, and from where
    for number, (run, decision, wait) in enumerate(steps(cell, sequence)):
        part = part_of(decision, cell.parts)
        here, option = run.locations[part - 1], run.option(decision)
        assert option is not None
        if part in came and not cell.positions[here].processing_s:
            before, place = came[part]
            for way in cell.positions[place].options:
                if way.to == option.to:
                    direct = entry(part, way.choice, cell.parts)
                    yield (*sequence[:before], direct, *sequence[before + 1 : number], *sequence[number + 1 :])
                    yield (*sequence[:before], *sequence[before + 1 : number], direct, *sequence[number + 1 :])
        came[part] = number, here
        run.move(decision, wait)


def _cost(cell: Cell, sequence: Sequence[int], objective: str) -> float:
    """What a sequence costs; infinite where it may not be carried out, or does not come to its end."""
    try:
        return cost(run, objective) if (run := follow(cell, sequence)).done else float("inf")
    except BadInput:
        return float("inf")
